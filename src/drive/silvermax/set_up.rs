//! The settings of the units of a seat: written where a person is, at rest, and read back (command reference, pages 47 to 75).

use super::look::UnitFacts;
use super::scale::DriveScale;
use super::talk::{Answer, Talk, TalkFault};
use crate::config::drive::homing::HomeWay;
use crate::config::drive::{SeatDrive, SilverMaxDrive};
use crate::drive::TICK_NS;
use crate::drive::link::{HomedAs, LinkPort, sum_of};
use crate::motion::{AxisGeometry, SeatType};
use crate::wire::silvermax::register::{
    self, CANARY, DRY_BRAKE, ERROR_LIMITS, KILL_CAUSE, MARK, QUEUE_SOURCE, SOFT_LIMIT_HIGH, SOFT_LIMIT_LOW,
    TORQUE_CLOSED, TORQUE_OPEN,
};
use crate::wire::silvermax::{Io, NakReason, Poll, Request, StatusWord, command, kill_names};

/// Bits of a canary that are a sum of settings.
pub(super) const HALF: i32 = 0xffff;

/// A seat, and the units that move it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SeatUnits<'a> {
    /// The name of its controller.
    pub(crate) name: &'a str,
    /// Those of seats that it may be taken for.
    pub(crate) twins: &'a [String],
    /// What it is.
    pub(crate) seat: &'a SeatType,
    /// How drives move it.
    pub(crate) drive: &'a SeatDrive,
    /// What its units are set to.
    pub(crate) silvermax: &'a SilverMaxDrive,
    /// The unit of each axis.
    pub(crate) units: &'a [u8],
}

/// What homing leaves in the registers of a unit that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UnitSettings {
    /// Its number.
    pub(crate) unit: u8,
    /// Torque limits, hold and moving a word each (206, 207).
    pub(crate) torque: i32,
    /// Error limits, moving and holding a word each (208).
    pub(crate) error_limits: i32,
    /// With what a dry queue brakes (19).
    pub(crate) dry_brake: i32,
    /// Soft limits, the lower first (38, 39).
    pub(crate) soft_limits: [i32; 2],
}

/// Why a seat is not home, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum HomeError {
    /// The line, or a unit.
    #[error(transparent)]
    Talk(#[from] TalkFault),
    /// A unit refused something.
    #[error("unit {unit} refused {what}: {reason}; check its own program and its firmware")]
    Refused {
        /// Who.
        unit: u8,
        /// The command, by its three letters.
        what: &'static str,
        /// Why.
        reason: NakReason,
    },
    /// Not known whether a move or a shift was taken.
    #[error("it is unknown whether unit {unit} took {what}; it was braked, home it again")]
    InDoubt {
        /// Who.
        unit: u8,
        /// The command, by its three letters.
        what: &'static str,
    },
    /// A setting reads back as another.
    #[error(
        "unit {unit}: register {number} ({name}) reads {found} after {wanted} was written; does another program \
         change it? Home again"
    )]
    ReadBack {
        /// Who.
        unit: u8,
        /// The register.
        number: u8,
        /// What it is.
        name: &'static str,
        /// As read.
        found: i32,
        /// As written.
        wanted: i32,
    },
    /// The seat type counts as no such drive does.
    #[error(
        "axis {axis}: a SilverMax cannot have {counts} counts per turn; set pulses_per_rev = 4000, 8000 or 16000"
    )]
    Counts {
        /// The axis, from 1.
        axis: usize,
        /// What the seat says.
        counts: f64,
    },
    /// A limit that a unit cannot keep.
    #[error("axis {axis}: an error of {mm} mm is {counts:.0} counts, over 32767; lower max_error_mm")]
    ErrorLimit {
        /// The axis, from 1.
        axis: usize,
        /// What the seat says.
        mm: f64,
        /// The same in counts.
        counts: f64,
    },
    /// Two with one number.
    #[error(
        "two units answer as unit {unit}; connect each alone to the line, and give one of them another number (IDT)"
    )]
    Twins {
        /// Their number.
        unit: u8,
    },
    /// Too hot.
    #[error("unit {unit} is too hot; let it cool, find out what loads it, then home")]
    Hot {
        /// Who.
        unit: u8,
    },
    /// The drive let go of its motor.
    #[error("unit {unit} was killed by {cause} (register 211); find out what blocks or heats it, then home")]
    Killed {
        /// Who.
        unit: u8,
        /// The conditions by name.
        cause: String,
    },
    /// The switch stays on.
    #[error(
        "unit {unit}: input {input} is still on after moving {travel_mm} mm away; check the switch and its wiring, and `active`"
    )]
    SwitchStaysOn {
        /// Who.
        unit: u8,
        /// The input.
        input: u8,
        /// How far it went.
        travel_mm: f64,
    },
    /// What was looked for is not there.
    #[error("unit {unit}: {what} not found within {travel_mm} mm; check it, its wiring, and `toward`")]
    NotFound {
        /// Who.
        unit: u8,
        /// What.
        what: String,
        /// How far it went.
        travel_mm: f64,
    },
    /// It moves on and on.
    #[error("unit {unit} still moves after {seconds:.0} s; it was braked; find out what slows it, then home")]
    TooLong {
        /// Who.
        unit: u8,
        /// The limit.
        seconds: f64,
    },
    /// It is elsewhere than it was sent.
    #[error(
        "unit {unit} is at {found_mm:.2} mm instead of {wanted_mm:.2}; find out what blocks it, then home"
    )]
    Elsewhere {
        /// Who.
        unit: u8,
        /// Where it is.
        found_mm: f64,
        /// Where it should be.
        wanted_mm: f64,
    },
    /// It has forgotten where it is, and how it was set.
    #[error(
        "unit {unit} was restarted while the seat was homed; check its supply (does it sag as the next motor starts?), then home again"
    )]
    Restarted {
        /// Who.
        unit: u8,
    },
    /// Its line leads elsewhere.
    #[error(transparent)]
    Another(#[from] HomedAs),
    /// A person stopped it.
    #[error("homing was stopped; the seat is not home")]
    Aborted,
    /// 0 cannot be told from a restart.
    #[error("the canary is 0, as after a restart of a unit; use another")]
    Canary,
}

/// An axis with its unit.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnitAxis<'a> {
    pub(super) unit: u8,
    pub(super) axis: &'a AxisGeometry,
    pub(super) scale: DriveScale,
    pub(super) of: SeatUnits<'a>,
}

impl<'a> SeatUnits<'a> {
    /// What homing leaves in its units.
    ///
    /// # Errors
    /// [`HomeError::Counts`], [`HomeError::ErrorLimit`] where no unit can be set so.
    pub(crate) fn settings(&self) -> Result<Vec<UnitSettings>, HomeError> {
        Ok(self.axes()?.iter().map(UnitAxis::settings).collect())
    }

    /// What a canary has in its lower half: another number once anything is that homing writes, or that places are measured by, and in
    /// each seat: where two lines change places, seats that are set alike are not taken for each other.
    pub(super) fn sum(&self) -> Result<i32, HomeError> {
        let homing = &self.drive.homing;
        let set: Vec<_> = self.axes()?.iter().map(|axis| (axis.scale, axis.settings())).collect();
        let [low, high, ..] =
            sum_of(&format!("{} {set:?} {} {:?}", self.name, homing.zero_mm, homing.toward)).to_le_bytes();
        Ok(u16::from_le_bytes([low, high]).into())
    }

    /// The number that homing leaves in its units: by chance, but for its lower half.
    pub(super) fn canary(&self, chance: i32) -> Result<i32, HomeError> {
        // Never 0, however it falls out.
        Ok(chance & !HALF | (HALF + 1) | self.sum()?)
    }

    /// Where the axis of a unit was read, and where that holds it, parts of its stroke; none of a unit that is not of the seat.
    pub(crate) fn places(&self, facts: &UnitFacts) -> Option<[f64; 2]> {
        let axes = self.axes().ok()?;
        let axis = axes.iter().find(|axis| axis.unit == facts.unit)?;
        Some([facts.position, facts.target].map(|counts| axis.scale.fraction(counts.into())))
    }

    /// One such number.
    #[cfg(test)]
    pub(crate) fn own_canary(&self) -> i32 {
        self.canary(77 << 16).unwrap()
    }

    /// The seat that was homed as its units hold it, where that is one that this may be taken for.
    pub(crate) fn homed_as(&self, canaries: &[i32]) -> Option<&'a str> {
        let is_whose = |name| canaries.iter().any(|canary| Self { name, ..*self }.is_own(*canary));
        self.twins.iter().map(String::as_str).find(|name| !is_whose(self.name) && is_whose(name))
    }

    /// True if a canary is one that homing with these settings leaves.
    pub(crate) fn is_own(&self, canary: i32) -> bool {
        self.canary(canary).is_ok_and(|own| own == canary)
    }

    /// Its axes.
    pub(super) fn axes(&self) -> Result<Vec<UnitAxis<'a>>, HomeError> {
        let pairs = self.seat.own().iter().zip(self.units).enumerate();
        let axis = |(index, (axis, unit)): (usize, (&'a AxisGeometry, &u8))| {
            let counts = HomeError::Counts { axis: index + 1, counts: axis.pulses_per_rev };
            let scale = DriveScale::of(axis, self.drive.reverse[index]).ok_or(counts)?;
            let (mm, most) = (self.silvermax.max_error_mm, f64::from(i16::MAX));
            let counts = scale.counts(mm).abs();
            if counts > most {
                return Err(HomeError::ErrorLimit { axis: index + 1, mm, counts });
            }
            Ok(UnitAxis { unit: *unit, axis, scale, of: *self })
        };
        pairs.map(axis).collect()
    }
}

/// Asks for what has to be taken, and may be done twice.
pub(super) fn write<P: LinkPort>(talk: &mut Talk<P>, unit: u8, request: Request) -> Result<(), HomeError> {
    let answer = talk.insist(unit, request)?;
    taken(unit, request, answer)
}

/// The same for what must not be done twice.
pub(super) fn write_once<P: LinkPort>(
    talk: &mut Talk<P>,
    unit: u8,
    request: Request,
) -> Result<(), HomeError> {
    let answer = match talk.exchange(unit, request) {
        Err(TalkFault::Link(fault)) => return Err(TalkFault::Link(fault).into()),
        Err(_) => talk.fence(unit, request)?,
        Ok(answer) => Some(answer),
    };
    let doubt = HomeError::InDoubt { unit, what: mnemonic(request) };
    taken(unit, request, answer.ok_or(doubt)?)
}

fn taken(unit: u8, request: Request, answer: Answer) -> Result<(), HomeError> {
    match answer {
        Answer::Nak(reason) => Err(HomeError::Refused { unit, what: mnemonic(request), reason }),
        Answer::Ack | Answer::Data(_) => Ok(()),
    }
}

fn mnemonic(request: Request) -> &'static str {
    command(request.number()).map_or("a command", |command| command.mnemonic)
}

impl UnitAxis<'_> {
    /// What homing leaves in its unit.
    fn settings(&self) -> UnitSettings {
        UnitSettings {
            unit: self.unit,
            torque: self.torque_words(None),
            error_limits: self.error_words(),
            dry_brake: self.brake().cast_signed(),
            soft_limits: self.soft_limits(),
        }
    }

    /// Before anything moves: what is wrong, then disarmed and held by its driver where it stands, with a mark that a restart
    /// takes away.
    pub(super) fn disarm<P: LinkPort>(&self, talk: &mut Talk<P>, mark: i32) -> Result<(), HomeError> {
        let unit = self.unit;
        write(talk, unit, Request::StopAtOnce)?;
        if talk.internal(unit)?.is_hot() {
            return Err(HomeError::Hot { unit });
        }
        let offset = i16::try_from(self.of.silvermax.gravity).unwrap_or_default();
        let requests = [
            Request::WriteRegister { register: MARK, value: mark },
            Request::ClearInternalStatus,
            Request::EnableMultiTasking,
            // On heat alone for now: the target may be far from where it stands.
            Request::KillConditions { enable: Io::COOL, state: 0 },
            // They lie before the switch: a second homing would end at them.
            Request::SoftLimitsOff,
            // What is given up half-way is not home.
            Request::WriteRegister { register: CANARY, value: 0 },
            self.torque(self.of.drive.homing.torque),
            self.error_limits(),
            Request::GravityOffset { offset },
            // Never the driver first: it jumps to where the target is (page 57).
            Request::TargetToPosition,
            Request::EnableDriver,
        ];
        requests.into_iter().try_for_each(|request| write(talk, unit, request))?;
        // What holds it up is somebody's leg: it must not make up for that at once when that lets go. A hard stop is found by the error.
        match self.of.drive.homing.way {
            HomeWay::HardStop => Ok(()),
            _ => self.kill_on_errors(talk, Io::MOVING_ERROR),
        }
    }

    /// Has the unit let go of its motor by itself on these errors, and where it is hot.
    fn kill_on_errors<P: LinkPort>(&self, talk: &mut Talk<P>, errors: u16) -> Result<(), HomeError> {
        write(talk, self.unit, Request::ClearInternalStatus)?;
        write(talk, self.unit, Request::KillConditions { enable: errors | Io::COOL, state: errors })
    }

    /// That it has not been restarted since it was disarmed. One bad digit looks so, too: twice is believed.
    pub(super) fn is_up_since<P: LinkPort>(&self, talk: &mut Talk<P>, mark: i32) -> Result<(), HomeError> {
        let mut has_mark = || talk.register(self.unit, MARK).map(|found| found == mark);
        if has_mark()? || has_mark()? { Ok(()) } else { Err(HomeError::Restarted { unit: self.unit }) }
    }

    /// The limits of a show, and the kill conditions.
    pub(super) fn arm<P: LinkPort>(&self, talk: &mut Talk<P>) -> Result<(), HomeError> {
        write(talk, self.unit, self.torque(None))?;
        write(talk, self.unit, self.error_limits())?;
        self.kill_on_errors(talk, Io::MOVING_ERROR | Io::HOLDING_ERROR)
    }

    /// Inside the stroke: what holds it there, read back; the canary last. One that was restarted meanwhile has lost its zero,
    /// wherever it says it is.
    pub(super) fn seal<P: LinkPort>(
        &self,
        talk: &mut Talk<P>,
        mark: i32,
        canary: i32,
    ) -> Result<(), HomeError> {
        let [low, high] = self.soft_limits();
        let written = [
            (SOFT_LIMIT_LOW, low),
            (SOFT_LIMIT_HIGH, high),
            (DRY_BRAKE, self.brake().cast_signed()),
            (QUEUE_SOURCE, 0),
        ];
        for (register, value) in written {
            write(talk, self.unit, Request::WriteRegister { register, value })?;
        }
        write(talk, self.unit, Request::SoftLimitsOn)?;
        let torque = self.torque_words(None);
        let settings = [(TORQUE_CLOSED, torque), (TORQUE_OPEN, torque), (ERROR_LIMITS, self.error_words())];
        let held = settings.into_iter().chain(written.into_iter().take(3));
        held.into_iter().try_for_each(|(number, wanted)| self.read_back(talk, number, wanted))?;
        self.is_up_since(talk, mark)?;
        write(talk, self.unit, Request::WriteRegister { register: CANARY, value: canary })?;
        self.read_back(talk, CANARY, canary)?;
        self.is_up_since(talk, mark)
    }

    fn read_back<P: LinkPort>(&self, talk: &mut Talk<P>, number: u8, wanted: i32) -> Result<(), HomeError> {
        let found = talk.register(self.unit, number)?;
        let name = register::name(number).unwrap_or("a register");
        let differs = HomeError::ReadBack { unit: self.unit, number, name, found, wanted };
        if found == wanted { Ok(()) } else { Err(differs) }
    }

    /// What happened since it was asked last; what killed is a fault.
    pub(super) fn happened<P: LinkPort>(&self, talk: &mut Talk<P>) -> Result<Poll, HomeError> {
        let poll = Poll(talk.word(self.unit, Request::Poll)?);
        if poll.has(Poll::KILLED) {
            let cause = kill_names(talk.register(self.unit, KILL_CAUSE)?);
            return Err(HomeError::Killed { unit: self.unit, cause });
        }
        Ok(poll)
    }

    /// Deceleration of a stop, and of a dry queue.
    pub(super) fn brake(&self) -> u32 {
        self.scale.acceleration(self.axis.max_acceleration)
    }

    #[expect(clippy::cast_possible_truncation, reason = "a stroke fits i32; saturating")]
    fn soft_limits(&self) -> [i32; 2] {
        let (low, high) = self.scale.reach(self.of.drive.margin_mm);
        [low.floor() as i32, high.ceil() as i32]
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "shares of at most 32767")]
    fn torque_limits(&self, share: Option<f64>) -> [u16; 2] {
        let torque = &self.of.silvermax.torque;
        let of = |share: f64| (share * f64::from(torque.full)).round().clamp(0.0, f64::from(i16::MAX)) as u16;
        [share.unwrap_or(torque.hold), share.unwrap_or(torque.moving)].map(of)
    }

    fn torque(&self, share: Option<f64>) -> Request {
        let [hold, moving] = self.torque_limits(share);
        Request::TorqueLimits { hold, moving }
    }

    fn torque_words(&self, share: Option<f64>) -> i32 {
        let [hold, moving] = self.torque_limits(share);
        two_words(hold, moving)
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "judged in axes()")]
    fn error_counts(&self) -> [u16; 2] {
        let SilverMaxDrive { max_error_mm, hold_error_mm, .. } = self.of.silvermax;
        [*max_error_mm, *hold_error_mm].map(|mm| self.scale.counts(mm).abs().round() as u16)
    }

    fn error_limits(&self) -> Request {
        let [moving, holding] = self.error_counts();
        let ticks = u64::from(self.of.silvermax.settle_ms) * 1_000_000 / u64::from(TICK_NS);
        let delay_ticks = u16::try_from(ticks).unwrap_or(u16::MAX);
        Request::ErrorLimits { moving, holding, delay_ticks }
    }

    fn error_words(&self) -> i32 {
        let [moving, holding] = self.error_counts();
        two_words(moving, holding)
    }
}

fn two_words(high: u16, low: u16) -> i32 {
    (u32::from(high) << 16 | u32::from(low)).cast_signed()
}
