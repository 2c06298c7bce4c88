//! Homing: writes 0 to DPF0 and waits until it reads 2 (SMC manual 2.3.3). What the controller then does is PA0e's to
//! say: search its zero, or go there without a search. Either way the seat moves by itself, over its whole stroke.

use std::time::Duration;

use super::settings::Values;
use super::survey::told;
use super::talk::Link;
use super::{
    Address, Fault, Patience, RegisterAnswer, Request, RequestOutcome, Talk, places, position_words_of,
    reads, refusal,
};
use crate::config::{Controller, Station};
use crate::time::{Clock, MonoTime};
use crate::wire::{DeviceError, Dialect, ReplyCode, position};

/// The control register that resets, and tells when it is done.
pub(crate) const DPF0: Address = Address::Dp(0xf0);
/// What a reset does: 0 searches zero, 1 goes there without a search.
pub(crate) const PA0E: Address = Address::Pa(0x0e);
/// How long homing may take before it is given up.
pub(crate) const TIMEOUT: Duration = Duration::from_secs(60);

/// What is written to DPF0, and what it reads when homing is complete.
const START: u16 = 0;
const COMPLETE: u16 = 2;
/// An axis that turns is at its 0 within so much: what its motor holds.
pub(crate) const AT_ZERO_DEG: f64 = 0.2;
/// What a person does where homing would wind up a turntable.
pub(crate) const UNTURN: &str = "park first, or turn it by hand until it is read at 0; if its 0 is wrong, turn it to where that is to be, \
                                 and switch its controller off and on";
/// From one look at DPF0 to the next.
const POLL: Duration = Duration::from_millis(200);
/// A look is not repeated: the next one comes soon.
const LOOK: Patience = Patience { timeout: Duration::from_millis(200), tries: 1 };
/// Looks in a row that must tell of completion: the first may still tell of the homing before.
const LOOKS: u32 = 2;

/// Why a seat is not home.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum HomeError {
    /// It did not take the order.
    #[error(transparent)]
    Order(#[from] Fault),
    /// Something is wrong with it that homing does not mend.
    #[error("cannot home: {}", refusal(*code, *error, *dialect))]
    State {
        /// Its reply code.
        code: ReplyCode,
        /// Its error number.
        error: DeviceError,
        /// By which the code is to be read.
        dialect: Dialect,
    },
    /// It would go to where it believes zero to be.
    #[error(
        "would go to zero without a search (PA0e = {0}), wherever zero has been since power-on; set PA0e = 0 \
         (kinocue register write PA0e=0 --keep), then home. No seat was moved"
    )]
    Unsearched(u16),
    /// It would not tell how far it is.
    #[error("DPF0 cannot be read: {0}")]
    Unreadable(Fault),
    /// Time ran out.
    #[error("not home after {} s: {}", after.as_secs(), last(*dpf0))]
    Timeout {
        /// How long was waited.
        after: Duration,
        /// What DPF0 read last; `None` if it was never read.
        dpf0: Option<u16>,
    },
}

fn last(dpf0: Option<u16>) -> String {
    dpf0.map_or_else(
        || "it stopped answering; it may still be moving".to_owned(),
        |value| format!("DPF0 reads {value}, not {COMPLETE}; it may still be moving"),
    )
}

/// How far a seat is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Progress {
    /// It took the order.
    Started,
    /// It is on its way.
    Homing {
        /// Since the order.
        since: Duration,
        /// What DPF0 reads; `None` if a look had no answer.
        dpf0: Option<u16>,
    },
    /// It is home.
    Home {
        /// How long it took, within the time between two looks.
        after: Duration,
    },
    /// It is not, and is no longer waited for.
    Failed(HomeError),
}

/// One seat on its way.
struct SeatHoming {
    lane: usize,
    dialect: Dialect,
    started: MonoTime,
    complete: u32,
    dpf0: Option<u16>,
    result: Option<Result<Duration, HomeError>>,
}

/// Homes the controllers `lanes`, all at the same time, and waits for each at most `timeout`. Tells `on` of each step
/// with the lane's number; gives how long each took, in the order of `lanes`.
///
/// Nothing else moves the seats meanwhile, as long as the conversation holds the frame port.
pub(crate) fn home<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    lanes: &[(usize, Dialect)],
    timeout: Duration,
    on: &mut dyn FnMut(usize, &Progress),
) -> Vec<Result<Duration, HomeError>> {
    let mut seats = start(talk, lanes, on);
    let begun = talk.now();
    let mut next = begun + POLL;
    while seats.iter().any(|seat| seat.result.is_none()) {
        talk.wait(next, &mut |_, _, _| {});
        next = talk.now() + POLL;
        let open = seats.iter().filter(|seat| seat.result.is_none());
        let looks = open.map(|seat| (seat.lane, Request::read(DPF0))).collect();
        for outcome in talk.ask(looks, LOOK) {
            let seat = seats.iter_mut().find(|seat| seat.lane == outcome.lane);
            let seat = seat.expect("only the seats were asked");
            seat.on_look(outcome.result, talk.now(), timeout);
            seat.tell(talk.now(), on);
        }
    }
    seats.into_iter().map(|seat| seat.result.expect("the loop ends with the last of them")).collect()
}

/// The controllers among `lanes` that would not search their zero (PA0e), each with what is wrong. One that does not
/// answer is not among them: the order to home will tell.
pub(crate) fn unsearched<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    lanes: &[(usize, Dialect)],
) -> Vec<(usize, HomeError)> {
    let requests = lanes.iter().map(|(lane, _)| (*lane, Request::read(PA0E))).collect();
    let value = |answer: &RegisterAnswer| answer.words.first().copied().filter(|value| *value != 0);
    let told = talk.ask(requests, Patience::default()).into_iter();
    told.filter_map(|outcome| {
        Some((outcome.lane, HomeError::Unsearched(value(outcome.result.as_ref().ok()?)?)))
    })
    .collect()
}

/// Where axes that turn are read, and whether their controllers say that they know their zero: homing makes that place their 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Turn {
    /// The controller's place in the conversation.
    pub(crate) lane: usize,
    /// The axis, from 0.
    pub(crate) axis: usize,
    /// Where it is read, deg.
    pub(crate) at: f64,
    /// It is home, so that the place is believed.
    pub(crate) homed: bool,
}

impl Turn {
    /// True if homing would wind it up: its 0 would be elsewhere than it is known to be.
    pub(crate) fn winds_up(&self) -> bool {
        self.homed && self.at.abs() > AT_ZERO_DEG
    }
}

/// Asks where the axes of `controllers` that turn are. One that does not tell is not among them.
pub(crate) fn turns<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    controllers: &[Controller<Station>],
) -> Vec<Turn> {
    let turning = || controllers.iter().enumerate().filter(|(_, one)| one.seat.rotary_axis().is_some());
    let wanted = |one: &Controller<Station>| places(one.seat.axes).chain([DPF0]).collect::<Vec<_>>();
    let requests =
        turning().flat_map(|(lane, one)| reads(&wanted(one)).into_iter().map(move |read| (lane, read)));
    let mut found = vec![Values::new(); controllers.len()];
    for RequestOutcome { lane, request, result } in talk.ask(requests.collect(), Patience::default()) {
        if let Ok(answer) = result {
            found[lane].extend(told(&request, &answer));
        }
    }
    let of = |(lane, one): (usize, &Controller<Station>)| {
        let axis = one.seat.rotary_axis()?;
        let words = *position_words_of(&found[lane], one.seat.axes)?.get(axis)?;
        let geometry = &one.seat.each[axis];
        let at = geometry.place(geometry.fraction(position(words, one.connection.dialect)));
        Some(Turn { lane, axis, at, homed: found[lane].get(&DPF0) == Some(&COMPLETE) })
    };
    turning().filter_map(of).collect()
}

fn start<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    lanes: &[(usize, Dialect)],
    on: &mut dyn FnMut(usize, &Progress),
) -> Vec<SeatHoming> {
    let orders = lanes.iter().map(|(lane, _)| (*lane, Request::write(DPF0, START))).collect();
    let outcomes = talk.ask(orders, Patience::default());
    let started = talk.now();
    let seats = outcomes.into_iter().zip(lanes).map(|(outcome, &(lane, dialect))| {
        let mut seat = SeatHoming { lane, dialect, started, complete: 0, dpf0: None, result: None };
        match outcome.result {
            Ok(answer) => seat.check(&answer),
            Err(fault) => seat.result = Some(Err(fault.into())),
        }
        match &seat.result {
            None => on(lane, &Progress::Started),
            Some(_) => seat.tell(started, on),
        }
        seat
    });
    seats.collect()
}

/// What keeps a controller that answered so from homing, where anything does.
#[must_use]
pub(crate) fn hindrance(answer: &RegisterAnswer, dialect: Dialect) -> Option<HomeError> {
    let &RegisterAnswer { code, error, .. } = answer;
    let hopeless = match code {
        ReplyCode::Running => false,
        ReplyCode::EmergencyStop | ReplyCode::Command => true,
        // Err17 and Err21 go with the reset, Err20 by itself; an error of a drive stays (chapter 6 of both manuals).
        ReplyCode::Fault => (1..=15).contains(&error.0),
    };
    hopeless.then_some(HomeError::State { code, error, dialect })
}

impl SeatHoming {
    /// Ends homing where the controller is in a state that it cannot leave by itself.
    fn check(&mut self, answer: &RegisterAnswer) {
        if let Some(error) = hindrance(answer, self.dialect) {
            self.result = Some(Err(error));
        }
    }

    fn on_look(&mut self, look: Result<RegisterAnswer, Fault>, at: MonoTime, timeout: Duration) {
        let since = at.since(self.started);
        match look {
            Ok(answer) => {
                self.dpf0 = answer.words.first().copied();
                self.complete = if self.dpf0 == Some(COMPLETE) { self.complete + 1 } else { 0 };
                self.check(&answer);
            }
            Err(fault) if fault.refused() || fault.is_foreign() => {
                self.result = Some(Err(HomeError::Unreadable(fault)))
            }
            Err(_) => (self.dpf0, self.complete) = (None, 0),
        }
        if self.result.is_none() && self.complete >= LOOKS {
            self.result = Some(Ok(since));
        }
        if self.result.is_none() && since >= timeout {
            self.result = Some(Err(HomeError::Timeout { after: timeout, dpf0: self.dpf0 }));
        }
    }

    fn tell(&self, at: MonoTime, on: &mut dyn FnMut(usize, &Progress)) {
        let progress = match &self.result {
            None => Progress::Homing { since: at.since(self.started), dpf0: self.dpf0 },
            Some(Ok(after)) => Progress::Home { after: *after },
            Some(Err(error)) => Progress::Failed(error.clone()),
        };
        on(self.lane, &progress);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::testing::{Rig, millis};
    use crate::sim::Setup;

    fn run(rig: &Rig, timeout: Duration) -> Vec<Result<Duration, HomeError>> {
        let lanes: Vec<_> = (0..rig.lanes()).map(|lane| (lane, Dialect::Smc)).collect();
        home(&mut rig.talk(), &lanes, timeout, &mut |_, _| {})
    }

    #[test]
    fn a_seat_is_home_when_dpf0_reads_2_and_not_before() {
        let rig = Rig::of(vec![Setup::default()]);
        let mut steps = Vec::new();
        let lanes = [(0, Dialect::Smc)];
        let result = home(&mut rig.talk(), &lanes, TIMEOUT, &mut |_, step| steps.push(step.clone()));
        let after = result[0].clone().unwrap();
        assert!((millis(500)..millis(1_200)).contains(&after), "{after:?}");
        assert_eq!(steps[0], Progress::Started);
        assert!(matches!(steps[1], Progress::Homing { dpf0: Some(1), .. }), "{:?}", steps[1]);
        assert_eq!(steps.last(), Some(&Progress::Home { after }));
    }

    #[test]
    fn a_dead_controller_holds_up_no_other() {
        let rig = Rig::of(vec![Setup::default(), Setup { mute: true, ..Setup::default() }, Setup::default()]);
        let results = run(&rig, TIMEOUT);
        assert!(results[0].is_ok() && results[2].is_ok());
        assert!(matches!(results[1], Err(HomeError::Order(Fault::Silent { .. }))));
        assert!(rig.elapsed() < Duration::from_secs(4), "{:?}", rig.elapsed());
    }

    #[test]
    fn a_controller_that_stops_answering_is_waited_for_until_the_time_is_up() {
        let rig = Rig::of(vec![Setup::default()]);
        rig.filter(|nth, reply| if nth < 3 { vec![reply] } else { vec![] });
        let results = run(&rig, Duration::from_secs(5));
        assert_eq!(results[0], Err(HomeError::Timeout { after: Duration::from_secs(5), dpf0: None }));
        assert!(rig.elapsed() < Duration::from_secs(8), "{:?}", rig.elapsed());
    }

    #[test]
    fn an_emergency_stop_ends_homing_in_words() {
        let rig = Rig::of(vec![Setup { estop_at: Some(Duration::ZERO), ..Setup::default() }]);
        let error = run(&rig, TIMEOUT)[0].clone().unwrap_err().to_string();
        assert_eq!(error, "cannot home: an emergency stop is in effect (x = 4)");
    }

    #[test]
    fn a_controller_that_would_not_search_its_zero_is_named_before_anything_moves() {
        let without = Setup { parameters: vec![(0x0e, 1)], ..Setup::default() };
        let mute = Setup { mute: true, ..Setup::default() };
        let rig = Rig::of(vec![Setup::default(), without, mute]);
        let lanes: Vec<_> = (0..3).map(|lane| (lane, Dialect::Smc)).collect();
        let found = unsearched(&mut rig.talk(), &lanes);
        assert_eq!(found, [(1, HomeError::Unsearched(1))]);
        assert!(found[0].1.to_string().contains("without a search (PA0e = 1)"));
    }

    #[test]
    fn a_completion_told_once_and_then_taken_back_is_none() {
        let rig = Rig::of(vec![Setup::default()]);
        let mut told = 0;
        rig.filter(move |_, mut reply| {
            if reply.len() == 18 && reply[4] == 0x11 && told == 0 {
                reply[17] = 2; // left over from the homing before
                told = 1;
            }
            vec![reply]
        });
        let after = run(&rig, TIMEOUT)[0].clone().unwrap();
        assert!(after >= millis(500), "{after:?}");
    }
}
