//! What operators have set: levels, effects, seats on or off, and what that means for each lane.

use std::collections::{BTreeMap, BTreeSet};

use crate::config::Config;
use crate::engine::Mix;
use crate::hall::{Code, Levels, LevelsChange, Problem};
use crate::rt::Desk;

/// What is set.
#[derive(Debug, Clone)]
pub(super) struct Board {
    pub(super) levels: Levels,
    /// The same as people have set it: what gear may set at the most.
    pub(super) ceiling: Levels,
    pub(super) trim_ms: i32,
    /// Groups that gear took out, and no person since.
    pub(super) gear_out: BTreeSet<String>,
    /// Groups that are taken out.
    pub(super) out: BTreeSet<String>,
    /// Rows that alone take part, while seats are tested; none where all do.
    pub(super) only: Option<BTreeSet<String>>,
    lanes: Vec<Strip>,
}

/// What has to be known of a lane.
#[derive(Debug, Clone)]
struct Strip {
    row: Option<String>,
    group: String,
}

impl Board {
    /// All of everything.
    pub(super) fn new(config: &Config) -> Self {
        let strip =
            |one: &crate::config::Controller| Strip { row: one.row.clone(), group: one.group.clone() };
        let lanes: Vec<Strip> = config.controllers.iter().map(strip).collect();
        let rows: BTreeMap<String, f64> =
            lanes.iter().filter_map(|lane| Some((lane.row.clone()?, 1.0))).collect();
        let effects = config.effects.iter().map(|effect| (effect.name.clone(), true)).collect();
        let levels = Levels { motion: 1.0, vibration: 1.0, effects, rows };
        let (ceiling, none) = (levels.clone(), BTreeSet::new());
        Self { levels, ceiling, trim_ms: 0, gear_out: none.clone(), out: none, only: None, lanes }
    }

    /// What is set goes over to the board of another configuration, as far as that knows it.
    pub(super) fn carry_over(&mut self, before: &Self) {
        carry(&mut self.levels, &before.levels);
        carry(&mut self.ceiling, &before.ceiling);
        self.trim_ms = before.trim_ms;
        self.out = before
            .out
            .iter()
            .filter(|group| self.lanes.iter().any(|lane| lane.group == **group))
            .cloned()
            .collect();
        self.gear_out = before.gear_out.intersection(&self.out).cloned().collect();
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
            faults.push(format!("{name}: {level} is outside 0..=1"));
        }
        for row in change.rows.keys().filter(|row| !self.levels.rows.contains_key(*row)) {
            faults.push(format!("there is no row {row}"));
        }
        for name in change.effects.keys().filter(|name| !self.levels.effects.contains_key(*name)) {
            faults.push(format!("there is no effect {name}"));
        }
        if !faults.is_empty() {
            let remedy = "give levels from 0 to 1, and names of the configuration";
            return Err(Problem::new(Code::Value, "levels not changed", remedy).with(faults));
        }
        apply(&mut self.levels, change);
        Ok(())
    }

    /// Takes the group of a controller in, or out.
    pub(super) fn enable(&mut self, group: &str, on: bool) {
        if on {
            self.out.remove(group);
        } else {
            self.out.insert(group.to_owned());
        }
    }

    /// Whether a lane is to take part.
    pub(super) fn is_on(&self, lane: usize) -> bool {
        let Strip { row, group } = &self.lanes[lane];
        let tested = match (&self.only, row) {
            (None, _) => true,
            (Some(only), Some(row)) => only.contains(row),
            (Some(_), None) => false,
        };
        !self.out.contains(group) && tested
    }

    /// What each lane makes of a cue that has these effects.
    pub(super) fn mixes(&self, effects: &[String]) -> Vec<Mix> {
        let on = |name: &String| self.levels.effects.get(name).copied().unwrap_or(true);
        let off = effects.iter().enumerate().filter(|(_, name)| !on(name));
        let named = off.fold(u32::MAX, |mask, (bit, _)| mask & !(1 << bit));
        // A raw output word passes where every bit is set: where no effect at all is off.
        let all = self.levels.effects.values().all(|on| *on);
        let mask = if all { named } else { named & !(1 << 31) };
        let mix = |(lane, strip): (usize, &Strip)| {
            let row = strip.row.as_ref().and_then(|row| self.levels.rows.get(row)).copied().unwrap_or(1.0);
            Mix {
                motion: self.levels.motion * row,
                vibration: self.levels.vibration * row,
                effects: mask,
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
