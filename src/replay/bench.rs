//! The hall in which a recording is judged again: its observer, its health, and what was recorded of both.

use std::time::Duration;

use super::frames::{Frames, LeftFrame};
use super::verdict::{ReplayDifference, ReplayVerdict, SeatVerdict};
use crate::config::LossPolicy;
use crate::control::Percentiles;
use crate::health::{Groups, HealthInput, HealthState, HealthTable};
use crate::observe::{Observer, Watched};
use crate::record::{Chunk, Contents, FrameKind, Judging, RecordedSeat, SeatSample, standing_of};
use crate::time::{MonoTime, Rate, ShowTime};
use crate::tracker::{ACK_TIMEOUT, Books, Fate, Histogram, Tracker, histogram};
use crate::wire::{FrameNo, VibrationPort};

/// A group of which nothing was known is taken as it was recorded for so long.
const WARM_UP: Duration = Duration::from_secs(2);

/// What is known of a controller's frames.
#[derive(Debug, Clone, Copy, Default)]
struct KnownFrames {
    /// From which frame on all is known of them, and since when; of a whole recording since the clock's zero.
    first: Option<(FrameNo, MonoTime)>,
    /// The drain with which they began, in the middle.
    began_in: Option<u64>,
    /// Lost frames as they were recorded last, and how many there have to be by now; `None` where that is not known.
    recorded_lost: Option<u64>,
    lost: Option<u64>,
    /// How it was recorded to stand.
    standing: Option<HealthState>,
    /// The recording begins with it.
    from_the_start: bool,
}

/// Whether a group is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum GroupKnown {
    /// Nothing is known of it yet.
    Not,
    /// It stands well, and is judged from then on.
    From(MonoTime),
    /// It is.
    Yes,
}

pub(super) struct Bench {
    pub(super) judging: Judging,
    pub(super) seats: Vec<RecordedSeat>,
    /// How many of them are on the network.
    pub(super) stations: usize,
    pub(super) frames: Frames,
    pub(super) observer: Observer,
    pub(super) health: HealthTable,
    pub(super) verdict: ReplayVerdict,
    known: Vec<KnownFrames>,
    groups: Vec<GroupKnown>,
    /// Events of the observer that health has.
    heard: u64,
    /// Health is judged.
    watches: bool,
    pub(super) lateness: Histogram,
    /// What samples say of each seat.
    pub(super) sampled: Vec<SampledFates>,
    /// The wall clock at the other clock's zero, ns since 1970.
    wall_ns: u64,
    last: MonoTime,
}

/// Fates of replies, as samples count them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SampledFates {
    pub(super) acked: u64,
    pub(super) refused: u64,
    pub(super) lost: u64,
}

impl Bench {
    pub(super) fn new(contents: &Contents, judging: Judging) -> Self {
        let seats = contents.seats.clone();
        let stations: Vec<Watched> = judging.controllers.iter().zip(&seats).map_while(watched).collect();
        let groups = Groups::named(
            judging
                .controllers
                .iter()
                .map(|one| one.group.to_string())
                .collect::<Vec<_>>()
                .iter()
                .map(String::as_str),
        );
        let period = Rate::from_hz(contents.rate_hz()).period();
        let health = HealthTable::new(groups, LossPolicy::Continue, judging.ack_every, period)
            .led_ahead(judging.controllers.iter().map(crate::record::JudgedController::acked_after));
        let health = if judging.is_hall { health.of_a_hall() } else { health };
        let mut observer = Observer::new(stations.clone());
        observer.add(seats.len() - stations.len());
        Self {
            known: vec![KnownFrames::default(); seats.len()],
            groups: vec![GroupKnown::Not; health.groups().len()],
            judging,
            stations: stations.len(),
            frames: Frames::default(),
            observer,
            health,
            verdict: ReplayVerdict::default(),
            heard: 0,
            watches: true,
            lateness: histogram(),
            wall_ns: contents.wall(MonoTime::default()),
            last: MonoTime::default(),
            sampled: vec![SampledFates::default(); seats.len()],
            seats,
        }
    }

    pub(super) fn on_tick(&mut self, chunk: &Chunk<'_>) {
        self.frames.take(chunk, &self.seats);
        if chunk.frames().next().is_some() {
            self.lateness.saturating_record(chunk.head.late_ns);
        }
    }

    /// Samples tell how a seat stood where the recording began in the middle.
    pub(super) fn on_sample(&mut self, lane: usize, sample: &SeatSample) {
        let Some(known) = self.known.get_mut(lane) else { return };
        known.standing = known.standing.or_else(|| sample.standing.and_then(standing_of));
        let SampledFates { acked, refused, lost } = &mut self.sampled[lane];
        *acked += u64::from(sample.acked);
        *refused += u64::from(sample.refused);
        *lost = lost.saturating_add(sample.lost);
    }

    pub(super) fn frames_there(&self) -> u64 {
        self.frames.there()
    }

    /// The recording begins with its hall: that is the first frame of a controller.
    pub(super) fn begins(&mut self, controller: usize, first: FrameNo, books: &mut Books) {
        let Some(known) = self.known.get_mut(controller) else { return };
        *known = KnownFrames {
            first: Some((first, MonoTime::default())),
            recorded_lost: Some(0),
            lost: Some(0),
            from_the_start: true,
            ..*known
        };
        books.tracker_mut().begin_at(controller, first);
        self.verdict.from_the_start = self.known.iter().all(|known| known.from_the_start);
        if self.verdict.from_the_start {
            self.groups.fill(GroupKnown::Yes);
            // It has its say once somebody watches.
            self.watches = false;
        }
    }

    pub(super) fn on_watched(&mut self) {
        self.watches = true;
        if self.judging.is_hall && self.verdict.from_the_start {
            (0..self.groups.len()).for_each(|group| self.health.look_anew(group));
        }
    }

    /// True if a frame of a controller is in the books.
    pub(super) fn knows(&self, controller: usize, frame: FrameNo) -> bool {
        self.known
            .get(controller)
            .and_then(|known| known.first)
            .is_some_and(|(first, _)| frame.since(first) >= 0)
    }

    /// Something is missing: what was known does not hold any more.
    pub(super) fn forget(&mut self) {
        self.verdict.gaps += 1;
        for known in &mut self.known {
            *known = KnownFrames { standing: known.standing, ..KnownFrames::default() };
        }
        self.groups.fill(GroupKnown::Not);
    }

    pub(super) fn on_frames(&mut self, frames: &[LeftFrame], tracker: &mut Tracker) {
        for &LeftFrame { lane, frame, at, is_behind_gap } in frames {
            if is_behind_gap && self.known.iter().any(|known| known.first.is_some()) {
                self.forget();
            }
            let Some(known) = self.known.get_mut(lane) else { continue };
            if known.first.is_none() {
                tracker.begin_at(lane, frame);
                *known = KnownFrames { began_in: Some(self.verdict.drains), ..*known };
            }
            if known.began_in == Some(self.verdict.drains) {
                // Some of this drain's replies came before it was known.
                known.first = Some((frame.next(), at));
            }
            let asked = frame.asks(self.judging.ack_every);
            tracker.on_sent(lane, frame, asked, at);
            if self.watches {
                self.health.on_sent(lane, frame, asked, at);
            }
            self.verdict.frames += 1;
        }
    }

    /// Of what was posted some is not in the file.
    pub(super) fn on_some_frames(&mut self, frames: &[LeftFrame], tracker: &mut Tracker) {
        if self.known.iter().any(|known| known.first.is_some()) {
            self.forget();
        }
        // It goes on: health has counted less than was sent since it began as well.
        self.groups.fill(GroupKnown::Not);
        self.on_frames(frames, tracker);
    }

    pub(super) fn on_joined(&mut self, controller: usize) {
        let group = self.health.groups().group_of(controller);
        self.health.on_joined(group);
    }

    pub(super) fn judge(&mut self, input: HealthInput) {
        if !input.is_of(self.seats.len(), self.groups.len()) {
            return;
        }
        self.health.take(input);
    }

    pub(super) fn pass_events(&mut self) {
        let Self { observer, health, heard, watches: true, .. } = self else { return };
        *heard = observer.events_since(*heard, |event| health.on_event(event));
        for (controller, state) in observer.states().iter().enumerate() {
            if let Some(at) = state.reported_at {
                health.on_status(controller, at);
            }
        }
    }

    pub(super) fn look(&mut self, now: MonoTime) {
        if self.watches {
            self.health.tick(now, &mut |_| ());
        }
    }

    pub(super) fn on_lost(&mut self, controller: usize, total: u64) {
        let Some(known) = self.known.get_mut(controller) else { return };
        // What was lost in this drain is held against what was lost again once it is over.
        let more = known.recorded_lost.replace(total).map(|before| total.wrapping_sub(before));
        known.lost = known.lost.zip(more).map(|(lost, more)| lost.wrapping_add(more));
    }

    pub(super) fn on_standing(&mut self, controller: usize, standing: HealthState) {
        self.verdict.standings += 1;
        if let Some(known) = self.known.get_mut(controller) {
            known.standing = Some(standing);
        }
    }

    /// Holds what a drain came to against what was recorded of it.
    pub(super) fn compare(&mut self, tracker: &Tracker, at: MonoTime) {
        self.last = at;
        for controller in 0..self.seats.len() {
            let known = self.known[controller];
            let Some((_, since)) = known.first else { continue };
            let again = tracker.counts(controller).lost;
            // Frames from before what is in the file are lost meanwhile as well.
            let is_sure = since == MonoTime::default() || at.since(since) > ACK_TIMEOUT + WARM_UP;
            if let Some(lost) = known.lost.filter(|lost| is_sure && *lost != again) {
                let told = (lost.to_string(), again.to_string());
                self.differs(at, Some(controller), "frames lost so far".to_owned(), told);
            }
            self.known[controller].lost = Some(again);
        }
        if self.watches {
            (0..self.groups.len()).for_each(|group| self.compare_group(group, at));
        }
    }

    fn compare_group(&mut self, group: usize, at: MonoTime) {
        let again = self.health.standing(group);
        let members: Vec<usize> = self.health.groups().members(group).collect();
        let told = |controller: &usize| self.known[*controller].standing;
        let is_told = |standing: HealthState| members.iter().filter_map(told).all(|one| one == standing);
        let is_well = members
            .iter()
            .all(|controller| matches!(told(controller), Some(HealthState::Ok | HealthState::Unwatched)));
        // A look that was asked for before the file is not taken here: how it comes back cannot be judged by it.
        let is_known =
            |controller: &usize| self.known[*controller].from_the_start || self.health.has_seen(*controller);
        let is_unknown = !again.may_move() && !members.iter().all(is_known);
        match self.groups[group] {
            GroupKnown::Yes | GroupKnown::From(_) if is_told(again) && is_unknown => {
                self.groups[group] = GroupKnown::Not;
                self.verdict.unjudged += 1;
            }
            GroupKnown::Yes if is_told(again) => {}
            GroupKnown::Yes => {
                let recorded = members.iter().find_map(told).map_or_else(String::new, |one| one.to_string());
                let what = "how it stands".to_owned();
                self.differs(at, members.first().copied(), what, (recorded, again.to_string()));
                self.groups[group] = GroupKnown::Not;
            }
            GroupKnown::From(from) if is_told(again) => {
                if at >= from {
                    self.groups[group] = GroupKnown::Yes;
                }
            }
            GroupKnown::Not | GroupKnown::From(_) if is_well => {
                self.health.assume_well(group);
                self.groups[group] = GroupKnown::From(at + WARM_UP);
            }
            GroupKnown::Not | GroupKnown::From(_) => self.groups[group] = GroupKnown::Not,
        }
    }

    pub(super) fn fate_differs(
        &mut self,
        at: MonoTime,
        controller: usize,
        frame: FrameNo,
        recorded: Option<(Fate, u32)>,
        replayed: Option<(Fate, u32)>,
    ) {
        let words = |fate: Option<(Fate, u32)>| match fate {
            Some((fate, latency)) => format!("{fate:?} after {}.{:03} µs", latency / 1_000, latency % 1_000),
            None => "nothing".to_owned(),
        };
        let what = format!("the reply to frame {}", frame.0);
        self.differs(at, Some(controller), what, (words(recorded), words(replayed)));
    }

    /// True if all of the hall's life is in the recording.
    pub(super) const fn is_whole(&self) -> bool {
        self.verdict.from_the_start && self.verdict.gaps == 0
    }

    /// A total that differs, unless it is the same.
    pub(super) fn compare_total(&mut self, seat: Option<usize>, what: &str, recorded: u64, again: u64) {
        if recorded != again {
            self.differs_in_total(seat, what.to_owned(), (recorded.to_string(), again.to_string()));
        }
    }

    pub(super) fn differs_in_total(&mut self, seat: Option<usize>, what: String, told: (String, String)) {
        self.differs(self.last, seat, what, told);
    }

    fn differs(&mut self, at: MonoTime, seat: Option<usize>, what: String, told: (String, String)) {
        let (recorded, replayed) = told;
        let seat = seat.and_then(|seat| self.seats.get(seat)).map(|seat| seat.name.clone());
        let film: ShowTime = self.frames.film(at);
        let wall_ns = self.wall_ns.saturating_add(at.as_nanos());
        self.verdict.differs(ReplayDifference {
            wall_ns,
            film_s: film.as_secs_f64(),
            seat,
            what,
            recorded,
            replayed,
        });
    }

    pub(super) fn into_verdict(mut self, books: &Books) -> ReplayVerdict {
        let tracker = books.tracker();
        let seat = |(index, seat): (usize, &RecordedSeat)| SeatVerdict {
            name: seat.name.clone(),
            frames: (&tracker.counts(index)).into(),
            ack_us: Percentiles::of(tracker.latency(index)),
        };
        self.verdict.seats = self.seats.iter().enumerate().map(seat).collect();
        self.verdict.lateness_us = Some(Percentiles::of(&self.lateness));
        self.verdict
    }
}

/// What the observer has to know of a controller; `None` of one on a link.
fn watched((judged, seat): (&crate::record::JudgedController, &RecordedSeat)) -> Option<Watched> {
    let vibration_port = match seat.frames {
        FrameKind::Datagram(port) => port,
        FrameKind::Pose => VibrationPort::Two,
    };
    let address = seat.address.as_deref().and_then(|address| address.parse().ok());
    Some(Watched {
        address: address.unwrap_or_else(|| judged.address()),
        dialect: judged.dialect()?,
        vibration_port,
        estop_inputs: judged.estop_inputs,
    })
}
