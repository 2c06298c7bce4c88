//! A controller that passes, to be spoilt by tests.

use std::net::Ipv4Addr;
use std::sync::Arc;
use std::time::Duration;

use super::{Finding, ShowTerms, Subject, judge, wanted};
use crate::config::{Controller, Station, from_to_args};
use crate::device::home::DPF0;
use crate::device::survey::{ROUNDS, Survey};
use crate::device::{Address, table};
use crate::motion::SeatType;
use crate::net::Route;
use crate::wire::Dialect;

/// This machine, as the controllers see it.
pub(super) const HOST: Ipv4Addr = Ipv4Addr::new(192, 168, 15, 101);
pub(super) const PORT: u16 = 8_410;

/// Settings that differ from the factory's and are safe.
const SAFE: [(u8, u16); 8] =
    [(0x04, 0), (0x06, 0), (0x90, 1), (0x91, 2), (0x92, 1), (0x93, 20), (0x94, 300), (0x07, 2_880)];
/// The same, of SMC controllers alone.
const SAFE_SMC: [(u8, u16); 3] = [(0x00, 10), (0x1e, 100), (0x1f, 1)];

/// And of MBOX controllers.
const SAFE_MBOX: [(u8, u16); 1] = [(0x51, 0)];

/// One controller with all that preflight knows of it.
pub(super) struct Case {
    pub(super) controller: Controller<Station>,
    pub(super) axes: Option<usize>,
    pub(super) survey: Survey,
    pub(super) route: Result<Route, String>,
    pub(super) terms: ShowTerms,
}

impl Case {
    pub(super) fn new(dialect: Dialect) -> Self {
        let to = ["192.168.15.201:7408,name=A1".to_owned()];
        let mut controller = from_to_args(&to, &[], 3).unwrap().stations().remove(0);
        controller.connection.dialect = dialect;
        controller.estop_inputs = u16::from(dialect == Dialect::Mbox);
        controller.seat = Arc::new(SeatType::bench3(3));
        let factory = |address: Address| {
            (address, table().get(address).and_then(|it| it.default(dialect)).unwrap_or(0))
        };
        let mut survey = Survey {
            values: wanted(&controller).into_iter().map(factory).collect(),
            round_trips: vec![Duration::from_micros(300); ROUNDS],
            rounds: ROUNDS,
            foreign_packets: (dialect == Dialect::Smc).then_some(0),
            ..Survey::default()
        };
        survey.reported.reports = u64::from(dialect == Dialect::Smc);
        let of_dialect: &[_] = if dialect == Dialect::Smc { &SAFE_SMC } else { &SAFE_MBOX };
        survey.values.insert(DPF0, 2);
        let of_axes = (0x80..=0x85).map(|number| (number, 2_880)).filter(|_| dialect == Dialect::Smc);
        for (number, value) in SAFE.into_iter().chain(of_dialect.iter().copied()).chain(of_axes) {
            survey.values.insert(Address::Pa(number), value);
        }
        Self {
            controller,
            axes: Some(3),
            survey,
            route: Ok(Route { local: HOST, mtu: 1_500 }),
            terms: ShowTerms { frame_port: PORT, rate_hz: 100.0, cue: None },
        }
    }

    pub(super) fn smc() -> Self {
        Self::new(Dialect::Smc)
    }

    /// With parameters of its own.
    pub(super) fn with(mut self, parameters: &[(u8, u16)]) -> Self {
        self.survey.values.extend(parameters.iter().map(|(number, value)| (Address::Pa(*number), *value)));
        self
    }

    pub(super) fn subject(&self) -> Subject<'_> {
        Subject {
            controller: &self.controller,
            axes: self.axes,
            route: self.route.clone(),
            survey: Some(&self.survey),
        }
    }

    pub(super) fn findings(&self) -> Vec<Finding> {
        judge(&[self.subject()], &self.terms, &[]).remove(0)
    }

    /// What is found beyond mere news.
    pub(super) fn told(&self) -> Vec<Finding> {
        self.findings().into_iter().filter(|finding| finding.severity() > super::Severity::Info).collect()
    }
}
