// The page's elements: found, made and filled. Data becomes text here, never markup.

/** The element of that id. */
export const byId = (id) => document.getElementById(id);

/** A new element with properties and children; strings become text. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.includes('-') || name === 'role' || name === 'for' || name === 'scope') element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children);
  return element;
}

/** A new SVG element with attributes and children. */
export function draw(tag, attributes = {}, ...children) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Sets a text where it has changed: ten times a second, screen readers and layout are not bothered for nothing. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Sets an attribute where it has changed. */
export function setAttribute(element, name, value) {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

/** Sets a property where it has changed. */
export function setProperty(element, name, value) {
  if (element[name] !== value) element[name] = value;
}

/** Sets a custom property of CSS, through the object model, which the content security policy allows. */
export function setStyle(element, name, value) {
  if (element.style.getPropertyValue(name) !== value) element.style.setProperty(name, value);
}

/**
 * A renderer that does nothing while what it is given says the same as the last time, so that buttons inside are not made anew
 * under a finger.
 */
export function onChange(render) {
  let last;
  return (value) => {
    const key = JSON.stringify(value);
    if (key === last) return;
    last = key;
    render(value);
  };
}

/** A group of buttons of which one is chosen; arrow keys move the choice, as in a group of radio buttons. */
export function choice(group, chosen) {
  const buttons = [...group.querySelectorAll('[role=radio]')];
  const choose = (button) => {
    for (const each of buttons) {
      setAttribute(each, 'aria-checked', String(each === button));
      each.tabIndex = each === button ? 0 : -1;
    }
    chosen(button.dataset);
  };
  for (const [index, button] of buttons.entries()) {
    button.tabIndex = index === 0 ? 0 : -1;
    button.addEventListener('click', () => choose(button));
  }
  group.addEventListener('keydown', (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    const at = buttons.indexOf(document.activeElement);
    if (step === undefined || at < 0) return;
    event.preventDefault();
    const next = buttons[(at + step + buttons.length) % buttons.length];
    next.focus();
    choose(next);
  });
}
