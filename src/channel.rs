//! The table of channels: values beside positions that a cue carries from its file into frames. Each holds until it changes,
//! and is 0 at rest. Files, digest, timeline, levels and `info` go through the table; codecs (`drive::mbox`, `drive::link`) alone know
//! what a channel means in a frame.

use std::fmt;

use crate::motion::MAX_AXES;
use crate::wire::Analogue;

/// The most parts of one channel.
pub(crate) const MAX_PARTS: usize = 2;

/// What a channel says at an instant, a number for each of its parts in the order of the table; all 0 at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample(pub [f64; MAX_PARTS]);

/// A channel, by its place in `CHANNELS`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum ChannelId {
    /// Vibration of an axis (SMC manual 2.2.2.9).
    Vibration,
    /// Analogue outputs: Extend (SMC manual 2.2.2.5), Play DAC (IMAX manual 2.2.2.6).
    Analogue,
}

/// Whose a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scope {
    /// One of each axis.
    Axis,
    /// One for all seats.
    Hall,
}

/// What a part counts, and so what it may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PartKind {
    /// Hz.
    Hertz,
    /// A distance in the cue's unit.
    Amplitude,
    /// 0 to 1 of what the output can do.
    Level,
}

/// What operators set of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LevelRule {
    /// The level of vibration scales its amplitude.
    Scale,
    /// Each part is allowed or not, as an effect is; a controller has it where its configuration says up to which level.
    Switch,
}

/// One number of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ChannelPart {
    /// Its name in files.
    pub(crate) name: &'static str,
    /// What it counts.
    pub(crate) kind: PartKind,
}

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Channel {
    /// Its place.
    pub(crate) id: ChannelId,
    /// Its MCAP topic.
    pub(crate) topic: &'static str,
    /// What a person calls it.
    pub(crate) title: &'static str,
    /// What its CSV columns begin with before the number of the axis; nothing in those of the hall.
    pub(crate) prefix: &'static str,
    /// Whose it is.
    pub(crate) scope: Scope,
    /// Its numbers.
    pub(crate) parts: &'static [ChannelPart],
    /// What operators set of it.
    pub(crate) level: LevelRule,
    /// False if frames with vibration have no place for it.
    pub(crate) beside_vibration: bool,
    /// What no frame may say though each part alone could, with the remedy.
    pub(crate) check: fn(Sample) -> Result<(), &'static str>,
}

/// All channels. The first is what every cue had from the first release on; see `proof::digest` and MCAP for the others.
pub(crate) const CHANNELS: &[Channel] = &[
    Channel {
        id: ChannelId::Vibration,
        topic: "/cue/vibration",
        title: "vibration",
        prefix: "v",
        scope: Scope::Axis,
        parts: &[
            ChannelPart { name: "hz", kind: PartKind::Hertz },
            ChannelPart { name: "amp", kind: PartKind::Amplitude },
        ],
        level: LevelRule::Scale,
        beside_vibration: true,
        check: |_| Ok(()),
    },
    Channel {
        id: ChannelId::Analogue,
        topic: "/cue/analogue",
        title: "analogue output",
        prefix: "",
        scope: Scope::Hall,
        parts: &[
            ChannelPart { name: "dac1", kind: PartKind::Level },
            ChannelPart { name: "dac2", kind: PartKind::Level },
        ],
        level: LevelRule::Switch,
        beside_vibration: false,
        check: |sample| Analogue::check(sample.0),
    },
];

/// How many values there are at an instant: one for each axis of a channel of axes, one of each other.
pub(crate) const TRACKS: usize = tracks_before(CHANNELS.len());
/// How many parts operators can switch.
pub(crate) const SWITCHES: usize = switches_before(CHANNELS.len());

const fn tracks_before(channel: usize) -> usize {
    let (mut index, mut tracks) = (0, 0);
    while index < channel {
        tracks += CHANNELS[index].width();
        index += 1;
    }
    tracks
}

const fn switches_before(channel: usize) -> usize {
    let (mut index, mut switches) = (0, 0);
    while index < channel {
        if matches!(CHANNELS[index].level, LevelRule::Switch) {
            switches += CHANNELS[index].parts.len();
        }
        index += 1;
    }
    switches
}

/// The place of each channel's first track, and of its first switch: looked up on the tick thread, so counted beforehand.
const FIRST: [(usize, usize); CHANNELS.len()] = {
    let mut first = [(0, 0); CHANNELS.len()];
    let mut index = 0;
    while index < first.len() {
        first[index] = (tracks_before(index), switches_before(index));
        index += 1;
    }
    first
};

/// One track of a cue: a channel, of an axis where it is one of axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TrackId {
    /// The channel.
    pub(crate) channel: ChannelId,
    /// The axis, counted from 0; 0 for a channel of the hall.
    pub(crate) axis: usize,
}

impl ChannelId {
    /// Its row of the table.
    #[must_use]
    pub(crate) const fn row(self) -> &'static Channel {
        &CHANNELS[self as usize]
    }

    /// Its track on an axis, counted from 0.
    #[must_use]
    pub(crate) const fn on(self, axis: usize) -> TrackId {
        TrackId { channel: self, axis }
    }

    /// Its only track, of a channel of the hall.
    #[must_use]
    pub(crate) const fn of_hall(self) -> TrackId {
        self.on(0)
    }
}

impl Channel {
    const fn width(&self) -> usize {
        match self.scope {
            Scope::Axis => MAX_AXES,
            Scope::Hall => 1,
        }
    }

    /// Its tracks in a cue of so many axes.
    pub(crate) fn tracks(&self, axes: usize) -> impl Iterator<Item = TrackId> + use<> {
        let id = self.id;
        (0..self.width().min(if self.scope == Scope::Axis { axes } else { 1 })).map(move |axis| id.on(axis))
    }

    /// What operators set, where each of its parts has a switch: the place of the first among all switches.
    #[must_use]
    pub(crate) const fn first_switch(&self) -> usize {
        FIRST[self.id as usize].1
    }
}

impl TrackId {
    /// Its place among all tracks.
    ///
    /// # Panics
    /// If there is no such axis.
    #[must_use]
    pub(crate) const fn index(self) -> usize {
        assert!(self.axis < self.channel.row().width(), "a track of an axis that there is");
        FIRST[self.channel as usize].0 + self.axis
    }

    /// The CSV column of one of its parts.
    #[must_use]
    pub(crate) fn column(self, part: usize) -> String {
        let Channel { prefix, scope, parts, .. } = self.channel.row();
        let name = parts[part].name;
        match scope {
            Scope::Axis => format!("{prefix}{}_{name}", self.axis + 1),
            Scope::Hall => name.to_owned(),
        }
    }
}

impl fmt::Display for TrackId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Channel { scope, title, .. } = self.channel.row();
        match scope {
            Scope::Axis => write!(f, "the {title} of axis {}", self.axis + 1),
            Scope::Hall => write!(f, "an {title}"),
        }
    }
}

/// The track and part that a CSV column carries; `axis_of` reads the number of an axis.
#[must_use]
pub(crate) fn of_column(name: &str, axis_of: impl Fn(&str) -> Option<usize>) -> Option<(TrackId, usize)> {
    CHANNELS.iter().find_map(|channel| {
        let (axis, part) = match channel.scope {
            Scope::Hall => (0, name),
            Scope::Axis => {
                let (axis, part) = name.strip_prefix(channel.prefix)?.split_once('_')?;
                (axis_of(axis)?, part)
            }
        };
        let part = channel.parts.iter().position(|known| known.name == part)?;
        Some((channel.id.on(axis), part))
    })
}

/// The parts that operators can switch: the track, the part, and the name of the switch, which is that of the column.
pub(crate) fn switches() -> impl Iterator<Item = (TrackId, usize, &'static str)> {
    let switched = CHANNELS.iter().filter(|channel| channel.level == LevelRule::Switch);
    switched.flat_map(|channel| {
        (0..).zip(channel.parts).map(|(part, known)| (channel.id.of_hall(), part, known.name))
    })
}

/// True if a switch has that name, which no effect may have then.
#[must_use]
pub(crate) fn is_switch(name: &str) -> bool {
    switches().any(|(_, _, known)| known == name)
}

/// The values of all tracks at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Samples([Sample; TRACKS]);

impl Samples {
    /// All off.
    pub(crate) const REST: Self = Self([Sample([0.0; MAX_PARTS]); TRACKS]);

    /// That of a track.
    #[must_use]
    pub(crate) const fn of(&self, track: TrackId) -> Sample {
        self.0[track.index()]
    }

    /// Sets that of a track.
    pub(crate) const fn set(&mut self, track: TrackId, sample: Sample) {
        self.0[track.index()] = sample;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_channel_stands_at_its_id_and_each_track_has_its_own_place() {
        let mut places = Vec::new();
        for (index, channel) in CHANNELS.iter().enumerate() {
            assert_eq!(channel.id as usize, index, "{}", channel.topic);
            assert!((1..=MAX_PARTS).contains(&channel.parts.len()));
            places.extend(channel.tracks(MAX_AXES).map(TrackId::index));
            let switched = channel.level == LevelRule::Switch;
            assert!(!switched || channel.scope == Scope::Hall, "a switch is named by its part alone");
        }
        assert_eq!(places, (0..TRACKS).collect::<Vec<_>>());
        assert_eq!(switches().count(), SWITCHES);
    }

    #[test]
    fn a_column_is_read_as_the_track_that_it_is_written_for() {
        for channel in CHANNELS {
            for track in channel.tracks(MAX_AXES) {
                for part in 0..channel.parts.len() {
                    let axis_of = |text: &str| text.parse::<usize>().ok()?.checked_sub(1);
                    assert_eq!(of_column(&track.column(part), axis_of), Some((track, part)));
                }
            }
        }
        assert_eq!(ChannelId::Vibration.on(2).column(1), "v3_amp");
        assert_eq!(of_column("v1", |_| Some(0)), None);
        assert!(is_switch("dac2") && !is_switch("v1_hz") && !is_switch("air"));
    }
}
