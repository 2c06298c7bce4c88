// The page: every part is started once, then shown the status as it comes. STOP starts by itself, as a script of its own.

import { showTransport, startTransport } from './transport.js';
import { showHeadline, startHeadline } from './headline.js';
import { byId } from './dom.js';
import { showController } from './controller.js';
import { showCurves, startCurves } from './curves.js';
import { showFilm, startFilm } from './film.js';
import { showFollow, startFollow } from './follow.js';
import { showHistograms } from './histogram.js';
import { showHistory } from './history.js';
import { learn, startLanguage } from './language.js';
import { showLevels } from './levels.js';
import { showLock, startLock } from './lock.js';
import { showLinks } from './links.js';
import { showNext } from './next.js';
import { showMap, startMap } from './map.js';
import { readLists, showPlaylist, startPlaylist } from './playlist.js';
import { showRecordings, startRecordings } from './recordings.js';
import { showReports, startReports } from './reports.js';
import { startPicture } from './picture.js';
import { startSources } from './sources.js';
import { showTrim, startTrim } from './trim.js';
import { showWarnings, startWarnings } from './warnings.js';
import { startStream } from './stream.js';
import { startToken } from './token.js';
import { startUpload } from './upload.js';
import { readWho, startWho } from './who.js';
import { watch } from './state.js';

const STARTS = [
  startTransport, startToken, startHeadline, startFilm, startMap, startTrim, startPlaylist, startReports, startCurves,
  startUpload, startWarnings, startFollow, startSources, startRecordings, startPicture, startLock, startWho,
];
const SHOWS = [
  showHeadline, showTransport, showNext, showFilm, showFollow, showWarnings, showMap, showController, showLevels, showTrim, showPlaylist,
  showLinks, showHistograms, showReports, showCurves, showHistory, showRecordings, showLock,
];

// Before it is in one language nothing is shown; STOP works meanwhile.
await learn();
startLanguage(byId('language'));
for (const start of STARTS) start();
for (const show of SHOWS) watch(show);

// The lists are read when the server is first heard, and again when it is back: it may be another one then.
let known = false;
watch((_, link) => {
  if (link === 'live' && !known) {
    readLists();
    readWho();
  }
  known = link === 'live';
});

startStream();
