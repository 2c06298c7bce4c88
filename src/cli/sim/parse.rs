//! What the options of `kinocue sim` are made of.

use std::time::Duration;

use anyhow::{Context as _, anyhow, bail};

use crate::sim::{Action, Command};
use crate::time::{parse_duration, parse_time};

/// `HEX=VALUE`: a parameter register in hex, its value decimal or 0x.
pub(super) fn parameter(text: &str) -> anyhow::Result<(u8, u16)> {
    let (register, value) = text.split_once('=').context("not HEX=VALUE, as in 95=6")?;
    Ok((register_number(register)?, value_number(value)?))
}

fn register_number(text: &str) -> anyhow::Result<u8> {
    u8::from_str_radix(text, 16).with_context(|| format!("register {text:?} is not hex from 00 to ff"))
}

fn value_number(text: &str) -> anyhow::Result<u16> {
    let number = match text.strip_prefix("0x") {
        Some(hex) => u16::from_str_radix(hex, 16),
        None => text.parse(),
    };
    number.with_context(|| format!("value {text:?} is not 0 to 65535, or 0x0 to 0xffff"))
}

/// A chance from 0 to 1.
pub(super) fn chance(text: &str) -> anyhow::Result<f64> {
    let chance: f64 = text.parse().context("not a number")?;
    if !(0.0..=1.0).contains(&chance) {
        bail!("{chance} is outside 0..=1");
    }
    Ok(chance)
}

/// A point in time, counted from the start.
pub(super) fn time(text: &str) -> anyhow::Result<Duration> {
    let nanos = parse_time(text).map_err(|why| anyhow!(why))?.as_nanos();
    Ok(Duration::from_nanos(u64::try_from(nanos).context("before the start")?))
}

/// A version, `MAJOR.MINOR`.
pub(super) fn version(text: &str) -> anyhow::Result<[u16; 2]> {
    let (major, minor) = text.split_once('.').context("not MAJOR.MINOR, as in 1.0")?;
    Ok([value_number(major)?, value_number(minor)?])
}

/// `TIME:COMMAND, …`: what happens when.
pub(super) fn script(text: &str) -> anyhow::Result<Vec<(Duration, Command)>> {
    timed(text, command)
}

/// `TIME:COMMAND, …` of commands of any kind.
pub(super) fn timed<T>(
    text: &str,
    command: impl Fn(&str) -> anyhow::Result<T>,
) -> anyhow::Result<Vec<(Duration, T)>> {
    list(text, |item| {
        let (at, rest) = item.split_once(':').context("no TIME: before it, as in 2.5:X1=1")?;
        Ok((time(at.trim())?, command(rest.trim())?))
    })
}

/// `COMMAND, …`, each refused by what it says.
pub(super) fn list<T>(text: &str, item: impl Fn(&str) -> anyhow::Result<T>) -> anyhow::Result<Vec<T>> {
    let items = text.split(',').map(str::trim).filter(|item| !item.is_empty());
    items.map(|text| item(text).with_context(|| format!("{text:?}"))).collect()
}

/// `[NAME@]ACTION`: what happens to one controller, or to all.
pub(super) fn command(text: &str) -> anyhow::Result<Command> {
    let (controller, action_text) = match text.split_once('@') {
        Some((name, action)) => (Some(controller(name.trim())?), action.trim()),
        None => (None, text),
    };
    let action = action(action_text)?;
    action.check()?;
    Ok(Command { controller, action })
}

/// A controller, counted from 0: `1` and `c1` are the first.
fn controller(name: &str) -> anyhow::Result<usize> {
    let number = name.strip_prefix('c').unwrap_or(name).parse::<usize>().ok();
    let index = number.and_then(|number| number.checked_sub(1));
    index.with_context(|| format!("{name:?} is not a controller; they are 1, 2 … or c1, c2 …"))
}

fn action(text: &str) -> anyhow::Result<Action> {
    if text == "reboot" {
        return Ok(Action::Reboot);
    }
    let Some((name, value)) = text.split_once('=').map(|(name, value)| (name.trim(), value.trim())) else {
        bail!("{text:?} is not a command; {COMMANDS}");
    };
    let of_register = name.strip_prefix("pa").or_else(|| name.strip_prefix("PA"));
    Ok(match (name, name.strip_prefix(['X', 'x']), of_register) {
        ("err", ..) => Action::Error(value_number(value)?),
        ("estop", ..) => Action::EmergencyStop(switch(value)?),
        ("mute", ..) => Action::Mute(switch(value)?),
        ("loss", ..) => Action::Loss(chance(value)?),
        ("duplicate", ..) => Action::Duplicate(chance(value)?),
        ("delay", ..) => Action::Delay(parse_duration(value).map_err(|why| anyhow!(why))?),
        (_, Some(input), _) => {
            let input = input.parse().with_context(|| format!("{name:?} is not X1 to X12"))?;
            Action::Switch { input, closed: switch(value)? }
        }
        (_, _, Some(register)) => Action::Parameter(register_number(register)?, value_number(value)?),
        _ => bail!("{text:?} is not a command; {COMMANDS}"),
    })
}

const COMMANDS: &str =
    "commands are X1=1, err=12, estop=1, mute=1, loss=0.1, duplicate=0.1, delay=50ms, pa95=3 and reboot";

/// 0 or 1.
pub(super) fn switch(text: &str) -> anyhow::Result<bool> {
    match text {
        "0" => Ok(false),
        "1" => Ok(true),
        _ => bail!("{text:?} is neither 0 nor 1"),
    }
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
    fn a_chance_lies_between_never_and_always() {
        assert_eq!(chance("0.25").unwrap(), 0.25);
        assert!(chance("1.1").is_err() && chance("NaN").is_err());
    }

    #[test]
    fn a_version_is_major_and_minor() {
        assert_eq!(version("3.12").unwrap(), [3, 12]);
        assert!(version("3").is_err() && version("3.x").is_err());
    }

    #[test]
    fn a_script_is_what_happens_when() {
        let seconds = Duration::from_secs_f64;
        let all = |action| Command { controller: None, action };
        assert_eq!(
            script("2.0:X1=1, 3.25:x12=0,5:err=12, 8:reboot,").unwrap(),
            [
                (seconds(2.0), all(Action::Switch { input: 1, closed: true })),
                (seconds(3.25), all(Action::Switch { input: 12, closed: false })),
                (seconds(5.0), all(Action::Error(12))),
                (seconds(8.0), all(Action::Reboot)),
            ]
        );
        assert_eq!(script("").unwrap(), []);
        let refusal = format!("{:#}", script("1:X1=1, 2:X13=1").unwrap_err());
        assert!(refusal.starts_with("\"2:X13=1\": there is no input X13"), "{refusal}");
        assert!(script("X1=1").is_err() && script("1").is_err() && script("-1:reboot").is_err());
    }

    #[test]
    fn a_command_is_for_all_or_for_one() {
        let to = |text| command(text).unwrap();
        assert_eq!(to("2@mute=1"), Command { controller: Some(1), action: Action::Mute(true) });
        assert_eq!(to("c10@pa95=0x3").controller, Some(9));
        assert_eq!(to("loss=0.1").action, Action::Loss(0.1));
        assert_eq!(to("duplicate = 1").action, Action::Duplicate(1.0));
        assert_eq!(to("delay=50ms").action, Action::Delay(Duration::from_millis(50)));
        assert_eq!(to("estop=1").action, Action::EmergencyStop(true));
        assert_eq!(to("PA0d=500").action, Action::Parameter(0x0d, 500));
        for wrong in [
            "",
            "0@reboot",
            "A1@reboot",
            "err=9",
            "err=x",
            "mute=2",
            "loss=2",
            "delay=5",
            "X=1",
            "paxx=1",
            "go",
        ] {
            assert!(command(wrong).is_err(), "{wrong}");
        }
    }
}
