//! Machines that the outside can reach: octets are what happens to them.

use std::time::Duration;

use super::script::Script;
use super::seen;
use crate::belief::Fall;
use crate::config::LossPolicy;
use crate::film::chase::{HoldCause, ParkCause};
use crate::film::point::FilmState;
use crate::health::{Continuity, Groups, HealthInput, HealthTable, Identity, Notice, Pushed, Sighting};
use crate::motion::Pulses;
use crate::observe;
use crate::state::rules::{HallRules, Step, Turn};
use crate::state::{Demand, Event, Finding, Latch, LedBefore, Machine, Readiness, Transition, Trouble};
use crate::time::MonoTime;
use crate::tracker::{Books, Reply, Tracker};
use crate::wire::{FrameNo, ReplyCode};

/// Steps of one history; more teach nothing new.
const STEPS: usize = 4_000;
const BEGUN: MonoTime = MonoTime::from_nanos(1_000_000_000_000);

/// Any history of sends and replies: each frame and each reply has one fate in the end.
pub(super) fn tracker(octets: &[u8]) {
    let mut script = Script::new(octets);
    let Some(mut link) = TriedLink::begin(&mut script) else { return };
    for _ in 0..STEPS {
        if link.step(&mut script).is_none() {
            break;
        }
    }
    link.end();
}

/// What the sending side has told, and not yet been taken from its mailbox.
enum SendRecord {
    Sent(FrameNo, bool, MonoTime),
    Failed(FrameNo),
    Withdrawn(FrameNo, FrameNo),
}

struct TriedLink {
    books: Books,
    told: Vec<SendRecord>,
    ack_every: u32,
    first: FrameNo,
    newest: FrameNo,
    now: MonoTime,
    replies: u64,
}

impl TriedLink {
    fn begin(script: &mut Script<'_>) -> Option<Self> {
        let (ack_every, first) = (u32::from(script.octet()?) % 12, FrameNo(script.long()?));
        let books = Books::new(Tracker::starting_at(&[first], ack_every));
        let newest = FrameNo(first.0.wrapping_sub(1));
        Some(Self { books, told: Vec::new(), ack_every, first, newest, now: BEGUN, replies: 0 })
    }

    /// One that was sent so long ago, or will be.
    fn frame(&self, script: &mut Script<'_>) -> Option<FrameNo> {
        let behind = script.word()?;
        Some(FrameNo(match behind {
            0xff00.. => self.newest.0.wrapping_add((behind & 0xff).into()),
            _ => self.newest.0.wrapping_sub(behind.into()),
        }))
    }

    fn step(&mut self, script: &mut Script<'_>) -> Option<()> {
        match script.below(8)? {
            0 | 1 => self.send(1),
            2 => self.send(1 + u32::from(script.octet()?)), // records of those before found no room
            3 => self.told.push(SendRecord::Failed(self.newest)),
            4 => self.reply(script)?,
            5 => self.now = self.now + script.span()?,
            6 => self.settle(),
            _ => {
                let last = FrameNo(self.newest.0.wrapping_sub(script.octet()?.into()));
                let first = FrameNo(last.0.wrapping_sub(script.octet()?.into()));
                self.told.push(SendRecord::Withdrawn(first, last));
            }
        }
        Some(())
    }

    fn send(&mut self, on: u32) {
        self.newest = FrameNo(self.newest.0.wrapping_add(on));
        let asked = self.newest.asks(self.ack_every);
        self.told.push(SendRecord::Sent(self.newest, asked, self.now));
    }

    fn reply(&mut self, script: &mut Script<'_>) -> Option<()> {
        let code = ReplyCode::from_byte(2 + (script.octet()? & 3))?;
        let frame = self.frame(script)?;
        let reply = Reply { controller: 0, frame, code, error: 0, inputs: 0, at: self.now };
        let Self { books, told, .. } = self;
        books.on_reply(reply, &mut |tracker: &mut Tracker| tell(tracker, told));
        self.replies += 1;
        Some(())
    }

    fn settle(&mut self) {
        let Self { books, told, now, .. } = self;
        books.settle(*now, &mut |tracker: &mut Tracker| tell(tracker, told));
        let counts = self.books.tracker().counts(0);
        let frames = u64::from(self.newest.0.wrapping_sub(self.first.0).wrapping_add(1));
        assert_eq!(counts.sent + counts.send_failed, frames, "each frame was sent or not: {counts:?}");
        assert!(counts.in_flight() <= frames, "{counts:?}");
    }

    fn end(mut self) {
        self.settle();
        let Self { books, told, .. } = &mut self;
        books.finish(&mut |tracker: &mut Tracker| tell(tracker, told));
        let counts = self.books.tracker().counts(0);
        assert_eq!(counts.in_flight(), 0, "{counts:?}");
        let fates = counts.acked + counts.refused() + counts.duplicate + counts.stale + counts.stray;
        assert_eq!(fates, self.replies, "{counts:?}");
        seen(self.books.tracker().lost_at_end(0));
    }
}

fn tell(tracker: &mut Tracker, told: &mut Vec<SendRecord>) {
    for record in told.drain(..) {
        match record {
            SendRecord::Sent(frame, asked, at) => tracker.on_sent(0, frame, asked, at),
            SendRecord::Failed(frame) => tracker.on_send_failed(0, frame),
            SendRecord::Withdrawn(first, last) => tracker.withdraw(0, first, last),
        }
    }
}

/// Any history of a hall: what [`HallRules`] has never happens, and a stop always ends it.
pub(super) fn hall(octets: &[u8]) {
    let mut script = Script::new(octets);
    let (mut hall, mut rules, mut now) = (Machine::new(BEGUN), HallRules::default(), BEGUN);
    for _ in 0..STEPS {
        let Some(turn) = turn(&mut script) else { break };
        rules.follow(&mut hall, turn, &mut now);
    }
    rules.follow(&mut hall, Turn::Step(Step::Command(Transition::Stop)), &mut now);
    // Here the clock may have been set back since the hall began to stop.
    hall.tick(now.max(hall.since()) + crate::state::STOPPING_FOR);
    assert!(!hall.may_send_motion(), "{} after a stop", hall.state());
}

fn turn(script: &mut Script<'_>) -> Option<Turn> {
    Some(match script.below(4)? {
        0 => Turn::Step(Step::Command(script.one_of(&Transition::ALL)?)),
        1 | 2 => Turn::Step(Step::Tell(event(script)?)),
        _ => Turn::Clock(i64::from(script.word()?.cast_signed()) * 50),
    })
}

fn event(script: &mut Script<'_>) -> Option<Event> {
    const PLAIN: [Event; 11] = [
        Event::PositionsRead,
        Event::Homed,
        Event::JoinBegun,
        Event::Joined,
        Event::Late,
        Event::CueEnded,
        Event::AtRest,
        Event::Parked,
        Event::AllReleased,
        Event::ZerosKnown,
        Event::FilmLeads,
    ];
    const HOLDS: [HoldCause; 5] = [
        HoldCause::Film(FilmState::Lost),
        HoldCause::Apart,
        HoldCause::Behind,
        HoldCause::Unstable,
        HoldCause::Asks,
    ];
    const PARKS: [ParkCause; 4] =
        [ParkCause::FilmEnded, ParkCause::FilmCutShort, ParkCause::CueLeft, ParkCause::HeldTooLong];
    const READY: [Readiness; 4] =
        [Readiness::Ready, Readiness::NoCue, Readiness::NotProved, Readiness::NotPreflighted];
    let controller = |script: &mut Script<'_>| script.below(3);
    Some(match script.below(22)? {
        plain @ ..11 => PLAIN[plain],
        11 | 12 => {
            let before = script.one_of(&[LedBefore::Ended, LedBefore::Crashed, LedBefore::OnCue])?;
            Event::Identified(Finding { homed: script.flag()?, at_park: script.flag()?, before })
        }
        13 => Event::Readiness(script.one_of(&READY)?),
        14 => Event::Astray(script.flag()?),
        15 => Event::Rebooted(controller(script)?),
        16 => Event::Policy(script.one_of(&[Demand::Pause, Demand::Park])?, controller(script)?),
        17 => Event::EmergencyStop(controller(script)?),
        18 => Event::Trouble(script.one_of(&[
            Trouble::Limiter,
            Trouble::Planner,
            Trouble::Deaf,
            Trouble::Homing(1),
            Trouble::OtherMaster(2),
        ])?),
        19 => Event::Latched(script.one_of(&[Latch::Free, Latch::Held, Latch::Over])?),
        20 => Event::Slept(Duration::from_secs(u64::from(script.word()?) % 400)),
        _ => match script.flag()? {
            true => Event::FilmAwaited(script.one_of(&HOLDS)?),
            false => Event::FilmOver(script.one_of(&PARKS)?),
        },
    })
}

/// Any history of four controllers under three seats: what is out moves again only once it was read, and nothing moves that is stopped.
pub(super) fn health(octets: &[u8]) {
    let mut script = Script::new(octets);
    let Some(mut watched) = WatchedSeats::begin(&mut script) else { return };
    for _ in 0..STEPS {
        if watched.step(&mut script).is_none() {
            break;
        }
    }
    watched.tick();
}

const CONTROLLERS: usize = 4;
const SEATS: usize = 3;

struct WatchedSeats {
    health: HealthTable,
    now: MonoTime,
    newest: FrameNo,
    ack_every: u32,
    /// Read since it was last seen out, controller by controller.
    read: [bool; CONTROLLERS],
    /// In an emergency stop.
    pressed: [bool; CONTROLLERS],
}

impl WatchedSeats {
    fn begin(script: &mut Script<'_>) -> Option<Self> {
        let policy = script.one_of(&[LossPolicy::Continue, LossPolicy::Pause, LossPolicy::Park])?;
        let ack_every = u32::from(script.octet()?) % 5;
        let period = Duration::from_millis(1 + u64::from(script.octet()?) % 50);
        let groups = Groups::named(["A1", "A1", "A2", "A3"]);
        let health = HealthTable::new(groups, policy, ack_every, period);
        let health = if script.flag()? { health.of_a_hall() } else { health };
        let [read, pressed] = [[false; CONTROLLERS]; 2];
        Some(Self { health, now: BEGUN, newest: FrameNo(0), ack_every, read, pressed })
    }

    fn step(&mut self, script: &mut Script<'_>) -> Option<()> {
        match script.below(8)? {
            0 => self.send(),
            1 | 2 => {
                let (controller, behind) = (script.below(CONTROLLERS)?, script.octet()?);
                let frame = FrameNo(self.newest.0.wrapping_sub(behind.into()));
                self.health.on_ack(controller, frame, self.now);
            }
            3 => self.seen(script)?,
            4 => self.input(script)?,
            5 => self.event(script)?,
            6 => self.now = self.now + script.span()?,
            _ => self.tick(),
        }
        Some(())
    }

    fn send(&mut self) {
        self.newest = FrameNo(self.newest.0.wrapping_add(1));
        let asked = self.newest.asks(self.ack_every);
        for controller in 0..CONTROLLERS {
            if self.health.standing(self.health.groups().group_of(controller)).may_move() {
                self.health.on_sent(controller, self.newest, asked, self.now);
            }
        }
    }

    fn seen(&mut self, script: &mut Script<'_>) -> Option<()> {
        let controller = script.below(CONTROLLERS)?;
        if script.flag()? {
            self.health.on_read_sent(controller, 1);
        }
        let identity = Identity { version: 3, minor_version: 1, work_mode: script.octet()?.into(), axes: 3 };
        let continuity = match script.below(3)? {
            0 => Continuity::Packets(script.word()?),
            1 => Continuity::Answers,
            _ => Continuity::Mark,
        };
        let [error, alarm] = [script.number(2)?, script.number(2)?];
        let sighting = Sighting { identity, error, alarm, continuity, homed: script.flag()? };
        self.health.on_sighting(controller, &sighting, self.now);
        self.read[controller] = true;
        Some(())
    }

    fn input(&mut self, script: &mut Script<'_>) -> Option<()> {
        const FALLS: [Fall; 5] = [Fall::Gap, Fall::Astray, Fall::PutBack, Fall::Stale, Fall::Stopped];
        let (kind, of, now) = (script.below(22)?, script.below(CONTROLLERS)?, self.now);
        let input = match kind {
            0 => HealthInput::Part(of, script.flag()?),
            1 => HealthInput::Refused(of),
            2 => HealthInput::Alive(of, now),
            3 => HealthInput::Answered(of, now),
            4 => HealthInput::ReadSent(of, script.octet()?.into()),
            5 => HealthInput::OtherSent(of, script.word()?.into()),
            6 => HealthInput::BeatSent(of, now),
            7 => HealthInput::BeatKept(of, now),
            8 => HealthInput::Zero(of, script.flag()?),
            9 => HealthInput::Killed(of, 1 + script.below(6)?, script.octet()?.into()),
            10 => HealthInput::LostZero(of),
            11 => HealthInput::Wide(of),
            12 => HealthInput::OtherAxes(of, script.octet()?.into()),
            13 if script.flag()? => HealthInput::Counted(of),
            13 => HealthInput::Count(of, script.word()?),
            14 => HealthInput::Moved(of),
            15 => HealthInput::FellOut(of, script.one_of(&FALLS)?),
            16 => {
                let outside = (script.below(6)?, Pulses(script.long()?.cast_signed()));
                HealthInput::Outside(of, script.flag()?.then_some(outside))
            }
            17 => {
                let pushed = Pushed { axis: script.below(6)?, at: 1, held: 2 };
                HealthInput::Pushed(of, script.flag()?.then_some(pushed))
            }
            18 => HealthInput::Ambiguous(of, script.flag()?),
            19 => HealthInput::Homed(of),
            20 => HealthInput::Joined(of % SEATS),
            _ => HealthInput::LookAnew(of % SEATS),
        };
        self.health.take(input);
        Some(())
    }

    fn event(&mut self, script: &mut Script<'_>) -> Option<()> {
        let controller = script.below(CONTROLLERS)?;
        let what = match script.below(6)? {
            0 => observe::What::EmergencyStop { cause: observe::Cause::Reply },
            1 => observe::What::EmergencyStopHeld,
            2 => observe::What::EmergencyStopOver,
            3 => observe::What::Error(script.number(3)?),
            4 => observe::What::ServoError { axis: 1 + script.below(6)?, error: script.number(2)? },
            _ => observe::What::Alarm { register: script.word()?, value: script.number(2)? },
        };
        match what {
            observe::What::EmergencyStop { .. } => self.pressed[controller] = true,
            observe::What::EmergencyStopOver => self.pressed[controller] = false,
            _ => {}
        }
        self.health.on_event(&observe::Event { controller, at: self.now, what });
        Some(())
    }

    fn tick(&mut self) {
        let moved: Vec<bool> = (0..SEATS).map(|seat| self.health.standing(seat).may_move()).collect();
        let (mut changes, mut reads) = ([0; SEATS], [0; CONTROLLERS]);
        self.health.tick(self.now, &mut |notice| match notice {
            Notice::Group(change) => {
                changes[change.group] += 1;
                seen((change.to_string(), change.why.figures(), change.why.next()));
            }
            Notice::Read(controller) | Notice::Count(controller) => reads[controller] += 1,
            Notice::Hall(_) => {}
        });
        assert!(changes.iter().all(|count| *count <= 1), "{changes:?}");
        assert!(reads.iter().all(|count| *count <= 2), "{reads:?}");
        for (seat, moved) in moved.into_iter().enumerate() {
            let members = (0..CONTROLLERS).filter(|one| self.health.groups().group_of(*one) == seat);
            let moves = self.health.standing(seat).may_move();
            let why = self.health.why(seat);
            let mut members = members.peekable();
            let is_read = members.clone().any(|one| self.read[one]);
            assert!(moved || !moves || is_read, "seat {seat} moves again unread: {why:?}");
            let is_pressed = members.clone().any(|one| self.pressed[one]);
            assert!(!moves || !is_pressed, "seat {seat} moves in an emergency stop: {why:?}");
            if !moves && moved {
                members.by_ref().for_each(|one| self.read[one] = false);
            }
        }
    }
}
