//! Levels, trims and switches of effects as configurations and playlists write them.

use std::collections::BTreeMap;

use super::Effect;
use super::fault::Faults;
use super::section::{Entry, Section, did_you_mean};
use crate::channel;
use crate::time::TRIM_MS;

/// What is wrong with a number that is no level, 0 to 1, in the words of all surfaces.
pub(crate) fn no_level(number: f64) -> String {
    let percent = if number > 2.0 && number <= 100.0 {
        format!("; {number} % is {} or \"{number}%\"", number / 100.0)
    } else {
        String::new()
    };
    format!("{number} is outside 0..=1{percent}")
}

/// An intensity, 0 to 1: `0.6`, `60%`, or `-6dB` for 10^(-6/20).
///
/// # Errors
/// What is wrong with the text, for a person.
pub(crate) fn parse_level(text: &str) -> Result<f64, String> {
    let refuse = || "not a level; write 0% to 100%, 0 to 1, or 0dB and below, such as -6dB".to_owned();
    let level = if let Some(percent) = text.strip_suffix('%') {
        percent.trim_end().parse::<f64>().map_err(|_| refuse())? / 100.0
    } else if let Some(decibel) = text.strip_suffix("dB") {
        let decibel: f64 = decibel.trim_end().parse().map_err(|_| refuse())?;
        10_f64.powf(decibel / 20.0)
    } else {
        let level = text.parse().map_err(|_| refuse())?;
        return if (0.0..=1.0).contains(&level) { Ok(level) } else { Err(no_level(level)) };
    };
    if (0.0..=1.0).contains(&level) { Ok(level) } else { Err(refuse()) }
}

/// A level: 0 to 1, or a text as [`parse_level`] takes it.
pub(crate) fn level(section: &mut Section<'_, '_, '_>, key: &'static str) -> Option<f64> {
    let entry = section.get(key)?;
    if !entry.value.is_str() {
        let level = entry.number(section.faults)?;
        if !(0.0..=1.0).contains(&level) {
            entry.fault(section.faults, &no_level(level));
            return None;
        }
        return Some(level);
    }
    let parsed = parse_level(entry.text(section.faults)?);
    parsed.map_err(|why| entry.fault(section.faults, &why)).ok()
}

/// A trim, -500 to 500 ms.
pub(crate) fn trim(section: &mut Section<'_, '_, '_>, key: &'static str) -> Option<i32> {
    section.whole_in(key, -TRIM_MS..=TRIM_MS)
}

/// Effects that may be on or not: `{ water = false }`. Where the site's effects are given, others are faults.
pub(crate) fn switches(
    entry: Entry<'_>,
    effects: Option<&[Effect]>,
    faults: &mut Faults<'_>,
) -> BTreeMap<String, bool> {
    let Some(table) = entry.table(faults) else { return BTreeMap::new() };
    let mut switches = BTreeMap::new();
    for (name, value) in table {
        let name = name.get_ref();
        let entry = Entry::new(name, value);
        let is_here = |effects: &[Effect]| effects.iter().any(|effect| effect.name == **name);
        if effects.is_some_and(|effects| !is_here(effects)) && !channel::is_switch(name) {
            let known = effects.unwrap_or_default().iter().map(|effect| effect.name.as_str());
            entry.fault(faults, &format!("is not in [effects]{}", did_you_mean(name, known)));
        }
        if let Some(on) = entry.switch(faults) {
            switches.insert(name.to_string(), on);
        }
    }
    switches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_a_part_of_the_whole() {
        assert_eq!(parse_level("60%"), Ok(0.6));
        assert_eq!(parse_level("0dB"), Ok(1.0));
        assert!((parse_level("-6dB").unwrap() - 0.501).abs() < 1e-3);
        assert_eq!((parse_level("0.6"), parse_level("1")), (Ok(0.6), Ok(1.0)));
        let percent = parse_level("60").unwrap_err();
        assert_eq!(percent, "60 is outside 0..=1; 60 % is 0.6 or \"60%\"");
        for text in ["60", "-0.1", "1000", "nan", "101%", "1dB", "-1%", "nan%", "inf%", "NaNdB", "%", "é%"] {
            assert!(parse_level(text).is_err(), "{text}");
        }
        assert_eq!(parse_level("-infdB"), Ok(0.0));
    }
}
