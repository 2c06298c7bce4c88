//! `fleet.toml` of a hall's link and `desk.toml` of a desk: where the engine is, who it is that comes, and by which key.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use nkeys::{KeyPair, KeyPairType};
use toml::de::DeTable;

use crate::cli::{Exit, Failure, OrExit as _};
use crate::config::{self, Entry, Faults, Section, is_fleet_id};
use crate::journal::is_journal_key;
use crate::sys;
use crate::sys::file::secret;

/// The longest file that is read: a desk has each of its halls twice, as `fleet init` makes it.
pub(super) const LONGEST: u64 = 1 << 20;

/// How a member of a fleet comes to the engine.
#[derive(Debug, Clone)]
pub(super) struct Access {
    /// Where the engine listens, in the order in which it is tried.
    pub(super) engine: Vec<String>,
    /// The key that logs in. It signs whatever the engine sends as a challenge, and therefore nothing else.
    pub(super) pair: KeyPair,
    /// Who signed the engine's certificate, if not an authority that the system knows.
    pub(super) ca: Option<PathBuf>,
}

/// Of a hall's link.
#[derive(Debug)]
pub(super) struct LinkSettings {
    pub(super) access: Access,
    /// `SITE.HALL`.
    pub(super) hall: String,
    /// The time server that all halls of the site ask.
    pub(super) time_server: Option<String>,
}

/// Of a desk.
#[derive(Debug)]
pub(super) struct DeskSettings {
    pub(super) access: Access,
    /// The key that signs orders and wishes.
    pub(super) letters: KeyPair,
    /// Who asks.
    pub(super) name: String,
    /// The halls that there are, `SITE.HALL` each.
    pub(super) halls: Vec<String>,
    /// Those that are started together, by the name of the group.
    pub(super) groups: BTreeMap<String, Vec<String>>,
    /// The public keys that seal the journal of each hall; where it has two show machines, of both.
    pub(super) journals: BTreeMap<String, Vec<String>>,
    /// Where its page is served, and to whom.
    pub(super) api: Option<config::Api>,
    /// Where the consoles of halls are.
    pub(super) consoles: BTreeMap<String, String>,
}

/// Reads the settings of a link.
pub(super) fn link(path: &Path) -> Result<LinkSettings, Failure> {
    read(path, |section| {
        let access = access(section, path);
        let site = section.get("site").and_then(|entry| id(entry, section.faults));
        let hall = section.get("hall").and_then(|entry| id(entry, section.faults));
        let time_server = section.text("time_server");
        section.require(&["site", "hall"]);
        Some(LinkSettings { hall: format!("{}.{}", site?, hall?), access: access?, time_server })
    })
}

/// Reads the settings of a desk.
pub(super) fn desk(path: &Path) -> Result<DeskSettings, Failure> {
    read(path, |section| {
        let access = access(section, path);
        let letters = letters(section, path);
        let name = section.get("name").and_then(|entry| id(entry, section.faults));
        let halls = section.get("halls").and_then(|entry| entry.array(section.faults)).unwrap_or_default();
        let halls = halls.into_iter().filter_map(|entry| member(entry, section.faults)).collect();
        let groups = groups(section);
        let journals = journals(section);
        let api = section.get("api").and_then(|entry| config::api(entry, section.faults));
        let consoles =
            section.get("consoles").map(|entry| consoles(entry, section.faults)).unwrap_or_default();
        section.require(&["name", "halls"]);
        Some(DeskSettings {
            access: access?,
            letters: letters?,
            name: name?,
            halls,
            groups,
            journals,
            api,
            consoles,
        })
    })
}

/// `trio = ["berlin.h1", …]`, in any number.
fn groups(section: &mut Section<'_, '_, '_>) -> BTreeMap<String, Vec<String>> {
    let Some(table) = section.get("groups").and_then(|entry| entry.table(section.faults)) else {
        return BTreeMap::new();
    };
    let mut groups = BTreeMap::new();
    for (name, value) in table {
        let entry = Entry::new(name.get_ref(), value);
        if !is_fleet_id(name.get_ref()) {
            entry.fault(section.faults, "a group is named by a to z, 0 to 9, - and _");
        }
        let halls = entry.array(section.faults).unwrap_or_default();
        let halls: Vec<_> = halls.into_iter().filter_map(|entry| member(entry, section.faults)).collect();
        if halls.is_empty() {
            entry.fault(section.faults, "a group has at least one hall");
        }
        groups.insert(name.get_ref().to_string(), halls);
    }
    groups
}

/// `"berlin.h1" = ["M…"]`, in any number.
fn journals(section: &mut Section<'_, '_, '_>) -> BTreeMap<String, Vec<String>> {
    let Some(table) = section.get("journals").and_then(|entry| entry.table(section.faults)) else {
        return BTreeMap::new();
    };
    let mut journals = BTreeMap::new();
    for (name, value) in table {
        let entry = Entry::new(name.get_ref(), value);
        let keys = entry.array(section.faults).unwrap_or_default();
        let mut known = Vec::new();
        for key in keys {
            match key.text(section.faults) {
                Some(public) if is_journal_key(public) => known.push(public.to_owned()),
                Some(_) => key.fault(
                    section.faults,
                    "a key of a journal begins with M; `kinocue report --keys` prints it in the hall",
                ),
                None => {}
            }
        }
        journals.insert(name.get_ref().to_string(), known);
    }
    journals
}

fn read<T>(path: &Path, take: impl FnOnce(&mut Section<'_, '_, '_>) -> Option<T>) -> Result<T, Failure> {
    let name = path.display();
    let text = sys::file::text(path, LONGEST).map_err(|error| {
        let exit = if error.kind() == ErrorKind::FileTooLarge { Exit::Config } else { Exit::NoInput };
        Failure { exit, error: anyhow::Error::new(error).context(format!("cannot read {name}")) }
    });
    let text = text?;
    let mut faults = Faults::of(&text);
    let (tree, errors) = DeTable::parse_recoverable(&text);
    for error in errors {
        faults.note_syntax(&error);
    }
    let mut section = Section::new("the file", 0, tree.get_ref(), &mut faults);
    let taken = take(&mut section);
    section.finish();
    match taken {
        Some(taken) if faults.is_empty() => Ok(taken),
        _ => {
            let faults: Vec<_> = faults.into_list(path).iter().map(ToString::to_string).collect();
            Err(anyhow!(faults.join("\n"))).or_exit(Exit::Config)
        }
    }
}

fn access(section: &mut Section<'_, '_, '_>, path: &Path) -> Option<Access> {
    section.require(&["engine", "seed"]);
    let entries = section.get("engine").and_then(|entry| entry.array(section.faults)).unwrap_or_default();
    let engine: Vec<_> = entries.into_iter().filter_map(|entry| address(entry, section.faults)).collect();
    let pair = key(section, "seed", KeyPairType::User, path);
    let ca = section.text("ca").map(|name| beside(path, &name));
    Some(Access { engine, pair: pair?, ca })
}

/// The key for letters of a desk. Settings of earlier versions have none: the key that logged in signed them as well.
fn letters(section: &mut Section<'_, '_, '_>, path: &Path) -> Option<KeyPair> {
    if section.get("letters").is_none() {
        let file = path.display();
        let message = format!(
            "letters, the key that signs orders, is missing: `kinocue fleet init --migrate {file}` makes it, and prints what each hall needs"
        );
        section.faults.note_missing(0, message);
    }
    key(section, "letters", KeyPairType::Service, path)
}

/// The key of that kind whose file is named under `name`.
fn key(
    section: &mut Section<'_, '_, '_>,
    name: &'static str,
    kind: KeyPairType,
    path: &Path,
) -> Option<KeyPair> {
    let entry = section.get(name)?;
    let file = beside(path, entry.text(section.faults)?);
    seed(&file, kind).map_err(|why| entry.fault(section.faults, &why)).ok()
}

fn beside(path: &Path, name: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new(".")).join(name)
}

/// `tls://engine.example:4222`; without TLS nothing leaves this machine.
fn address(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<String> {
    let text = entry.text(faults)?;
    let rest = text.strip_prefix("tls://").map(|rest| (true, rest));
    let rest = rest.or_else(|| text.strip_prefix("nats://").map(|rest| (false, rest)));
    let message = match rest.and_then(|(is_tls, rest)| Some((is_tls, rest.rsplit_once(':')?))) {
        Some((is_tls, (host, port)))
            if port.parse::<u16>().is_ok() && !host.is_empty() && !host.contains('@') =>
        {
            if is_tls || is_loopback(host) {
                return Some(text.to_owned());
            }
            format!(
                "{text:?} would send over the network as it is; use tls:// and a certificate for the engine"
            )
        }
        _ => format!("{text:?} is not where an engine listens, such as tls://engine.example:4222"),
    };
    entry.fault(faults, &message);
    None
}

/// True if what is sent there stays on this machine.
pub(super) fn is_loopback(host: &str) -> bool {
    let host = host.trim_start_matches('[').trim_end_matches(']');
    host == "localhost" || host.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback())
}

/// The key in a file that nobody else may read.
fn seed(path: &Path, kind: KeyPairType) -> Result<KeyPair, String> {
    let name = path.display();
    let unread = |error| format!("cannot read {name}: {error}");
    let Some(text) = secret(path, LONGEST).map_err(unread)? else {
        return Err(format!("others may read {name}; `chmod 600` it, and make a new key if somebody did"));
    };
    let pair = KeyPair::from_seed(text.trim()).ok().filter(|pair| pair.key_pair_type() == kind);
    let what = if kind == KeyPairType::User { "to log in at an engine" } else { "for letters" };
    pair.ok_or_else(|| format!("{name} has no key {what}; `kinocue fleet init` makes keys"))
}

fn id(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<String> {
    let text = entry.text(faults)?;
    if !is_fleet_id(text) {
        entry.fault(faults, &format!("{text:?} is not a name here: a to z, 0 to 9, - and _"));
        return None;
    }
    Some(text.to_owned())
}

/// `"berlin.h3" = "http://10.0.0.3:8480"`, by hall.
fn consoles(entry: Entry<'_>, faults: &mut Faults<'_>) -> BTreeMap<String, String> {
    let Some(table) = entry.table(faults) else { return BTreeMap::new() };
    let mut consoles = BTreeMap::new();
    for (hall, value) in table {
        let entry = Entry::new(hall.get_ref(), value);
        let Some(text) = entry.text(faults) else { continue };
        // A link that a page shows: nothing but where a console is.
        if text.starts_with("https://") || text.starts_with("http://") {
            consoles.insert(hall.get_ref().to_string(), text.to_owned());
        } else {
            entry.fault(faults, &format!("{text:?} is no console, such as http://10.0.0.3:8480"));
        }
    }
    consoles
}

fn member(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<String> {
    let text = entry.text(faults)?;
    if !text.split_once('.').is_some_and(|(site, hall)| is_fleet_id(site) && is_fleet_id(hall)) {
        entry.fault(faults, &format!("{text:?} is not SITE.HALL, such as berlin.h3"));
        return None;
    }
    Some(text.to_owned())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    fn of(text: &str, mode: u32) -> Result<LinkSettings, String> {
        let dir = tempfile::tempdir().unwrap();
        let (file, key) = (dir.path().join("fleet.toml"), dir.path().join("fleet.nk"));
        fs::write(&key, KeyPair::new_user().seed().unwrap()).unwrap();
        fs::set_permissions(&key, fs::Permissions::from_mode(mode)).unwrap();
        fs::write(&file, text).unwrap();
        link(&file).map_err(|failure| failure.to_string())
    }

    /// The keys of a desk in that folder; where its settings go.
    fn desk_in(folder: &Path) -> PathBuf {
        for (name, pair) in [("desk.nk", KeyPair::new_user()), ("letters.nk", KeyPair::new_service())] {
            fs::write(folder.join(name), pair.seed().unwrap()).unwrap();
            fs::set_permissions(folder.join(name), fs::Permissions::from_mode(0o600)).unwrap();
        }
        folder.join("desk.toml")
    }

    #[test]
    fn a_desk_knows_which_halls_are_started_together() {
        let dir = tempfile::tempdir().unwrap();
        let file = desk_in(dir.path());
        let of = |groups: &str| {
            let access =
                "engine = [\"nats://127.0.0.1:4222\"]\nseed = \"desk.nk\"\nletters = \"letters.nk\"\n";
            let text = format!("{access}name = \"office\"\nhalls = [\"berlin.h1\", \"berlin.h2\"]\n{groups}");
            fs::write(&file, text).unwrap();
            desk(&file).map(|settings| settings.groups).map_err(|failure| failure.to_string())
        };
        assert!(of("").unwrap().is_empty());
        let trio = of("[groups]\ntrio = [\"berlin.h1\", \"berlin.h2\"]\n").unwrap();
        assert_eq!(trio["trio"], ["berlin.h1", "berlin.h2"]);
        for (groups, says) in [
            ("[groups]\nTrio = [\"berlin.h1\"]\n", "a group is named by"),
            ("[groups]\ntrio = []\n", "a group has at least one hall"),
            ("[groups]\ntrio = [\"h1\"]\n", "is not SITE.HALL"),
        ] {
            let fault = of(groups).unwrap_err();
            assert!(fault.contains(says), "{fault}");
        }
    }

    #[test]
    fn a_desk_has_two_keys_and_neither_does_for_the_other() {
        let dir = tempfile::tempdir().unwrap();
        let file = desk_in(dir.path());
        let of = |keys: &str| {
            let text = format!(
                "engine = [\"nats://127.0.0.1:4222\"]\n{keys}name = \"office\"\nhalls = [\"berlin.h1\"]\n"
            );
            fs::write(&file, text).unwrap();
            desk(&file).map(drop).map_err(|failure| failure.to_string())
        };
        assert_eq!(of("seed = \"desk.nk\"\nletters = \"letters.nk\"\n"), Ok(()));
        for (keys, says) in [
            ("seed = \"desk.nk\"\n", "kinocue fleet init --migrate "),
            ("seed = \"desk.nk\"\nletters = \"desk.nk\"\n", "desk.nk has no key for letters"),
            ("seed = \"letters.nk\"\nletters = \"letters.nk\"\n", "letters.nk has no key to log in"),
        ] {
            let fault = of(keys).unwrap_err();
            assert!(fault.contains(says), "{fault}");
        }
    }

    const SOUND: &str =
        "engine = [\"tls://engine.example:4222\"]\nsite = \"berlin\"\nhall = \"h3\"\nseed = \"fleet.nk\"\n";

    #[test]
    fn a_link_has_its_hall_its_key_and_an_engine_that_it_reaches_in_secret() {
        let settings = of(SOUND, 0o600).unwrap();
        assert_eq!((settings.hall.as_str(), settings.access.engine.len()), ("berlin.h3", 1));
        for local in ["nats://127.0.0.1:4222", "nats://localhost:4222", "nats://[::1]:4222"] {
            assert!(of(&SOUND.replace("tls://engine.example:4222", local), 0o600).is_ok(), "{local}");
        }
    }

    #[test]
    fn what_would_give_a_key_or_a_hall_away_is_refused_with_its_place() {
        for (text, mode, says) in [
            (SOUND.to_owned(), 0o640, "others may read"),
            (
                SOUND.replace("tls", "nats"),
                0o600,
                "fleet.toml:1:11: engine: \"nats://engine.example:4222\" would send",
            ),
            (SOUND.replace("tls://engine.example:4222", "engine"), 0o600, "is not where an engine listens"),
            (SOUND.replace("example:4222", "example:x"), 0o600, "is not where an engine listens"),
            (SOUND.replace("\"h3\"", "\"h3.>\""), 0o600, "is not a name here"),
            (SOUND.replace("fleet.nk", "gone.nk"), 0o600, "cannot read"),
            (SOUND.replace("fleet.nk", "fleet.toml"), 0o600, "others may read"),
            (SOUND.replace("seed", "sede"), 0o600, "did you mean seed?"),
        ] {
            let fault = of(&text, mode).unwrap_err();
            assert!(fault.contains(says), "{fault}");
        }
    }
}
