//! `[osc]`: the port that takes OSC; without the table there is none.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::fault::Faults;
use super::section::{Entry, Section};
use super::sources::sources;

/// The port that takes OSC messages over UDP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OscPort {
    /// Where it listens.
    pub listen: SocketAddrV4,
    /// Whose messages are taken, at least one.
    pub sources: Vec<Ipv4Addr>,
    /// What they may ask; stop may be asked always.
    pub allow: Vec<OscWord>,
}

/// What OSC may ask at the most. Arming, homing and clearing are not among it: the address of a datagram proves nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OscWord {
    /// `/kinocue/go`.
    Go,
    /// `/kinocue/pause`.
    Pause,
    /// `/kinocue/resume`.
    Resume,
    /// `/kinocue/park`.
    Park,
    /// `/kinocue/seek`.
    Seek,
    /// `/kinocue/trim`.
    Trim,
    /// `/kinocue/level/…`, `/kinocue/effect/…` and `/kinocue/row/…`.
    Levels,
    /// `/kinocue/seat/…`.
    Seats,
}

impl OscWord {
    /// All of them, by the words of the configuration.
    pub const ALL: [(&'static str, Self); 8] = [
        ("go", Self::Go),
        ("pause", Self::Pause),
        ("resume", Self::Resume),
        ("park", Self::Park),
        ("seek", Self::Seek),
        ("trim", Self::Trim),
        ("levels", Self::Levels),
        ("seats", Self::Seats),
    ];
}

/// Reads the table; what it may ask is everything where `allow` is left out.
pub(super) fn osc(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<OscPort> {
    let mut section = Section::new("[osc]", entry.at, entry.table(faults)?, faults);
    section.require(&["listen", "sources"]);
    let listen = section.address("listen");
    let sources = sources(&mut section);
    let allow = allowed(&mut section);
    section.finish();
    Some(OscPort { listen: listen?, sources: sources?, allow })
}

fn allowed(section: &mut Section<'_, '_, '_>) -> Vec<OscWord> {
    let Some(entry) = section.get("allow") else { return OscWord::ALL.map(|(_, word)| word).to_vec() };
    let words = entry.array(section.faults).unwrap_or_default();
    words.iter().filter_map(|entry| allowed_word(*entry, section.faults)).collect()
}

fn allowed_word(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<OscWord> {
    let text = entry.text(faults)?;
    let found = OscWord::ALL.iter().find(|(word, _)| *word == text).map(|&(_, word)| word);
    // Whoever lists what is allowed will list it too.
    if found.is_none() && text != "stop" {
        let message = match text {
            "arm" | "home" | "clear" => format!("{text} is nothing that OSC may ever ask"),
            _ => {
                let words = OscWord::ALL.map(|(word, _)| word).join(", ");
                format!("{text:?} is none of {words}, stop")
            }
        };
        entry.fault(faults, &message);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::with;

    #[test]
    fn without_the_table_there_is_no_port() {
        assert_eq!(with("").unwrap().osc, None);
    }

    #[test]
    fn a_port_may_be_asked_everything_unless_it_says_what() {
        let all = with("[osc]\nlisten = \"10.0.0.2:53000\"\nsources = [\"10.0.0.5\"]").unwrap().osc.unwrap();
        assert_eq!(all.listen, "10.0.0.2:53000".parse().unwrap());
        assert_eq!(all.sources, [Ipv4Addr::new(10, 0, 0, 5)]);
        assert_eq!(all.allow.len(), OscWord::ALL.len());
        let few = "[osc]\nlisten = \"10.0.0.2:53000\"\nsources = [\"10.0.0.5\"]\nallow = [\"stop\", \"go\"]";
        assert_eq!(with(few).unwrap().osc.unwrap().allow, [OscWord::Go]);
    }

    #[test]
    fn a_port_for_everybody_or_one_that_arms_is_refused() {
        let faults = with("[osc]\nlisten = \"10.0.0.2:53000\"").unwrap_err();
        assert!(faults[0].ends_with("[osc] has no sources, which is needed"), "{faults:?}");
        let faults = with("[osc]\nlisten = \"10.0.0.2:53000\"\nsources = []\nallow = [\"arm\"]").unwrap_err();
        assert!(faults[0].contains("sources: names nobody"), "{faults:?}");
        assert!(faults[1].ends_with("allow: arm is nothing that OSC may ever ask"), "{faults:?}");
        let faults = with("[osc]\nlisten = \"x\"\nsources = [\"box\"]\nallow = [\"gone\"]").unwrap_err();
        assert!(faults.iter().any(|fault| fault.contains("\"box\" is no IPv4 address")), "{faults:?}");
        assert!(faults.iter().any(|fault| fault.contains("\"gone\" is none of go, pause")), "{faults:?}");
    }
}
