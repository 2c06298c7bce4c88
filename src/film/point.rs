//! Where the film is at an instant, and how that gets from who knows it to the tick thread: levels in atomics, which nobody waits for.

#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Duration;

use crate::published::SharedWords;
use crate::time::{MonoTime, ShowTime, Tick};

/// A point older than this speaks for nobody. Whoever publishes does so ten times a second, whatever the source does; if that
/// thread hangs, seats must not follow its last word for ever. A loaded machine may hold it up for some of these.
pub(crate) const STALE: Duration = Duration::from_millis(500);

/// A frame of film, at 24 a second. What is off by no more is slewed, and nobody in a seat notices; what is off by more is joined.
pub(crate) const FILM_FRAME: Duration = Duration::from_nanos(41_666_667);

/// What may be said of where the film is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FilmState {
    /// The show is its own film: there is nobody to chase.
    FreeRunning,
    /// Nobody has told anything yet.
    Absent,
    /// It is told, and not known well enough.
    Acquiring,
    /// It is known.
    Locked,
    /// Nobody tells at the moment; the estimate runs on.
    Freewheeling,
    /// It was stopped.
    Stopped,
    /// It is over.
    Ended,
    /// It was wound, or jumped; where it is now is not known well enough.
    Jumped,
    /// It runs backwards.
    Reverse,
    /// It is wound with the picture on, or runs at another speed than the seats may follow.
    Shuttle,
    /// What is told makes no sense.
    Unusable,
    /// Nobody tells any more.
    Lost,
}

impl FilmState {
    /// All of them; the place of each is its number in [`PublishedPoint`].
    pub const ALL: [Self; 12] = [
        Self::FreeRunning,
        Self::Absent,
        Self::Acquiring,
        Self::Locked,
        Self::Freewheeling,
        Self::Stopped,
        Self::Ended,
        Self::Jumped,
        Self::Reverse,
        Self::Shuttle,
        Self::Unusable,
        Self::Lost,
    ];

    /// True if seats may follow.
    #[must_use]
    pub(crate) const fn may_lead(self) -> bool {
        matches!(self, Self::FreeRunning | Self::Locked | Self::Freewheeling)
    }

    /// True if seats may follow, or will know in a moment whether they may.
    pub(super) const fn is_brief(self) -> bool {
        self.may_lead() || matches!(self, Self::Acquiring | Self::Jumped)
    }
}

/// Where the film is at an instant, and how fast it runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmPoint {
    /// The instant.
    pub at: MonoTime,
    /// Where the film is then.
    pub media: ShowTime,
    /// How many times as fast as the clock it runs.
    pub rate: f64,
    /// Grows with each jump of the film.
    pub epoch: u32,
    /// What this rests on.
    pub state: FilmState,
}

impl FilmPoint {
    /// Where the film is at another instant, if it runs on as it does.
    #[must_use]
    #[expect(
        clippy::cast_precision_loss,
        reason = "a point is used within seconds, in which a nanosecond counts"
    )]
    pub fn media_at(&self, at: MonoTime) -> ShowTime {
        let (ahead, behind) = (at.since(self.at), self.at.since(at));
        let passed = (ahead.as_nanos() as f64 - behind.as_nanos() as f64) * 1e-9 * self.rate;
        ShowTime::from_nanos(self.media.as_nanos().saturating_add(ShowTime::from_secs_f64(passed).as_nanos()))
    }
}

/// The newest point, for one writer and any reader: its instant, its place in the film, its rate, and its epoch with the number of
/// the state below it.
#[derive(Debug, Default)]
pub struct PublishedPoint(SharedWords<4>);

const STATE_BITS: u32 = 8;

impl PublishedPoint {
    /// Publishes a point. Only one thread may.
    pub fn publish(&self, point: &FilmPoint) {
        let state = FilmState::ALL.iter().position(|state| *state == point.state).unwrap_or_default();
        // Each word more is one more that a tick has to read: these two have room in one.
        let epoch = u64::from(point.epoch) << STATE_BITS | state as u64;
        self.0.put([
            point.at.as_nanos(),
            point.media.as_nanos().cast_unsigned(),
            point.rate.to_bits(),
            epoch,
        ]);
    }

    /// The newest point; `None` before the first and while one is being written.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "what was put together is taken apart")]
    pub(crate) fn read(&self) -> Option<FilmPoint> {
        // Which version it is says nothing: a point has its own instant, by which it grows old.
        let (_, [at, media, rate, epoch]) = self.0.get()?;
        Some(FilmPoint {
            at: MonoTime::from_nanos(at),
            media: ShowTime::from_nanos(media.cast_signed()),
            rate: f64::from_bits(rate),
            epoch: (epoch >> STATE_BITS) as u32,
            state: *FilmState::ALL.get((epoch & 0xff) as usize)?,
        })
    }
}

/// The newest point of a film that is chased.
#[derive(Debug)]
pub struct ChasedFilm {
    source: Arc<PublishedPoint>,
    last: Option<FilmPoint>,
}

impl ChasedFilm {
    /// A film that somebody else shows.
    #[must_use]
    pub const fn new(source: Arc<PublishedPoint>) -> Self {
        Self { source, last: None }
    }

    /// Where the film is at the deadline of a tick; `None` if nobody has ever told.
    pub fn at(&mut self, tick: &Tick) -> Option<FilmPoint> {
        // While a point is being written the one before does: it is a few milliseconds old.
        self.last = self.source.read().or(self.last);
        let mut point = self.last?;
        // By its own instant: a thread that hangs cannot say that it does.
        if tick.deadline.since(point.at) > STALE {
            point.state = FilmState::Lost;
        }
        Some(point)
    }
}
