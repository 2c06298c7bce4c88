//! What anyone may look at while a play runs: atomics that the playing threads store, and nobody waits for. Only the times
//! are behind a lock, which the ack thread and whoever looks share, never the tick thread.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::TickReport;
use super::broadcast::Broadcast;
use super::table::Row;
use crate::belief::{EvidenceTable, LaneEvidence};
use crate::engine::Engine;
use crate::published::SharedWord;
use crate::state::{Machine, State};
use crate::time::{MonoTime, ShowTime};
use crate::tracker::{Histogram, histogram};

/// Where a hall stands, in one word: its state by its place in [`State::ALL`], whether motion frames leave, and how often a person
/// has cleared.
#[derive(Debug, Default)]
struct HallWord(SharedWord);

const STATE: u64 = 0xf;
const MOVING: u64 = 1 << 4;
const CLEARS: u32 = 5;

impl HallWord {
    fn state(&self) -> State {
        // Who sees the state sees the homing that it speaks of.
        let place = usize::try_from(self.0.get() & STATE).unwrap_or(usize::MAX);
        State::ALL.get(place).copied().unwrap_or(State::Boot)
    }

    fn set(&self, state: State, moving: bool, clears: u32) {
        let place = (0..).zip(State::ALL).find_map(|(place, known)| (known == state).then_some(place));
        let moving = if moving { MOVING } else { 0 };
        self.0.put(place.unwrap_or(0) | moving | u64::from(clears) << CLEARS);
    }

    fn is_moving(&self) -> bool {
        self.0.get() & MOVING != 0
    }

    #[expect(clippy::cast_possible_truncation, reason = "what was put together is taken apart")]
    fn clears(&self) -> u32 {
        (self.0.get() >> CLEARS) as u32
    }
}

/// The times that a play has counted so far, ns.
#[derive(Debug, Clone, PartialEq)]
pub struct Times {
    /// Lateness of the ticks that sent.
    pub lateness: Histogram,
    /// Latency of the acks of all controllers on the network.
    pub acks: Histogram,
    /// The same of all seats on links.
    pub(crate) link_acks: Histogram,
}

impl Default for Times {
    fn default() -> Self {
        Self { lateness: histogram(), acks: histogram(), link_acks: histogram() }
    }
}

/// What anyone may look at while a play runs.
#[derive(Debug, Default)]
pub struct Live {
    times: Mutex<Times>,
    hall: HallWord,
    /// Seats that are brought to park, and below that how long the slowest takes, ms.
    parking: SharedWord,
    show_ns: AtomicI64,
    /// The same, for whoever goes on from there.
    sought_ns: AtomicI64,
    /// Twice how far ahead of the film the seats are, and 1; 0 while they follow none.
    film_error_ns: AtomicI64,
    /// The greatest amount of that since somebody asked, and 1; 0 if they followed none.
    film_error_most: AtomicU64,
    film_joins: AtomicU64,
    /// What moves the seats is a test of them, and no show.
    is_test: AtomicBool,
    ticks: AtomicU64,
    missed: AtomicU64,
    beats: AtomicU64,
    closed: AtomicBool,
    /// How often the limiter held each lane back.
    clamps: Box<[AtomicU64]>,
    /// What the ack thread has seen of each lane.
    evidence: EvidenceTable,
    /// Which controllers have said anything at all.
    heard: Box<[AtomicBool]>,
    /// At how many controllers that answer something may be on.
    left_on: SharedWord,
    /// Up to when it has told all that arrived.
    told_ns: SharedWord,
    /// Since when a reading of all seats is waited for, and whether anybody reads them.
    wanted_ns: SharedWord,
    reads: AtomicBool,
    /// By when it is to have told more.
    due_ns: AtomicU64,
    table: Mutex<Vec<Row>>,
    /// The network whose controllers may get one datagram together, where there is one.
    broadcast: Option<Arc<Broadcast>>,
}

impl Live {
    /// That of a play of so many lanes.
    #[must_use]
    pub fn new(lanes: usize) -> Self {
        Self {
            clamps: (0..lanes).map(|_| AtomicU64::new(0)).collect(),
            evidence: EvidenceTable::of(lanes),
            heard: (0..lanes).map(|_| AtomicBool::new(false)).collect(),
            ..Self::default()
        }
    }

    /// The same of one with such a network.
    #[must_use]
    pub fn with_broadcast(self, broadcast: Option<Broadcast>) -> Self {
        Self { broadcast: broadcast.map(Arc::new), ..self }
    }

    /// The network whose controllers may get one datagram together, where there is one.
    #[must_use]
    pub const fn broadcast(&self) -> Option<&Arc<Broadcast>> {
        self.broadcast.as_ref()
    }

    /// What the ack thread has seen of a lane; none where there is no such lane.
    #[must_use]
    pub fn evidence(&self, lane: usize) -> Option<LaneEvidence<'_>> {
        self.evidence.lane(lane)
    }

    /// True if a controller has said anything at all.
    pub(crate) fn has_heard(&self, controller: usize) -> bool {
        self.heard.get(controller).is_some_and(|heard| heard.load(Ordering::Relaxed))
    }

    /// Notes that it has.
    pub(super) fn on_heard(&self, controller: usize) {
        if let Some(heard) = self.heard.get(controller) {
            heard.store(true, Ordering::Relaxed);
        }
    }

    /// The instant up to which the ack thread has told all that arrived; the clock's zero before it did.
    #[must_use]
    pub(crate) fn told(&self) -> MonoTime {
        // Whoever sees the instant sees the evidence from before it.
        MonoTime::from_nanos(self.told_ns.get())
    }

    /// Since when a reading of all seats is waited for; the clock's zero before one was.
    #[must_use]
    pub(crate) fn wanted(&self) -> MonoTime {
        MonoTime::from_nanos(self.wanted_ns.get())
    }

    /// True if something may be on at a controller that answers: outputs, or vibration.
    pub(crate) fn is_left_on(&self) -> bool {
        self.left_on.get() > 0
    }

    /// Notes at how many.
    pub(crate) fn on_left_on(&self, controllers: u32) {
        self.left_on.put(controllers.into());
    }

    /// Asks for a reading of all seats, later than `since`. Tick thread, and whoever leads before anything moves.
    pub(crate) fn want(&self, since: MonoTime) {
        self.wanted_ns.put(since.as_nanos());
    }

    /// Whether somebody reads seats when that is asked for.
    pub(super) fn has_reader(&self) -> bool {
        self.reads.load(Ordering::Acquire)
    }

    /// Notes that somebody does.
    pub(super) fn on_reader(&self) {
        self.reads.store(true, Ordering::Release);
    }

    /// Notes that all that arrived before an instant was told.
    pub(crate) fn on_told(&self, until: MonoTime) {
        self.told_ns.put(until.as_nanos());
    }

    /// How often the limiter held a lane back since the program started; 0 where that is not told.
    #[must_use]
    pub(crate) fn clamps(&self, lane: usize) -> u64 {
        self.clamps.get(lane).map_or(0, |clamps| clamps.load(Ordering::Relaxed))
    }

    /// Notes how often the limiter held a lane back.
    pub(super) fn on_clamps(&self, lane: usize, clamps: u64) {
        if let Some(told) = self.clamps.get(lane) {
            told.store(clamps, Ordering::Relaxed);
        }
    }

    /// Where the hall stands.
    #[must_use]
    pub fn state(&self) -> State {
        self.hall.state()
    }

    /// Seats that are brought to park before the show, and how long the slowest of them takes to get there.
    #[must_use]
    pub(crate) fn parking(&self) -> (u32, Duration) {
        let word = self.parking.get();
        (u32::try_from(word >> 32).unwrap_or(u32::MAX), Duration::from_millis(word & u64::from(u32::MAX)))
    }

    /// Show time after the newest tick.
    #[must_use]
    pub fn show(&self) -> ShowTime {
        ShowTime::from_nanos(self.show_ns.load(Ordering::Relaxed))
    }

    /// The same for whoever goes on from there: where somebody seeks, though the seats are on their way.
    pub(crate) fn sought(&self) -> ShowTime {
        ShowTime::from_nanos(self.sought_ns.load(Ordering::Relaxed))
    }

    /// How far ahead of the film that they follow the seats are, seconds; none while they follow none.
    pub(crate) fn film_error_s(&self) -> Option<f64> {
        let twice = self.film_error_ns.load(Ordering::Relaxed);
        (twice != 0).then(|| ShowTime::from_nanos(twice >> 1).as_secs_f64())
    }

    /// The farthest that the seats were from the film while they followed it, since this was asked last, seconds.
    pub(crate) fn take_film_error_most_s(&self) -> Option<f64> {
        let ns = self.film_error_most.swap(0, Ordering::Relaxed).checked_sub(1)?;
        Some(Duration::from_nanos(ns).as_secs_f64())
    }

    /// How often seats have joined the film.
    pub(crate) fn film_joins(&self) -> u64 {
        self.film_joins.load(Ordering::Relaxed)
    }

    /// Ticks that sent so far.
    #[must_use]
    pub(crate) fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::Relaxed)
    }

    /// Ticks slept through so far.
    #[must_use]
    pub(crate) fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }

    /// Ticks so far in whatever state, sending or not: while the tick thread lives, this grows.
    #[must_use]
    pub fn beats(&self) -> u64 {
        self.beats.load(Ordering::Relaxed)
    }

    /// The ticks so far, and up to when the ack thread has told all: both grow. None once the tick loop is over.
    #[must_use]
    pub(crate) fn pulse(&self) -> Option<[u64; 2]> {
        let told = self.told().as_nanos();
        (!self.closed.load(Ordering::Relaxed)).then(|| [self.beats(), told])
    }

    /// Notes by when the ack thread is to have told more, or it hangs.
    pub fn expect_by(&self, due: MonoTime) {
        self.due_ns.store(due.as_nanos(), Ordering::Relaxed);
    }

    /// By when the ack thread is to have told more; none before it runs.
    pub(super) fn told_by(&self) -> Option<MonoTime> {
        let due = self.due_ns.load(Ordering::Relaxed);
        (due > 0).then(|| MonoTime::from_nanos(due))
    }

    /// Notes that the tick loop is over.
    pub(crate) fn close(&self) {
        self.closed.store(true, Ordering::Relaxed);
    }

    /// Notes a tick.
    pub(super) fn beat(&self) {
        self.beats.fetch_add(1, Ordering::Relaxed);
    }

    /// A copy of the times as the ack thread last told them; empty where nobody asked it to.
    #[must_use]
    pub(crate) fn times(&self) -> Times {
        self.lock().clone()
    }

    /// Notes the times so far; where somebody is just looking at them, the next time will do: the ack thread waits for nobody.
    ///
    /// # Panics
    /// Where they are not made as [`histogram()`] makes them.
    pub(crate) fn on_times(&self, lateness: &Histogram, [acks, link_acks]: &[Histogram; 2]) {
        let Ok(mut times) = self.times.try_lock() else { return };
        let alike = "they have the same bounds";
        times.lateness.set_to(lateness).expect(alike);
        times.acks.set_to(acks).expect(alike);
        times.link_acks.set_to(link_acks).expect(alike);
    }

    /// Held for the time of a copy.
    fn lock(&self) -> MutexGuard<'_, Times> {
        self.times.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes one more seat that is on its slow way to park before the show, `time_ms` long. Only one thread may.
    pub(crate) fn on_parking(&self, time_ms: u32) {
        let word = self.parking.get();
        let longest = (word & u64::from(u32::MAX)).max(time_ms.into());
        self.parking.put(((word >> 32) + 1) << 32 | longest);
    }

    /// Notes a state by itself.
    #[cfg(test)]
    pub(crate) fn enter(&self, state: State) {
        self.hall.set(state, self.is_moving(), self.clears());
    }

    /// Notes where the hall stands.
    pub(super) fn on_hall(&self, machine: &Machine, engine: &Engine) {
        let moving = machine.may_send_motion();
        if moving {
            self.on_show(engine.playhead().film());
            self.sought_ns.store(engine.film().as_nanos(), Ordering::Relaxed);
        }
        self.hall.set(machine.state(), moving && !engine.waits(), machine.clears());
    }

    /// Notes how far ahead of the film the seats are, and how often they have joined it.
    pub(super) fn on_film(&self, ns: Option<i64>, joins: u64) {
        self.film_joins.store(joins, Ordering::Relaxed);
        self.film_error_ns.store(ns.map_or(0, |ns| ns << 1 | 1), Ordering::Relaxed);
        if let Some(ns) = ns {
            self.film_error_most.fetch_max(ns.unsigned_abs().saturating_add(1), Ordering::Relaxed);
        }
    }

    /// Notes whether what is loaded is a test of the seats.
    pub(crate) fn tests(&self, is_test: bool) {
        self.is_test.store(is_test, Ordering::Relaxed);
    }

    /// True if it is.
    pub(crate) fn is_test(&self) -> bool {
        self.is_test.load(Ordering::Relaxed)
    }

    /// Notes where the film is.
    pub(crate) fn on_show(&self, film: ShowTime) {
        self.show_ns.store(film.as_nanos(), Ordering::Relaxed);
    }

    /// How often a person has cleared.
    pub(super) fn clears(&self) -> u32 {
        self.hall.clears()
    }

    /// Whether motion frames leave.
    #[must_use]
    pub fn is_moving(&self) -> bool {
        self.hall.is_moving()
    }

    /// How the controllers stood when the ack thread last told; empty before it did.
    #[must_use]
    pub fn table(&self) -> Vec<Row> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Notes how the controllers stand; as [`Self::on_times`], it waits for nobody. Says whether it was noted.
    pub(crate) fn on_table(&self, note: impl FnOnce(&mut Vec<Row>)) -> bool {
        self.table.try_lock().map(|mut table| note(&mut table)).is_ok()
    }

    /// Notes a tick that sent.
    pub(crate) fn on_tick(&self, report: &TickReport) {
        self.ticks.fetch_add(1, Ordering::Relaxed);
        self.missed.fetch_add(report.missed, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_is_seen_beside_whether_frames_leave_and_how_often_it_was_cleared() {
        let live = Live::default();
        assert_eq!((live.state(), live.is_moving(), live.clears()), (State::Boot, false, 0));
        for state in State::ALL {
            live.hall.set(state, true, 7);
            assert_eq!((live.state(), live.is_moving(), live.clears()), (state, true, 7));
        }
    }

    #[test]
    fn a_pulse_is_expected_from_the_start_until_the_loop_is_over() {
        let live = Live::default();
        assert_eq!(live.pulse(), Some([0, 0]), "a tick thread that does not begin to tick hangs as well");
        live.beat();
        assert_eq!(live.pulse(), Some([1, 0]));
        live.on_told(MonoTime::from_nanos(7));
        assert_eq!(live.pulse(), Some([1, 7]));
        live.close();
        assert_eq!(live.pulse(), None);
    }

    #[test]
    fn the_slowest_seat_says_how_long_all_take_to_park() {
        let live = Live::default();
        [2_000, 3_000, 1_000].into_iter().for_each(|ms| live.on_parking(ms));
        assert_eq!(live.parking(), (3, Duration::from_secs(3)));
    }
}
