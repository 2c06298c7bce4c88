// Whether a STOP from here would arrive: tried before anybody presses it, and said where it would not.

import { byId, setProperty, setText } from './dom.js';
import { whyNoStop } from './api.js';
import { channelAnswers } from './channel.js';
import { words } from './language.js';

const EVERY_MS = 500;
const PATIENCE_MS = 1000;

/** Tries for as long as the page is open and seen. */
export async function startReach() {
  for (;;) {
    await new Promise((resolve) => setTimeout(resolve, EVERY_MS));
    if (document.hidden) continue;
    const problem = channelAnswers() ? null : await whyNoStop(PATIENCE_MS);
    if (!document.hidden) show(channelAnswers() ? null : problem);
  }
}

function show(problem) {
  setProperty(byId('stop-reach'), 'hidden', problem === null);
  document.documentElement.toggleAttribute('data-no-stop', problem !== null);
  setText(byId('stop-reach'), problem === null ? '' : words('stop.cannot', { why: problem.message }));
}
