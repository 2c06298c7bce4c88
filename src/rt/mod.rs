//! The tick loop, and the mailboxes that lead to it and away from it.
//!
//! The loop never allocates, locks, logs, formats or waits for anything but its deadline. Whatever can fail or grow
//! happened before it or happens on another thread; values cross in bounded single-producer mailboxes.

mod acks;
mod broadcast;
mod conductor;
mod desk;
#[cfg(test)]
mod desk_tests;
mod film;
mod line;
mod links;
mod live;
mod mail;
mod places;
mod planning;
mod sending;
mod spin;
mod standby;
mod still;
mod table;
mod timed;
mod watch;
mod withdrawn;

pub use acks::{Accounts, AckLoop};
pub use broadcast::Broadcast;
pub use conductor::Conductor;
pub(crate) use desk::Calls;
pub use desk::Desk;
pub use film::FilmLead;
pub(crate) use film::FilmStart;
pub use line::Line;
pub(crate) use line::line;
pub use links::Outlets;
pub(crate) use links::{LinkEnd, LinkLane, LinkLoop, LinkNews, Port};
pub use live::Live;
pub(crate) use live::Times;
pub use mail::{
    Alarm, Answer, Command, Loaded, MailEnds, News, NewsIn, Planning, Sent, Task, TickReport, mailboxes,
};
pub(crate) use mail::{Mail, Ticket};
#[cfg(test)]
pub(crate) use mail::{NewsOut, news};
pub use places::Places;
pub use planning::PlanLoop;
pub use spin::Spinning;
pub(crate) use spin::Spun;
pub use standby::Order;
pub(crate) use standby::Standby;
pub(crate) use table::Row;
pub(crate) use timed::StartOff;
pub(crate) use watch::Watch;

use std::sync::atomic::{AtomicBool, Ordering};

use crate::belief::Taken;
use crate::drive::{Lane, Stamped};
use crate::engine::{Ending, Engine, EngineEvent, PlayProgress, Step};
use crate::motion::Pose;
use crate::net::{Delivery, SendFault, Sender};
use crate::record::{Asked, TickHead};
use crate::state::{PlayMode, Refusal, State, Transition, Why};
use crate::time::{Clock, MonoTime, Tick, TickGrid, nanos};
use crate::wire::MAX_LEN;
use sending::Sending;
use timed::StartTurn;

/// Where the frames of a tick go.
pub trait FrameSink {
    /// Hands one lane's datagram to the kernel, `at` being now; never blocks.
    fn send(&mut self, lane: usize, datagram: &[u8], at: MonoTime) -> Delivery;

    /// Hands the kernel one datagram for all controllers of the network that may get one together ([`Broadcast`]); never blocks.
    fn send_to_all(&mut self, _datagram: &[u8]) -> Delivery {
        Delivery::Failed(SendFault::of(libc::EOPNOTSUPP))
    }

    /// A lane's frame was that one, with this fate; for whoever records.
    fn went_along(&mut self, _lane: usize, _datagram: &[u8], _at: MonoTime, _delivery: Delivery) {}

    /// The next frame comes of that; for whoever records.
    fn asked(&mut self, _asked: Asked) {}

    /// A tick is over, whether frames left or not; for whoever records.
    fn tick_over(&mut self, _head: &TickHead) {}
}

impl FrameSink for Sender {
    fn send(&mut self, lane: usize, datagram: &[u8], _at: MonoTime) -> Delivery {
        Sender::send(self, lane, datagram)
    }
}

/// Commands taken in one tick; more wait for the next.
const COMMANDS_PER_TICK: usize = 8;
/// Alarms taken in one tick; more wait for the next.
const ALARMS_PER_TICK: usize = 64;

/// What the loop has done so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Ticked {
    /// Ticks that sent.
    pub(crate) ticks: u64,
    /// Ticks slept through.
    pub(crate) missed: u64,
}

/// What the loop did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ended {
    /// Ticks that sent.
    pub ticks: u64,
    /// Ticks slept through.
    pub missed: u64,
    /// Records that found no room in a mailbox.
    pub unposted: u64,
    /// How the play ended.
    pub ending: Ending,
}

/// The tick loop of one play: everything it touches, made before it starts.
pub struct TickLoop<'a, C, S> {
    /// The clock that its deadlines are on.
    pub clock: &'a C,
    /// Its deadlines.
    pub grid: TickGrid,
    /// What the lanes do.
    pub engine: Engine,
    /// What the hall is in, and what it is asked.
    pub conductor: Conductor,
    /// The lanes, in the order of the sink's.
    pub lanes: Vec<Lane>,
    /// What is known of their seats.
    pub places: Places,
    /// Where frames go.
    pub sink: S,
    /// Its ends of the mailboxes.
    pub mail: Mail,
    /// What operators set, and the stop; read every tick.
    pub desk: &'a Desk,
    /// Read every tick: somebody wants the seats parked and the play to end.
    pub leave: &'a AtomicBool,
}

impl<C: Clock, S: FrameSink> TickLoop<'_, C, S> {
    /// Runs until the play has ended.
    pub fn run(&mut self) -> Ended {
        let mut ticked = Ticked::default();
        while self.step(&mut ticked) {}
        let Ticked { ticks, missed } = ticked;
        let ending = self.conductor.ending(&self.engine);
        Ended { ticks, missed, unposted: self.mail.unposted(), ending }
    }

    /// Waits for the next tick and does it; says whether there is another.
    pub fn step(&mut self, ticked: &mut Ticked) -> bool {
        self.clock.sleep_until(self.grid.next_deadline());
        let now = self.clock.now();
        let tick = self.grid.take(now);
        self.conductor.mind_gap(tick.missed, &mut self.engine, now);
        self.take_mail(now);
        let soon = self.mind_start(&tick, now);
        let film = self.conductor.mind_film(&tick, &mut self.engine, self.desk.trim_ms(), now);
        // In a pause nothing is sent: what follows begins as any motion does.
        let moving = self.conductor.machine().may_send_motion() && !self.engine.waits();
        self.places.look(&mut self.engine, &self.mail, now, moving);
        let was_over = matches!(self.engine.progress(), PlayProgress::Over(_));
        let goes_on = self.places.may_go_on(&mut self.engine, &self.mail, now, moving, soon);
        let step = if goes_on { self.engine.tick(tick.missed, film) } else { Step::Quiet };
        self.mind_broadcast(now);
        let late_ns = match step {
            // Asked once more: whatever the engine does, no frame leaves in a state that sends none.
            Step::Send if self.conductor.machine().may_send_motion() => {
                ticked.missed += tick.missed;
                ticked.ticks += 1;
                self.send(tick, now)
            }
            Step::Send | Step::Quiet | Step::Over => nanos(tick.late),
        };
        // Seats are at park once they were read after their last frame, where somebody reads them; whose program ends does not wait.
        let is_awaited = self.conductor.stays() && !self.conductor.is_left() && self.mail.live().has_reader();
        let is_read = (was_over && goes_on) || !is_awaited;
        let is_left_on = self.mail.live().is_left_on();
        self.conductor.watch(&mut self.engine, is_read, is_left_on, now);
        let Tick { index, deadline, missed, .. } = tick;
        let (film, state) = (self.engine.playhead().at(), self.conductor.machine().state());
        self.sink.tick_over(&TickHead { index, deadline, late_ns, missed, film, state });
        self.hand_on();
        self.mail.beat();
        // A hall goes on when its show is over; one that is told to leave has ended its engine once nothing moves.
        let goes_on = step != Step::Over || (self.conductor.stays() && !self.conductor.is_left());
        // The end is over when every seat that answers is dark and still.
        self.conductor.waits_for_dark(!goes_on, is_left_on, now) || goes_on
    }

    /// Begins what is to begin at this tick; true where it does, or will soon.
    fn mind_start(&mut self, tick: &Tick, now: MonoTime) -> bool {
        let news = match self.conductor.mind_start(tick, &mut self.engine, now) {
            StartTurn::Waits => return false,
            StartTurn::Near => return true,
            StartTurn::Due => News::Started,
            StartTurn::Off(why) => News::CalledOff(why),
        };
        tell_state(&mut self.conductor, &mut self.mail);
        self.mail.tell(news);
        news == News::Started
    }

    /// Bounded: so many commands and alarms a tick, and the planner answers one request at a time. The stop waits for none of
    /// them.
    fn take_mail(&mut self, now: MonoTime) {
        let Self { conductor, engine, mail, desk, .. } = self;
        if desk.take_stop() {
            conductor.stop(engine, now);
        }
        conductor.tick(engine, now);
        conductor.mind_acks(mail.told_by(), engine, now);
        conductor.mind_lead(engine, now);
        for lane in 0..desk.lanes() {
            engine.mix(lane, desk.mix(lane));
        }
        engine.trim(desk.trim_ms());
        for _ in 0..ALARMS_PER_TICK {
            let Some(alarm) = self.mail.alarm() else { break };
            if let Alarm::Found(lane) = alarm {
                self.find(usize::from(lane), now);
            }
            self.conductor.alarm(alarm, &mut self.engine, now);
        }
        for _ in 0..COMMANDS_PER_TICK {
            let Some((ticket, command)) = self.mail.command() else { break };
            let news = self.obey(command, now);
            // What it led to goes before the answer, so that whoever hears the answer knows it.
            tell_state(&mut self.conductor, &mut self.mail);
            self.mail.reply(ticket, news);
        }
        let Self { conductor, engine, mail, desk, .. } = self;
        let asked = desk.is_ended();
        if asked && conductor.hears_first_of_the_end() {
            mail.wake_leader();
        }
        if self.leave.load(Ordering::Relaxed) || conductor.is_ended(asked, now) {
            conductor.leave(engine, now);
        }
        while let Some(answer) = mail.answer() {
            match answer {
                Answer::Course(course, scene) => engine.offer(course, scene),
                Answer::Refused(serial, scene) => engine.refuse(serial, scene),
            }
        }
    }

    fn obey(&mut self, command: Command, now: MonoTime) -> News {
        let Self { conductor, engine, lanes, mail, .. } = self;
        match command {
            Command::Load(show) => {
                let film = show.film;
                let news = load(show, conductor.machine().state(), engine, lanes, mail);
                if matches!(news, News::Taken) {
                    conductor.load_film(film, now);
                }
                conductor.steer(engine);
                news
            }
            Command::Request(request) => told(conductor.request(request, engine, now)),
            Command::Seek(film) => told(conductor.seek(film, engine, now)),
            Command::Event(event) => {
                conductor.event(event, engine, now);
                News::Taken
            }
            Command::StartAt(film_zero) => {
                conductor.hold_start(film_zero);
                News::Taken
            }
            Command::CallOff => {
                if conductor.call_off_start() {
                    mail.tell(News::CalledOff(StartOff::Asked));
                }
                News::Taken
            }
            Command::ParkSlowly { lane, time_ms } => told(self.park_slowly(usize::from(lane), time_ms)),
        }
    }

    /// Leads a seat of which nobody knows where it is to park, by one frame.
    fn park_slowly(&mut self, index: usize, time_ms: u32) -> Result<(), Refusal> {
        let Self { conductor, lanes, places, mail, sink, clock, .. } = self;
        let state = conductor.machine().state();
        let (park, at) = (lanes[index].window.park(), clock.now());
        // Later the engine leads whatever may move.
        if state != State::Boot || !places.belief(index).allows(&park, time_ms, at) {
            return Err(Refusal { state, asked: Transition::Park, why: Why::PositionUnknown });
        }
        let mut buf = [0; MAX_LEN];
        let (stamped, datagram) = lanes[index].encode_slow_park(time_ms, &mut buf);
        let sent = Outgoing { index, stamped, pose: &park, lasts_ms: time_ms, at_most_ms: time_ms, at };
        sent.hand_over(datagram, places, mail, sink);
        Ok(())
    }

    /// One datagram is for many seats only while they all are on the cue: joins, holds, stops and ways to park rest on nobody's permit.
    fn mind_broadcast(&self, now: MonoTime) {
        if let Some(broadcast) = self.mail.live().broadcast()
            && self.conductor.machine().state() != State::Playing(PlayMode::Following)
        {
            broadcast.rest(now);
        }
    }

    /// Sends to every lane that gets a frame; says how long after its deadline the first left, or the tick began where none did, nanoseconds.
    fn send(&mut self, tick: Tick, now: MonoTime) -> u64 {
        let mut buf = [0; MAX_LEN];
        let Self { lanes, places, engine, mail, sink, clock, .. } = self;
        let mut sending =
            Sending { lanes, places, engine, mail, sink, clock: *clock, tick: now, first: None };
        sending.send_all(&mut buf);
        let late_ns = nanos(sending.first.map_or(tick.late, |first| first.since(tick.deadline)));
        self.mail.report(TickReport { late_ns, missed: tick.missed });
        late_ns
    }

    fn hand_on(&mut self) {
        self.mail.look(self.conductor.machine(), &self.engine);
        self.mail.live().on_film(self.conductor.film_error_ns(), self.conductor.film_joins());
        tell_state(&mut self.conductor, &mut self.mail);
        if let Some(request) = self.engine.take_request() {
            self.mail.task(Task::Plan(request));
        }
        let Self { engine, mail, places, .. } = self;
        engine.events().take(|event| {
            match event {
                EngineEvent::Unplanned(what) if mail.has_room_for_news() => mail.tell(News::Unplanned(what)),
                EngineEvent::Joined(lane) => mail.post(Sent::Joined { lane: places::number(lane) }),
                EngineEvent::FellOut(lane, why) => {
                    let shakes = places.belief(lane).shakes();
                    mail.post(Sent::FellOut { lane: places::number(lane), why, shakes });
                }
                // What is the conductor's waits for that.
                EngineEvent::Unplanned(_) | EngineEvent::NoMove | EngineEvent::LimiterFault => return false,
            }
            true
        });
        while let Some(course) = self.engine.take_retired() {
            self.mail.task(Task::Retire(course));
        }
    }
}

/// A frame that is written.
struct Outgoing<'a> {
    index: usize,
    stamped: Stamped,
    pose: &'a Pose,
    lasts_ms: u32,
    at_most_ms: u32,
    at: MonoTime,
}

impl Outgoing<'_> {
    /// Hands it to the kernel, and notes what became of it.
    #[inline]
    fn hand_over(&self, datagram: &[u8], places: &mut Places, mail: &mut Mail, sink: &mut impl FrameSink) {
        let Self { index, stamped, pose, lasts_ms, at_most_ms, at } = *self;
        let Stamped { frame, asked, lights, shakes } = stamped;
        // Posted before it is sent: a reply can overtake what is posted after.
        // To the microsecond, as it is recorded: whoever judges a recording again judges by the same instants.
        let lane = places::number(index);
        mail.post(Sent::Posted { lane, frame, asked, at: at.whole_micros(), lights, shakes });
        let delivery = sink.send(index, datagram, at);
        places.sent(index, &Taken { frame, asked, pose, lasts_ms, at_most_ms, shakes, at }, delivery);
        if let Delivery::Failed(_) = delivery {
            mail.post(Sent::Failed { lane: places::number(index), frame });
        }
    }
}

/// Makes known where the hall stands, once there is room for it: nobody asks for that again.
fn tell_state(conductor: &mut Conductor, mail: &mut Mail) {
    if mail.has_room_for_news()
        && let Some(entered) = conductor.news()
    {
        mail.tell(entered);
    }
}

/// Exchanges the show that is loaded for the next; the planner gets what it plans with, and frees the old one.
fn load(
    mut show: Box<Loaded>,
    state: State,
    engine: &mut Engine,
    lanes: &mut Vec<Lane>,
    mail: &mut Mail,
) -> News {
    let taken = !state.may_send_motion() && mail.has_room_for_a_show();
    if taken {
        show.engine.take_over(engine);
        for (lane, old) in show.lanes.iter_mut().zip(&*lanes) {
            lane.go_on_from(old);
        }
        std::mem::swap(engine, &mut show.engine);
        std::mem::swap(lanes, &mut show.lanes);
        if let Some(planning) = show.planning.take() {
            mail.task(Task::Load(planning));
        }
    }
    mail.task(Task::Free(show));
    if taken { News::Taken } else { News::NotLoaded(state) }
}

fn told(result: Result<(), Refusal>) -> News {
    result.map_or_else(News::Refused, |()| News::Taken)
}
