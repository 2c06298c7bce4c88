//! What the options of `kinocue sim` are made of.

use std::time::Duration;

use anyhow::{Context as _, bail};

/// `HEX=VALUE`: a parameter register in hex, its value decimal or 0x.
pub(super) fn parameter(text: &str) -> anyhow::Result<(u8, u16)> {
    let (register, value) = text.split_once('=').context("not HEX=VALUE, as in 95=6")?;
    let register = u8::from_str_radix(register, 16)
        .with_context(|| format!("register {register:?} is not hex from 00 to ff"))?;
    let number = match value.strip_prefix("0x") {
        Some(hex) => u16::from_str_radix(hex, 16),
        None => value.parse(),
    };
    let value = number.with_context(|| format!("value {value:?} is not 0 to 65535, or 0x0 to 0xffff"))?;
    Ok((register, value))
}

/// A chance from 0 to 1.
pub(super) fn chance(text: &str) -> anyhow::Result<f64> {
    let chance: f64 = text.parse().context("not a number")?;
    if !(0.0..=1.0).contains(&chance) {
        bail!("{chance} is outside 0..=1");
    }
    Ok(chance)
}

/// A length of time with its unit: `80ms`, `1.5s`; at most a minute.
pub(super) fn span(text: &str) -> anyhow::Result<Duration> {
    const LONGEST_S: f64 = 60.0;
    let (number, per_second) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1e-3),
        (None, Some(number)) => (number, 1.0),
        (None, None) => bail!("no unit; give it as 80ms or 1.5s"),
    };
    let seconds = number.parse::<f64>().with_context(|| format!("{number:?} is not a number"))? * per_second;
    if !(0.0..=LONGEST_S).contains(&seconds) {
        bail!("{text} is outside 0ms..={LONGEST_S}s");
    }
    Ok(Duration::from_secs_f64(seconds))
}

/// A point in time: `SS[.mmm]`, `MM:SS[.mmm]` or `HH:MM:SS[.mmm]`.
pub(super) fn time(text: &str) -> anyhow::Result<Duration> {
    let spelling = "give it as SS[.mmm], MM:SS[.mmm] or HH:MM:SS[.mmm]";
    let parts: Vec<&str> = text.split(':').collect();
    let Some((seconds, before)) = parts.split_last().filter(|_| parts.len() <= 3) else {
        bail!("{spelling}")
    };
    let mut minutes: u32 = 0;
    for part in before {
        let number: u32 = part.parse().context(spelling)?;
        minutes = minutes.checked_mul(60).and_then(|m| m.checked_add(number)).context(spelling)?;
    }
    let seconds: f64 = seconds.parse().context(spelling)?;
    let total = f64::from(minutes) * 60.0 + seconds;
    if before.is_empty() || (0.0..60.0).contains(&seconds) {
        return Duration::try_from_secs_f64(total).context(spelling);
    }
    bail!("{seconds} seconds are no part of a minute; {spelling}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_hex_and_its_value_decimal_or_0x() {
        assert_eq!(parameter("95=6").unwrap(), (0x95, 6));
        assert_eq!(parameter("0b=0x10").unwrap(), (0x0b, 16));
        for wrong in ["95", "195=1", "xx=1", "95=70000", "95=-1", "95=0xg"] {
            assert!(parameter(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_span_carries_its_unit() {
        assert_eq!(span("80ms").unwrap(), Duration::from_millis(80));
        assert_eq!(span("1.5s").unwrap(), Duration::from_millis(1_500));
        for wrong in ["80", "ms", "-1s", "NaNs", "1h", "1e9s"] {
            assert!(span(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_time_is_seconds_or_a_clock() {
        assert_eq!(time("90.5").unwrap(), Duration::from_millis(90_500));
        assert_eq!(time("01:30.5").unwrap(), Duration::from_millis(90_500));
        assert_eq!(time("01:00:00").unwrap(), Duration::from_secs(3_600));
        for wrong in ["", "1:60", "a", "1:2:3:4", "-1", "NaN", "1:-1", "4000000000:4000000000:0"] {
            assert!(time(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_chance_lies_between_never_and_always() {
        assert_eq!(chance("0.25").unwrap(), 0.25);
        assert!(chance("1.1").is_err() && chance("NaN").is_err());
    }
}
