// Every word and every edge that is in view, by what the browser computed: what stands out too little, each with its figure.

const channel = (part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
const luminance = ([red, green, blue]) => 0.2126 * channel(red) + 0.7152 * channel(green) + 0.0722 * channel(blue);
const contrast = (one, other) => {
  const [least, most] = [luminance(one), luminance(other)].sort((a, b) => a - b);
  return (most + 0.05) / (least + 0.05);
};

/** Parts of red, green and blue, and how opaque, of `rgb(…)` or `color(srgb …)`. */
const parse = (text) => {
  const figures = text.match(/-?[\d.]+(e-?\d+)?/g).map(Number);
  const scale = text.startsWith('color') ? 1 : 255;
  return [...figures.slice(0, 3).map((figure) => figure / scale), figures[3] ?? 1];
};
const over = ([red, green, blue, alpha], ground) => [red, green, blue].map((part, index) => part * alpha + ground[index] * (1 - alpha));
const ground = (element) => {
  if (!element) return [0, 0, 0];
  const colour = parse(getComputedStyle(element).backgroundColor);
  return colour[3] === 1 ? colour.slice(0, 3) : over(colour, ground(element.parentElement));
};

const shown = (element) => element.checkVisibility({ visibilityProperty: true, opacityProperty: true }) && !element.closest('.off-screen, .skip, .uplot, [inert]');
const isOff = (element) => element.closest(':disabled, [aria-disabled=true]') !== null;
const name = (element) => `${element.id || element.className || element.tagName} "${element.textContent.trim().slice(0, 20)}"`;
const wrong = [];
const check = (element, what, one, other, least) => {
  const is = contrast(one, other);
  if (is < least) wrong.push(`${what} of ${name(element)}: ${is.toFixed(2)}, not ${least}`);
};

for (const element of document.body.querySelectorAll('*')) {
  const style = getComputedStyle(element);
  const hasText = [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim() !== '');
  if (!shown(element) || isOff(element)) continue;
  if (hasText) {
    const size = parseFloat(style.fontSize);
    const isLarge = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    // The octagon is drawn before its words.
    const behind = element.closest('.stop-shape') ? parse(getComputedStyle(element.closest('.stop-shape'), '::before').backgroundColor) : ground(element);
    check(element, 'words', over(parse(style.color), behind), behind, isLarge ? 3 : 4.5);
  }
  if (element.matches('button:not(.choice button, .stop), select, input:not([type=range])')) {
    const around = ground(element.parentElement);
    const edge = over(parse(style.borderTopColor), around);
    const stands = Math.max(contrast(edge, around), contrast(ground(element), around));
    if (stands < 3) wrong.push(`edge of ${name(element)}: ${stands.toFixed(2)}, not 3`);
  }
}
const root = getComputedStyle(document.documentElement);
const variable = (which) => root.getPropertyValue(which).match(/[0-9a-f]{2}/gi).map((pair) => parseInt(pair, 16) / 255);
check(document.documentElement, 'rails', variable('--edge'), variable('--panel'), 3);
return wrong;
