//! A cue that is made of others, row by row.

use super::limits::{MAX_EFFECTS, MAX_MARKERS, MAX_ROWS};
use super::{Cue, Effects, Marker, Origin, Problem, Steps, Tracks};
use crate::channel::{Sample, TrackId};
use crate::time::ShowTime;

/// A cue in the making, with title, units and curve of another.
#[derive(Debug)]
pub(crate) struct Splice(Cue);

impl Splice {
    /// One that has those axes of `like`, in that order, each counted from 0.
    pub(crate) fn like(like: &Cue, axes: &[usize]) -> Self {
        let effects = match &like.effects {
            Effects::Named { names, .. } => Effects::Named { names: names.clone(), steps: Steps::default() },
            Effects::Words(_) => Effects::Words(Steps::default()),
        };
        Self(Cue {
            file: like.file.clone(),
            title: like.title.clone(),
            units: like.units.picked(axes),
            interpolation: like.interpolation,
            axes: axes.len(),
            times: Vec::new(),
            positions: Vec::new(),
            origin: Origin::Messages,
            tracks: Tracks::default(),
            effects,
            markers: Vec::new(),
        })
    }

    /// The time of the last row.
    pub(crate) fn end(&self) -> Option<ShowTime> {
        self.0.times.last().copied()
    }

    /// Adds a row. One at the time of the last takes its place.
    ///
    /// # Panics
    /// If there is not a position for each axis.
    pub(crate) fn row(&mut self, at: ShowTime, positions: &[f64]) {
        assert_eq!(positions.len(), self.0.axes, "a row has a position for each axis");
        if self.end() == Some(at) {
            self.0.times.pop();
            self.0.positions.truncate(self.0.times.len() * self.0.axes);
        }
        self.0.times.push(at);
        self.0.positions.extend_from_slice(positions);
    }

    /// Moves the last row a millisecond earlier, so that one elsewhere at its time does not bend what came before.
    pub(crate) fn make_room(&mut self) {
        if let [.., before, last] = &mut self.0.times[..] {
            *last = ShowTime::from_nanos(last.as_nanos() - 1_000_000)
                .max(ShowTime::from_nanos(before.as_nanos() + 1));
        }
    }

    /// Notes what a track holds from a time on, which is not before the last one noted.
    pub(crate) fn track(&mut self, track: TrackId, at: ShowTime, value: Sample) {
        self.0.tracks.of_mut(track).push(at, value);
    }

    /// True if nothing was noted of a track yet.
    pub(crate) fn is_bare(&self, track: TrackId) -> bool {
        self.0.tracks.of(track).as_slice().is_empty()
    }

    /// The number of an effect here, which is new if it has none; `None` for the raw output word.
    ///
    /// # Errors
    /// Where there are more than a cue may name.
    pub(crate) fn effect(&mut self, name: &str) -> Result<Option<usize>, Problem> {
        let Effects::Named { names, .. } = &mut self.0.effects else { return Ok(None) };
        if let Some(known) = names.iter().position(|one| one == name) {
            return Ok(Some(known));
        }
        if names.len() == MAX_EFFECTS {
            return Err(Problem::TooManyEffects);
        }
        names.push(name.to_owned());
        Ok(Some(names.len() - 1))
    }

    /// Notes which effects are on from a time on, or the raw output word.
    pub(crate) fn switch(&mut self, at: ShowTime, on: u32) {
        match &mut self.0.effects {
            Effects::Named { steps, .. } => steps.push(at, on),
            Effects::Words(steps) => steps.push(at, u16::try_from(on).unwrap_or(u16::MAX)),
        }
    }

    /// Switches off from a time on whatever is on.
    pub(crate) fn rest(&mut self, at: ShowTime) {
        self.0.tracks.rest(at);
        self.switch(at, 0);
    }

    /// Sets a marker.
    pub(crate) fn marker(&mut self, at: ShowTime, name: &str) {
        self.0.markers.push(Marker { at, name: name.to_owned() });
    }

    /// The cue.
    ///
    /// # Errors
    /// Where it has more or fewer rows, or more markers, than a cue may have.
    pub(crate) fn finish(self) -> Result<Cue, Problem> {
        let Self(mut cue) = self;
        cue.markers.sort_by_key(|marker| marker.at);
        match cue.rows() {
            rows @ ..2 => Err(Problem::TooFewRows(rows)),
            rows if rows > MAX_ROWS => Err(Problem::TooManyRows),
            _ if cue.markers.len() > MAX_MARKERS => Err(Problem::TooManyMarkers),
            _ => Ok(cue),
        }
    }
}
