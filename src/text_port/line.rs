//! Parses a line of text into a command.

use crate::config::{GearWord, parse_level};
use crate::control::{Code, Command, LevelsChange, Problem};
use crate::time::{TrimChange, parse_time, parse_trim_change};

/// The lines that there are, as a refusal lists them.
const LINES: &str = "go, pause, resume, stop, park, status, film, seek 12:30, trim +80ms, level 60%, level motion 60%, effect \
                     water off, enable F4, disable F4";

/// What a line asks.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum TextOrder {
    /// Of the hall.
    Command(Command),
    /// How it is.
    Status,
    /// How the film is that it follows.
    Film,
}

/// Why a line is not obeyed.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum TextFault {
    /// It is an order with a value that is none, or one that may never come from here.
    Refused(Problem),
    /// It is no order: who sends such lines speaks something else, a browser perhaps that somebody else's page leads.
    NoOrder(Problem),
}

impl From<Problem> for TextFault {
    fn from(problem: Problem) -> Self {
        Self::Refused(problem)
    }
}

/// What a line asks; it has no end of line any more.
pub(super) fn order(line: &[u8], allow: &[GearWord]) -> Result<TextOrder, TextFault> {
    if is_stop(line) {
        return Ok(TextOrder::Command(Command::Stop));
    }
    let text = str::from_utf8(line).ok().filter(|text| text.is_ascii());
    let no_ascii = || TextFault::NoOrder(value("the line is not ASCII".to_owned(), "send plain ASCII"));
    let text = text.ok_or_else(no_ascii)?;
    let small = text.to_ascii_lowercase();
    let words: Vec<&str> = small.split_ascii_whitespace().collect();
    // Names are what they are, in capitals or not.
    let name = || text.split_ascii_whitespace().nth(1).unwrap_or_default();
    let order = TextOrder::Command(match words[..] {
        ["status"] => return Ok(TextOrder::Status),
        ["film"] => return Ok(TextOrder::Film),
        ["go"] => Command::Go,
        ["pause"] => Command::Pause,
        ["resume"] => Command::Resume,
        ["park"] => Command::Park,
        ["seek", at] => Command::Seek(parse_time(at).map_err(|why| argument(at, &why))?),
        ["trim", trim] => match parse_trim_change(trim).map_err(|why| argument(trim, &why))? {
            TrimChange::To(ms) => Command::Trim(ms),
            TrimChange::ByFrames(frames) => Command::Nudge(frames),
        },
        ["level", all] => level(all, |all| (Some(all), Some(all)))?,
        ["level", "motion", motion] => level(motion, |motion| (Some(motion), None))?,
        ["level", "vibration", vibration] => level(vibration, |vibration| (None, Some(vibration)))?,
        ["effect", _, "on"] => effect(name(), true),
        ["effect", _, "off"] => effect(name(), false),
        ["enable", _] => Command::Enable(name().to_owned()),
        ["disable", _] => Command::Disable { name: name().to_owned(), why: None },
        [word, ..] if Command::OF_PEOPLE.contains(&word) => {
            let detail = format!("lines of text may never {word}");
            return Err(Problem::new(Code::Role, detail, "a person does that on the console").into());
        }
        _ => {
            let detail = format!("{text:?} is not a line that kinocue knows");
            return Err(TextFault::NoOrder(value(detail, &format!("the lines are {LINES}"))));
        }
    });
    allowed(order, allow)
}

/// True of what can be read as a stop: its first word is that, whatever stands before and behind it.
pub(super) fn is_stop(line: &[u8]) -> bool {
    let from = line.iter().position(u8::is_ascii_alphanumeric).unwrap_or(line.len());
    let Some((word, rest)) = line[from..].split_first_chunk::<4>() else { return false };
    let is_over = rest.first().is_none_or(|next| !next.is_ascii_alphanumeric() && !b"-_".contains(next));
    word.eq_ignore_ascii_case(b"stop") && is_over
}

/// An order, where the configuration allows it.
fn allowed(order: TextOrder, allow: &[GearWord]) -> Result<TextOrder, TextFault> {
    let TextOrder::Command(ask) = &order else { return Ok(order) };
    if ask.gear_word().is_none_or(|word| allow.contains(&word)) {
        return Ok(order);
    }
    let detail = format!("{} is not allowed here", ask.word());
    Err(Problem::new(Code::Role, detail, "list it in `allow` of [text]").into())
}

fn level(text: &str, of: impl FnOnce(f64) -> (Option<f64>, Option<f64>)) -> Result<Command, Problem> {
    let (motion, vibration) = of(parse_level(text).map_err(|why| argument(text, &why))?);
    Ok(Command::Levels(LevelsChange { motion, vibration, ..LevelsChange::default() }))
}

fn effect(name: &str, on: bool) -> Command {
    Command::Levels(LevelsChange { effects: [(name.to_owned(), on)].into(), ..LevelsChange::default() })
}

/// A refusal of one word of a line; `why` says what is wrong and, where it has one, what to write.
fn argument(word: &str, why: &str) -> Problem {
    let (detail, remedy) = why.split_once("; ").unwrap_or((why, "write it so"));
    value(format!("{word:?}: {detail}"), remedy)
}

fn value(detail: String, remedy: &str) -> Problem {
    Problem::new(Code::Value, detail, remedy)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::time::ShowTime;

    fn ordered(line: &[u8]) -> Result<TextOrder, TextFault> {
        order(line, &GearWord::ALL.map(|(_, word)| word))
    }

    fn asked(line: &str) -> Command {
        match ordered(line.as_bytes()) {
            Ok(TextOrder::Command(ask)) => ask,
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn each_line_asks_what_it_says() {
        let levels =
            |motion, vibration| Command::Levels(LevelsChange { motion, vibration, ..<_>::default() });
        for (line, ask) in [
            ("go", Command::Go),
            ("  pause ", Command::Pause),
            ("resume", Command::Resume),
            ("stop", Command::Stop),
            (" STOP ", Command::Stop),
            ("Stop!", Command::Stop),
            ("\u{feff}stop;", Command::Stop),
            ("\0stop\r", Command::Stop),
            ("stop the show", Command::Stop),
            ("GO", Command::Go),
            ("Seek 12:30", Command::Seek(ShowTime::from_millis(750_000))),
            ("LEVEL 60%", levels(Some(0.6), Some(0.6))),
            ("TRIM +80MS", Command::Trim(80)),
            ("ENABLE F4", Command::Enable("F4".to_owned())),
            ("Effect Water OFF", effect("Water", false)),
            ("park", Command::Park),
            ("seek 12:30", Command::Seek(ShowTime::from_millis(750_000))),
            ("trim +80ms", Command::Trim(80)),
            ("trim -80ms", Command::Trim(-80)),
            ("trim +2f", Command::Nudge(2)),
            ("trim -1f", Command::Nudge(-1)),
            ("level 60%", levels(Some(0.6), Some(0.6))),
            ("level motion 60%", levels(Some(0.6), None)),
            ("level  vibration\t60%", levels(None, Some(0.6))),
            ("effect water off", effect("water", false)),
            ("effect water on", effect("water", true)),
            ("enable F4", Command::Enable("F4".to_owned())),
            ("disable F4", Command::Disable { name: "F4".to_owned(), why: None }),
        ] {
            assert_eq!(asked(line), ask, "{line}");
        }
        assert_eq!(ordered(b"status"), Ok(TextOrder::Status));
    }

    #[test]
    fn nothing_arms_homes_clears_or_loads() {
        for line in ["arm", "disarm", "home", "home A1", "clear", "load coaster"] {
            let fault = ordered(line.as_bytes()).unwrap_err();
            assert!(
                matches!(fault, TextFault::Refused(Problem { code: Code::Role, .. })),
                "{line}: {fault:?}"
            );
        }
    }

    #[test]
    fn what_is_not_listed_is_not_allowed_but_stop_is() {
        assert_eq!(order(b"stop", &[]), Ok(TextOrder::Command(Command::Stop)));
        assert_eq!(order(b"status", &[]), Ok(TextOrder::Status));
        assert_eq!(order(b"go", &[GearWord::Go]), Ok(TextOrder::Command(Command::Go)));
        let fault = order(b"park", &[GearWord::Go]).unwrap_err();
        assert!(matches!(fault, TextFault::Refused(Problem { code: Code::Role, .. })), "{fault:?}");
    }

    #[test]
    fn what_is_no_line_is_refused_with_what_to_write() {
        for (line, says) in [
            ("", "the lines are go, pause"),
            ("GOO", "\"GOO\" is not a line"),
            ("stopwatch", "not a line"),
            ("stop-film", "not a line"),
            ("no stop", "not a line"),
            ("go now", "not a line"),
            ("seek", "not a line"),
            ("effect water maybe", "not a line"),
            ("POST / HTTP/1.1", "not a line"),
            ("gö", "not ASCII"),
        ] {
            let TextFault::NoOrder(problem) = ordered(line.as_bytes()).unwrap_err() else { panic!("{line}") };
            assert_eq!(problem.code, Code::Value, "{line}");
            assert!(problem.to_string().contains(says), "{line}: {problem}");
        }
        assert!(matches!(ordered(&[0xff, 0xfe]), Err(TextFault::NoOrder(_))));
    }

    #[test]
    fn a_value_that_is_none_is_refused_with_what_to_write() {
        for (line, says) in [
            ("seek soon", "write SS[.mmm], MM:SS"),
            ("trim 501", "\"501\": a trim is -500ms to 500ms"),
            ("trim 13f", "up to 12 frames"),
            ("trim xf", "write +2f or -1f"),
            ("level 101%", "write 0% to 100%"),
        ] {
            let TextFault::Refused(problem) = ordered(line.as_bytes()).unwrap_err() else { panic!("{line}") };
            assert!(problem.to_string().contains(says), "{line}: {problem}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_panic_and_none_arm(bytes in proptest::collection::vec(any::<u8>(), 0..60), word in "[a-z]{2,7}") {
            let line = [word.as_bytes(), b" ", &bytes].concat();
            for line in [bytes.as_slice(), line.as_slice()] {
                if let Ok(TextOrder::Command(ask)) = ordered(line) {
                    prop_assert!(!["arm", "disarm", "home", "clear", "load"].contains(&ask.word()));
                }
            }
        }
    }
}
