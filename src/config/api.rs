//! `[api]`: where HTTP is served besides the control socket, to whom, and who they are.

use std::net::SocketAddr;

use serde::{Deserialize, Serialize};

use super::fault::Faults;
use super::section::{Entry, Section};
use crate::plain;

/// HTTP over TCP. By default there is none: the control socket alone is served.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Api {
    /// Where it listens; nowhere by default.
    pub listen: Vec<SocketAddr>,
    /// What the Host header of a request may be, `name` or `name:port`; empty for the addresses that it listens on.
    pub hosts: Vec<String>,
    /// What the Origin header of a request may be, where there is one; empty for the hosts, by http and https.
    pub origins: Vec<String>,
    /// What whoever comes without a token may do; nothing by default.
    pub open_role: Option<Role>,
    /// Who may do more, each by a token of their own.
    pub tokens: Vec<ApiToken>,
}

/// Somebody who has a token.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ApiToken {
    /// Their name in the journal, unlike any other's.
    pub name: String,
    /// What they may do.
    pub role: Role,
    /// SHA-256 of the token; the token itself stands nowhere.
    pub sha256: [u8; 32],
}

/// What somebody may do; each role may do all that those before it may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Look, and stop.
    View,
    /// Run a show that is armed: load, go, pause, seek, park, levels, trim, seats, preflight.
    Operate,
    /// Home, clear, test seats, arm, reload and change the library.
    Engineer,
}

plain::displayed!(Role {
    Self::View => "view",
    Self::Operate => "operate",
    Self::Engineer => "engineer",
});

/// Reads the table `[api]`.
pub(crate) fn api(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Api> {
    let mut section = Section::new("[api]", entry.at, entry.table(faults)?, faults);
    let open = [("none", None), ("view", Some(Role::View))];
    let listen = list(&mut section, "listen", address);
    let hosts = list(&mut section, "hosts", |entry, faults| checked(entry, faults, check_host));
    let api = Api {
        origins: list(&mut section, "origins", |entry, faults| checked(entry, faults, check_origin)),
        open_role: section.choice("open_role", &open).flatten(),
        tokens: tokens(&mut section),
        listen,
        hosts,
    };
    section.finish();
    if api.hosts.is_empty()
        && let Some(any) = api.listen.iter().find(|address| address.ip().is_unspecified())
    {
        entry.fault(
            faults,
            &format!("listen has {any}, any address of this machine; list its names in hosts"),
        );
    }
    Some(api)
}

/// The values of an array that can be read, `None` if the key is missing.
fn list<T>(
    section: &mut Section<'_, '_, '_>,
    key: &'static str,
    mut read: impl FnMut(Entry<'_>, &mut Faults<'_>) -> Option<T>,
) -> Vec<T> {
    let entries = section.get(key).and_then(|entry| entry.array(section.faults)).unwrap_or_default();
    entries.into_iter().filter_map(|entry| read(entry, section.faults)).collect()
}

fn address(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<SocketAddr> {
    let text = entry.text(faults)?;
    let address = text.parse().ok();
    if address.is_none() {
        entry.fault(
            faults,
            &format!("{text:?} is not an address and port; write 127.0.0.1:8480 or [::1]:8480"),
        );
    }
    address
}

fn checked(
    entry: Entry<'_>,
    faults: &mut Faults<'_>,
    check: fn(&str) -> Result<(), &'static str>,
) -> Option<String> {
    let text = entry.text(faults)?;
    match check(text) {
        Ok(()) => Some(text.to_ascii_lowercase()),
        Err(why) => {
            entry.fault(faults, &format!("{text:?} {why}"));
            None
        }
    }
}

fn check_host(host: &str) -> Result<(), &'static str> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "-.:[]_".contains(c);
    if host.chars().all(fits) { Ok(()) } else { Err("is not a host; write hall-1.example:8480") }
}

fn check_origin(origin: &str) -> Result<(), &'static str> {
    let host = origin.strip_prefix("https://").or_else(|| origin.strip_prefix("http://"));
    match host {
        Some(host) if !host.is_empty() && check_host(host).is_ok() => Ok(()),
        _ => Err("is not an origin, such as http://hall-1.example:8480, without a path"),
    }
}

fn tokens(section: &mut Section<'_, '_, '_>) -> Vec<ApiToken> {
    let entries = section.get("token").and_then(|entry| entry.array(section.faults)).unwrap_or_default();
    let mut tokens: Vec<ApiToken> = Vec::new();
    for entry in entries {
        let Some(token) = token(entry, section.faults) else { continue };
        if tokens.iter().any(|before| before.name == token.name) {
            entry.fault(section.faults, &format!("{} already has a token; use another name", token.name));
        } else if tokens.iter().any(|before| before.sha256 == token.sha256) {
            entry.fault(section.faults, &format!("{} has the same token as another name", token.name));
        }
        tokens.push(token);
    }
    tokens
}

fn token(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<ApiToken> {
    let roles = [("view", Role::View), ("operate", Role::Operate), ("engineer", Role::Engineer)];
    let mut section = Section::new("[[api.token]]", entry.at, entry.table(faults)?, faults);
    section.require(&["name", "role", "sha256"]);
    let name = section.text("name");
    let role = section.choice("role", &roles);
    let sha256 = section.get("sha256").and_then(|entry| hash(entry, section.faults));
    section.finish();
    Some(ApiToken { name: name?, role: role?, sha256: sha256? })
}

/// The SHA-256 of a token, as `kinocue token` writes it.
pub(super) fn hash(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<[u8; 32]> {
    let text = entry.text(faults)?;
    let hash = from_hex(text);
    if hash.is_none() {
        let message = "is not a SHA-256 of 64 hexadecimal digits; `kinocue token NAME --role ROLE` makes one";
        entry.fault(faults, message);
    }
    hash
}

fn from_hex(text: &str) -> Option<[u8; 32]> {
    let digits = text.as_bytes();
    if digits.len() != 64 || !digits.iter().all(u8::is_ascii_hexdigit) {
        return None;
    }
    let mut bytes = [0; 32];
    for (byte, pair) in bytes.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok()?;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::{Config, ConfigFaults, read};

    fn hall(api: &str) -> Result<Config, Vec<String>> {
        let text = format!(
            "[seat.s]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
             max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
             [[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"10.0.0.1:7408\"\n{api}\n"
        );
        read::document(Path::new("hall.toml"), &text).map_err(|faults| match faults {
            ConfigFaults::Bad(faults) => faults.iter().map(ToString::to_string).collect(),
            ConfigFaults::Unreadable { .. } => unreachable!("a text is no file"),
        })
    }

    fn fault(api: &str) -> String {
        hall(api).unwrap_err().remove(0)
    }

    #[test]
    fn without_the_table_nothing_is_served_over_tcp() {
        assert_eq!(hall("").unwrap().api, Api::default());
        assert_eq!(hall("[api]").unwrap().api, Api::default());
    }

    #[test]
    fn the_table_reads_as_it_is_written() {
        let digits = "00ff".repeat(16);
        let api = hall(&format!(
            "[api]\nlisten = [\"127.0.0.1:8480\", \"[::1]:8480\"]\nhosts = [\"Hall-1:8480\"]\n\
             origins = [\"https://hall-1.example\"]\nopen_role = \"view\"\n\
             [[api.token]]\nname = \"tablet\"\nrole = \"operate\"\nsha256 = \"{digits}\"\n"
        ));
        let api = api.unwrap().api;
        assert_eq!(api.listen.len(), 2);
        assert_eq!(
            (api.hosts[0].as_str(), api.origins[0].as_str()),
            ("hall-1:8480", "https://hall-1.example")
        );
        assert_eq!((api.open_role, api.tokens[0].role), (Some(Role::View), Role::Operate));
        assert_eq!(api.tokens[0].sha256[..4], [0x00, 0xff, 0x00, 0xff]);
    }

    #[test]
    fn what_would_open_the_door_wider_than_meant_is_refused() {
        assert!(
            fault("[api]\nlisten = [\"8480\"]")
                .contains("hall.toml:14:11: listen: \"8480\" is not an address")
        );
        assert!(fault("[api]\nlisten = [\"0.0.0.0:8480\"]").contains("any address of this machine"));
        assert!(fault("[api]\nhosts = [\"http://hall\"]").contains("is not a host"));
        assert!(fault("[api]\norigins = [\"http://hall/page\"]").contains("is not an origin"));
        assert!(fault("[api]\norigins = [\"*\"]").contains("is not an origin"));
        assert!(fault("[api]\nopen_role = \"operate\"").contains("is not one of none, view"));
        assert!(fault("[api]\nport = 1").contains("port: unknown key in [api]"));
    }

    #[test]
    fn a_token_has_a_name_a_role_and_a_hash_of_its_own() {
        let token = |name: &str, hash: &str| {
            format!("[[api.token]]\nname = \"{name}\"\nrole = \"view\"\nsha256 = \"{hash}\"\n")
        };
        let (a, b) = ("a".repeat(64), "b".repeat(64));
        assert!(hall(&(token("x", &a) + &token("y", &b))).is_ok());
        assert!(fault(&(token("x", &a) + &token("x", &b))).contains("x already has a token"));
        assert!(fault(&(token("x", &a) + &token("y", &a))).contains("the same token as another name"));
        assert!(fault(&token("x", "secret")).contains("`kinocue token NAME --role ROLE` makes one"));
        assert!(fault("[[api.token]]\nname = \"x\"\nrole = \"admin\"").contains("has no sha256"));
    }
}
