// How far this machine's clock is from the server's. A request says when it was sent and is refused when it comes late; a
// tablet whose clock is wrong by some seconds could else never start a show.

const OLD_MS = 60_000;
const HEADER = 'X-Kinocue-Time';

// Of the replies of the last minute the one that took least tells the difference best.
let best = null;

/** Takes the server's time from a reply that was asked for at `before`, by `performance.now()`. */
export const hear = (replyHeaders, before) => hearTime(Number(replyHeaders.get(HEADER)), before);

/** Takes the server's time, Unix milliseconds, from what was asked for then. */
export function hearTime(theirs, before) {
  if (!theirs) return;
  const now = performance.now();
  const round = now - before;
  if (best && round > best.round && now - best.heard < OLD_MS) return;
  best = { round, heard: now, ahead: theirs - (before + now) / 2 };
}

/** This instant in unix milliseconds, by the server's clock where it is known. */
export function sentAt() {
  return Math.round(best ? best.ahead + performance.now() : Date.now());
}
