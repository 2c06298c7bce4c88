//! What is set, in words.

use jiff::Zoned;
use jiff::civil::Date;
use jiff::tz::TimeZone;

use super::{LONGEST_WHY, LoadedShow, Out, Settings};
use crate::control::Levels;
use crate::time::ShowTime;

impl Out {
    /// Since when, by whom and why: `out since yesterday 21:14, by anna: broken leg`.
    #[must_use]
    pub(crate) fn words(&self, now: &Zoned) -> String {
        let why = self.why.as_ref().map(|why| format!(": {why}")).unwrap_or_default();
        format!("out since {}, by {}{why}", since(&self.at, now), self.who)
    }

    /// A reason as it is kept: in a line, `None` if there is nothing to read.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn reason(why: &str) -> Result<Option<String>, String> {
        let why = why.trim();
        if why.chars().any(char::is_control) {
            return Err("the reason has control characters".to_owned());
        }
        match why.chars().count() {
            0 => Ok(None),
            1..=LONGEST_WHY => Ok(Some(why.to_owned())),
            length => Err(format!("the reason has {length} characters, more than {LONGEST_WHY}")),
        }
    }
}

/// `NAMES is out since …`, of the seats that these names are of.
#[must_use]
pub(crate) fn seats_out(names: &[&str], out: &Out, now: &Zoned) -> String {
    let is = if names.len() > 1 { "are" } else { "is" };
    format!("{} {is} {}", names.join(", "), out.words(now))
}

/// A day and time as people say it: `14:05`, `yesterday 21:14`, `Friday`, `2026-11-03`.
fn since(at: &str, now: &Zoned) -> String {
    let Ok(at) = at.parse::<jiff::Timestamp>() else { return at.to_owned() };
    let at = at.to_zoned(TimeZone::clone(now.time_zone()));
    match days(at.date(), now.date()) {
        0 => at.strftime("%H:%M").to_string(),
        1 => at.strftime("yesterday %H:%M").to_string(),
        2..=6 => at.strftime("%A").to_string(),
        // Also what is still to come: the clock was set back.
        _ => at.date().to_string(),
    }
}

fn days(from: Date, to: Date) -> i32 {
    from.until(to).map_or(i32::MAX, |span| span.get_days())
}

impl Settings {
    /// What of levels, effects, trim and what is loaded is otherwise than in a hall in which nobody has set anything; none
    /// where nothing is.
    #[must_use]
    pub(crate) fn words(&self) -> Option<String> {
        let Levels { motion, vibration, effects, rows } = &self.levels;
        let mut words = Vec::new();
        let levels = [("motion".to_owned(), *motion), ("vibration".to_owned(), *vibration)];
        let rows = rows.iter().map(|(row, level)| (format!("row {row}"), *level));
        for (name, level) in levels.into_iter().chain(rows).filter(|(_, level)| *level < 1.0) {
            words.push(format!("{name} {:.0} %", level * 100.0));
        }
        words.extend(effects.iter().filter(|(_, on)| !**on).map(|(name, _)| format!("{name} off")));
        if self.trim_ms != 0 {
            words.push(format!("trim {:+} ms", self.trim_ms));
        }
        words.extend(self.show.as_ref().map(LoadedShow::words));
        (!words.is_empty()).then(|| words.join(", "))
    }
}

impl LoadedShow {
    fn words(&self) -> String {
        let Self { cue, playlist, film_ms, .. } = self;
        let of = playlist.as_ref().map(|at| format!(" (playlist {}, entry {})", at.id, at.entry + 1));
        let left = film_ms.map(|ms| format!(", left at {}", ShowTime::from_millis(ms)));
        format!("cue {cue}{}{}", of.unwrap_or_default(), left.unwrap_or_default())
    }
}
