//! What may be sent. What moves on when its sender is gone, what starts a search by itself, and what writes memory for good has
//! no place here.

use super::{
    AbortSearch, ActionsQuery, BaudSwitch, ClockDivider, CurrentSettings, InputQuery, JointStart,
    JointTarget, MotorSettings, PacketTimeout, PeakCurrent, PiSettings, PiTarget, PositionPreset,
    PositionQuery, RampSettings, ReferenceSearch, ReferenceSettings, Rotation, SixpackCommand, SixpackFrame,
    SixpackReply, StartSettings, UnitQuery, VelocityQuery, ZeroSettings, p5, p6,
};

/// What a unit may be told or asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SixpackOrder {
    /// `$10`.
    Peak(PeakCurrent),
    /// `$11`.
    Currents(CurrentSettings),
    /// `$12`.
    Clock(ClockDivider),
    /// `$13`.
    Start(StartSettings),
    /// `$14`.
    Ramp(RampSettings),
    /// `$15`. Sent so that it never searches by itself, whatever flags are here: without those of [`p5::SEARCHES`], and with
    /// [`p6::STOP_NO_REF`]; the page calls that bit 6 in two places, and it is safe by either reading.
    Motor(MotorSettings),
    /// `$16`.
    Reference(ReferenceSettings),
    /// `$18`.
    Zero(ZeroSettings),
    /// `$19`.
    Pi(PiSettings),
    /// `$20`.
    AskPosition(PositionQuery),
    /// `$21`.
    #[cfg_attr(not(test), expect(dead_code, reason = "positions tell as much"))]
    AskVelocity(VelocityQuery),
    /// `$22`.
    Search(ReferenceSearch),
    /// `$24`.
    Target(PiTarget),
    /// `$25` with 0, which stops by the ramp; with any other velocity a motor runs on without a host.
    RampedStop {
        /// Which motor.
        motor: u8,
    },
    /// `$26`.
    JointTarget(JointTarget),
    /// `$27`.
    Preset(PositionPreset),
    /// `$28`, to be answered at once.
    AskActions {
        /// The address of the answer.
        response: u8,
    },
    /// `$2B`.
    AbortSearch(AbortSearch),
    /// `$30`.
    AskInput(InputQuery),
    /// `$40`.
    Baud(BaudSwitch),
    /// `$41`.
    Timeout(PacketTimeout),
    /// `$43`.
    AskUnit(UnitQuery),
    /// `$50`.
    JointStart(JointStart),
}

impl SixpackOrder {
    /// The command that is sent.
    #[must_use]
    pub(crate) fn command(self) -> SixpackCommand {
        match self {
            Self::Peak(order) => order.into(),
            Self::Currents(order) => order.into(),
            Self::Clock(order) => order.into(),
            Self::Start(order) => order.into(),
            Self::Ramp(order) => order.into(),
            Self::Motor(order) => {
                let (p5, p6) = (order.p5 & !p5::SEARCHES, order.p6 | p6::STOP_NO_REF);
                MotorSettings { p5, p6, ..order }.into()
            }
            Self::Reference(order) => order.into(),
            Self::Zero(order) => order.into(),
            Self::Pi(order) => order.into(),
            Self::AskPosition(order) => order.into(),
            Self::AskVelocity(order) => order.into(),
            Self::Search(order) => order.into(),
            Self::Target(order) => order.into(),
            Self::RampedStop { motor } => Rotation { motor, velocity: 0 }.into(),
            Self::JointTarget(order) => order.into(),
            Self::Preset(order) => order.into(),
            Self::AskActions { response } => ActionsQuery { response, delay_mask: 0 }.into(),
            Self::AbortSearch(order) => order.into(),
            Self::AskInput(order) => order.into(),
            Self::Baud(order) => order.into(),
            Self::Timeout(order) => order.into(),
            Self::AskUnit(order) => order.into(),
            Self::JointStart(order) => order.into(),
        }
    }

    /// As it is sent to a unit.
    #[must_use]
    pub(crate) fn frame(self, unit: u8) -> SixpackFrame {
        self.command().frame(unit)
    }

    /// The answer, if a frame is that.
    #[must_use]
    pub(crate) fn answered_by(self, frame: SixpackFrame) -> Option<SixpackReply> {
        self.command().answered_by(frame)
    }
}
