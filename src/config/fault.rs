//! What is wrong with a configuration file, and where.

use std::fmt;
use std::io;
use std::path::PathBuf;

use super::syntax::in_words;
use crate::plain;

/// How much of a fault is told, bytes.
const TOLD: usize = 1_000;
/// So many are noted; whoever corrects these sees the others then.
const MOST: usize = 200;

/// One fault of a configuration file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigFault {
    /// The file.
    pub(crate) path: PathBuf,
    /// Line, counted from 1.
    pub(crate) line: usize,
    /// Column in characters, counted from 1.
    pub(crate) column: usize,
    /// What is wrong, with value and limit.
    pub(crate) message: String,
}

impl fmt::Display for ConfigFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}: {}", plain::path(&self.path), self.line, self.column, self.message)
    }
}

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigFaults {
    /// The file is missing, a folder, or cannot be read.
    #[error("cannot read the configuration {}", plain::path(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file was read; these are all its faults, at least one, in its order.
    #[error("{}", lines(.0))]
    Bad(Vec<ConfigFault>),
}

fn lines(faults: &[ConfigFault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// The faults found so far in a text, by their place in it.
pub(crate) struct Faults<'t> {
    text: &'t str,
    found: Vec<(usize, String)>,
    /// Lines that are no TOML: what was made of them says nothing.
    broken: Vec<usize>,
}

impl<'t> Faults<'t> {
    pub(crate) fn of(text: &'t str) -> Self {
        Self { text, found: Vec::new(), broken: Vec::new() }
    }

    /// Notes a fault at byte `at` of the text.
    pub(crate) fn note(&mut self, at: usize, message: impl Into<String>) {
        if !self.is_full() && !self.broken.contains(&self.line(at)) {
            self.found.push((at, message.into()));
        }
    }

    /// True if no more are noted: what comes is not looked at, as a text may have a fault in each of its lines.
    pub(crate) fn is_full(&self) -> bool {
        self.found.len() >= MOST
    }

    /// Notes that something is not there, unless a line that is no TOML may have held it.
    pub(crate) fn note_missing(&mut self, at: usize, message: impl Into<String>) {
        if self.broken.is_empty() {
            self.note(at, message);
        }
    }

    /// Notes that the text is no TOML; further faults of that line are not noted.
    pub(crate) fn note_syntax(&mut self, error: &toml::de::Error) {
        if self.is_full() {
            return;
        }
        let span = error.span().unwrap_or(0..0);
        let from = self.text[..span.start].rfind('\n').map_or(0, |end| end + 1);
        let line = self.text[from..].lines().next().unwrap_or_default();
        self.note(span.start, in_words(error.message(), &self.text[span.clone()], line));
        self.broken.push(self.line(span.start));
    }

    /// The line of byte `at`, counted from 1.
    pub(crate) fn line(&self, at: usize) -> usize {
        self.place(at).0
    }

    /// Line and column of byte `at`, both counted from 1.
    pub(crate) fn place(&self, at: usize) -> (usize, usize) {
        place(self.text.as_bytes(), at)
    }

    /// True if none has been noted.
    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// All of them, in the order of the text.
    pub(crate) fn into_list(mut self, path: &std::path::Path) -> Vec<ConfigFault> {
        self.found.sort_by_key(|&(at, _)| at);
        let text = self.text.as_bytes();
        let at_place = |(at, message): (usize, String)| {
            let (line, column) = place(text, at);
            // It may name a key as it stands in the file.
            let message = plain::escaped(&message, TOLD).into_owned();
            ConfigFault { path: path.to_owned(), line, column, message }
        };
        let is_full = self.is_full();
        let mut faults: Vec<_> = self.found.into_iter().map(at_place).collect();
        if let Some(last) = faults.last_mut().filter(|_| is_full) {
            last.message.push_str("; there may be more: correct these first");
        }
        faults
    }
}

/// Line and column of byte `at`, as an editor counts them: from 1, the column in characters.
pub(crate) fn place(text: &[u8], at: usize) -> (usize, usize) {
    let before = &text[..at.min(text.len())];
    let line_start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
    let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
    let is_char_start = |byte: &&u8| (**byte & 0xc0) != 0x80;
    (line, 1 + before[line_start..].iter().filter(is_char_start).count())
}
