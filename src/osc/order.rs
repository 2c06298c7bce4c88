//! A message into what it asks.

use rosc::{OscMessage, OscType};

use crate::config::GearWord;
use crate::control::{Command, LevelsChange};
use crate::time::{ShowTime, TRIM_FRAMES};

/// The longest that a subscription lasts before it has to be renewed, s.
const LONGEST_S: u16 = 3_600;

/// What a message asks.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum OscOrder {
    /// Of the hall.
    Command(Command),
    /// Feedback to that port of its sender, for so many seconds; 0 ends it.
    Subscribe { port: u16, seconds: u16 },
    /// Nothing: a button was let go.
    Released,
}

/// Why a message is not obeyed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum OscFault {
    #[error("{0:?} is not an address of kinocue; docs/show-control.md lists them")]
    Unknown(String),
    #[error("OSC may never {0}; a person does that on the console or with `kinocue {0}`")]
    Forbidden(&'static str),
    #[error("{0:?} is not allowed here; list it in `allow` of [osc]")]
    NotAllowed(String),
    #[error("{address:?} takes {wanted}")]
    Argument { address: String, wanted: &'static str },
    #[error("{0:?} was in a bundle for a later time, and nothing is scheduled here; send it when it is due")]
    Early(String),
    #[error("{0} receivers of feedback are subscribed already; let one lapse")]
    Crowded(usize),
    #[error("too many messages wait; {0:?} was not done, send it again")]
    Busy(String),
}

/// What `message` asks, of what is allowed.
pub(super) fn order(message: &OscMessage, allow: &[GearWord]) -> Result<OscOrder, OscFault> {
    let unknown = || OscFault::Unknown(message.addr.clone());
    let path = message.addr.strip_prefix("/kinocue/").ok_or_else(unknown)?;
    let parts: Vec<&str> = path.split('/').collect();
    let taken = Taken { message, allow };
    match parts[..] {
        ["stop"] => Ok(taken.stop()),
        ["go"] => taken.button(Command::Go),
        ["pause"] => taken.button(Command::Pause),
        ["resume"] => taken.button(Command::Resume),
        ["park"] => taken.button(Command::Park),
        ["mark"] => taken.button(Command::Mark { text: None }),
        ["seek"] => taken.allowed(GearWord::Seek)?.seek(),
        ["trim"] => taken.allowed(GearWord::Trim)?.trim(),
        ["nudge"] => taken.allowed(GearWord::Trim)?.nudge(),
        ["subscribe"] => taken.subscribe(),
        ["level", "motion"] => taken.levels(|motion| LevelsChange { motion: Some(motion), ..<_>::default() }),
        ["level", "vibration"] => {
            taken.levels(|vibration| LevelsChange { vibration: Some(vibration), ..<_>::default() })
        }
        ["row", row, "level"] if !row.is_empty() => {
            taken.levels(|level| LevelsChange { rows: [(row.to_owned(), level)].into(), ..<_>::default() })
        }
        ["effect", name] if !name.is_empty() => {
            let on = taken.allowed(GearWord::Levels)?.switch()?;
            let effects = [(name.to_owned(), on)].into();
            Ok(OscOrder::Command(Command::Levels(LevelsChange { effects, ..<_>::default() })))
        }
        ["seat", name, "enable"] if !name.is_empty() => {
            let on = taken.allowed(GearWord::Seats)?.switch()?;
            let name = name.to_owned();
            Ok(OscOrder::Command(if on {
                Command::Enable(name)
            } else {
                Command::Disable { name, why: None }
            }))
        }
        _ => Err(match Command::OF_PEOPLE.into_iter().find(|word| *word == parts[0]) {
            Some(word) => OscFault::Forbidden(word),
            None => unknown(),
        }),
    }
}

/// A message whose address is known.
#[derive(Clone, Copy)]
struct Taken<'m> {
    message: &'m OscMessage,
    allow: &'m [GearWord],
}

impl Taken<'_> {
    fn allowed(self, word: GearWord) -> Result<Self, OscFault> {
        if self.allow.contains(&word) {
            Ok(self)
        } else {
            Err(OscFault::NotAllowed(self.message.addr.clone()))
        }
    }

    /// Without an argument, or with one that says whether a button went down or up.
    fn button(self, ask: Command) -> Result<OscOrder, OscFault> {
        ask.gear_word().map_or(Ok(self), |word| self.allowed(word))?;
        let pressed = match self.message.args.as_slice() {
            [] => true,
            [value] => switch(value).ok_or_else(|| self.wants("nothing, or 1 for a pressed button"))?,
            _ => return Err(self.wants("nothing, or 1 for a pressed button")),
        };
        Ok(if pressed { OscOrder::Command(ask) } else { OscOrder::Released })
    }

    /// Whatever comes with it, unless that says that a button came up.
    fn stop(self) -> OscOrder {
        match self.message.args.as_slice() {
            [value] if switch(value) == Some(false) => OscOrder::Released,
            _ => OscOrder::Command(Command::Stop),
        }
    }

    fn seek(self) -> Result<OscOrder, OscFault> {
        let at = self.number().filter(|&s| (0.0..=1e6).contains(&s));
        let at = at.ok_or_else(|| self.wants("a position in seconds, 0 or more"))?;
        Ok(OscOrder::Command(Command::Seek(ShowTime::from_secs_f64(at))))
    }

    fn trim(self) -> Result<OscOrder, OscFault> {
        let ms = self.number().filter(|ms| (-500.0..=500.0).contains(ms));
        let ms = ms.ok_or_else(|| self.wants("milliseconds, -500 to 500"))?;
        #[expect(clippy::cast_possible_truncation, reason = "it is within -500 to 500")]
        Ok(OscOrder::Command(Command::Trim(ms.round() as i32)))
    }

    fn nudge(self) -> Result<OscOrder, OscFault> {
        let most = f64::from(TRIM_FRAMES);
        let frames = self.number().filter(|frames| (-most..=most).contains(frames) && frames.fract() == 0.0);
        let frames = frames.ok_or_else(|| self.wants("whole frames of the film, -12 to 12"))?;
        #[expect(clippy::cast_possible_truncation, reason = "it is a whole number within -12 to 12")]
        Ok(OscOrder::Command(Command::Nudge(frames as i32)))
    }

    fn levels(self, change: impl FnOnce(f64) -> LevelsChange) -> Result<OscOrder, OscFault> {
        let taken = self.allowed(GearWord::Levels)?;
        let level = taken.number().filter(|level| (0.0..=1.0).contains(level));
        let level = level.ok_or_else(|| taken.wants("a level, 0 to 1"))?;
        Ok(OscOrder::Command(Command::Levels(change(level))))
    }

    fn subscribe(self) -> Result<OscOrder, OscFault> {
        let wants = || self.wants("a port, 1 to 65535, and seconds, 0 to 3600");
        let [OscType::Int(port), OscType::Int(seconds)] = self.message.args.as_slice() else {
            return Err(wants());
        };
        let port = u16::try_from(*port).ok().filter(|&port| port > 0).ok_or_else(wants)?;
        let seconds = u16::try_from(*seconds).ok().filter(|&s| s <= LONGEST_S).ok_or_else(wants)?;
        Ok(OscOrder::Subscribe { port, seconds })
    }

    fn switch(self) -> Result<bool, OscFault> {
        let on = if let [value] = self.message.args.as_slice() { switch(value) } else { None };
        on.ok_or_else(|| self.wants("1 for on or 0 for off"))
    }

    /// The only argument as a number.
    fn number(self) -> Option<f64> {
        if let [value] = self.message.args.as_slice() { number(value) } else { None }
    }

    fn wants(self, wanted: &'static str) -> OscFault {
        OscFault::Argument { address: self.message.addr.clone(), wanted }
    }
}

/// A finite number of whichever type.
fn number(value: &OscType) -> Option<f64> {
    let number = match value {
        OscType::Int(number) => f64::from(*number),
        OscType::Long(number) => f64::from(i32::try_from(*number).ok()?),
        OscType::Float(number) => shortest(*number),
        OscType::Double(number) => *number,
        _ => return None,
    };
    number.is_finite().then_some(number)
}

/// The decimal that a single was written as: 0.6 and not 0.6000000238.
fn shortest(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::NAN)
}

fn switch(value: &OscType) -> Option<bool> {
    match value {
        OscType::Bool(on) => Some(*on),
        _ => match number(value)? {
            0.0 => Some(false),
            1.0 => Some(true),
            _ => None,
        },
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn all() -> Vec<GearWord> {
        GearWord::ALL.map(|(_, word)| word).to_vec()
    }

    fn ordered(addr: &str, args: Vec<OscType>) -> Result<OscOrder, OscFault> {
        order(&OscMessage { addr: addr.to_owned(), args }, &all())
    }

    #[test]
    fn each_address_asks_what_it_says() {
        let levels = |change| Command::Levels(change);
        for (addr, args, ask) in [
            ("/kinocue/go", vec![], Command::Go),
            ("/kinocue/pause", vec![OscType::Float(1.0)], Command::Pause),
            ("/kinocue/resume", vec![OscType::Int(1)], Command::Resume),
            ("/kinocue/stop", vec![OscType::Bool(true)], Command::Stop),
            ("/kinocue/park", vec![], Command::Park),
            ("/kinocue/seek", vec![OscType::Float(12.5)], Command::Seek(ShowTime::from_millis(12_500))),
            ("/kinocue/seek", vec![OscType::Int(750)], Command::Seek(ShowTime::from_millis(750_000))),
            ("/kinocue/trim", vec![OscType::Float(-80.4)], Command::Trim(-80)),
            ("/kinocue/nudge", vec![OscType::Int(-1)], Command::Nudge(-1)),
            (
                "/kinocue/level/motion",
                vec![OscType::Float(0.6)],
                levels(LevelsChange { motion: Some(0.6), ..LevelsChange::default() }),
            ),
            (
                "/kinocue/level/vibration",
                vec![OscType::Double(0.25)],
                levels(LevelsChange { vibration: Some(0.25), ..LevelsChange::default() }),
            ),
            (
                "/kinocue/effect/water",
                vec![OscType::Int(0)],
                levels(LevelsChange {
                    effects: [("water".to_owned(), false)].into(),
                    ..LevelsChange::default()
                }),
            ),
            (
                "/kinocue/row/A/level",
                vec![OscType::Int(0)],
                levels(LevelsChange { rows: [("A".to_owned(), 0.0)].into(), ..LevelsChange::default() }),
            ),
            ("/kinocue/seat/F4/enable", vec![OscType::Int(1)], Command::Enable("F4".to_owned())),
            (
                "/kinocue/seat/F4/enable",
                vec![OscType::Bool(false)],
                Command::Disable { name: "F4".to_owned(), why: None },
            ),
        ] {
            assert_eq!(ordered(addr, args), Ok(OscOrder::Command(ask)), "{addr}");
        }
    }

    #[test]
    fn a_button_that_is_let_go_asks_nothing() {
        assert_eq!(ordered("/kinocue/go", vec![OscType::Float(0.0)]), Ok(OscOrder::Released));
        assert!(matches!(ordered("/kinocue/go", vec![OscType::Float(0.5)]), Err(OscFault::Argument { .. })));
    }

    #[test]
    fn a_stop_is_a_stop_whatever_comes_with_it() {
        let odd =
            [vec![OscType::Float(0.5)], vec![OscType::String("now".to_owned())], vec![OscType::Int(0); 2]];
        for args in odd {
            assert_eq!(ordered("/kinocue/stop", args), Ok(OscOrder::Command(Command::Stop)));
        }
        assert_eq!(ordered("/kinocue/stop", vec![OscType::Int(0)]), Ok(OscOrder::Released));
    }

    #[test]
    fn nothing_arms_homes_clears_or_loads() {
        for word in ["arm", "disarm", "home", "clear", "load"] {
            for addr in [format!("/kinocue/{word}"), format!("/kinocue/{word}/x")] {
                let fault = ordered(&addr, vec![OscType::Int(1)]).unwrap_err();
                assert!(matches!(fault, OscFault::Forbidden(said) if said == word), "{fault}");
            }
        }
    }

    #[test]
    fn a_value_outside_its_range_is_refused() {
        for (addr, value) in [
            ("/kinocue/level/motion", OscType::Float(1.01)),
            ("/kinocue/level/motion", OscType::Float(f32::NAN)),
            ("/kinocue/level/vibration", OscType::Int(-1)),
            ("/kinocue/seek", OscType::Float(-0.5)),
            ("/kinocue/seek", OscType::Double(f64::INFINITY)),
            ("/kinocue/trim", OscType::Int(501)),
            ("/kinocue/nudge", OscType::Int(13)),
            ("/kinocue/nudge", OscType::Float(0.5)),
            ("/kinocue/effect/water", OscType::String("on".to_owned())),
            ("/kinocue/seat/A1/enable", OscType::Int(2)),
        ] {
            let fault = ordered(addr, vec![value]).unwrap_err();
            assert!(matches!(fault, OscFault::Argument { .. }), "{addr}: {fault}");
        }
        assert!(ordered("/kinocue/seek", vec![]).is_err());
        assert!(ordered("/kinocue/seek", vec![OscType::Int(1), OscType::Int(2)]).is_err());
    }

    #[test]
    fn patterns_and_other_addresses_are_unknown() {
        for addr in
            ["/kinocue/*", "/kinocue", "/kinocue/", "/go", "/kinocue/go/", "/kinocue/row//level", "/{a,b}"]
        {
            assert!(matches!(ordered(addr, vec![]), Err(OscFault::Unknown(_))), "{addr}");
        }
    }

    #[test]
    fn what_is_not_listed_is_not_allowed_but_stop_is() {
        let message = |addr: &str| OscMessage { addr: addr.to_owned(), args: Vec::new() };
        assert_eq!(order(&message("/kinocue/stop"), &[]), Ok(OscOrder::Command(Command::Stop)));
        assert!(matches!(order(&message("/kinocue/go"), &[GearWord::Pause]), Err(OscFault::NotAllowed(_))));
    }

    #[test]
    fn a_subscription_names_a_port_and_how_long() {
        let subscribe = |port, s| ordered("/kinocue/subscribe", vec![OscType::Int(port), OscType::Int(s)]);
        assert_eq!(subscribe(53001, 60), Ok(OscOrder::Subscribe { port: 53001, seconds: 60 }));
        for (port, seconds) in [(0, 60), (65_536, 60), (-1, 60), (53001, 3_601), (53001, -1)] {
            assert!(subscribe(port, seconds).is_err(), "{port} {seconds}");
        }
    }

    proptest! {
        #[test]
        fn whatever_a_message_says_it_never_arms_homes_clears_loads_or_reloads(
            addr in "/kinocue/[a-z]{0,9}(/[a-zA-Z0-9*]{0,4}){0,2}",
            value in any::<f32>(),
            with_value in any::<bool>(),
        ) {
            let args = if with_value { vec![OscType::Float(value)] } else { Vec::new() };
            if let Ok(OscOrder::Command(ask)) = ordered(&addr, args) {
                let words =
                    ["go", "pause", "resume", "stop", "park", "seek", "trim", "levels", "enable", "disable"];
                prop_assert!(words.contains(&ask.word()), "{}", ask.word());
            }
        }
    }
}
