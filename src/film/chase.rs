//! What seats may do by where the film is: wait, follow, hold or park. A verdict each tick, as a level; who arms, homes, clears and
//! stops is the hall, which is above all of this. Tick thread; allocates nothing.

#[cfg(test)]
mod tests;

use std::time::Duration;

use super::follower::{Follower, PaceLimits};
use super::point::{FILM_FRAME, FilmPoint, FilmState};
use crate::time::{MonoTime, ShowTime, Tick};

/// An error beyond this is never slewed away, unless it is configured otherwise: seats hold, and join.
pub(crate) const JOIN_ABOVE: Duration = FILM_FRAME;
/// Seats that are parked join once the film has been followable for so long: a reader that flickers must not begin a show.
const READY_FOR: Duration = Duration::from_millis(500);
/// So long before the first sample of the cue seats join its first pose.
pub(crate) const PRE_ROLL: ShowTime = ShowTime::from_millis(-10_000);
/// A film that is outside the cue for longer has left it.
const LEFT_AFTER: Duration = Duration::from_secs(2);
/// Seats that have held for longer are parked, as in a pause.
const HELD_AFTER: Duration = Duration::from_mins(5);
/// The next join waits for a person if so many came within [`UNSTABLE_WITHIN`].
const UNSTABLE_JOINS: usize = 5;
const UNSTABLE_WITHIN: Duration = Duration::from_mins(1);
/// A person who lets seats join means the film of now; the player may need a moment to run again.
const LET_FOR: Duration = Duration::from_secs(10);
/// Of so many parts of a cue, so many have to be led for it to have been played: whoever joins within the first tenth, or leaves in
/// the last, has seen it.
const PARTS: i64 = 32;
const PARTS_LED: u32 = 29;
/// Nor has anybody missed what is before the first join, if that came as soon as it could: a player that begins is known a second
/// later, and on a loaded machine two. Of a short film that is more than a tenth.
const JOINS_WITHIN: ShowTime = ShowTime::from_millis(3_000);

/// Where a show that chases a film stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum ChaseState {
    /// Seats are parked, and have not joined yet.
    Waiting,
    /// Seats follow, or join.
    Following,
    /// Seats decelerate, or are at rest, until the film can be followed again.
    Holding,
    /// Seats park; only the hall leads on from there.
    Leaving,
}

/// Why seats hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HoldCause {
    /// What is known of the film does not do: its state says why.
    Film(FilmState),
    /// The film is further from the playhead than may be slewed.
    Apart,
    /// It is so because ticks were missed.
    Behind,
    /// It was so too often: a person has to let them join.
    Unstable,
    /// They were asked to wait for a person before each join.
    Asks,
}

/// Why seats park.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ParkCause {
    /// The film is over, and with it the cue.
    FilmEnded,
    /// The film is over, and part of the cue was never led.
    FilmCutShort,
    /// The film is outside the cue.
    CueLeft,
    /// Nobody knew for too long where the film is.
    HeldTooLong,
}

/// What the seats are to do in this tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ChaseVerdict {
    /// Stay parked.
    Wait,
    /// Follow the cue.
    Follow {
        /// How often seats have joined; where this differs from the tick before, they are to join.
        join: u32,
        /// Where in the cue the frame of this tick leads.
        playhead: ShowTime,
        /// How many times as fast as the clock the playhead moves.
        pace: f64,
    },
    /// Decelerate, and rest.
    Hold(HoldCause),
    /// Park.
    Park(ParkCause),
}

/// When seats that hold may join again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Rejoin {
    /// By themselves.
    Auto,
    /// When a person lets them.
    Ask,
}

/// What is fixed for a show that chases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChaseRules {
    /// The pace that the cue was proved at.
    pub(crate) pace: PaceLimits,
    /// Errors beyond it are joined, not slewed.
    pub(crate) join_above: Duration,
    /// When seats that hold may join again.
    pub(crate) rejoin: Rejoin,
    /// Where the cue ends.
    pub(crate) cue_end: ShowTime,
}

impl ChaseRules {
    /// Those of a cue that ends there, where nobody says otherwise.
    #[must_use]
    pub fn until(cue_end: ShowTime) -> Self {
        Self { pace: PaceLimits::default(), join_above: JOIN_ABOVE, rejoin: Rejoin::Auto, cue_end }
    }
}

/// What a tick brings.
#[derive(Debug, Clone, Copy)]
pub struct ChaseInput<'a> {
    /// The tick.
    pub tick: &'a Tick,
    /// How long its frame takes.
    pub frame: Duration,
    /// Where the film is, if anybody has ever told.
    pub point: Option<FilmPoint>,
    /// How much later than the film the motion is to be, milliseconds.
    pub trim_ms: i32,
    /// What the hall lets it do: nothing in here makes it more.
    pub leave: FilmLeave,
}

/// What the hall lets the film do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilmLeave {
    /// Nothing: seats are parked, stopped, or on their way there.
    Nothing,
    /// Nothing, until a person resumes: seats rest where they are.
    Paused,
    /// To lead.
    Lead,
}

/// What the point of a tick means for the seats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ChaseSign {
    /// The hall does not let the film lead.
    Barred,
    /// Nor while it is paused.
    Paused,
    /// There is nothing more to follow.
    Over(ParkCause),
    /// It cannot be followed.
    Unready(HoldCause),
    /// It can, for a moment so far.
    Brief,
    /// It can.
    Ready,
}

impl ChaseState {
    #[rustfmt::skip] // As a table.
    const fn next(self, sign: ChaseSign) -> Self {
        use ChaseState::{Following, Holding, Leaving, Waiting};
        match (sign, self) {
            (ChaseSign::Barred, Waiting | Following | Holding | Leaving) => Waiting,
            (ChaseSign::Paused, Waiting) => Waiting,
            (ChaseSign::Paused, Following | Holding) => Holding, // they are up, and have to come down some day
            (ChaseSign::Paused, Leaving) => Leaving,
            (ChaseSign::Over(_), Waiting) => Waiting, // nothing has moved
            (ChaseSign::Over(_), Following | Holding | Leaving) => Leaving,
            (ChaseSign::Unready(_), Waiting) => Waiting,
            (ChaseSign::Unready(_), Following | Holding) => Holding,
            (ChaseSign::Unready(_) | ChaseSign::Brief | ChaseSign::Ready, Leaving) => Leaving,
            (ChaseSign::Brief, Waiting) => Waiting,
            // Once let go they need no half second: what flickers is stopped by the count of joins.
            (ChaseSign::Brief, Following | Holding) => Following,
            (ChaseSign::Ready, Waiting | Following | Holding) => Following,
        }
    }
}

/// The chase of one show.
#[derive(Debug, Clone)]
pub struct Chase {
    rules: ChaseRules,
    state: ChaseState,
    since: MonoTime,
    follower: Follower,
    /// How often seats have joined, and when they did last.
    joins: u32,
    joined: [MonoTime; UNSTABLE_JOINS],
    /// Until when a person lets them join, once.
    let_join: Option<MonoTime>,
    /// They joined too often, and no person has let them since.
    is_unstable: bool,
    ready_since: Option<MonoTime>,
    outside_since: Option<MonoTime>,
    /// The parts of the cue in which seats have followed, a bit each.
    led: u32,
    why: HoldCause,
    end: ParkCause,
}

impl Chase {
    /// A show whose seats are parked.
    #[must_use]
    pub const fn new(rules: ChaseRules, now: MonoTime) -> Self {
        Self {
            rules,
            state: ChaseState::Waiting,
            since: now,
            follower: Follower::new(rules.pace),
            joins: 0,
            joined: [MonoTime::from_nanos(0); UNSTABLE_JOINS],
            let_join: None,
            is_unstable: false,
            ready_since: None,
            outside_since: None,
            led: 0,
            why: HoldCause::Film(FilmState::Absent),
            end: ParkCause::CueLeft,
        }
    }

    /// Where it stands.
    #[must_use]
    pub(crate) const fn state(&self) -> ChaseState {
        self.state
    }

    /// Whether the seats hold for what is over in a moment: it jumped, and where it is now is being found, which no source is given more
    /// than five seconds for. What may last, as a film that was stopped, rests as a pause does.
    #[must_use]
    pub(crate) const fn is_held_briefly(&self) -> bool {
        let is_brief = match self.why {
            HoldCause::Apart | HoldCause::Behind => true,
            HoldCause::Film(state) => state.is_brief(),
            HoldCause::Unstable | HoldCause::Asks => false,
        };
        matches!(self.state, ChaseState::Holding) && is_brief
    }

    /// A person lets seats that hold join, once, and soon.
    pub(crate) fn let_join(&mut self, now: MonoTime) {
        self.let_join = Some(now + LET_FOR);
    }

    /// What the seats are to do.
    pub fn tick(&mut self, input: &ChaseInput<'_>) -> ChaseVerdict {
        let now = input.tick.deadline;
        // Seats reach the pose of a frame when it ends: then is when they and the film have to agree.
        let end = now + input.frame;
        let sign = self.sign(input, now, end);
        let from = self.state;
        self.state = from.next(sign);
        if self.state != from || sign == ChaseSign::Paused {
            self.since = now;
        }
        match (sign, input.point) {
            (ChaseSign::Over(cause), _) => self.end = cause,
            (ChaseSign::Unready(cause), _) => self.why = cause,
            (ChaseSign::Brief | ChaseSign::Ready, Some(point)) if self.state == ChaseState::Following => {
                if from == ChaseState::Following {
                    self.follower.follow(&point, end, input.frame, input.trim_ms);
                } else {
                    self.join(&point, (now, end), input.trim_ms);
                }
                self.led |= self.part();
            }
            (ChaseSign::Barred | ChaseSign::Paused | ChaseSign::Brief | ChaseSign::Ready, _) => {}
        }
        self.verdict()
    }

    fn join(&mut self, point: &FilmPoint, (now, end): (MonoTime, MonoTime), trim_ms: i32) {
        self.follower.join(point, end, trim_ms);
        self.joined[self.joins as usize % UNSTABLE_JOINS] = now;
        self.joins = self.joins.wrapping_add(1);
        (self.let_join, self.is_unstable) = (None, false);
        let at = self.follower.playhead();
        if at <= JOINS_WITHIN && at.as_nanos() <= self.rules.cue_end.as_nanos() / 2 {
            // Nobody has missed what was before so early a join: those parts count as led.
            self.led |= self.part().saturating_sub(1);
        }
    }

    /// The part of the cue that seats follow in, as its bit. Parts, not time: who is led through one half twice has not seen the other.
    fn part(&self) -> u32 {
        let at = self.follower.playhead().as_nanos().checked_div(self.rules.cue_end.as_nanos() / PARTS);
        at.and_then(|part| 1_u32.checked_shl(part.try_into().ok()?)).unwrap_or_default()
    }

    const fn verdict(&self) -> ChaseVerdict {
        match self.state {
            ChaseState::Waiting => ChaseVerdict::Wait,
            ChaseState::Following => ChaseVerdict::Follow {
                join: self.joins,
                playhead: self.follower.playhead(),
                pace: self.follower.pace(),
            },
            ChaseState::Holding => ChaseVerdict::Hold(self.why),
            ChaseState::Leaving => ChaseVerdict::Park(self.end),
        }
    }

    fn sign(&mut self, input: &ChaseInput<'_>, now: MonoTime, end: MonoTime) -> ChaseSign {
        if input.leave != FilmLeave::Lead {
            // What could be followed while the hall did not let it lead has to be so anew.
            (self.ready_since, self.outside_since) = (None, None);
            return if input.leave == FilmLeave::Paused { ChaseSign::Paused } else { ChaseSign::Barred };
        }
        let state = input.point.map_or(FilmState::Absent, |point| point.state);
        // A film that stands or runs back has no pace that a playhead may take, whatever its state says.
        let Some(point) = input.point.filter(|point| point.state.may_lead() && point.rate > 0.0) else {
            self.ready_since = None;
            return self.sign_of_nobody(state, now);
        };
        // Before all that could hold: seats that hold outside the cue would hold there for minutes.
        if self.has_left(point.media_at(end), now) {
            return ChaseSign::Over(ParkCause::CueLeft);
        }
        // Only of seats that follow: those that hold come back by a join, from however far.
        let is_apart = self.state == ChaseState::Following
            && self.follower.error_s(&point, end, input.frame).abs() > self.rules.join_above.as_secs_f64();
        if is_apart {
            // Who is to look for the cause: the film's people, or this machine's.
            let cause = if input.tick.missed > 0 { HoldCause::Behind } else { HoldCause::Apart };
            return ChaseSign::Unready(cause);
        }
        if let Some(cause) = self.waits_for_a_person(now) {
            return self.held(cause, now);
        }
        // Seats at rest do not join the end of a cue for a film that is somewhere else.
        if self.outside_since.is_some() && self.state == ChaseState::Holding {
            return self.held(HoldCause::Film(state), now);
        }
        let since = *self.ready_since.get_or_insert(now);
        let is_ready = now.since(since) >= READY_FOR || state == FilmState::FreeRunning;
        // Seats that are parked wait for a film that is before the cue, and for one that is behind it.
        let is_ready = is_ready && self.outside_since.is_none();
        if is_ready { ChaseSign::Ready } else { ChaseSign::Brief }
    }

    /// The film cannot be followed.
    fn sign_of_nobody(&mut self, state: FilmState, now: MonoTime) -> ChaseSign {
        if state == FilmState::Ended {
            let is_led = self.led.count_ones() >= PARTS_LED;
            return ChaseSign::Over(if is_led { ParkCause::FilmEnded } else { ParkCause::FilmCutShort });
        }
        self.outside_since = None;
        self.held(HoldCause::Film(state), now)
    }

    fn held(&self, cause: HoldCause, now: MonoTime) -> ChaseSign {
        let is_too_long = self.state == ChaseState::Holding && now.since(self.since) > HELD_AFTER;
        if is_too_long { ChaseSign::Over(ParkCause::HeldTooLong) } else { ChaseSign::Unready(cause) }
    }

    /// Whether the film has been outside the cue for so long that it has left it.
    fn has_left(&mut self, media: ShowTime, now: MonoTime) -> bool {
        if (PRE_ROLL..=self.rules.cue_end).contains(&media) {
            self.outside_since = None;
            return false;
        }
        let since = *self.outside_since.get_or_insert(now);
        now.since(since) > LEFT_AFTER
    }

    /// Why seats that hold may not join by themselves, if they may not.
    fn waits_for_a_person(&mut self, now: MonoTime) -> Option<HoldCause> {
        if self.state != ChaseState::Holding {
            return None;
        }
        let oldest = self.joined[self.joins as usize % UNSTABLE_JOINS];
        // Of the last five the oldest: its place in the ring is the next that is written.
        let many = self.joins as usize >= UNSTABLE_JOINS && now.since(oldest) < UNSTABLE_WITHIN;
        // Said once, it stays so, whatever becomes of the film meanwhile: time alone makes no source stable.
        self.is_unstable |= many;
        match self.rules.rejoin {
            _ if self.let_join.is_some_and(|until| now <= until) => None,
            Rejoin::Ask => Some(HoldCause::Asks),
            Rejoin::Auto => self.is_unstable.then_some(HoldCause::Unstable),
        }
    }
}
