//! What the channels of the table carry in a cue.

use super::Steps;
use crate::channel::{CHANNELS, ChannelId, Sample, TRACKS, TrackId};
use crate::motion::MAX_AXES;
use crate::time::ShowTime;

/// A vibration of one axis; none if either part is 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Vibration {
    /// Frequency, Hz: 0, or [`super::limits::MIN_VIBRATION_HZ`] to [`super::limits::MAX_VIBRATION_HZ`].
    pub(crate) hz: f64,
    /// Amplitude in the cue's unit, 0 or more.
    pub amplitude: f64,
}

impl From<Sample> for Vibration {
    fn from(Sample([hz, amplitude]): Sample) -> Self {
        Self { hz, amplitude }
    }
}

impl From<Vibration> for Sample {
    fn from(Vibration { hz, amplitude }: Vibration) -> Self {
        Self([hz, amplitude])
    }
}

/// The steps of each track; none where the file does not have it.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracks([Steps<Sample>; TRACKS]);

impl Default for Tracks {
    fn default() -> Self {
        Self(std::array::from_fn(|_| Steps::default()))
    }
}

impl Tracks {
    /// That of a track.
    #[must_use]
    pub(crate) fn of(&self, track: TrackId) -> &Steps<Sample> {
        &self.0[track.index()]
    }

    /// That of the vibration of an axis, counted from 0.
    #[must_use]
    pub(crate) fn vibration(&self, axis: usize) -> &Steps<Sample> {
        self.of(ChannelId::Vibration.on(axis))
    }

    pub(super) fn of_mut(&mut self, track: TrackId) -> &mut Steps<Sample> {
        &mut self.0[track.index()]
    }

    /// The tracks that the cue has, in the order of the table.
    pub fn used(&self) -> impl Iterator<Item = (TrackId, &Steps<Sample>)> {
        let all = CHANNELS.iter().flat_map(|channel| channel.tracks(MAX_AXES));
        all.map(|track| (track, self.of(track))).filter(|(_, steps)| !steps.as_slice().is_empty())
    }

    /// Ends at a time what each track that the cue has holds then.
    pub(super) fn rest(&mut self, at: ShowTime) {
        let used = self.0.iter_mut().filter(|steps| !steps.as_slice().is_empty());
        used.for_each(|steps| steps.push(at, Sample::default()));
    }

    pub(super) fn shrink(&mut self) {
        self.0.iter_mut().for_each(Steps::shrink);
    }
}
