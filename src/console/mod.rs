//! The web console: one page and what belongs to it, built into the program. It needs no network but the server's own, no
//! build step, and nothing that `Content-Security-Policy: default-src 'self'` forbids. What it shows comes from
//! `/api/v1/live`, what is pressed goes to `/api/v1`; the modules in `page/js` say which does what. Control plane.

#[cfg(test)]
mod tests;

/// A file of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Asset {
    /// Its `Content-Type`.
    pub(crate) content_type: &'static str,
    /// Its bytes.
    pub(crate) body: &'static [u8],
}

/// A `Content-Type`, and the bytes of that.
type ServedBytes = (&'static str, &'static [u8]);

impl Asset {
    fn served(self) -> ServedBytes {
        (self.content_type, self.body)
    }
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const JS: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";
const TEXT: &str = "text/plain; charset=utf-8";

/// A file under the path that it has in its folder.
macro_rules! files {
    ($folder:literal: $($path:literal $content_type:ident),+ $(,)?) => {
        &[$((concat!("/", $path), Asset { content_type: $content_type, body: include_bytes!(concat!($folder, $path)) })),+]
    };
}

/// What we wrote.
const PAGE: &[(&str, Asset)] = files!("page/":
    "index.html" HTML,
    "icon.svg" SVG,
    "style.css" CSS,
    "controls.css" CSS,
    "panels.css" CSS,
    "js/api.js" JS,
    "js/channel.js" JS,
    "js/clock.js" JS,
    "js/controller.js" JS,
    "js/curves.js" JS,
    "js/dom.js" JS,
    "js/error.js" JS,
    "js/events.js" JS,
    "js/film.js" JS,
    "js/follow.js" JS,
    "js/headline.js" JS,
    "js/histogram.js" JS,
    "js/history.js" JS,
    "js/lang/de.js" JS,
    "js/lang/en.js" JS,
    "js/lang/es.js" JS,
    "js/lang/fr.js" JS,
    "js/lang/ja.js" JS,
    "js/lang/zh.js" JS,
    "js/language.js" JS,
    "js/levels.js" JS,
    "js/links.js" JS,
    "js/lock.js" JS,
    "js/main.js" JS,
    "js/map.js" JS,
    "js/marks.js" JS,
    "js/next.js" JS,
    "js/picture.js" JS,
    "js/playlist.js" JS,
    "js/pose.js" JS,
    "js/press.js" JS,
    "js/reach.js" JS,
    "js/recordings.js" JS,
    "js/reports.js" JS,
    "js/said.js" JS,
    "js/seats.js" JS,
    "js/sources.js" JS,
    "js/starts.js" JS,
    "js/state.js" JS,
    "js/stop.js" JS,
    "js/stream.js" JS,
    "js/timeline.js" JS,
    "js/token.js" JS,
    "js/transport.js" JS,
    "js/trace.js" JS,
    "js/trim.js" JS,
    "js/upload.js" JS,
    "js/warnings.js" JS,
    "js/who.js" JS,
    "js/words.js" JS,
    "js/zone.js" JS,
);

/// What others wrote, with its licence (`vendor/README.md`).
const VENDOR: &[(&str, Asset)] = files!("":
    "vendor/uPlot.iife.min.js" JS,
    "vendor/uPlot.min.css" CSS,
    "vendor/LICENSE" TEXT,
);

/// The page of a desk with many halls.
const FLEET: &[(&str, Asset)] = files!("fleet/":
    "index.html" HTML,
    "fleet.css" CSS,
    "fleet.js" JS,
);

/// What it has of the other page.
const SHARED: [&str; 2] = ["/icon.svg", "/js/dom.js"];

/// The same of the page of a desk.
#[must_use]
pub(crate) fn fleet(path: &str) -> Option<ServedBytes> {
    let shared = PAGE.iter().filter(|(at, _)| SHARED.contains(at));
    find(FLEET.iter().chain(shared), path).map(Asset::served)
}

/// What is at a path, which begins with a slash; `/` is the page itself. None where there is nothing.
#[must_use]
pub(crate) fn asset(path: &str) -> Option<Asset> {
    find(PAGE.iter().chain(VENDOR), path)
}

fn find(files: impl IntoIterator<Item = &'static (&'static str, Asset)>, path: &str) -> Option<Asset> {
    let path = if path == "/" { "/index.html" } else { path };
    files.into_iter().find(|(at, _)| *at == path).map(|(_, asset)| *asset)
}

/// The content type and the bytes of what is at a path, as a server hands them out.
#[must_use]
pub(crate) fn page(path: &str) -> Option<ServedBytes> {
    asset(path).map(Asset::served)
}
