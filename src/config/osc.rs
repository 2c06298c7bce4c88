//! `[osc]`: the port that takes OSC; without the table there is none.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::fault::Faults;
use super::gear::{GearWord, allowed, sources};
use super::section::{Entry, Section};

/// The port that takes OSC messages over UDP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct OscPort {
    /// Where it listens.
    pub(crate) listen: SocketAddrV4,
    /// Whose messages are taken, at least one.
    pub(crate) sources: Vec<Ipv4Addr>,
    /// What they may ask; stop may be asked always.
    pub(crate) allow: Vec<GearWord>,
}

/// Reads the table.
pub(super) fn osc(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<OscPort> {
    let mut section = Section::new("[osc]", entry.at, entry.table(faults)?, faults);
    section.require(&["listen", "sources"]);
    let listen = section.address("listen");
    let sources = sources(&mut section);
    let allow = allowed(&mut section);
    section.finish();
    Some(OscPort { listen: listen?, sources: sources?, allow })
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
    fn a_port_may_be_asked_what_it_lists_and_little_unless_it_does() {
        let bare = with("[osc]\nlisten = \"10.0.0.2:53000\"\nsources = [\"10.0.0.5\"]").unwrap().osc.unwrap();
        assert_eq!(bare.listen, "10.0.0.2:53000".parse().unwrap());
        assert_eq!(bare.sources, [Ipv4Addr::new(10, 0, 0, 5)]);
        assert_eq!(bare.allow, GearWord::DEFAULT);
        assert!(
            !bare.allow.iter().any(|word| matches!(word, GearWord::Park | GearWord::Seek | GearWord::Trim))
        );
        let few = "[osc]\nlisten = \"10.0.0.2:53000\"\nsources = [\"10.0.0.5\"]\nallow = [\"stop\", \"go\"]";
        assert_eq!(with(few).unwrap().osc.unwrap().allow, [GearWord::Go]);
    }

    #[test]
    fn a_port_for_everybody_or_one_that_arms_is_refused() {
        let faults = with("[osc]\nlisten = \"10.0.0.2:53000\"").unwrap_err();
        assert!(faults[0].ends_with("[osc] has no sources, which is needed"), "{faults:?}");
        let faults = with("[osc]\nlisten = \"10.0.0.2:53000\"\nsources = []\nallow = [\"arm\"]").unwrap_err();
        assert!(faults[0].contains("sources: is empty"), "{faults:?}");
        assert!(faults[1].ends_with("allow: arm is never allowed to show-control gear"), "{faults:?}");
        let faults = with("[osc]\nlisten = \"x\"\nsources = [\"box\"]\nallow = [\"gone\"]").unwrap_err();
        assert!(faults.iter().any(|fault| fault.contains("\"box\" is not an IPv4 address")), "{faults:?}");
        assert!(faults.iter().any(|fault| fault.contains("\"gone\" is not one of go, pause")), "{faults:?}");
    }
}
