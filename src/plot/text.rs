//! Text from anywhere as text of SVG and HTML, and numbers as people read them.

use crate::plain;
use crate::time::ShowTime;

/// The longest text that is shown whole, bytes.
const LEN: usize = 400;

/// The text so that it is text, wherever in a page or an SVG it stands. What XML has no place for is escaped as Rust does.
#[must_use]
pub(super) fn safe(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in plain::escaped(text, LEN).chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\u{fffe}' | '\u{ffff}' => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

/// A show time with as many places as a step of the axis needs.
#[must_use]
pub(super) fn clock(at_s: f64, step_s: f64) -> String {
    let text = ShowTime::from_secs_f64(at_s).to_string();
    let cut = [(1.0, 4), (0.1, 2), (0.01, 1)].iter().find(|(step, _)| step_s >= *step).map_or(0, |one| one.1);
    text[..text.len() - cut].to_owned()
}

/// A number with its thousands apart, and places only where it is small.
#[must_use]
pub(super) fn number(value: f64) -> String {
    if value.abs() < 100.0 {
        return format!("{}", (10.0 * value).round() / 10.0 + 0.0);
    }
    let digits = format!("{:.0}", value.abs());
    let mut text = if value < 0.0 { "-".to_owned() } else { String::new() };
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
