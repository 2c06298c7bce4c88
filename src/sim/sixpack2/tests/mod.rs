//! Units in virtual time, led as a host would, and by anything.

mod chance;
mod line;
mod motion;
mod search;
mod unit;

use std::time::Duration;

use super::motor::{LOOP, MotorWritten};
use super::unit::UnitBooks;
use super::*;
use crate::wire::sixpack2::*;

const UNIT: u8 = 1;
const ANSWER: u8 = 2;
const MS: fn(u64) -> Duration = Duration::from_millis;
/// Microsteps a millimetre.
const MM: f64 = 640.0;

/// A bus, and whoever leads it.
struct Host {
    bus: SixpackBus,
    now: MonoTime,
}

impl Host {
    fn of(setup: SixpackSetup) -> Self {
        let now = MonoTime::from_nanos(1_000_000_000);
        Self { bus: SixpackBus::waking([setup], now), now }
    }

    fn with(shaft: ShaftSetup) -> Self {
        Self::of(SixpackSetup { shafts: [shaft; MOTORS], ..setup() })
    }

    fn wait(&mut self, span: Duration) {
        self.now = self.now + span;
        self.bus.advance(self.now);
    }

    fn octets(&mut self, octets: &[u8]) {
        for octet in octets {
            self.wait(Duration::from_nanos(10_000_000_000 / u64::from(self.bus.baud())));
            self.bus.on_octet(*octet, self.now);
        }
    }

    /// Nothing of it is checked: what may never be sent goes this way, too.
    fn tell(&mut self, command: impl Into<SixpackCommand>) {
        self.octets(&command.into().frame(UNIT).octets());
    }

    fn order(&mut self, order: SixpackOrder) {
        self.octets(&order.frame(UNIT).octets());
    }

    /// What is answered within so long.
    fn hear(&mut self, patience: Duration) -> Vec<u8> {
        let until = self.now + patience;
        let mut heard = Vec::new();
        while self.now < until {
            self.wait(Duration::from_micros(100));
            heard.extend(std::iter::from_fn(|| self.bus.take_octet(self.now)));
        }
        heard
    }

    fn ask(&mut self, order: SixpackOrder) -> Option<SixpackReply> {
        self.order(order);
        let octets: [u8; FRAME_LEN] = self.hear(MS(20)).try_into().ok()?;
        order.answered_by(SixpackFrame::from_octets(octets))
    }

    fn position(&mut self, motor: u8) -> PositionTold {
        let query = PositionQuery { motor, response: ANSWER };
        let reply = self.ask(SixpackOrder::AskPosition(query));
        let Some(SixpackReply::PositionTold(told)) = reply else { panic!("{reply:?}") };
        told
    }

    fn identity(&mut self) -> Option<UnitTold> {
        let reply = self.ask(SixpackOrder::AskUnit(UnitQuery { response: ANSWER }));
        reply.map(|reply| if let SixpackReply::UnitTold(told) = reply { told } else { panic!("{reply:?}") })
    }

    fn unit(&self) -> &SixpackUnit {
        &self.bus.units()[0]
    }

    fn motor(&self, motor: usize) -> &SixpackMotor {
        &self.unit().motors[motor]
    }

    fn suffer(&mut self, fault: SixpackFault) {
        let now = self.now;
        self.bus.suffer(Some(UNIT), fault, now);
    }

    /// All that a home writes for a motor, its zero to the left.
    fn settle(&mut self, motor: u8) {
        let flags = (p5::NULL_LEFT | p5::FILTER_SWITCH, p6::FAST_REF | p6::STOP_SOFT | p6::NULL_POSITIVE);
        for order in [
            SixpackOrder::Clock(ClockDivider { divider: 3 }),
            SixpackOrder::Ramp(RampSettings { motor, amax: 5, vmax: 128 }),
            SixpackOrder::Motor(MotorSettings { motor, poslimit: 105_600, p5: flags.0, p6: flags.1 }),
            SixpackOrder::Reference(ReferenceSettings { motor, vrefmax: 60, debounce: 4_095, stop_after: 1 }),
            SixpackOrder::Zero(ZeroSettings { motor, offset: 0, range: 64 }),
            SixpackOrder::Pi(PiSettings { motor, propdiv: 12, intdiv: 129, intclip: 129, intinpclip: 1 }),
        ] {
            self.order(order);
        }
    }

    /// Until a motor does nothing.
    fn await_idle(&mut self, motor: u8, patience: Duration) {
        let until = self.now + patience;
        while self.position(motor).action != action::IDLE {
            assert!(self.now < until, "{:?}", self.motor(usize::from(motor)));
            self.wait(MS(50));
        }
    }
}

fn setup() -> SixpackSetup {
    let shafts = [ShaftSetup::default(); MOTORS];
    SixpackSetup { unit: UNIT, serial: 4_660, shafts, is_two_wires: false, can_baud: None }
}

fn target(motor: u8, target: i32) -> SixpackOrder {
    SixpackOrder::Target(PiTarget { motor, target })
}

fn search(motor: u8) -> SixpackOrder {
    SixpackOrder::Search(ReferenceSearch { motor })
}

/// Safe settings but for these flags.
fn flags(p5: u8, p6: u8) -> MotorSettings {
    MotorSettings { motor: 0, poslimit: 105_600, p5, p6 }
}
