//! How a play is led through its runtime: where every seat stands, those to park that stand elsewhere, the show loaded and let go, and
//! the end once it is over. A thread of its own, which only asks: what moves is the tick thread's to allow.
//!
//! A seat that tells all its axes parks and joins as engine and limiter lead it. One that does not is brought to park by one frame
//! that is slow enough from anywhere in the stroke, and has to be acked if acks are on.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use rtrb::Producer;

use super::refused::PlayError;
use super::roll_call::{RollCall, lanes_with};
use super::runtime::RuntimeHandle;
use super::staged::StagedShow;
use crate::belief::{FRESH, KnownPose, Reading};
use crate::drive::Lane;
use crate::health::Why;
use crate::motion::Slot;
use crate::plan::slow_park_time;
use crate::rt::{Command, Live, News, NewsIn, Row};
use crate::state::{Event, Finding, LedBefore, Readiness, State, Transition};
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
use crate::time::{Clock as _, MonoTime};
use crate::wire::FrameNo;

/// Rounds of position reads, by how long each waits for the answers, ms. A seat is at rest where six rounds over half a second find it, or
/// three where it cannot vibrate: what another program left on is not to be read at the same place of each swing.
const READ_WAITS_MS: [u64; 10] = [67, 97, 71, 83, 59, 101, 73, 89, 61, 79];
/// How often the slow frame is sent, where its ack does not come.
const PARK_TRIES: usize = 3;
/// How long that ack is waited for.
const ACK_WAIT: Duration = Duration::from_millis(200);
/// How often it is looked whether something has come; news wakes sooner.
const LOOK: Duration = Duration::from_millis(5);
/// The same where only news is waited for.
const NEWS: Duration = Duration::from_millis(100);
/// What is waited beyond the Time of the slow frame.
const SETTLE: Duration = Duration::from_millis(20);
/// How far from park a seat may be read that was brought there, in strokes: 0.3 mm of 150.
const PARKED: f64 = 0.002;

/// What a play is led with.
#[derive(Debug)]
pub struct PlayHandle {
    /// What is asked of the hall.
    pub commands: Producer<Command>,
    /// What the hall does.
    pub news: NewsIn,
}

/// What was done before the show.
#[derive(Debug, Clone, Default)]
pub(super) struct Prepared {
    /// Slow frames, by controller.
    pub(super) park_frames: Vec<u64>,
    /// Controllers whose way to park may have been faster than 50 mm/s, because PA0b cuts a longer Time.
    pub(super) hurried: Vec<usize>,
}

impl Prepared {
    /// Nothing done for so many controllers.
    pub(super) fn nothing(controllers: usize) -> Self {
        Self { park_frames: vec![0; controllers], hurried: Vec::new() }
    }
}

/// What a script came to.
#[derive(Debug)]
pub(super) struct ScriptEnd {
    pub(super) prepared: Prepared,
    /// When the show was let go; `None` where it was not.
    pub(super) began: Option<MonoTime>,
    /// True if it was not let go, or was stopped before it was over.
    pub(super) is_cut_short: bool,
}

/// Whoever leads a play.
pub(super) struct PlayScript {
    handle: RuntimeHandle,
    /// As the show has them.
    lanes: Vec<Lane>,
    /// The number of the last frame that each was sent.
    last: Vec<FrameNo>,
    prepared: Prepared,
    roll: Arc<RollCall>,
    end: EndOfPlay,
}

/// Ends the play with its script, whatever becomes of that.
struct EndOfPlay(Arc<AtomicBool>);

impl Drop for EndOfPlay {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl PlayScript {
    pub(super) fn new(handle: RuntimeHandle, show: &StagedShow, roll: Arc<RollCall>) -> Self {
        let lanes = show.lanes.clone();
        let last = lanes.iter().map(Lane::last_frame).collect();
        let (prepared, end) = (Prepared::nothing(lanes.len()), EndOfPlay(Arc::clone(&handle.leave)));
        Self { handle, lanes, last, prepared, roll, end }
    }

    /// Leads the show from the first look at the seats to its end; `holds` says that nothing may move, and `reads` that seats are asked
    /// where they are. As it is let go `lead` gets what it is led with, and says whether somebody will.
    ///
    /// # Errors
    /// Why the show was not let go.
    pub(super) fn run(
        mut self,
        show: StagedShow,
        holds: bool,
        reads: bool,
        lead: impl FnOnce(PlayHandle) -> bool,
    ) -> Result<ScriptEnd, PlayError> {
        let _ = realtime::normal_priority();
        if reads {
            self.read_positions();
            self.look_at_layouts()?;
            self.look_at_axes()?;
        }
        if holds {
            self.make_sure()?;
        } else {
            self.find_seats()?;
            self.leave_out_silent(reads)?;
        }
        if !self.is_called_off() {
            let found = Finding { homed: true, at_park: true, before: LedBefore::Ended };
            self.ask(vec![Command::Event(Event::Identified(found))]);
            if !holds {
                self.park();
            }
        }
        Ok(self.let_go(show, lead))
    }

    /// True once somebody wants the play to end, or something keeps it from beginning.
    fn is_called_off(&self) -> bool {
        self.handle.leave.load(Ordering::Relaxed) || self.handle.live.state().is_latched() || self.is_over()
    }

    fn is_over(&self) -> bool {
        self.handle.live.pulse().is_none()
    }

    /// Waits until an instant, or until there is nothing left to wait for.
    fn wait_until(&self, until: MonoTime, enough: impl Fn() -> bool) {
        while Monotonic.now() < until && !self.is_called_off() && !enough() {
            thread::park_timeout(LOOK.min(until.since(Monotonic.now())));
        }
    }

    /// Gives commands to the tick thread and waits for its answers: whether it took each. What they led to is seen by then.
    fn ask(&mut self, commands: Vec<Command>) -> Vec<bool> {
        let (all, mut commands) = (commands.len(), commands.into_iter());
        let mut taken = Vec::with_capacity(all);
        while taken.len() < all && !self.is_over() {
            while self.handle.commands.slots() > 0
                && let Some(command) = commands.next()
            {
                let _ = self.handle.commands.push(command); // there is room
            }
            thread::park_timeout(LOOK);
            while let Some((ticket, news)) = self.handle.news.take() {
                taken.extend(ticket.map(|_| matches!(news, News::Taken)));
            }
        }
        wait_for_ticks(&self.handle.live, 1);
        taken
    }

    fn names(&self, which: impl Fn(usize) -> bool) -> Vec<String> {
        let lanes = (0..self.lanes.len()).filter(|&lane| which(lane));
        lanes.map(|lane| self.handle.config.controllers[lane].name.clone()).collect()
    }

    fn reading(&self, lane: usize) -> Option<Reading> {
        self.handle.live.evidence(lane)?.reading().map(|(_, reading)| reading)
    }

    /// Where a seat is that told of all its axes, and was at rest.
    fn known(&self, lane: usize) -> Option<KnownPose> {
        KnownPose::of(&self.reading(lane)?, &self.lanes[lane].window)
    }

    /// Reads where the seats stand, until each was seen at rest.
    fn read_positions(&self) {
        let rests = |lane| self.reading(lane).is_some_and(|reading| reading.rests);
        let all_rest = || (0..self.lanes.len()).all(rests);
        for wait_ms in READ_WAITS_MS.into_iter().take_while(|_| !all_rest()) {
            let now = Monotonic.now();
            self.handle.live.want(now);
            self.wait_until(now + Duration::from_millis(wait_ms), all_rest);
        }
    }

    /// Refuses controllers to which a frame would mean something else than it says.
    fn look_at_layouts(&self) -> Result<(), PlayError> {
        let is_foreign = |lane: usize| self.handle.live.evidence(lane).is_some_and(|it| it.is_foreign());
        let foreign = self.names(is_foreign);
        if foreign.is_empty() { Ok(()) } else { Err(PlayError::Foreign(foreign)) }
    }

    /// Refuses controllers that said that they drive other axes than their seats have.
    fn look_at_axes(&self) -> Result<(), PlayError> {
        let config = &self.handle.config;
        let other = |(lane, row): (usize, Row)| match row.why {
            Why::OtherAxes { controller, drives } if controller == lane => {
                Some((config.controllers[lane].name.clone(), drives, config.controllers[lane].seat.axes))
            }
            _ => None,
        };
        let other: Vec<_> = self.handle.live.table().into_iter().enumerate().filter_map(other).collect();
        if other.is_empty() { Ok(()) } else { Err(PlayError::Axes(other)) }
    }

    /// Moves nothing: only makes sure that every seat tells that it stands at its park pose, to a pulse.
    fn make_sure(&self) -> Result<(), PlayError> {
        let is_at_park = |lane: usize| {
            let mut slots = self.lanes[lane].window.slots().iter().enumerate();
            self.known(lane).is_some_and(|known| {
                let far =
                    |index: usize, slot: &Slot| (known.pose()[index] - slot.park).abs() * slot.stroke_pulses;
                slots.all(|(index, slot)| !slot.is_own || far(index, slot) <= 1.5)
            })
        };
        let unsure = self.names(|lane| !is_at_park(lane));
        if unsure.is_empty() || self.is_called_off() { Ok(()) } else { Err(PlayError::Unsure(unsure)) }
    }

    /// Makes sure that nothing moves, and brings the seats to park that do not tell where they are.
    fn find_seats(&mut self) -> Result<(), PlayError> {
        let moving = self.names(|lane| self.reading(lane).is_some_and(|reading| reading.moves));
        if self.is_called_off() {
            return Ok(());
        }
        if !moving.is_empty() {
            return Err(PlayError::Moving(moving));
        }
        let untold = (0..self.lanes.len()).filter(|&lane| self.known(lane).is_none());
        let on_link = |&lane: &usize| self.handle.config.controllers[lane].drives().is_some();
        let (drives, untold): (Vec<_>, Vec<_>) = untold.partition(on_link);
        // Those of which nothing was heard are named as silent.
        let not_home = self.names(|lane| drives.contains(&lane) && self.handle.live.has_heard(lane));
        if !not_home.is_empty() {
            return Err(PlayError::NotHome(not_home));
        }
        let turns = |lane: usize| self.handle.config.controllers[lane].seat.rotary_axis().is_some();
        let unknown = self.names(|lane| untold.contains(&lane) && turns(lane));
        if !unknown.is_empty() {
            return Err(PlayError::UnknownTurn(unknown));
        }
        let unsure = self.park_slowly(untold);
        if unsure.is_empty() || self.is_called_off() {
            return Ok(());
        }
        Err(PlayError::Unplaced(self.names(|lane| unsure.contains(&lane))))
    }

    /// Leaves out the seats of controllers that have said nothing at all, once somebody agrees where somebody is there; where these are
    /// all, there is no play.
    fn leave_out_silent(&self, reads: bool) -> Result<(), PlayError> {
        let is_silent = |lane: usize| self.known(lane).is_none() && !self.handle.live.has_heard(lane);
        let silent = self.names(is_silent);
        if !reads || silent.is_empty() || self.is_called_off() {
            return Ok(());
        }
        if silent.len() == self.lanes.len() || self.roll.requires_all() {
            return Err(PlayError::Silent(silent));
        }
        for lane in lanes_with(&self.handle.config.controllers, is_silent) {
            self.handle.desk.leave_out(lane);
        }
        self.roll.note(silent);
        while self.roll.is_open() && !self.is_called_off() {
            thread::park_timeout(NEWS);
        }
        Ok(())
    }

    /// Has those seats sent to park by a frame that is slow enough from anywhere; gives those that cannot be known to get there.
    fn park_slowly(&mut self, mut open: Vec<usize>) -> Vec<usize> {
        let mut unsure = Vec::new();
        for _ in 0..PARK_TRIES {
            let slowly = |&lane: &usize| {
                let of = u16::try_from(lane).expect("fewer controllers than ports");
                Command::ParkSlowly { lane: of, time_ms: self.slow_time(lane).0 }
            };
            let mut taken = self.ask(open.iter().map(slowly).collect()).into_iter();
            let mut slowest = Duration::ZERO;
            open.retain(|&lane| {
                let is_sent = taken.next().unwrap_or(false);
                if is_sent {
                    slowest = slowest.max(self.on_slow_frame(lane));
                } else {
                    unsure.push(lane);
                }
                is_sent
            });
            let (now, slowest) = (Monotonic.now(), slowest + SETTLE);
            // One that has not acked by then has the whole way to do so.
            self.wait_until(now + ACK_WAIT.min(slowest), || open.iter().all(|&lane| self.is_acked(lane)));
            self.wait_until(now + slowest, || open.is_empty());
            // One that says nothing at all is left out.
            open.retain(|&lane| !self.is_acked(lane) && self.handle.live.has_heard(lane));
            if open.is_empty() || self.is_called_off() {
                return unsure;
            }
        }
        unsure.extend(open);
        unsure
    }

    /// True if the last frame to a lane was acked, or asked for no ack.
    fn is_acked(&self, lane: usize) -> bool {
        let acked = self.handle.live.evidence(lane).and_then(|evidence| evidence.acked());
        self.lanes[lane].ack_every == 0 || acked.is_some_and(|acked| acked.since(self.last[lane]) >= 0)
    }

    /// How long the slow frame of a lane takes, ms, and whether that may be faster than 50 mm/s.
    fn slow_time(&self, lane: usize) -> (u32, bool) {
        let (time_ms, hurried) = slow_park_time(&self.handle.config.controllers[lane].seat);
        (time_ms.min(self.lanes[lane].longest_ms), hurried)
    }

    /// Notes a slow frame, which takes so long.
    fn on_slow_frame(&mut self, lane: usize) -> Duration {
        let (time_ms, hurried) = self.slow_time(lane);
        self.last[lane] = self.last[lane].next();
        self.prepared.park_frames[lane] += 1;
        if hurried && !self.prepared.hurried.contains(&lane) {
            self.prepared.hurried.push(lane);
        }
        self.handle.live.on_parking(time_ms);
        Duration::from_millis(u64::from(time_ms))
    }

    /// Has engine and limiter lead the seats to park that told where they are; nothing else.
    fn park(&mut self) {
        let off_park = off_park(&self.lanes, &self.handle.live, Monotonic.now());
        if off_park.is_empty() {
            return;
        }
        off_park.iter().for_each(|(_, time_ms)| self.handle.live.on_parking(*time_ms));
        self.ask(vec![Command::Request(Transition::Park)]);
        while self.handle.live.state() == State::Parking && !self.is_over() {
            thread::park_timeout(LOOK);
        }
    }

    /// Loads the show, lets it go, and waits for its end.
    fn let_go(self, show: StagedShow, lead: impl FnOnce(PlayHandle) -> bool) -> ScriptEnd {
        let is_called_off = self.is_called_off();
        let Self { handle, prepared, end: _end, .. } = self;
        let RuntimeHandle { live, leave, mut commands, news, .. } = handle;
        if is_called_off {
            lead(PlayHandle { commands, news }); // there may be a reason to be told
            return ScriptEnd { prepared, began: None, is_cut_short: true };
        }
        let (began, sent) = (Monotonic.now(), live.ticks());
        // At once, so that nothing comes between arming and going.
        let ready = Command::Event(Event::Readiness(Readiness::Ready));
        let [arm, go] = [Transition::Arm, Transition::Go].map(Command::Request);
        for command in [ready, Command::Load(show.loaded()), arm, go] {
            commands.push(command).expect("there is room where all were answered");
        }
        let attended = lead(PlayHandle { commands, news });
        // A whole tick has begun since, and is over: it took them.
        wait_for_ticks(&live, 2);
        let goes = |state: State| state != State::Parked && (attended || !state.is_latched());
        let mut state = live.state();
        let is_begun = state.may_send_motion() || live.ticks() > sent;
        while goes(state) && live.pulse().is_some() && !leave.load(Ordering::Relaxed) {
            thread::park_timeout(NEWS);
            state = live.state();
        }
        let is_cut_short = !is_begun || state.is_latched();
        ScriptEnd { prepared, began: is_begun.then_some(began), is_cut_short }
    }
}

/// Waits for so many ticks: what was taken in one is seen after it.
fn wait_for_ticks(live: &Live, ticks: u64) {
    let then = live.beats() + ticks;
    while live.beats() < then && live.pulse().is_some() {
        thread::park_timeout(LOOK);
    }
}

/// The seats that told of late that they are not at park, and how long their way there takes, ms.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a stroke is crossed in minutes at the most"
)]
pub(super) fn off_park(lanes: &[Lane], live: &Live, now: MonoTime) -> Vec<(usize, u32)> {
    let way_ms = |lane: usize| {
        let (_, Reading { pose, slots, at, .. }) = live.evidence(lane)?.reading()?;
        let told = lanes[lane].window.moving().filter(|(slot, _)| slots >> slot & 1 == 1);
        let ways = told.map(|(slot, axis)| ((pose[slot] - axis.park).abs(), axis));
        // What it told before says nothing of now.
        let off = ways.filter(|(way, _)| *way > PARKED && now.since(at) <= FRESH);
        let longest_s =
            off.map(|(way, axis)| way * axis.stroke / axis.unit.park_velocity()).reduce(f64::max)?;
        Some((longest_s * 1e3) as u32)
    };
    (0..lanes.len()).filter_map(|lane| Some((lane, way_ms(lane)?))).collect()
}
