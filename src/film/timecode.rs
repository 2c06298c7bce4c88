//! Labels of film frames, hours to frames, at the six kinds of timecode that are in use, and the media time that a label stands for.
//!
//! A label counts frames; how long a frame lasts is another matter: 24 labels a second are written on film that runs at 24 frames and
//! on film that runs at 24,000 in 1,001 seconds. After an hour these two are 3.6 s apart.

#[cfg(test)]
mod tests;

use std::fmt;
use std::str::FromStr;

use crate::time::ShowTime;

/// How frames are labelled, and how long each lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum FrameRate {
    /// Labels of 24, 24,000/1,001 frames a second.
    F23_976,
    /// 24 frames a second.
    F24,
    /// 25 frames a second.
    F25,
    /// Labels of 30, 30,000/1,001 frames a second: a label falls behind the clock by 3.6 s an hour.
    F29_97,
    /// The same frames; two labels are left out each minute but every tenth, so that labels keep to the clock.
    F29_97Drop,
    /// 30 frames a second.
    F30,
}

/// Labels that drop frame leaves out at the begin of a minute.
const DROPPED: u32 = 2;
/// Frames of ten minutes of drop frame: 10 x 60 x 30 less 9 x 2.
const DROP_TEN_MINUTES: u32 = 17_982;
/// Frames of a minute of drop frame that has labels left out.
const DROP_MINUTE: u32 = 1_798;

impl FrameRate {
    /// All of them.
    pub(crate) const ALL: [Self; 6] =
        [Self::F23_976, Self::F24, Self::F25, Self::F29_97, Self::F29_97Drop, Self::F30];

    /// Labels of a second.
    pub(crate) const fn labels(self) -> u32 {
        match self {
            Self::F23_976 | Self::F24 => 24,
            Self::F25 => 25,
            Self::F29_97 | Self::F29_97Drop | Self::F30 => 30,
        }
    }

    /// The one of so many labels a second that keeps to the clock.
    pub(crate) const fn whole(labels: u32, drops: bool) -> Self {
        match (labels, drops) {
            (24, _) => Self::F24,
            (25, _) => Self::F25,
            (_, true) => Self::F29_97Drop,
            (_, false) => Self::F30,
        }
    }

    /// True if labels are left out to keep to the clock.
    pub(crate) const fn drops(self) -> bool {
        matches!(self, Self::F29_97Drop)
    }

    /// Frames of so many seconds.
    const fn ratio(self) -> (i64, i64) {
        match self {
            Self::F23_976 => (24_000, 1_001),
            Self::F24 => (24, 1),
            Self::F25 => (25, 1),
            Self::F29_97 | Self::F29_97Drop => (30_000, 1_001),
            Self::F30 => (30, 1),
        }
    }

    /// Frames a second.
    #[expect(clippy::cast_precision_loss, reason = "at most 30,000")]
    pub(crate) fn frames_per_second(self) -> f64 {
        let (frames, seconds) = self.ratio();
        frames as f64 / seconds as f64
    }

    /// Labels of a day.
    pub(crate) const fn labels_of_a_day(self) -> u32 {
        if self.drops() { 144 * DROP_TEN_MINUTES } else { 86_400 * self.labels() }
    }

    /// How long so many quarters of a frame last.
    pub(crate) fn quarters(self, quarters: i64) -> ShowTime {
        let (frames, seconds) = self.ratio();
        let (parts, per) =
            (i128::from(quarters) * i128::from(seconds) * 1_000_000_000, i128::from(4 * frames));
        // In whole numbers: after two hours a period that was rounded to a nanosecond would be 0.06 ms off.
        let nanos = (parts + per / 2).div_euclid(per);
        // Only a count of more than 292 years saturates.
        ShowTime::from_nanos(i64::try_from(nanos).unwrap_or(if nanos < 0 { i64::MIN } else { i64::MAX }))
    }

    /// The same frames with labels that drop, or do not; `None` if there is no such timecode.
    pub(crate) const fn dropping(self, drops: bool) -> Option<Self> {
        match (self, drops) {
            (Self::F29_97 | Self::F29_97Drop, true) => Some(Self::F29_97Drop),
            (Self::F29_97 | Self::F29_97Drop, false) => Some(Self::F29_97),
            (Self::F23_976 | Self::F24 | Self::F25 | Self::F30, true) => None,
            (Self::F23_976 | Self::F24 | Self::F25 | Self::F30, false) => Some(self),
        }
    }
}

/// What each rate is called; the first name of one is the one that is shown.
const NAMES: [(&str, FrameRate); 7] = [
    ("23.976", FrameRate::F23_976),
    ("23.98", FrameRate::F23_976),
    ("24", FrameRate::F24),
    ("25", FrameRate::F25),
    ("29.97", FrameRate::F29_97),
    ("29.97 drop", FrameRate::F29_97Drop),
    ("30", FrameRate::F30),
];

impl fmt::Display for FrameRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = NAMES.iter().find(|(_, rate)| rate == self);
        f.write_str(name.map_or("", |(name, _)| name))
    }
}

impl FromStr for FrameRate {
    type Err = TimecodeError;

    /// `29.97` is either of its two until a label says which: the bit in the label decides.
    fn from_str(text: &str) -> Result<Self, TimecodeError> {
        let rate = NAMES.iter().find(|(name, _)| *name == text).map(|(_, rate)| *rate);
        rate.ok_or_else(|| TimecodeError::Rate(text.to_owned()))
    }
}

/// A label as it comes with the signal: nobody has checked it, and its rate is not known yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Label {
    pub(crate) hours: u8,
    pub(crate) minutes: u8,
    pub(crate) seconds: u8,
    pub(crate) frames: u8,
    /// Whether it says that labels are left out.
    pub(crate) drops: bool,
}

impl FromStr for Label {
    type Err = TimecodeError;

    /// `HH:MM:SS:FF`, with a semicolon before the frames if it drops.
    fn from_str(text: &str) -> Result<Self, TimecodeError> {
        let refuse = || TimecodeError::Text(text.to_owned());
        let (before, frames) = text.rsplit_once([':', ';']).ok_or_else(refuse)?;
        let mut parts = before.split(':').chain([frames]).map(|part| {
            let is_short = matches!(part.len(), 1 | 2) && part.bytes().all(|digit| digit.is_ascii_digit());
            part.parse().ok().filter(|_| is_short).ok_or_else(refuse)
        });
        let mut next = || parts.next().ok_or_else(refuse)?;
        let (hours, minutes, seconds, frames) = (next()?, next()?, next()?, next()?);
        let drops = text.contains(';');
        if parts.next().is_some() {
            Err(refuse())
        } else {
            Ok(Self { hours, minutes, seconds, frames, drops })
        }
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { hours, minutes, seconds, frames, drops } = self;
        let before = if *drops { ';' } else { ':' };
        write!(f, "{hours:02}:{minutes:02}:{seconds:02}{before}{frames:02}")
    }
}

/// Why something is no timecode.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum TimecodeError {
    #[error("{0} is not a timecode; write HH:MM:SS:FF, such as 01:00:00:00")]
    Text(String),
    #[error("{0} is not a frame rate; take 23.976, 24, 25, 29.97 or 30")]
    Rate(String),
    #[error("{label}: {value} {part} are outside 0..={most}")]
    Range { label: Label, part: &'static str, value: u8, most: u32 },
    #[error("{0} does not exist: drop frame leaves out ;00 and ;01 of each minute but every tenth; take ;02")]
    LeftOut(Label),
    #[error("{label} is drop frame, which there is at 29.97 frames a second alone; {rate} is configured")]
    Drops { label: Label, rate: FrameRate },
    #[error("a second ends with frame {last}, so there are {} frames a second; {rate} is configured", last + 1)]
    SecondEnds { last: u8, rate: FrameRate },
    #[error(
        "its frame rate cannot be found by how its labels come; give it as --film-fps, or as film_fps in [sync]"
    )]
    Unfound,
    #[error("the source says that it has {said} frames a second; {rate} is configured")]
    Says { said: u32, rate: FrameRate },
}

/// A frame of a day, by its rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Timecode {
    rate: FrameRate,
    /// Frames since the label of midnight.
    index: u32,
}

impl Timecode {
    /// The frame that a label names; at `rate` 29.97 the label says whether it drops.
    ///
    /// # Errors
    /// [`TimecodeError::Range`], [`TimecodeError::LeftOut`] or [`TimecodeError::Drops`] if there is no such frame.
    pub(crate) fn of(label: Label, rate: FrameRate) -> Result<Self, TimecodeError> {
        let rate = rate.dropping(label.drops).ok_or(TimecodeError::Drops { label, rate })?;
        let Label { hours, minutes, seconds, frames, .. } = label;
        let parts = [
            ("hours", hours, 23),
            ("minutes", minutes, 59),
            ("seconds", seconds, 59),
            ("frames", frames, rate.labels() - 1),
        ];
        for (part, value, most) in parts {
            if u32::from(value) > most {
                return Err(TimecodeError::Range { label, part, value, most });
            }
        }
        let minute = 60 * u32::from(hours) + u32::from(minutes);
        let counted = rate.labels() * (60 * minute + u32::from(seconds)) + u32::from(frames);
        if !rate.drops() {
            return Ok(Self { rate, index: counted });
        }
        if seconds == 0 && u32::from(frames) < DROPPED && !minute.is_multiple_of(10) {
            return Err(TimecodeError::LeftOut(label));
        }
        // Two labels less for each minute so far, but for every tenth.
        Ok(Self { rate, index: counted - DROPPED * (minute - minute / 10) })
    }

    /// The frame that was typed, as [`Label`] reads it.
    ///
    /// # Errors
    /// What is wrong with the text, for a person.
    pub(crate) fn parse(text: &str, rate: FrameRate) -> Result<Self, TimecodeError> {
        let label: Label = text.parse()?;
        Self::of(Label { drops: label.drops || rate.drops(), ..label }, rate)
    }

    /// Frames since the label of midnight, less whole days.
    pub(crate) fn at_index(rate: FrameRate, index: i64) -> Self {
        let day = rate.labels_of_a_day();
        // Never below zero: the frame before midnight is the last of the day before.
        let index = u32::try_from(index.rem_euclid(i64::from(day))).unwrap_or(0);
        Self { rate, index }
    }

    pub(crate) const fn rate(self) -> FrameRate {
        self.rate
    }

    pub(crate) const fn index(self) -> u32 {
        self.index
    }

    /// The frame so many frames later, or earlier; after the last of a day comes the first.
    pub(crate) fn plus(self, frames: i64) -> Self {
        Self::at_index(self.rate, i64::from(self.index).saturating_add(frames))
    }

    /// How many frames this is after `earlier`, the shorter way round the day; below zero it is before it.
    pub(crate) fn since(self, earlier: Self) -> i64 {
        let day = i64::from(self.rate.labels_of_a_day());
        let ahead = (i64::from(self.index) - i64::from(earlier.index)).rem_euclid(day);
        // A film that starts before midnight goes on after it.
        if ahead >= day / 2 { ahead - day } else { ahead }
    }

    /// The media time of its first instant in a film that starts with the frame `start`; half a day before to half a day after.
    pub(crate) fn media_since(self, start: Self) -> ShowTime {
        self.rate.quarters(4 * self.since(start))
    }

    /// The frame that the film is at, so long after this one began.
    #[expect(clippy::cast_possible_truncation, reason = "beyond a day it begins anew")]
    pub(crate) fn at_media(self, media: ShowTime) -> Self {
        // A frame has begun even if rounding puts its begin a little later.
        self.plus((media.as_secs_f64() * self.rate.frames_per_second() + 1e-4).floor() as i64)
    }

    pub(crate) fn label(self) -> Label {
        let (rate, index) = (self.rate, self.index);
        let counted = if rate.drops() { index + DROPPED * minutes_dropped(index) } else { index };
        let part = |value: u32| u8::try_from(value).unwrap_or(u8::MAX);
        let second = counted / rate.labels();
        Label {
            hours: part(second / 3_600),
            minutes: part(second / 60 % 60),
            seconds: part(second % 60),
            frames: part(counted % rate.labels()),
            drops: rate.drops(),
        }
    }
}

/// In how many minutes before that frame labels were left out.
const fn minutes_dropped(index: u32) -> u32 {
    let (tens, rest) = (index / DROP_TEN_MINUTES, index % DROP_TEN_MINUTES);
    // The first minute of ten has all its labels, so it is longer than the others by those that they leave out.
    let within = if rest < DROPPED { 0 } else { (rest - DROPPED) / DROP_MINUTE };
    9 * tens + within
}

impl fmt::Display for Timecode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.label().fmt(f)
    }
}
