//! A film of the visitor's in the demo: shown by mpv, with a gentle cue of its length.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};

use super::seats::quoted;
use crate::app::player::film_length_s;
use crate::cli::{Exit, Failure, OrExit as _};
use crate::control::Command;

/// Id of the cue and of the playlist.
const ID: &str = "film";
/// What is played, for the report.
const NAME: &str = "a cue of the film's length";
/// The shortest swell of the seats, ms, and how far one goes, of their stroke.
const SWELL_MS: u32 = 8_000;
/// The seats are at rest for so long when the film ends, so that its end cuts nothing off.
const REST_MS: u32 = 500;
const SWELL: f64 = 0.3;
/// From one sample to the next.
const STEP_MS: u32 = 20;
/// A day.
const LONGEST_S: f64 = 86_400.0;

/// The film.
#[derive(Debug)]
pub(super) struct DemoFilm {
    folder: PathBuf,
    name: String,
    length_ms: u32,
}

impl DemoFilm {
    /// Looks at a film.
    pub(super) fn find(path: &Path) -> Result<Self, Failure> {
        let path = path.canonicalize().with_context(|| path.display().to_string()).or_exit(Exit::NoInput)?;
        let name = path.file_name().and_then(|name| name.to_str()).map(str::to_owned);
        let (Some(folder), Some(name), Some(_)) = (path.parent(), name, path.to_str()) else {
            return Err(anyhow!("{} is not a file with a UTF-8 name", path.display())).or_exit(Exit::NoInput);
        };
        let length_s = film_length_s(&path).map_err(anyhow::Error::msg).or_exit(Exit::Unavailable)?;
        let shortest_s = f64::from(SWELL_MS + REST_MS) / 1e3;
        if !(shortest_s..LONGEST_S).contains(&length_s) {
            let short = format!("{name} is {length_s:.1} s long; use a film of {shortest_s} s to a day");
            return Err(anyhow!(short)).or_exit(Exit::NoInput);
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "up to a day")]
        let length_ms = (length_s * 1e3) as u32;
        Ok(Self { folder: folder.to_owned(), name, length_ms })
    }

    /// What loads it, and what is played then.
    pub(super) fn load(&self) -> (Command, &'static str) {
        (Command::Playlist { id: Some(ID.to_owned()) }, NAME)
    }

    /// What the configuration says of it.
    pub(super) fn tables(&self) -> String {
        format!(
            "[film]\nplayer = \"mpv\"\nfolder = {}\nfullscreen = false\n",
            quoted(&self.folder.to_string_lossy())
        )
    }

    /// The playlist and the cue.
    pub(super) fn files(&self) -> [(String, String); 2] {
        let entry = format!("title = \"Film\"\n[[entry]]\ncue = \"{ID}\"\nmovie = {}\n", quoted(&self.name));
        [(format!("playlists/{ID}.toml"), entry), (format!("cues/{ID}.csv"), self.cue())]
    }

    /// Swells up to the film's end, but for a moment.
    fn cue(&self) -> String {
        let steps = (self.length_ms - REST_MS) / STEP_MS;
        let swells = (steps * STEP_MS / SWELL_MS).max(1);
        let mut text = "time_ms,a1,a2,a3\n".to_owned();
        for step in 0..=steps {
            let (ms, turn) = (step * STEP_MS, f64::from(step) / f64::from(steps) * f64::from(swells) * TAU);
            let at = SWELL / 2.0 * (1.0 - turn.cos());
            writeln!(text, "{ms},{at:.6},{at:.6},{at:.6}").expect("a String takes what is written to it");
        }
        text
    }
}
