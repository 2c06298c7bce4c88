//! Numbers as text that reads back as the same number.

use std::fmt::Write as _;

use crate::time::ShowTime;

/// Appends a finite number in its shortest exact form, for CSV and JSON alike.
pub(super) fn push_number(text: &mut String, value: f64) {
    // Without an exponent the smallest numbers have hundreds of digits. Writing to a string cannot fail.
    let _ =
        if value != 0.0 && value.abs() < 1e-6 { write!(text, "{value:e}") } else { write!(text, "{value}") };
}

/// Appends a show time in milliseconds, exact to the nanosecond.
pub(super) fn push_millis(text: &mut String, time: ShowTime) {
    let ns = time.as_nanos();
    let _ = write!(text, "{}", ns / 1_000_000);
    if ns % 1_000_000 != 0 {
        let fraction = format!("{:06}", ns % 1_000_000);
        let _ = write!(text, ".{}", fraction.trim_end_matches('0'));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_they_were() {
        for value in [0.0, 0.1, 1.0 / 3.0, 5e-324, 1.5e-7, 123_456_789.123, 2_147_483_647.0, 1e-6] {
            let mut text = String::new();
            push_number(&mut text, value);
            assert_eq!(text.parse(), Ok(value), "{text}");
            assert_eq!(serde_json::from_str::<f64>(&text).ok(), Some(value), "{text}");
            assert!(text.len() < 25, "{text}");
        }
    }

    #[test]
    fn times_are_exact() {
        for (ns, expected) in
            [(0, "0"), (16_666_667, "16.666667"), (10_000_000, "10"), (1, "0.000001"), (500_000, "0.5")]
        {
            let mut text = String::new();
            push_millis(&mut text, ShowTime::from_nanos(ns));
            assert_eq!(text, expected);
        }
    }
}
