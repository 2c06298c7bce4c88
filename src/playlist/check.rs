//! Checks if a playlist can be played: everything that may go wrong is found when it is loaded, not when it starts.

use std::collections::BTreeSet;

use super::{Entry, Playlist};
use crate::config::{Config, ConfigFault, did_you_mean};
use crate::control::Problem;
use crate::library::{CueId, CueInfo, Library, Proved};
use crate::plain;

impl Playlist {
    /// Every fault of a playlist for a library and a hall: a cue that is missing or does not pass, a preset or an effect
    /// that is unknown. Cues that nobody has looked at are checked and proved now, so this blocks: seconds a cue, minutes for
    /// a long one beside a show. Empty where all of it can be played.
    #[must_use]
    pub fn check(&self, library: &Library, config: &Config) -> Vec<ConfigFault> {
        self.check_by(config, |cue| library.examine(cue))
    }

    /// The same by what `examine` says of each cue.
    pub(crate) fn check_by(
        &self,
        config: &Config,
        examine: impl Fn(&CueId) -> Result<CueInfo, Problem>,
    ) -> Vec<ConfigFault> {
        let mut faults = Vec::new();
        let mut examined: BTreeSet<(&CueId, bool)> = BTreeSet::new();
        for entry in &self.entries {
            self.check_names(entry, config, &mut faults);
            let begins = entry.film.begins(config).unwrap_or_else(|why| {
                faults.push(self.fault(entry.places.film, why));
                None
            });
            if examined.insert((&entry.cue, begins.is_some()))
                && let Err(message) = judge(&entry.cue, examine(&entry.cue), begins.is_some())
            {
                faults.push(self.fault(entry.places.cue, message));
            }
        }
        faults
    }

    fn check_names(&self, entry: &Entry, config: &Config, faults: &mut Vec<ConfigFault>) {
        if let Some(name) = entry.preset.as_deref().filter(|name| config.preset(name).is_none()) {
            let hint = did_you_mean(name, config.presets.iter().map(|preset| preset.name.as_str()));
            let name = plain::seen(name);
            let message = format!("preset: there is no [preset.{name}] in the configuration{hint}");
            faults.push(self.fault(entry.places.preset, message));
        }
        if entry.film.movie.is_some() && config.film.is_none() {
            let message = "movie: the configuration has no [film], with the player that shows it".to_owned();
            faults.push(self.fault(entry.places.movie, message));
        }
        for name in entry.effects.keys() {
            if !config.effects.iter().any(|effect| effect.name == *name) {
                let hint = did_you_mean(name, config.effects.iter().map(|effect| effect.name.as_str()));
                let name = plain::seen(name);
                let message = format!("{name}: is not in [effects] of the configuration{hint}");
                faults.push(self.fault(entry.places.effects, message));
            }
        }
    }

    /// Which of its films cannot be shown now, and why. Somebody may copy them yet before their time.
    #[must_use]
    pub(crate) fn missing(&self, config: &Config) -> Vec<String> {
        let movies: BTreeSet<_> =
            self.entries.iter().filter_map(|entry| entry.film.movie.as_deref()).collect();
        let player = config.film.iter();
        player.flat_map(|player| movies.iter().filter_map(|movie| player.find(movie).err())).collect()
    }

    fn fault(&self, (line, column): (usize, usize), message: String) -> ConfigFault {
        ConfigFault { path: self.path.clone(), line, column, message }
    }
}

/// Why a cue cannot be played, or not led by a film, if it cannot.
fn judge(cue: &CueId, info: Result<CueInfo, Problem>, is_led: bool) -> Result<(), String> {
    let info = info.map_err(|problem| format!("cue: {}; {}", problem.detail, problem.remedy))?;
    let failed = |when: &str, faults: &[String]| {
        let first = faults.first().map_or("it does not pass", String::as_str);
        let more = match faults.len() {
            0 | 1 => String::new(),
            faults => format!(" (and {} more)", faults - 1),
        };
        Err(format!("cue: {cue} does not pass{when}: {first}{more}"))
    };
    match info.proof {
        Proved::Passed if is_led && !info.led_faults.is_empty() => {
            failed(" at every pace that its film may ask for", &info.led_faults)
        }
        Proved::Passed => Ok(()),
        Proved::Failed { faults } => failed("", &faults),
        Proved::Unknown => Err(format!("cue: {cue} has not been checked")),
    }
}
