//! Lines that bring timecode or a film's sound, as they are written.

use std::fmt;
use std::path::PathBuf;

/// Where sound comes from, LTC or a film's own: 16 bits, raw at 48,000 samples a second or behind a RIFF header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SoundLine {
    /// What a command writes.
    Pipe(String),
    /// A FIFO; it is opened anew when its writer is gone.
    Fifo(PathBuf),
    /// Standard input.
    Stdin,
    /// A sound card, by `arecord`.
    Alsa(String),
    /// What a relay reads of it on this machine, at its socket.
    Relay(PathBuf),
    /// A WAV file, at the speed of its samples: for a look, and for tests.
    File(PathBuf),
}

/// Where MIDI timecode comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum MtcInput {
    /// A raw device or a FIFO.
    Device(PathBuf),
    /// What a relay reads of it on this machine, at its socket.
    Relay(PathBuf),
}

/// A kind of line that a relay passes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LineKind {
    Ltc,
    Mtc,
}

impl fmt::Display for SoundLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pipe(_) => f.write_str("pipe"), // a command may be long, or hold what nobody is to see
            Self::Fifo(path) => write!(f, "fifo:{}", path.display()),
            Self::Stdin => f.write_str("-"),
            Self::Alsa(device) => write!(f, "alsa:{device}"),
            Self::Relay(socket) => write!(f, "relay:{}", socket.display()),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

impl SoundLine {
    pub(super) fn of(text: &str) -> Self {
        match text.split_once(':') {
            _ if text == "-" => Self::Stdin,
            Some(("pipe", command)) => Self::Pipe(command.to_owned()),
            Some(("fifo", path)) => Self::Fifo(path.into()),
            Some(("relay", socket)) => Self::Relay(socket.into()),
            Some(("alsa", device)) => Self::Alsa(device.to_owned()),
            _ => Self::File(text.into()),
        }
    }
}

impl MtcInput {
    pub(super) fn of(text: &str) -> Self {
        text.strip_prefix("relay:")
            .map_or_else(|| Self::Device(text.into()), |socket| Self::Relay(socket.into()))
    }
}

impl LineKind {
    /// As sources begin that bring it.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Ltc => "ltc",
            Self::Mtc => "mtc",
        }
    }
}
