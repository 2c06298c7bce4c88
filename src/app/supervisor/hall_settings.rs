//! Settings of the operators: levels, effects, seats on or off, and their consequences for each lane.

use std::collections::{BTreeMap, BTreeSet};

use crate::channel;
use crate::config::{Config, no_level, there_is_no};
use crate::control::{Code, Levels, LevelsChange, Problem};
use crate::engine::Mix;
use crate::rt::Desk;
use crate::settings::{Out, Settings};

/// What is set.
#[derive(Debug, Clone)]
pub(super) struct HallSettings {
    pub(super) levels: Levels,
    /// The same as people have set it: what gear may set at the most.
    pub(super) ceiling: Levels,
    pub(super) trim_ms: i32,
    /// Groups that are taken out, also such as this configuration does not know: one that comes back with the next is out still.
    pub(super) out: BTreeMap<String, Out>,
    /// Rows that alone take part, while seats are tested; `None` if all do.
    pub(super) only: Option<BTreeSet<String>>,
    lanes: Vec<LanePlace>,
}

/// What has to be known of a lane.
#[derive(Debug, Clone)]
struct LanePlace {
    row: Option<String>,
    group: String,
}

impl HallSettings {
    /// All of everything.
    pub(super) fn new(config: &Config) -> Self {
        let strip =
            |one: &crate::config::Controller| LanePlace { row: one.row.clone(), group: one.group.clone() };
        let lanes: Vec<LanePlace> = config.controllers.iter().map(strip).collect();
        let rows: BTreeMap<String, f64> =
            config.named().filter_map(|one| Some((one.row.clone()?, 1.0))).collect();
        let effects = config.switch_names().map(|name| (name.to_owned(), true)).collect();
        let levels = Levels { motion: 1.0, vibration: 1.0, effects, rows };
        Self { ceiling: levels.clone(), levels, trim_ms: 0, out: BTreeMap::new(), only: None, lanes }
    }

    /// The same with what was set before, as far as this configuration knows it.
    pub(super) fn with(config: &Config, before: &Settings) -> Self {
        let mut settings = Self::new(config);
        let Settings { levels, ceiling, trim_ms, out, .. } = before;
        carry(&mut settings.levels, levels);
        carry(&mut settings.ceiling, ceiling.as_ref().unwrap_or(levels));
        settings.trim_ms = *trim_ms;
        settings.out.clone_from(out);
        settings
    }

    /// Changes levels and effects, as a person does; nothing is changed where one of them is not known or not within 0 to 1.
    ///
    /// # Errors
    /// Every fault.
    pub(super) fn change(&mut self, change: &LevelsChange) -> Result<(), Problem> {
        self.change_below(change)?;
        apply(&mut self.ceiling, change);
        Ok(())
    }

    /// The same for gear, of what a person has allowed for.
    ///
    /// # Errors
    /// Every fault.
    pub(super) fn change_below(&mut self, change: &LevelsChange) -> Result<(), Problem> {
        let mut faults = Vec::new();
        let levels = [("motion", change.motion), ("vibration", change.vibration)];
        let levels = levels.into_iter().filter_map(|(name, level)| Some((name.to_owned(), level?)));
        let rows = change.rows.iter().map(|(row, level)| (format!("row {row}"), *level));
        for (name, level) in levels.chain(rows).filter(|(_, level)| !(0.0..=1.0).contains(level)) {
            faults.push(format!("{name}: {}", no_level(level)));
        }
        if !faults.is_empty() {
            return Err(
                Problem::new(Code::Value, "levels not changed", "give levels from 0 to 1").with(faults)
            );
        }
        let rows = unknown("row", change.rows.keys(), self.levels.rows.keys());
        let effects = unknown("effect", change.effects.keys(), self.levels.effects.keys());
        let faults: Vec<_> = rows.chain(effects).collect();
        if !faults.is_empty() {
            let remedy = "give rows and effects of the configuration; the status lists them";
            return Err(Problem::new(Code::Unknown, "levels not changed", remedy).with(faults));
        }
        apply(&mut self.levels, change);
        Ok(())
    }

    /// Takes a group in, or out. One that is out already stays so since then, and by whom it was, but for one that gear took out and
    /// now a person; a reason that is given now counts.
    pub(super) fn enable(&mut self, group: &str, out: Option<Out>) {
        let Some(out) = out else {
            self.out.remove(group);
            return;
        };
        if self.out.get(group).is_some_and(|before| before.surface.is_gear() && !out.surface.is_gear()) {
            self.out.remove(group);
        }
        let why = out.why.clone();
        let entry = self.out.entry(group.to_owned()).or_insert(out);
        entry.why = why.or_else(|| entry.why.take());
    }

    /// True if a lane is to take part.
    pub(super) fn is_on(&self, lane: usize) -> bool {
        let LanePlace { row, group } = &self.lanes[lane];
        let tested = match (&self.only, row) {
            (None, _) => true,
            (Some(only), Some(row)) => only.contains(row),
            (Some(_), None) => false,
        };
        !self.out.contains_key(group) && tested
    }

    /// The group of a lane.
    pub(super) fn group(&self, lane: usize) -> &str {
        &self.lanes[lane].group
    }

    /// What each lane makes of a cue that has these effects.
    pub(super) fn mixes(&self, effects: &[String]) -> Vec<Mix> {
        let allowed = |name: &str| self.levels.effects.get(name).copied().unwrap_or(true);
        let off = effects.iter().enumerate().filter(|(_, name)| !allowed(name));
        let named = off.fold(u32::MAX, |mask, (bit, _)| mask & !(1 << bit));
        // A raw output word passes where every bit is set: where no effect at all is off.
        let all = self.levels.effects.iter().all(|(name, on)| *on || channel::is_switch(name));
        let mask = if all { named } else { named & !(1 << 31) };
        let switches = channel::switches().enumerate().filter(|(_, (_, _, name))| allowed(name));
        let switches = switches.fold(0, |mask, (bit, _)| mask | 1 << bit);
        let mix = |(lane, strip): (usize, &LanePlace)| {
            let row = strip.row.as_ref().and_then(|row| self.levels.rows.get(row)).copied().unwrap_or(1.0);
            Mix {
                motion: self.levels.motion * row,
                vibration: self.levels.vibration * row,
                effects: mask,
                switches,
                on: self.is_on(lane),
            }
        };
        self.lanes.iter().enumerate().map(mix).collect()
    }

    /// Sets the desk accordingly.
    pub(super) fn set(&self, desk: &Desk, effects: &[String]) {
        for (lane, mix) in self.mixes(effects).into_iter().enumerate() {
            desk.set(lane, mix);
        }
        desk.set_trim_ms(self.trim_ms);
    }
}

/// Those of `asked` that are not among `known`, each with the one that it may be a slip for.
fn unknown<'a>(
    what: &'static str,
    asked: impl Iterator<Item = &'a String>,
    known: impl Iterator<Item = &'a String> + Clone,
) -> impl Iterator<Item = String> {
    asked.filter_map(move |name| {
        let known = || known.clone().map(String::as_str);
        known().all(|one| one != name).then(|| there_is_no(what, name, known()))
    })
}

fn apply(levels: &mut Levels, change: &LevelsChange) {
    levels.motion = change.motion.unwrap_or(levels.motion);
    levels.vibration = change.vibration.unwrap_or(levels.vibration);
    levels.rows.extend(change.rows.clone());
    levels.effects.extend(change.effects.clone());
}

/// Takes over what was set before, as far as it is known here.
fn carry(levels: &mut Levels, before: &Levels) {
    levels.motion = before.motion;
    levels.vibration = before.vibration;
    for (name, on) in &mut levels.effects {
        *on = before.effects.get(name).copied().unwrap_or(*on);
    }
    for (row, level) in &mut levels.rows {
        *level = before.rows.get(row).copied().unwrap_or(*level);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::from_to_args;

    #[test]
    fn an_output_is_switched_as_an_effect_is_and_keeps_no_raw_output_word_back() {
        let config = from_to_args(&["127.0.0.1:1".to_owned()], &[], 1).unwrap();
        let mut settings = HallSettings::new(&config);
        let change =
            |name: &str, on| LevelsChange { effects: [(name.to_owned(), on)].into(), ..<_>::default() };
        settings.change(&change("dac2", false)).unwrap();
        let mix = settings.mixes(&[])[0];
        assert_eq!((mix.switches, mix.effects), (0b01, u32::MAX));
        settings.change(&change("water", false)).unwrap();
        let mix = settings.mixes(&["air".to_owned(), "water".to_owned()])[0];
        assert_eq!((mix.switches, mix.effects), (0b01, !(1 << 1 | 1 << 31)));
        assert!(settings.change(&change("dac3", false)).is_err());
    }
}
