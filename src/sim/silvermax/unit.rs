//! One unit: what it remembers, and what it does in each tick.

use super::axis::Axis;
use super::mover::{MoverMode, Queue, StopWords};
use super::trajectory::Trajectory;
use super::{Executed, TICK_NS, UnitSetup};
use crate::time::MonoTime;
use crate::wire::silvermax::{AnyRequest, Internal, Poll, register};

/// What a unit did, counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Tally {
    /// Requests that were for it.
    pub(crate) requests: u32,
    /// Those it refused, but for a full queue.
    pub(crate) refused: u32,
    /// Segments it began.
    pub(crate) segments: u32,
    /// Segments it refused since the queue was full.
    pub(crate) full: u32,
    /// How often its queue ran dry.
    pub(crate) dry: u32,
    /// How often it was killed.
    pub(crate) kills: u32,
    /// How often it started.
    pub(crate) resets: u32,
    /// Commands that kinocue must never send: HLT, RST, VMI, TIM, GOL, KDD, and those that write its memory.
    pub(crate) forbidden: u32,
}

/// A virtual SilverMax with its axis.
#[derive(Debug, Clone)]
pub(crate) struct Unit {
    pub(super) setup: UnitSetup,
    /// From where on its crystal runs as it does, and how many ticks were before.
    since: (MonoTime, u64),
    pub(super) tick: u64,
    /// The tick at which it listens.
    listens: u64,
    pub(super) axis: Axis,
    /// The place at which it counts 0.
    pub(super) origin: i64,
    pub(super) trajectory: Trajectory,
    /// The target, as far from the origin as the trajectory says, but within soft limits.
    pub(super) target: i64,
    pub(super) mode: MoverMode,
    pub(super) queue: Queue,
    /// A motion that waits for the running one.
    pub(super) pending: Option<AnyRequest>,
    pub(super) settings: Settings,
    pub(super) status: Status,
    pub(super) world: World,
    pub(super) tally: Tally,
}

/// What commands set, and a reset forgets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settings {
    /// Registers 10 to 40 at their numbers, and 4 and 5.
    pub(super) registers: [i32; 41],
    pub(super) is_driving: bool,
    /// EMT.
    pub(super) is_multi_tasking: bool,
    /// Torque limits: closed hold, closed move, open hold, open move.
    pub(super) torque: [u16; 4],
    /// Error limits: moving, holding, ticks to holding.
    pub(super) errors: [u16; 3],
    /// Enable and state.
    pub(super) kill: [u16; 2],
    /// The first of two registers.
    pub(super) soft_limits: Option<u8>,
}

/// What it tells.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Status {
    /// What happened since it was asked.
    pub(super) news: u16,
    /// What it told, and was not cleared.
    pub(super) told: u16,
    /// Bits of the internal status word that stay until CIS.
    pub(super) latched: u16,
    pub(super) kill_cause: u32,
    pub(super) max_error: i64,
    /// Ticks until it counts as holding.
    pub(super) settling: u32,
}

/// What somebody does to it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct World {
    pub(super) is_hot: bool,
    pub(super) is_dead: bool,
    pub(super) answers_as: Option<u8>,
}

impl Settings {
    const fn after_reset() -> Self {
        Self {
            registers: [0; 41],
            is_driving: true,
            is_multi_tasking: false,
            torque: [15_000, 20_000, 10_000, 20_000],
            errors: [0; 3],
            kill: [0; 2],
            soft_limits: None,
        }
    }
}

impl Unit {
    /// A unit that has been on for long.
    pub(crate) fn new(setup: UnitSetup, start: MonoTime) -> Self {
        let axis = Axis::new(setup);
        let origin = axis.place();
        let status = Status { news: Poll::DONE, ..Status::default() };
        Self {
            setup,
            since: (start, 0),
            tick: 0,
            listens: 0,
            axis,
            origin,
            trajectory: Trajectory::at_rest(0),
            target: 0,
            mode: MoverMode::Hold,
            queue: Queue::default(),
            pending: None,
            settings: Settings::after_reset(),
            status,
            world: World::default(),
            tally: Tally::default(),
        }
    }

    /// Its number.
    pub(crate) const fn number(&self) -> u8 {
        self.setup.unit
    }

    /// What it did.
    pub(crate) const fn tally(&self) -> Tally {
        self.tally
    }

    /// Where its axis was.
    pub(crate) const fn executed(&self) -> &Executed {
        &self.axis.executed
    }

    /// Forgets where its axis was until now.
    #[cfg(test)]
    pub(crate) fn forget_executed(&mut self) {
        self.axis.executed = Executed::at(self.axis.counts());
    }

    /// Where its axis stands, counts from the lower stop.
    pub(crate) fn place(&self) -> f64 {
        self.axis.counts()
    }

    /// What it takes for its position, counts.
    pub(crate) fn position(&self) -> i32 {
        self.counts(self.actual())
    }

    /// The target, counts.
    pub(crate) fn target(&self) -> i32 {
        self.counts(self.target)
    }

    /// True if something is under way.
    pub(crate) fn is_moving(&self) -> bool {
        self.mode != MoverMode::Hold
    }

    /// Segments that wait.
    #[cfg(test)]
    pub(crate) fn queued(&self) -> usize {
        self.queue.len()
    }

    /// Ticks left of the running segment.
    pub(crate) const fn ticks_left(&self) -> u32 {
        match self.mode {
            MoverMode::Queue { left, .. } => left,
            _ => 0,
        }
    }

    /// True if it listens and answers.
    pub(super) const fn is_there(&self) -> bool {
        !self.world.is_dead && self.tick >= self.listens
    }

    pub(super) const fn actual(&self) -> i64 {
        self.axis.place() - self.origin
    }

    pub(super) fn twice_of(&self, counts: i32) -> i64 {
        i64::from(counts) << (self.setup.bits + 1)
    }

    pub(super) fn counts(&self, twice: i64) -> i32 {
        i32::try_from(twice >> (self.setup.bits + 1)).unwrap_or(if twice < 0 { i32::MIN } else { i32::MAX })
    }

    /// All ticks up to now.
    pub(crate) fn advance(&mut self, now: MonoTime) {
        let (since, before) = self.since;
        let gone = u128::from(now.as_nanos().saturating_sub(since.as_nanos()));
        let speed = u128::from(1_000_000_u32.saturating_add_signed(self.setup.ppm));
        let ticks = gone * speed / (u128::from(TICK_NS) * 1_000_000);
        let ticks = u64::try_from(ticks).unwrap_or(u64::MAX).saturating_add(before);
        while self.tick < ticks {
            self.tick += 1;
            self.run_tick();
            if self.is_idle() {
                self.tick = ticks;
            }
        }
    }

    /// From now on, to which it has been advanced, its crystal is off by so many millionths.
    pub(super) fn run_at(&mut self, ppm: i32, now: MonoTime) {
        self.since = (now, self.tick);
        self.setup.ppm = ppm;
    }

    /// True if the next tick is like this one until somebody does something.
    fn is_idle(&self) -> bool {
        let waits = match self.mode {
            MoverMode::Hold => true,
            MoverMode::Queue { running, .. } => running.is_none() && self.queue.len() == 0,
            MoverMode::Move { .. } => false,
        };
        waits && self.pending.is_none() && self.status.settling == 0 && !self.axis.gives_way()
    }

    fn run_tick(&mut self) {
        self.feed();
        match &mut self.mode {
            MoverMode::Hold => self.status.settling = self.status.settling.saturating_sub(1),
            MoverMode::Queue { running: None, .. } => {}
            MoverMode::Queue { running: Some(goal), left } => {
                *left -= 1;
                let (moved, _) = self.trajectory.tick(*goal);
                self.shift(moved);
            }
            MoverMode::Move { goal, stop } => {
                let stop = *stop;
                let (moved, is_there) = self.trajectory.tick(*goal);
                self.shift(moved);
                if is_there && self.trajectory.velocity == 0 {
                    self.finish();
                } else if self.senses(stop) {
                    self.sensed();
                }
            }
        }
        if self.settings.is_driving {
            self.axis.pull(self.target + self.origin, self.tick);
        }
        self.mind_errors();
        self.mind_kill();
    }

    /// The next segment, where the running one is over.
    fn feed(&mut self) {
        let MoverMode::Queue { running, left: 0 } = self.mode else { return };
        let Some(segment) = self.queue.pop() else {
            if running.is_some() {
                self.run_dry();
            }
            return;
        };
        self.tally.segments += 1;
        let (acceleration, velocity) = (segment.acceleration, segment.velocity);
        let as_register = |value: i64| i32::try_from(value).unwrap_or(i32::MAX);
        for (number, value) in [
            (register::SEGMENT_POSITION, segment.position),
            (register::SEGMENT_ACCELERATION, as_register(acceleration)),
            (register::SEGMENT_VELOCITY, as_register(velocity)),
            (register::SEGMENT_DECELERATION, as_register(acceleration)),
        ] {
            self.settings.registers[usize::from(number)] = value;
        }
        self.mode = if segment.ticks == 0 {
            MoverMode::Move {
                goal: segment.last_goal(self.twice_of(segment.position)),
                stop: StopWords::default(),
            }
        } else {
            let goal = segment.goal(|counts| self.twice_of(counts));
            MoverMode::Queue { running: Some(goal), left: segment.ticks }
        };
    }

    /// Nothing follows the segment that is over (IMS, page 92).
    fn run_dry(&mut self) {
        self.tally.dry += 1;
        self.status.news |= Poll::PROGRAM_ERROR;
        self.brake(self.settings.registers[usize::from(register::DRY_BRAKE)].into());
    }

    /// Comes to rest by a deceleration; at once without one.
    pub(super) fn brake(&mut self, deceleration: i64) {
        if deceleration > 0 {
            self.mode = MoverMode::brake(deceleration);
        } else {
            self.trajectory = Trajectory::at_rest(self.target);
            self.finish();
        }
    }

    /// Moves the target by what the trajectory moved; soft limits stop it hard (SSL, page 72).
    fn shift(&mut self, moved: i64) {
        let wanted = self.target + moved;
        let Some(first) = self.settings.soft_limits.map(usize::from) else {
            self.target = wanted;
            return;
        };
        let low = self.twice_of(self.settings.registers[first]);
        let high = self.twice_of(self.settings.registers[first + 1]);
        let kept =
            if moved < 0 { wanted.max(low.min(self.target)) } else { wanted.min(high.max(self.target)) };
        if kept != wanted {
            self.status.news |= Poll::SOFT_LIMIT;
        }
        self.target = kept;
    }

    /// A motion is over: it holds, and what waited begins.
    pub(super) fn finish(&mut self) {
        self.mode = MoverMode::Hold;
        self.trajectory = Trajectory::at_rest(self.target);
        self.status.news |= Poll::DONE;
        self.status.settling = u32::from(self.settings.errors[2]) + 1;
        if let Some(request) = self.pending.take() {
            self.begin(&request);
        }
    }

    /// What ends a move was sensed: it brakes as it accelerated, and remembers where that was.
    fn sensed(&mut self) {
        self.status.latched |= Internal::INPUT_FOUND;
        self.status.news |= Poll::ENDED_BY_SENSOR;
        self.settings.registers[usize::from(register::INPUT_POSITION)] = self.position();
        self.brake(self.mode.acceleration().unwrap_or(0));
    }

    /// Ends all motion at once and forgets what waits.
    pub(super) fn halt(&mut self) {
        self.pending = None;
        self.mode = MoverMode::Hold;
        self.trajectory = Trajectory::at_rest(self.target);
    }

    /// The power goes and comes back, or RST: nothing is left, and the rotor moves to where it is aligned.
    pub(super) fn reset(&mut self) {
        self.halt();
        self.queue.clear();
        self.tally.resets += 1;
        self.axis.jump(self.axis.place() + self.twice_of(self.setup.align));
        self.origin = self.axis.place();
        self.trajectory = Trajectory::at_rest(0);
        self.target = 0;
        self.settings = Settings::after_reset();
        self.status = Status { news: Poll::DONE, ..Status::default() };
        self.listens = self.tick + u64::from(self.setup.boot_ticks);
    }
}
