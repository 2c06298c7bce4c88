//! One motor as its unit runs it: every 2 ms a speed of what it is doing, and steps of the speed.

use std::time::Duration;

use super::search::{Search, SearchStep};
use super::shaft::Shaft;
use crate::time::MonoTime;
use crate::wire::sixpack2::{
    CurrentSettings, MOST_SPEED, MotorSettings, PeakCurrent, PiSettings, PositionTold, RampSettings,
    ReferenceSettings, SixpackCommand, StartSettings, ZeroSettings, action, p5, p6, steps_of_a_unit,
};

/// How often it chooses a speed (manual, page 25).
pub(crate) const LOOP: Duration = Duration::from_millis(2);

/// What a motor was told about itself; gone with each reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MotorWritten {
    pub(crate) start: StartSettings,
    pub(crate) ramp: RampSettings,
    pub(crate) kind: MotorSettings,
    pub(crate) reference: ReferenceSettings,
    pub(crate) zero: ZeroSettings,
    pub(crate) pi: PiSettings,
    /// Nothing depends on it here.
    pub(crate) peak: Option<PeakCurrent>,
    /// Nothing depends on it here.
    pub(crate) currents: Option<CurrentSettings>,
}

impl MotorWritten {
    /// As it wakes. Only `$19` has printed defaults; the others are the manual's examples, and no switch does anything.
    pub(super) const fn waking(motor: u8) -> Self {
        Self {
            start: StartSettings { motor, vmin: 0, vstart: 16, div: 0 },
            ramp: RampSettings { motor, amax: 5, vmax: 128 },
            kind: MotorSettings { motor, poslimit: 0, p5: 0, p6: 0 },
            reference: ReferenceSettings { motor, vrefmax: 100, debounce: 0, stop_after: 0 },
            zero: ZeroSettings { motor, offset: 0, range: 0 },
            pi: PiSettings { motor, propdiv: 8, intdiv: 129, intclip: 129, intinpclip: 1 },
            peak: None,
            currents: None,
        }
    }
}

/// What a motor does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Doing {
    /// Stands.
    Nothing,
    /// `$24`.
    Following(i32),
    /// `$50`, and back to where `$2A` came: by a ramp to a place, with such a part of speed and acceleration.
    Ramp(i32, f64),
    /// `$25`.
    Turning(i16),
    /// `$22`.
    Searching(Search),
}

/// A motor.
#[derive(Debug, Clone)]
pub(crate) struct SixpackMotor {
    pub(crate) written: MotorWritten,
    pub(crate) shaft: Shaft,
    /// Searches that began without a `$22`.
    pub(crate) own_searches: u32,
    /// Where a joint move will lead.
    pub(super) joint: i32,
    pub(super) doing: Doing,
    /// Microsteps, as it counts.
    counter: f64,
    /// Of the loop that runs, in units.
    speed: f64,
    was_stopped: bool,
}

impl SixpackMotor {
    /// As it wakes, wherever its shaft is.
    pub(super) const fn new(motor: u8, shaft: Shaft) -> Self {
        Self {
            written: MotorWritten::waking(motor),
            shaft,
            own_searches: 0,
            joint: 0,
            doing: Doing::Nothing,
            counter: 0.0,
            speed: 0.0,
            was_stopped: false,
        }
    }

    /// The same where its unit wakes again.
    pub(super) fn woken(&self) -> Self {
        let mut shaft = self.shaft.clone();
        shaft.let_go();
        Self { own_searches: self.own_searches, ..Self::new(self.written.zero.motor, shaft) }
    }

    /// The counter, microsteps.
    #[expect(clippy::cast_possible_truncation, reason = "saturating, where a unit would wrap")]
    pub(crate) const fn position(&self) -> i32 {
        self.counter.round() as i32
    }

    /// In units, negative downwards.
    #[expect(clippy::cast_possible_truncation, reason = "511 at most")]
    pub(crate) const fn speed(&self) -> i16 {
        self.speed.round() as i16
    }

    /// As it tells it.
    pub(crate) const fn action(&self) -> u8 {
        match self.doing {
            Doing::Nothing => action::IDLE,
            Doing::Following(_) => action::PI,
            Doing::Ramp(..) => action::RAMP,
            Doing::Turning(_) => action::ROTATION,
            Doing::Searching(search) => search.step.action(),
        }
    }

    /// Whether anything may change by itself.
    pub(super) const fn is_under_way(&self) -> bool {
        self.speed != 0.0 || !matches!(self.doing, Doing::Nothing) || self.written.kind.p5 & p5::SEARCHES != 0
    }

    /// Whether it stands, and is told nothing that could change that.
    pub(super) fn is_at_rest(&self) -> bool {
        self.speed == 0.0 && !matches!(self.doing, Doing::Searching(_))
    }

    /// Calls the place where it stands so.
    pub(super) fn preset(&mut self, position: i32) {
        self.counter = f64::from(position);
    }

    /// The answer to whoever asks where it is, which tells once that it was stopped.
    pub(super) fn tell_position(&mut self, motor: u8) -> PositionTold {
        let stop = u8::from(std::mem::take(&mut self.was_stopped));
        PositionTold { motor, position: self.position(), action: self.action(), stop }
    }

    /// Begins to search zero.
    pub(super) fn search(&mut self) {
        let step = if self.written.kind.p6 & p6::MECH_REF != 0 {
            SearchStep::Mechanical
        } else if self.is_switch_active() {
            SearchStep::Leave
        } else {
            SearchStep::Seek
        };
        self.doing = Doing::Searching(Search::begun_with(step));
    }

    /// Stops a search; any other is left to go on.
    pub(super) fn abort_search(&mut self) {
        if matches!(self.doing, Doing::Searching(_)) {
            self.halt();
        }
    }

    /// At once.
    fn halt(&mut self) {
        (self.doing, self.speed) = (Doing::Nothing, 0.0);
    }

    /// A loop is over `at` a time: it has moved for 2 ms, and chooses the speed of the next.
    pub(super) fn run(&mut self, clock_divider: u8, at: MonoTime) {
        let unit = steps_of_a_unit(clock_divider) / f64::from(1_u32 << self.written.start.div.min(16));
        let steps_a_unit = unit * LOOP.as_secs_f64();
        self.counter += self.speed * steps_a_unit;
        self.shaft.turn(self.speed * unit, LOOP, at);
        self.mind_switch();
        self.choose(steps_a_unit);
    }

    fn choose(&mut self, steps_a_unit: f64) {
        match self.doing {
            Doing::Nothing => self.speed = 0.0,
            Doing::Following(target) => {
                let distance = target.saturating_sub(self.position());
                let by = distance / i32::from(self.written.pi.propdiv.max(1));
                self.speed = f64::from(by.clamp(-MOST_SPEED, MOST_SPEED));
            }
            Doing::Turning(speed) => {
                // A unit makes no more (manual, page 28).
                let most = f64::from(MOST_SPEED);
                self.speed_up(f64::from(speed).clamp(-most, most));
                if self.speed == 0.0 && speed == 0 {
                    self.doing = Doing::Nothing;
                }
            }
            Doing::Ramp(target, part) => {
                let most = f64::from(self.written.ramp.vmax.clamp(1, 511));
                self.ramp(f64::from(target), (part * most, part * self.amax()), steps_a_unit);
            }
            Doing::Searching(search) => self.search_on(search, steps_a_unit),
        }
    }

    /// Units by which ramps change the speed in a loop.
    fn amax(&self) -> f64 {
        f64::from(self.written.ramp.amax.max(1))
    }

    /// Towards a speed, by the greatest acceleration.
    fn speed_up(&mut self, wanted: f64) {
        self.speed += (wanted - self.speed).clamp(-self.amax(), self.amax());
    }

    /// Towards a place, by so much speed and acceleration at the most, and stands once it is there.
    fn ramp(&mut self, target: f64, (most, amax): (f64, f64), steps_a_unit: f64) {
        let loops = (target - self.counter) / steps_a_unit;
        let (way, speed) = (loops.abs(), self.speed.abs());
        if way == 0.0 {
            self.halt();
        } else if way <= amax && speed <= 2.0 * amax {
            // With the last loop it is there; a unit makes single steps.
            self.speed = loops;
        } else {
            let braking = (2.0 * amax * way).sqrt() - amax;
            let wanted = braking.clamp(amax.min(most), most).copysign(loops);
            self.speed += (wanted - self.speed).clamp(-amax, amax);
        }
    }

    fn search_on(&mut self, mut search: Search, steps_a_unit: f64) {
        let MotorWritten { start, reference, kind, zero, .. } = self.written;
        let towards = if kind.p5 & p5::NULL_LEFT != 0 { -1.0 } else { 1.0 };
        let slow = f64::from(start.vstart.clamp(1, reference.vrefmax.max(1)));
        let is_fast = kind.p6 & p6::FAST_REF != 0;
        let fast = if is_fast { f64::from(reference.vrefmax.clamp(1, 511)) } else { slow };
        search.travelled += self.speed.abs() * steps_a_unit;
        let is_over = kind.poslimit > 0 && search.travelled > 1.25 * f64::from(kind.poslimit);
        if let Some(step) = search.next(self.is_switch_active(), is_over) {
            search.enter(step);
            if step == SearchStep::Return {
                // Zero lies so far beside the edge, which is here.
                (self.counter, self.speed) = (-f64::from(zero.offset), 0.0);
            }
        }
        self.doing = Doing::Searching(search);
        match search.step {
            SearchStep::Leave | SearchStep::BackOff => self.speed_up(-towards * slow),
            SearchStep::Seek | SearchStep::Mechanical => self.speed_up(towards * fast),
            SearchStep::Creep => self.speed_up(towards * slow),
            SearchStep::Return => self.ramp(0.0, (slow, self.amax()), steps_a_unit),
        }
    }

    /// Writes a setting of it; what is none changes nothing.
    pub(super) fn write(&mut self, setting: SixpackCommand) {
        let written = &mut self.written;
        match setting {
            SixpackCommand::StartSettings(told) => written.start = told,
            SixpackCommand::RampSettings(told) => written.ramp = told,
            SixpackCommand::ReferenceSettings(told) => written.reference = told,
            SixpackCommand::ZeroSettings(told) => written.zero = told,
            SixpackCommand::PiSettings(told) => written.pi = told,
            SixpackCommand::PeakCurrent(told) => written.peak = Some(told),
            SixpackCommand::CurrentSettings(told) => written.currents = Some(told),
            SixpackCommand::MotorSettings(told) => {
                written.kind = told;
                if told.p5 & p5::AUTONULL_CMD != 0 {
                    self.search_by_itself();
                }
            }
            _ => {}
        }
    }

    /// Whether its switch says that it is at zero, by the level it was told.
    fn is_switch_active(&self) -> bool {
        self.shaft.level() == (self.written.kind.p6 & p6::NULL_POSITIVE != 0)
    }

    /// Stops it, and has it search by itself, where its settings say so (motor parameters, page 38).
    fn mind_switch(&mut self) {
        let kind = self.written.kind;
        if matches!(self.doing, Doing::Searching(_)) {
            return;
        }
        let is_active = self.is_switch_active();
        let is_near = self.position().unsigned_abs() <= u32::from(self.written.zero.range);
        let stops_null = kind.p5 & p5::STOP_NULL != 0 && is_active && !is_near;
        let is_ready = matches!(self.doing, Doing::Nothing);
        let tests_null = kind.p5 & p5::TEST_NULL != 0 && is_ready && is_near && !is_active;
        if !stops_null && !tests_null {
            return;
        }
        self.was_stopped = true;
        if kind.p6 & p6::STOP_NO_REF == 0 {
            self.search_by_itself();
        } else if kind.p6 & p6::STOP_SOFT != 0 {
            self.doing = Doing::Turning(0);
        } else {
            self.halt();
        }
    }

    /// Begins a search that nobody asked for now.
    fn search_by_itself(&mut self) {
        self.own_searches += 1;
        self.search();
    }
}
