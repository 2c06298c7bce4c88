//! `[fleet]`: what other houses may ask of this hall by the fleet, and whose signatures are taken; without the table there is no fleet.

use std::time::Duration;

use nkeys::{KeyPair, KeyPairType};

use super::Role;
use super::fault::Faults;
use super::section::{Entry, Section, did_you_mean};
use crate::plain;

/// How far the clock may be off in a start, where nothing is said, ms; and the most that can be said.
const START_BOUND_MS: (f64, f64) = (2.0, 100.0);
/// The longest part of a name in the fleet.
const LONGEST_NAME: usize = 32;

/// The hall as a member of a fleet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Fleet {
    /// Its name there, `SITE.HALL`: what is not addressed to it is not taken.
    pub(crate) name: String,
    /// What may be asked beside a stop; nothing by default.
    pub(crate) allow: Vec<FleetWord>,
    /// True if the fleet may start what a person here has armed for that.
    pub(crate) start: bool,
    /// How far the wall clock may be off in such a start.
    pub(crate) start_bound: Duration,
    /// Whose signatures are taken.
    pub(crate) keys: Vec<FleetKey>,
}

/// Somebody whose signature is taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FleetKey {
    /// Their name in the journal, unlike any other's.
    pub(crate) name: String,
    /// What they may do: operate at the most.
    pub(crate) role: Role,
    /// The public half of their key, as `kinocue fleet init` writes it.
    pub(crate) public: String,
}

/// What the fleet may ask at the most; a stop is always taken. Nothing among it arms, homes, clears or moves a seat that nobody in the
/// hall has armed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum FleetWord {
    /// To hold.
    Pause,
    /// To end a show.
    Park,
    /// To stand down.
    Disarm,
    /// To load a cue, while parked.
    Load,
    /// Levels and effects, up to what a person has set.
    Levels,
    /// To move the motion against the film.
    Trim,
    /// To ask the controllers how they are, while nothing is armed.
    Preflight,
    /// To put cues into the library, while parked; loads none of them.
    Cues,
    /// To put playlists beside the library, while parked; loads none of them.
    Playlists,
    /// To fetch cues out of the library, while parked.
    Pull,
    /// To start at an instant what a person in the hall has armed for that; by a key of its own, not by `allow`.
    Start,
}

impl FleetWord {
    /// Those of `allow`, by the words of the configuration.
    pub(crate) const ALL: [(&'static str, Self); 10] = [
        ("pause", Self::Pause),
        ("park", Self::Park),
        ("disarm", Self::Disarm),
        ("load", Self::Load),
        ("levels", Self::Levels),
        ("trim", Self::Trim),
        ("preflight", Self::Preflight),
        ("cues", Self::Cues),
        ("playlists", Self::Playlists),
        ("pull", Self::Pull),
    ];
    /// Those that are no orders, but say what wishes count for.
    pub(crate) const OF_WISHES: [Self; 2] = [Self::Cues, Self::Playlists];
    /// What nobody who is elsewhere may ask, whatever the configuration says.
    const NEVER: [&'static str; 13] = [
        "arm", "home", "clear", "go", "resume", "seek", "enable", "disable", "seats", "test", "reload",
        "preset", "playlist",
    ];
}

plain::displayed!(FleetWord {
    Self::Pause => "pause",
    Self::Park => "park",
    Self::Disarm => "disarm",
    Self::Load => "load",
    Self::Levels => "levels",
    Self::Trim => "trim",
    Self::Preflight => "preflight",
    Self::Cues => "cues",
    Self::Playlists => "playlists",
    Self::Pull => "pull",
    Self::Start => "start",
});

impl Fleet {
    /// True if the configuration allows it.
    #[must_use]
    pub(crate) fn allows(&self, word: FleetWord) -> bool {
        if word == FleetWord::Start { self.start } else { self.allow.contains(&word) }
    }
}

/// Reads the table.
pub(super) fn fleet(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Fleet> {
    let mut section = Section::new("[fleet]", entry.at, entry.table(faults)?, faults);
    section.require(&["name"]);
    let name = section.get("name").and_then(|entry| name(entry, section.faults));
    let words = section.get("allow").and_then(|entry| entry.array(section.faults)).unwrap_or_default();
    let allow = words.into_iter().filter_map(|entry| word(entry, section.faults)).collect();
    let start = section.get("start").and_then(|entry| entry.switch(section.faults)).unwrap_or(false);
    let (usual, most) = START_BOUND_MS;
    let bound_ms = section.number_in("start_bound_ms", 0.01..=most).unwrap_or(usual);
    let start_bound = Duration::from_secs_f64(bound_ms / 1e3);
    let keys = keys(&mut section);
    section.finish();
    Some(Fleet { name: name?, allow, start, start_bound, keys })
}

/// `berlin.h3`.
fn name(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<String> {
    let text = entry.text(faults)?;
    let parts = text.split_once('.').map(|(site, hall)| [site, hall]);
    if !parts.is_some_and(|parts| parts.into_iter().all(is_fleet_id)) {
        let message = format!(
            "{text:?} is not SITE.HALL, such as berlin.h3: each of a to z, 0 to 9, - and _, at most \
            {LONGEST_NAME} long"
        );
        entry.fault(faults, &message);
        return None;
    }
    Some(text.to_owned())
}

/// True if it can be a site, a hall or a person in a fleet: it is a part of subjects and of keys there.
#[must_use]
pub(crate) fn is_fleet_id(text: &str) -> bool {
    let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
    !text.is_empty() && text.len() <= LONGEST_NAME && text.chars().all(fits)
}

fn word(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<FleetWord> {
    let text = entry.text(faults)?;
    let found = FleetWord::ALL.iter().find(|(word, _)| *word == text).map(|&(_, word)| word);
    // Whoever lists what is allowed will list it too.
    if found.is_none() && text != "stop" {
        let message = if FleetWord::NEVER.contains(&text) {
            format!("{text} is never allowed to the fleet: whoever asks it has to see the seats")
        } else {
            let words = FleetWord::ALL.map(|(word, _)| word);
            let hint = did_you_mean(text, words.into_iter());
            format!("{text:?} is not one of {}, stop{hint}", words.join(", "))
        };
        entry.fault(faults, &message);
    }
    found
}

fn keys(section: &mut Section<'_, '_, '_>) -> Vec<FleetKey> {
    let entries = section.get("key").and_then(|entry| entry.array(section.faults)).unwrap_or_default();
    let mut keys: Vec<FleetKey> = Vec::new();
    for entry in entries {
        let Some(key) = key(entry, section.faults) else { continue };
        if keys.iter().any(|before| before.name == key.name) {
            entry.fault(section.faults, &format!("{} already has a key; use another name", key.name));
        } else if keys.iter().any(|before| before.public == key.public) {
            entry.fault(section.faults, &format!("{} has the same key as another name", key.name));
        }
        keys.push(key);
    }
    keys
}

fn key(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<FleetKey> {
    let roles = [("view", Role::View), ("operate", Role::Operate)];
    let mut section = Section::new("[[fleet.key]]", entry.at, entry.table(faults)?, faults);
    section.require(&["name", "role", "public"]);
    let name = section.get("name").and_then(|entry| key_name(entry, section.faults));
    let role = section.choice("role", &roles);
    let public = section.get("public").and_then(|entry| public(entry, section.faults));
    section.finish();
    Some(FleetKey { name: name?, role: role?, public: public? })
}

fn key_name(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<String> {
    let text = entry.text(faults)?;
    if !is_fleet_id(text) {
        let message =
            format!("{text:?} is not a name here: a to z, 0 to 9, - and _, at most {LONGEST_NAME} long");
        entry.fault(faults, &message);
        return None;
    }
    Some(text.to_owned())
}

/// The public half of a key for letters, which begins with V. The other half, which begins with S, has no place in a configuration; nor
/// has a key that logs in at the engine, which begins with U: an engine that is none could have it sign anything.
fn public(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<String> {
    let text = entry.text(faults)?;
    let kind = KeyPair::from_public_key(text).ok().map(|pair| pair.key_pair_type());
    let fault = match kind {
        _ if text.starts_with('S') => {
            "is the secret half of a key: make a new key, and write the public half here, which begins with V"
        }
        Some(KeyPairType::Service) => return Some(text.to_owned()),
        Some(KeyPairType::User) => {
            "is a key that logs in at the engine, and no longer signs letters: run `kinocue fleet init --migrate desk.toml` at the desk, \
             and write the key here that it prints, which begins with V"
        }
        _ => {
            "is not the public half of a key for letters, which begins with V; `kinocue fleet init` makes keys"
        }
    };
    entry.fault(faults, fault);
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::{faults_of, hall_with};

    #[test]
    fn a_hall_is_in_a_fleet_only_where_its_configuration_says_so_and_allows_nothing_by_itself() {
        assert_eq!(hall_with("").fleet, None);
        let starts =
            hall_with("[fleet]\nname = \"berlin.h3\"\nstart = true\nstart_bound_ms = 0.5\n").fleet.unwrap();
        assert!(starts.start && starts.start_bound == Duration::from_micros(500));
        assert!(starts.allows(FleetWord::Start) && !starts.allows(FleetWord::Pause));
        let alone = hall_with("[fleet]\nname = \"berlin.h3\"\n").fleet.unwrap();
        assert_eq!((alone.start, alone.start_bound), (false, Duration::from_millis(2)));
        assert_eq!((alone.name.as_str(), alone.allow, alone.keys), ("berlin.h3", vec![], vec![]));
        let public = KeyPair::new_service().public_key();
        let fleet = hall_with(&format!(
            "[fleet]\nname = \"berlin.h3\"\nallow = [\"pause\", \"stop\", \"levels\"]\n[[fleet.key]]\nname = \"office\"\n\
             role = \"operate\"\npublic = \"{public}\"\n"
        ));
        let fleet = fleet.fleet.unwrap();
        assert_eq!(fleet.allow, [FleetWord::Pause, FleetWord::Levels]);
        assert_eq!(fleet.keys, [FleetKey { name: "office".to_owned(), role: Role::Operate, public }]);
    }

    #[test]
    fn what_the_fleet_may_never_ask_and_what_is_no_key_is_refused_with_its_place() {
        let (pair, login, account) = (KeyPair::new_service(), KeyPair::new_user(), KeyPair::new_account());
        let key = |name: &str, role: &str, public: &str| {
            format!("[[fleet.key]]\nname = \"{name}\"\nrole = \"{role}\"\npublic = \"{public}\"\n")
        };
        let (public, seed) = (pair.public_key(), pair.seed().unwrap());
        let named = |rest: &str| format!("name = \"berlin.h3\"\n{rest}");
        let mut wrong = vec![
            (String::new(), "[fleet] has no name"),
            ("name = \"berlin\"".to_owned(), "\"berlin\" is not SITE.HALL"),
            ("name = \"berlin.h3.x\"".to_owned(), "is not SITE.HALL"),
            ("name = \"Berlin.*\"".to_owned(), "is not SITE.HALL"),
            (named("allow = [\"pauze\"]"), "did you mean pause?"),
            (named("start = 1"), "start"),
            (named("start_bound_ms = 0"), "start_bound_ms"),
            (named("start_bound_ms = 101"), "start_bound_ms"),
            (named("allow = [\"start\"]"), "\"start\" is not one of"),
            (named("keys = []"), "unknown key in [fleet]; did you mean key?"),
            (named(&key("office", "engineer", &public)), "\"engineer\" is not one of view, operate"),
            (named(&key("of.fice", "view", &public)), "\"of.fice\" is not a name here"),
            (named(&key("office", "view", &seed)), "is the secret half of a key"),
            (named(&key("office", "view", &account.public_key())), "is not the public half"),
            (
                named(&key("office", "operate", &login.public_key())),
                "run `kinocue fleet init --migrate desk.toml`",
            ),
            (named(&key("office", "view", &public[1..])), "is not the public half"),
            (named(&(key("a", "view", &public) + &key("b", "view", &public))), "the same key as another"),
        ];
        wrong.extend(
            FleetWord::NEVER.map(|word| (named(&format!("allow = [\"{word}\"]")), "is never allowed")),
        );
        for (text, says) in wrong {
            let faults = faults_of(&format!("[fleet]\n{text}\n"));
            assert!(faults.iter().any(|fault| fault.contains(says)), "{text}: {faults:?}");
        }
    }
}
