//! Which source leads a show, as it is written.

use std::path::PathBuf;
use std::str::FromStr;

use crate::film::timecode::{FrameRate, Label, Timecode, TimecodeError};
use crate::film::tracker::SourceKind;
use crate::time::ShowTime;

/// Where LTC comes from: sound, the first channel of it, 16 bits, raw at 48,000 samples a second or behind a RIFF header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum LtcInput {
    /// What a command writes.
    Pipe(String),
    /// A FIFO; it is opened anew when its writer is gone.
    Fifo(PathBuf),
    /// Standard input.
    Stdin,
    /// A sound card, by `arecord`.
    Alsa(String),
    /// A WAV file, at the speed of its samples: for a look, and for tests.
    File(PathBuf),
}

/// Who says where the film is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum FilmSource {
    /// Linear timecode.
    Ltc(LtcInput),
    /// mpv, by its socket (`--input-ipc-server`).
    Mpv(PathBuf),
}

/// How a film is read.
#[derive(Debug, Clone)]
pub(crate) struct FilmArgs {
    /// Its source.
    pub(crate) source: FilmSource,
    /// Frames a second; found where none are given.
    pub(crate) rate: Option<FrameRate>,
    /// The timecode of the cue's beginning.
    pub(crate) start: Label,
}

/// Why something that was written is none of this.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(crate) struct FilmArgError(String);

impl FilmArgError {
    pub(super) fn of(error: &TimecodeError) -> Self {
        Self(error.to_string())
    }
}

impl FilmArgs {
    /// Where a film is whose first frame is labelled 00:00:00:00 when the cue begins.
    pub(super) fn begin(&self) -> ShowTime {
        let rate = self.rate.unwrap_or(FrameRate::F24);
        let of = |label| Timecode::of(label, rate).map(|code| rate.quarters(4 * i64::from(code.index())));
        of(self.start).unwrap_or(ShowTime::ZERO)
    }

    /// What is written for them: a source, frames a second, and the timecode at which the cue begins.
    ///
    /// # Errors
    /// [`FilmArgError`] where one of them is nothing known.
    pub(crate) fn new(
        source: FilmSource,
        rate: Option<&str>,
        start: Option<&str>,
    ) -> Result<Self, FilmArgError> {
        let rate = rate.map(FrameRate::from_str).transpose().map_err(|error| FilmArgError::of(&error))?;
        let start = start.map(Label::from_str).transpose().map_err(|error| FilmArgError::of(&error))?;
        if let (Some(start), Some(rate)) = (start, rate) {
            Timecode::of(start, rate).map_err(|error| FilmArgError::of(&error))?;
        }
        Ok(Self { source, rate, start: start.unwrap_or_default() })
    }
}

impl FilmSource {
    pub(super) const fn kind(&self) -> SourceKind {
        match self {
            Self::Ltc(_) => SourceKind::Ltc,
            Self::Mpv(_) => SourceKind::MpvSound,
        }
    }
}

impl FromStr for FilmSource {
    type Err = FilmArgError;

    fn from_str(text: &str) -> Result<Self, FilmArgError> {
        let refuse = || {
            FilmArgError(format!(
                "{text} is no source; take mpv:SOCKET, ltc:pipe:COMMAND, ltc:fifo:PATH, ltc:alsa:DEVICE, ltc:- or ltc:FILE.wav"
            ))
        };
        let (kind, input) = text.split_once(':').filter(|(_, input)| !input.is_empty()).ok_or_else(refuse)?;
        match kind {
            "ltc" => Ok(Self::Ltc(LtcInput::of(input))),
            "mpv" => Ok(Self::Mpv(input.into())),
            _ => Err(refuse()),
        }
    }
}

impl LtcInput {
    fn of(text: &str) -> Self {
        match text.split_once(':') {
            _ if text == "-" => Self::Stdin,
            Some(("pipe", command)) => Self::Pipe(command.to_owned()),
            Some(("fifo", path)) => Self::Fifo(path.into()),
            Some(("alsa", device)) => Self::Alsa(device.to_owned()),
            _ => Self::File(text.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_form_of_a_source_is_read_and_others_are_told_what_there_is() {
        let of = |text: &str| text.parse::<FilmSource>();
        let ltc = |input| Ok(FilmSource::Ltc(input));
        assert_eq!(of("ltc:-"), ltc(LtcInput::Stdin));
        assert_eq!(of("ltc:pipe:sox a.wav -t raw -"), ltc(LtcInput::Pipe("sox a.wav -t raw -".to_owned())));
        assert_eq!(of("ltc:fifo:/run/ltc"), ltc(LtcInput::Fifo("/run/ltc".into())));
        assert_eq!(of("ltc:alsa:hw:2,0"), ltc(LtcInput::Alsa("hw:2,0".to_owned())));
        assert_eq!(of("mpv:/run/mpv.sock"), Ok(FilmSource::Mpv("/run/mpv.sock".into())));
        assert_eq!(of("ltc:reel:1.wav"), ltc(LtcInput::File("reel:1.wav".into())));
        for text in ["", "ltc", "ltc:", "tape:1"] {
            let error = of(text).expect_err(text).to_string();
            assert!(error.contains("ltc:FILE.wav"), "{error}");
        }
    }

    #[test]
    fn rate_and_start_are_read_and_refused_in_words() {
        let args = |rate, start| FilmArgs::new(FilmSource::Ltc(LtcInput::Stdin), rate, start);
        let read = args(Some("29.97"), Some("01:00:00;02")).expect("both are sound");
        assert_eq!((read.start.hours, read.start.drops), (1, true));
        for (rate, start) in [(Some("26"), None), (None, Some("1:2"))] {
            let error = args(rate, start).expect_err("it is not").to_string();
            assert!(error.contains("take") || error.contains("write"), "{error}");
        }
    }
}
