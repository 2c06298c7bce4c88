//! Single values: from text to numbers, and whether a cue may have them.

use super::limits::{ALL_OUTPUTS, MAX_TIME, MAX_VIBRATION_HZ, MIN_VIBRATION_HZ};
use super::problem::Problem;
use super::unit::{DeclaredUnit, Unit};
use crate::channel::{PartKind, TrackId};
use crate::time::ShowTime;

/// A finite number.
pub(super) fn number(text: &str) -> Result<f64, Problem> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(Problem::NotFinite(shortened(text))),
        Err(_) => Err(Problem::NotANumber(shortened(text))),
    }
}

/// A show time from a number of units of `unit_ns` nanoseconds, rounded to the nanosecond.
#[expect(clippy::cast_possible_truncation, reason = "held below a day")]
pub(super) fn time(text: &str, unit_ns: f64) -> Result<ShowTime, Problem> {
    let ns = (number(text)? * unit_ns).round();
    let time = ShowTime::from_nanos(ns as i64);
    if time > MAX_TIME { Err(Problem::TimeTooLate(shortened(text))) } else { Ok(time) }
}

/// A position in the unit of memory, from one in the unit of the file.
pub(super) fn position(value: f64, unit: DeclaredUnit) -> Result<f64, Problem> {
    let (low, high) = (unit.floor(), unit.ceiling());
    if (low..=high).contains(&value) {
        Ok(unit.in_memory(value))
    } else if unit.unit() == Unit::Fraction {
        Err(Problem::OutsideStroke { value, low, high, unit: unit.suffix() })
    } else {
        Err(Problem::NoPosition { value, low, high, unit: unit.suffix() })
    }
}

/// A vibration amplitude in the unit of memory, from one in the unit of the file.
pub(super) fn amplitude(value: f64, unit: DeclaredUnit) -> Result<f64, Problem> {
    let high = unit.ceiling();
    if (0.0..=high).contains(&value) {
        Ok(unit.in_memory(value))
    } else {
        Err(Problem::Amplitude { value, high, unit: unit.suffix() })
    }
}

/// A vibration frequency in Hz; 0 is none.
pub(super) fn hertz(value: f64) -> Result<f64, Problem> {
    if value == 0.0 || (MIN_VIBRATION_HZ..=MAX_VIBRATION_HZ).contains(&value) {
        Ok(value)
    } else {
        Err(Problem::Frequency(value))
    }
}

/// A part of a channel in the unit of memory, from one in the unit of the file.
pub(super) fn part(value: f64, track: TrackId, part: usize, unit: DeclaredUnit) -> Result<f64, Problem> {
    match track.channel.row().parts[part].kind {
        PartKind::Hertz => hertz(value),
        PartKind::Amplitude => amplitude(value, unit),
        PartKind::Level if (0.0..=1.0).contains(&value) => Ok(value),
        PartKind::Level => Err(Problem::Level(value)),
    }
}

/// True if an effect is on: `1` or `0`, which tables of numbers write as `1.0` and spreadsheets as `TRUE`.
pub(super) fn switch(text: &str) -> Result<bool, Problem> {
    match text.parse::<f64>() {
        Ok(0.0) => Ok(false),
        Ok(1.0) => Ok(true),
        _ if text.eq_ignore_ascii_case("true") => Ok(true),
        _ if text.eq_ignore_ascii_case("false") => Ok(false),
        _ => Err(Problem::Switch(shortened(text))),
    }
}

/// A raw output word: decimal, with `.0` where a table of numbers writes that, or hexadecimal behind `0x`.
pub(super) fn word(text: &str) -> Result<u16, Problem> {
    let (digits, radix) = match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) => (digits, 16),
        None => (
            text.split_once('.')
                .filter(|(_, part)| part.bytes().all(|b| b == b'0'))
                .map_or(text, |(whole, _)| whole),
            10,
        ),
    };
    let word = u16::from_str_radix(digits, radix).ok().filter(|_| !digits.starts_with('+'));
    word.filter(|word| outputs(*word).is_ok()).ok_or_else(|| Problem::Word(shortened(text)))
}

/// A raw output word as a number: it names outputs that there are (SMC manual 2.2.2.5).
pub(super) fn outputs(word: u16) -> Result<u16, Problem> {
    if word & !ALL_OUTPUTS == 0 { Ok(word) } else { Err(Problem::Word(word.to_string())) }
}

/// The text, cut where it would fill the screen.
pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_finite_or_refused() {
        assert_eq!(number("-1.5e3"), Ok(-1500.0));
        for text in ["nan", "NaN", "inf", "-infinity", "1e400"] {
            assert_eq!(number(text), Err(Problem::NotFinite(text.to_owned())));
        }
        for text in ["", "1,5", "abc", "0x10", "1 2"] {
            assert_eq!(number(text), Err(Problem::NotANumber(text.to_owned())));
        }
    }

    #[test]
    fn words_are_decimal_or_hexadecimal() {
        assert_eq!((word("4095"), word("0x0fFF")), (Ok(0x0fff), Ok(0x0fff)));
        assert_eq!((word("5.0"), word("4095.000")), (Ok(5), Ok(0x0fff)));
        for text in [
            "4096", "0x1000", "65535", "65536", "-1", "+1", "0x", "fff", "0x+1", "5.5", "0x5.0", ".0",
            "4096.0",
        ] {
            assert!(word(text).is_err(), "{text}");
        }
    }

    #[test]
    fn an_effect_is_on_or_off_however_a_table_writes_it() {
        for (text, on) in [
            ("1", true),
            ("1.0", true),
            ("TRUE", true),
            ("true", true),
            ("0", false),
            ("0.00", false),
            ("False", false),
        ] {
            assert_eq!(switch(text), Ok(on), "{text}");
        }
        for text in ["2", "0.5", "on", "yes", "-1", "nan", "", "1,0"] {
            assert_eq!(switch(text), Err(Problem::Switch(text.to_owned())), "{text}");
        }
    }

    #[test]
    fn the_units_have_their_ends() {
        assert_eq!(position(255.0, DeclaredUnit::U8), Ok(1.0));
        assert_eq!(position(50.0, DeclaredUnit::Percent), Ok(0.5));
        assert!(position(100.1, DeclaredUnit::Percent).is_err());
        assert!(position(-0.1, DeclaredUnit::Fraction).is_err());
        assert!(position(-100_000.1, DeclaredUnit::Millimetre).is_err());
        assert_eq!(position(-90.0, DeclaredUnit::Degree), Ok(-90.0));
        assert_eq!(position(1234.5, DeclaredUnit::Millimetre), Ok(1234.5));
    }

    #[test]
    fn a_long_text_is_shortened_between_characters() {
        assert_eq!(shortened(&"ä".repeat(50)), format!("{}…", "ä".repeat(40)));
    }
}
