//! `sources = ["10.0.0.5"]`: whose messages a port takes.

use std::net::Ipv4Addr;

use super::section::{Entry, Section};

/// Reads the list, which has to name somebody: a port for everybody is nothing that one gets by leaving a line out.
pub(super) fn sources(section: &mut Section<'_, '_, '_>) -> Option<Vec<Ipv4Addr>> {
    let entry = section.get("sources")?;
    let entries = entry.array(section.faults)?;
    if entries.is_empty() {
        entry.fault(section.faults, "names nobody; list the addresses of the gear that may ask");
    }
    let addresses = entries.into_iter().filter_map(|entry| source(entry, section)).collect();
    Some(addresses)
}

fn source(entry: Entry<'_>, section: &mut Section<'_, '_, '_>) -> Option<Ipv4Addr> {
    let text = entry.text(section.faults)?;
    let address = text.parse::<Ipv4Addr>().ok().filter(|address| !address.is_unspecified());
    if address.is_none() {
        entry.fault(section.faults, &format!("{text:?} is no IPv4 address of a machine, as 10.0.0.5"));
    }
    address
}
