//! `[pair]`: the two show machines of a hall, one of which leads; without the table there is one.

use std::net::SocketAddrV4;
use std::path::PathBuf;

use super::fault::Faults;
use super::fleet::is_fleet_id;
use super::section::{Entry, Section};

/// Networks between the machines at the most.
const NETWORKS: usize = 2;

/// Two show machines, with one configuration for both.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Pair {
    /// The file of the key that both have, 64 hexadecimal digits; beside the configuration where it is no whole path.
    pub(crate) key: PathBuf,
    /// The machines; of two that start together the first leads.
    pub(crate) machines: [PairMachine; 2],
}

/// One show machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PairMachine {
    /// What people call it.
    pub(crate) name: String,
    /// Where it hears the other one, one address for each network between them.
    pub(crate) addresses: Vec<SocketAddrV4>,
}

/// Reads the table of a hall that may have serial links, or be in a fleet.
pub(super) fn pair(entry: Entry<'_>, has_links: bool, faults: &mut Faults<'_>) -> Option<Pair> {
    if has_links {
        entry.fault(faults, "serial lines end at one machine; a hall with [link] has no second one");
    }
    let at = entry.at;
    let mut section = Section::new("[pair]", at, entry.table(faults)?, faults);
    section.require(&["key", "machine"]);
    let key = section.text("key").map(PathBuf::from);
    section.refuse("takeover", "this version leaves it to a person to go on after a takeover; remove it");
    let entries = section.get("machine").and_then(|entry| entry.array(section.faults));
    section.finish();
    let found: Vec<_> = entries?.into_iter().filter_map(|entry| machine(entry, faults)).collect();
    let machines = <[PairMachine; 2]>::try_from(found);
    if let Ok([first, second]) = &machines {
        let is_twice = first.addresses.iter().any(|address| second.addresses.contains(address));
        if first.name == second.name || is_twice {
            faults.note(at, "pair: both machines have the same name or address; give each its own");
        }
        if first.addresses.len() != second.addresses.len() {
            faults
                .note(at, "pair: one machine has more addresses; give each one in each network between them");
        }
    } else if faults.is_empty() {
        faults.note(at, "pair: there are two machines in a pair; write [[pair.machine]] twice");
    }
    Some(Pair { key: key?, machines: machines.ok()? })
}

fn machine(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<PairMachine> {
    let mut section = Section::new("[[pair.machine]]", entry.at, entry.table(faults)?, faults);
    section.require(&["name", "addresses"]);
    let name = section.get("name").and_then(|entry| name(entry, section.faults));
    let list = section.get("addresses");
    section.finish();
    let list = list?;
    let addresses: Option<Vec<_>> =
        list.array(faults)?.into_iter().map(|entry| address(entry, faults)).collect();
    let addresses = addresses?;
    if addresses.is_empty() || addresses.len() > NETWORKS {
        list.fault(faults, "has to have one address, or two in two networks");
    }
    Some(PairMachine { name: name?, addresses })
}

fn name(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<String> {
    let text = entry.text(faults)?.to_owned();
    if !is_fleet_id(&text.to_lowercase()) {
        entry.fault(faults, &format!("{text:?} is not a name here: letters, digits, - and _"));
        return None;
    }
    Some(text)
}

fn address(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<SocketAddrV4> {
    let text = entry.text(faults)?;
    let address: Option<SocketAddrV4> = text.parse().ok();
    let fits = |address: &SocketAddrV4| {
        let ip = address.ip();
        !(ip.is_unspecified() || ip.is_multicast() || ip.is_broadcast() || address.port() == 0)
    };
    let address = address.filter(fits);
    if address.is_none() {
        entry.fault(
            faults,
            &format!("{text:?} is not the address of a machine and a port, such as 10.1.0.1:8430"),
        );
    }
    address
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::{faults_of, hall_with};

    const A: &str = "[[pair.machine]]\nname = \"A\"\naddresses = [\"10.1.0.1:8430\", \"10.2.0.1:8430\"]\n";
    const B: &str = "[[pair.machine]]\nname = \"B\"\naddresses = [\"10.1.0.2:8430\", \"10.2.0.2:8430\"]\n";

    #[test]
    fn a_hall_has_one_machine_unless_its_configuration_names_two() {
        assert_eq!(hall_with("").pair, None);
        let pair = hall_with(&format!("[pair]\nkey = \"pair.key\"\n{A}{B}")).pair.unwrap();
        assert_eq!(pair.key, PathBuf::from("pair.key"));
        let names = pair.machines.each_ref().map(|machine| machine.name.as_str());
        assert_eq!(names, ["A", "B"]);
        assert_eq!(pair.machines[1].addresses[0], "10.1.0.2:8430".parse().unwrap());
    }

    #[test]
    fn what_is_no_pair_is_refused_with_what_to_do() {
        let key = "key = \"k\"\n";
        for (text, says) in [
            (format!("{A}{B}"), "[pair] has no key"),
            (key.to_owned(), "[pair] has no machine"),
            (format!("{key}{A}"), "there are two machines in a pair"),
            (format!("{key}{A}{B}{B}"), "there are two machines in a pair"),
            (format!("{key}{A}{A}"), "the same name or address"),
            (format!("{key}{A}{}", B.replace("10.1.0.2", "10.1.0.1")), "the same name or address"),
            (format!("{key}{A}{}", B.replace(", \"10.2.0.2:8430\"", "")), "one machine has more addresses"),
            (format!("{key}{A}{}", B.replace(":8430", ":0")), "is not the address of a machine and a port"),
            (format!("{key}{A}{}", B.replace("10.1.0.2", "0.0.0.0")), "is not the address of a machine"),
            (format!("{key}{A}{}", B.replace("\"B\"", "\"B.1\"")), "is not a name here"),
            (format!("{key}takeover = \"join\"\n{A}{B}"), "leaves it to a person to go on"),
            (format!("{key}first = 1\n{A}{B}"), "unknown key in [pair]"),
        ] {
            let faults = faults_of(&format!("[pair]\n{text}"));
            assert!(faults.iter().any(|fault| fault.contains(says)), "{text}: {faults:?}");
        }
    }
}
