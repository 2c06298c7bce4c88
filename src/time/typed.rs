//! Times, durations and trims as a person types them.

use std::time::Duration;

use super::ShowTime;

/// The furthest that motion may be moved against the film, either way, milliseconds.
pub(crate) const TRIM_MS: i32 = 500;

/// The most frames of a film by which a trim changes at once: half a second of the slowest film, which is all that there is.
pub(crate) const TRIM_FRAMES: i32 = 12;

const SECOND: u128 = 1_000_000_000;

/// The frame rates of a time code in frames.
const FRAME_RATES: std::ops::RangeInclusive<u128> = 1..=120;

/// A position in a cue: `SS[.mmm]`, `MM:SS[.mmm]`, `HH:MM:SS[.mmm]` or `HH:MM:SS:FF@24`.
///
/// # Errors
/// What is wrong with the text, for a person.
pub(crate) fn parse_time(text: &str) -> Result<ShowTime, String> {
    let refuse = |why: &str| format!("{why}; write SS[.mmm], MM:SS, HH:MM:SS[.mmm] or HH:MM:SS:FF@24");
    let parts: Vec<&str> = text.split(':').collect();
    let nanos = match parts[..] {
        [s] => seconds(s, None),
        [m, s] => seconds(s, Some(60)).and_then(|s| Some(whole(m)? * 60 * SECOND + s)),
        [h, m, s] => seconds(s, Some(60)).and_then(|s| Some(hours_minutes(h, m)? + s)),
        [h, m, s, frames] => {
            let frames = frames_at_rate(frames).map_err(|why| refuse(&why))?;
            sexagesimal(s).and_then(|s| Some(hours_minutes(h, m)? + s * SECOND + frames))
        }
        _ => None,
    };
    let nanos = nanos.ok_or_else(|| refuse("not a time"))?;
    i64::try_from(nanos).map(ShowTime::from_nanos).map_err(|_| refuse("longer than any cue"))
}

/// True if a time of day, alone or behind a date, is at second 60. Readers of times take it for second 59; no clock of the day shows it.
pub(crate) fn is_second_60(text: &str) -> bool {
    let clock = text.rsplit(['T', 't', ' ']).next().unwrap_or(text);
    let of_clock = clock.chars().take_while(|c| c.is_ascii_digit() || *c == ':');
    of_clock.filter(char::is_ascii_digit).skip(4).take(2).eq(['6', '0'])
}

/// A length of time with its unit: `80ms`, `1.5s`, `100us`, `5min`, `2h`.
///
/// # Errors
/// What is wrong with the text, for a person.
pub(crate) fn parse_duration(text: &str) -> Result<Duration, String> {
    let refuse = |why: &str| format!("{why}; write a number and its unit: 80ms, 1.5s, 100us, 5min or 2h");
    let unit_at = text.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(|| refuse("no unit"))?;
    let (number, unit) = text.split_at(unit_at);
    let unit = match unit {
        "us" => 1_000,
        "ms" => 1_000_000,
        "s" => SECOND,
        "min" => 60 * SECOND,
        "h" => 3_600 * SECOND,
        _ => return Err(refuse("unknown unit")),
    };
    let billionths = seconds(number.trim_end(), None).ok_or_else(|| refuse("not a duration"))?;
    let nanos = billionths.checked_mul(unit).map(|nanos| nanos / SECOND);
    let nanos = nanos.and_then(|nanos| u64::try_from(nanos).ok()).ok_or_else(|| refuse("too long"))?;
    Ok(Duration::from_nanos(nanos))
}

/// A trim of the motion against the film, -500 to 500 ms in whole milliseconds: `40`, `-120ms`, `+80 ms`.
///
/// # Errors
/// What is wrong with the text, for a person.
pub(crate) fn parse_trim(text: &str) -> Result<i32, String> {
    let digits = text.strip_suffix("ms").unwrap_or(text).trim_end();
    let trim = digits.parse().ok().filter(|ms| (-TRIM_MS..=TRIM_MS).contains(ms));
    trim.ok_or_else(|| format!("a trim is -{TRIM_MS}ms to {TRIM_MS}ms, in whole milliseconds"))
}

/// What is asked of a trim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TrimChange {
    /// To be that, milliseconds.
    To(i32),
    /// To be later by so many frames of the film, or earlier.
    ByFrames(i32),
}

/// A trim as [`parse_trim`] reads it, or frames by which it changes: `+2f`, `-1f`.
///
/// # Errors
/// What is wrong with the text, for a person.
pub(crate) fn parse_trim_change(text: &str) -> Result<TrimChange, String> {
    let frames = text.strip_suffix('f').map(|frames| frames.parse().ok());
    let frames = frames.map(|frames| frames.filter(|frames| (-TRIM_FRAMES..=TRIM_FRAMES).contains(frames)));
    match frames {
        None => parse_trim(text)
            .map(TrimChange::To)
            .map_err(|why| format!("{why}; or frames by which it changes, as +2f")),
        Some(Some(frames)) => Ok(TrimChange::ByFrames(frames)),
        Some(None) => Err(format!("a trim changes by up to {TRIM_FRAMES} frames; write +2f or -1f")),
    }
}

fn hours_minutes(h: &str, m: &str) -> Option<u128> {
    Some((whole(h)? * 3_600 + sexagesimal(m)? * 60) * SECOND)
}

/// The nanoseconds of `FF@24`.
fn frames_at_rate(text: &str) -> Result<u128, String> {
    let (frame, rate) = text.split_once('@').ok_or("frames need their rate")?;
    let rate =
        whole(rate).filter(|rate| FRAME_RATES.contains(rate)).ok_or("the frame rate is not 1 to 120")?;
    let frame = whole(frame)
        .filter(|&frame| frame < rate)
        .ok_or_else(|| format!("frame {frame} is outside 0..={}", rate - 1))?;
    Ok((frame * SECOND + rate / 2) / rate)
}

/// The nanoseconds of `SS[.fraction]`, below `limit` seconds; at most nine digits of the fraction count.
fn seconds(text: &str, limit: Option<u128>) -> Option<u128> {
    let (before, after) = text.split_once('.').unwrap_or((text, "0"));
    let before = whole(before).filter(|&s| limit.is_none_or(|limit| s < limit))?;
    if after.is_empty() || !after.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let digits = &after[..after.len().min(9)];
    let scale = u32::try_from(digits.len()).ok()?;
    Some(before * SECOND + whole(digits)? * SECOND / 10_u128.pow(scale))
}

fn sexagesimal(text: &str) -> Option<u128> {
    whole(text).filter(|&part| part < 60)
}

/// Digits alone, at most 12 of them: no sign, no spaces.
fn whole(text: &str) -> Option<u128> {
    let digits = !text.is_empty() && text.len() <= 12 && text.bytes().all(|byte| byte.is_ascii_digit());
    if digits { text.parse().ok() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_reads_in_every_spelling() {
        for (text, ms) in [
            ("0", 0),
            ("90", 90_000),
            ("1.5", 1_500),
            ("01:23", 83_000),
            ("90:00", 5_400_000),
            ("01:23.250", 83_250),
            ("02:00:00", 7_200_000),
            ("1:02:03.004", 3_723_004),
            ("00:00:01:12@24", 1_500),
            ("01:00:00:59@60", 3_600_983),
        ] {
            let nanos = parse_time(text).unwrap().as_nanos();
            assert_eq!(nanos / 1_000_000, ms, "{text}");
        }
        assert_eq!(parse_time("0.000000001").unwrap(), ShowTime::from_nanos(1));
    }

    #[test]
    fn a_time_that_is_shown_reads_back() {
        let time = ShowTime::from_millis(3_723_456);
        assert_eq!(parse_time(&time.to_string()), Ok(time));
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in [
            "",
            ".",
            "1.",
            ".5",
            "-1",
            "+1",
            "1:60",
            "1:60:00",
            "00:00:01:24@24",
            "00:00:01:12",
            "1s",
            " 1",
            "1:2:3:4:5",
            "00:00:00:00@0",
            "00:00:00:00@23.976",
            "999999999999",
            "1:-2",
            "1e3",
            "inf",
            "9999999999999999999999",
        ] {
            assert!(parse_time(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_duration_carries_its_unit() {
        for (text, micros) in [
            ("80ms", 80_000),
            ("2s", 2_000_000),
            ("1.5s", 1_500_000),
            ("100us", 100),
            ("0.5 ms", 500),
            ("5min", 300_000_000),
            ("1h", 3_600_000_000),
        ] {
            assert_eq!(parse_duration(text), Ok(Duration::from_micros(micros)), "{text}");
        }
        for text in ["", "80", "ms", "80 parsecs", "-1s", "1e3s", "1.s", "999999999999h"] {
            assert!(parse_duration(text).is_err(), "{text}");
        }
    }

    proptest::proptest! {
        #[test]
        fn no_text_panics(text in "[0-9:.@a-z%é -]{0,12}") {
            let _ = (parse_time(&text), parse_duration(&text), parse_trim(&text));
        }
    }
}
