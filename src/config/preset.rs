//! `[preset.NAME]`: levels and effects that are set together, by a name.

use std::collections::BTreeMap;

use super::Effect;
use super::fault::Faults;
use super::level::{level, switches};
use super::section::{Entry, Section};

/// Levels and effects that are set together. What it does not name stays as it is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Preset {
    /// Its name.
    pub(crate) name: String,
    /// Of the motion about the neutral pose, 0 to 1.
    pub(crate) motion: Option<f64>,
    /// Of the vibration, 0 to 1.
    pub(crate) vibration: Option<f64>,
    /// True if an effect may be on, by its name.
    pub(crate) effects: BTreeMap<String, bool>,
}

/// Reads the presets; every effect that they name has to be one of the site's.
pub(super) fn presets(entry: Entry<'_>, effects: &[Effect], faults: &mut Faults<'_>) -> Vec<Preset> {
    let Some(table) = entry.table(faults) else { return Vec::new() };
    table
        .iter()
        .filter_map(|(name, value)| preset(Entry::new(name.get_ref(), value), effects, faults))
        .collect()
}

fn preset(entry: Entry<'_>, effects: &[Effect], faults: &mut Faults<'_>) -> Option<Preset> {
    let table = entry.table(faults)?;
    let mut section = Section::new(format!("[preset.{}]", entry.key), entry.at, table, faults);
    let motion = level(&mut section, "motion");
    let vibration = level(&mut section, "vibration");
    let effects_at = section.get("effects");
    section.finish();
    let effects = effects_at.map_or_else(BTreeMap::new, |entry| switches(entry, Some(effects), faults));
    Some(Preset { name: entry.key.to_owned(), motion, vibration, effects })
}

#[cfg(test)]
mod tests {
    use crate::config::tests::{faults_of, hall_with};

    #[test]
    fn a_preset_sets_levels_and_effects_together() {
        let hall = hall_with(
            "[effects]\nwater = 2\n[preset.kids]\nmotion = \"60%\"\nvibration = 0.5\neffects = { water = false }\n\
             [preset.loud]\n",
        );
        let kids = hall.preset("kids").unwrap();
        assert_eq!((kids.motion, kids.vibration, kids.effects["water"]), (Some(0.6), Some(0.5), false));
        assert_eq!(hall.preset("loud").unwrap().motion, None);
        assert!(hall.preset("silent").is_none());
    }

    #[test]
    fn a_preset_that_says_what_cannot_be_is_refused_with_every_fault() {
        let faults = faults_of(
            "[effects]\nwater = 2\n[preset.kids]\nmotion = 1.5\nvibration = \"loud\"\nlevel = 1\n\
             effects = { watr = false, water = 1 }\n",
        );
        let [motion, vibration, level, effect, switch] = &faults[..] else { panic!("{faults:?}") };
        assert!(motion.contains("motion: 1.5 is outside 0..=1"), "{motion}");
        assert!(vibration.contains("vibration: not a level"), "{vibration}");
        assert!(level.contains("level: unknown key in [preset.kids]"), "{level}");
        assert!(effect.ends_with("watr: is not in [effects]; did you mean water?"), "{effect}");
        assert!(switch.contains("water: expected true or false"), "{switch}");
    }
}
