//! Timecode as datagrams and as bytes of MIDI: made for technicians and tests, each piece with the time at which it is to go out.

use std::time::Duration;

use crate::film::artnet::ArtTimecode;
use crate::film::mtc::quarter_frames;
use crate::film::source::FilmArgError;
use crate::film::timecode::{FrameRate, Timecode, TimecodeError};

/// Timecode of a film that runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimecodeSent {
    first: Timecode,
}

impl TimecodeSent {
    /// From a label on, at so many frames a second.
    pub(crate) fn new(fps: &str, start: &str) -> Result<Self, FilmArgError> {
        let words = |error: TimecodeError| FilmArgError::of(&error);
        let rate: FrameRate = fps.parse().map_err(words)?;
        Ok(Self { first: Timecode::parse(start, rate).map_err(words)? })
    }

    /// The datagrams of Art-Net, one a frame.
    pub(crate) fn artnet(self) -> impl Iterator<Item = (Duration, Vec<u8>)> {
        (0_i64..).map(move |frame| {
            let code = self.first.plus(frame);
            (self.after(4 * frame), ArtTimecode::emit(code.label(), code.rate()).to_vec())
        })
    }

    /// The quarter frames of MIDI; eight of them carry the label of each second frame.
    pub(crate) fn mtc(self) -> impl Iterator<Item = (Duration, Vec<u8>)> {
        let set = move |set: i64| quarter_frames(self.first.plus(2 * set));
        let quarters = (0_i64..).flat_map(set);
        (0_i64..).zip(quarters).map(move |(quarter, bytes)| (self.after(quarter), bytes.to_vec()))
    }

    /// When so many quarters of a frame have passed.
    fn after(self, quarters: i64) -> Duration {
        Duration::from_nanos(self.first.rate().quarters(quarters).as_nanos().unsigned_abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_piece_goes_out_when_the_film_is_there() {
        let film = TimecodeSent::new("25", "00:59:59:24").expect("there is such a label");
        let datagrams: Vec<_> = film.artnet().take(2).collect();
        assert_eq!(datagrams[1].0, Duration::from_millis(40));
        assert_eq!(datagrams[1].1[14..], [0, 0, 0, 1, 1], "01:00:00:00 at 25");
        let quarters: Vec<_> = film.mtc().take(9).collect();
        assert_eq!((quarters[0].1.as_slice(), quarters[8].0), (&[0xf1, 0x08][..], Duration::from_millis(80)));
        assert_eq!(quarters[8].1, [0xf1, 0x01], "two frames on, 01:00:00:01");
        assert!(TimecodeSent::new("25", "00:00:00:25").is_err());
    }
}
