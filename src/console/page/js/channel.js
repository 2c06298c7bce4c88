// The channel to the server: a WebSocket of this page. Statuses come by it, and a STOP goes past all requests that wait: a browser has
// six connections to a server for the requests of all its pages together, and others for WebSockets. An echo each half second shows
// that a STOP would arrive.

import { hearTime } from './clock.js';
import { token } from './token.js';

const ECHO_MS = 500;
const SILENCE_MS = 1500;

let socket = null;
/** When the server last answered an echo, and when the one was sent that it has not answered yet. */
let answered = -Infinity;
let echoed = null;
/** Those who wait for the word that a stop was received. */
let stops = [];
let end = () => {};

setInterval(echo, ECHO_MS);

/** Whether a STOP would arrive by it. */
export const channelAnswers = () => socket !== null && performance.now() - answered < SILENCE_MS;

/** Opens it. Once it has ended: whether the server said anything. */
export function openChannel({ take, refuse }) {
  return new Promise((resolve) => {
    const url = new URL('/api/v1/live', location.href);
    url.protocol = url.protocol.replace('http', 'ws');
    const [mine, shown] = [new WebSocket(url), token()];
    let spoke = false;
    [socket, answered, echoed] = [mine, -Infinity, null];
    // Of a server that is gone no end would come for long.
    end = () => {
      if (mine === socket) socket = null;
      mine.close();
      resolve(spoke);
    };
    mine.addEventListener('open', () => {
      mine.send(shown ? `Bearer ${shown}` : '');
      echo();
    });
    mine.addEventListener('message', ({ data }) => {
      if (mine !== socket) return;
      spoke = true;
      const { status, time, stop, problem } = JSON.parse(data);
      if (time) onEcho(time);
      if (stop) stops.splice(0).forEach((received) => received());
      if (status) take(status);
      if (problem) refuse(problem, shown);
    });
    mine.addEventListener('close', () => {
      if (mine === socket) socket = null;
      resolve(spoke);
    });
  });
}

/** Ends it. */
export const endChannel = () => end();

/** Sends a STOP by it; done when the server says that it was received. */
export function stopByChannel(patience) {
  return new Promise((resolve, reject) => {
    if (socket?.readyState !== WebSocket.OPEN) throw new Error('it is not open');
    socket.send('stop');
    stops.push(resolve);
    setTimeout(reject, patience, new Error('no answer'));
  });
}

function echo() {
  if (socket?.readyState !== WebSocket.OPEN || echoed !== null) return;
  echoed = performance.now();
  socket.send('echo');
}

function onEcho(time) {
  hearTime(time, echoed);
  answered = performance.now();
  echoed = null;
}
