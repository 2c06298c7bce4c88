// The newest status of the hall and how well it is known. Every part of the page is told of each change, once a frame.

const listeners = [];
let status = null;
let link = 'connecting';
let due = false;

/** The newest status; null before the first. */
export const hall = () => status;

/** `connecting` before the first word since the page is seen, `live`, or `lost` where nothing came for too long. */
export const linkState = () => link;

/** Calls back with the status and the link, at each change of either. */
export const watch = (listener) => listeners.push(listener);

/** A new status came. */
export function setStatus(newest) {
  status = newest;
  link = 'live';
  changed();
}

/** Nobody sees the page, and nothing is heard: what was known is old until the next status. */
export function setAway() {
  link = 'connecting';
  changed();
}

/** The link is lost; what was known is kept to be shown as old. */
export function setLost() {
  if (link === 'lost') return;
  link = 'lost';
  changed();
}

function changed() {
  if (due) return;
  due = true;
  // A hidden page has no frames, yet must be true when it is looked at again.
  if (document.hidden) queueMicrotask(tell);
  else requestAnimationFrame(tell);
}

function tell() {
  due = false;
  for (const listener of listeners) {
    // One part that fails must not keep the others, the controls above all, from the truth.
    try {
      listener(status, link);
    } catch (error) {
      console.error(error);
    }
  }
}
