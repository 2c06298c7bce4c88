//! `[link.NAME]`: the serial lines, and CAN buses, that drives share. What a link must be for its drives is judged with them, in
//! `drive_controller`.

use std::fs;
use std::path::{Path, PathBuf};

use super::drive::DriveFamily;
use super::fault::Faults;
use super::section::{Entry, Section};
use crate::wire::sixpack2::BAUD_CLOCK;

/// Bits a second that a SilverMax knows (BRT 174, command reference page 35).
const SILVERMAX_BAUDS: [u32; 12] =
    [300, 1_200, 2_400, 4_800, 9_600, 19_200, 28_800, 38_400, 57_600, 100_000, 115_200, 230_400];
/// The rates between which a SIXpack 2 is switched.
const SIXPACK2_BAUDS: std::ops::RangeInclusive<u32> = 9_600..=250_000;
/// How far from the rate that was asked for a SIXpack 2 may be: another program asks for 57,600, and it makes 56,818.
const TOLERANCE: f64 = 0.02;
/// The bit rate of a CAN bus unless another is named, and all there are.
const CAN_BAUD: u32 = 500_000;
const CAN_BAUDS: std::ops::RangeInclusive<u32> = 50_000..=1_000_000;
/// Segments a second that no drive executes any more.
const MOST_HZ: f64 = 500.0;

/// A line or bus that drives of one family share.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Link {
    /// Its name, as addresses have it behind `link:`.
    pub(crate) name: String,
    /// The device, or the interface of a bus.
    pub(crate) port: PathBuf,
    /// How it is wired.
    pub(crate) wiring: LinkWiring,
    /// Bits a second as the drives make them.
    pub(crate) baud: u32,
    /// Bits a second as they stand in the file, or would.
    pub(crate) asked_baud: u32,
    /// Stop bits of an octet, 1 or 2.
    pub(crate) stop_bits: u8,
    /// The adapter returns what is sent.
    pub(crate) has_echo: bool,
    /// Segments or targets a second for each axis; `None` for the most that fit.
    pub(crate) rate_hz: Option<f64>,
    /// What its drives are; `None` if no controller is on it.
    pub(crate) family: Option<DriveFamily>,
}

impl Link {
    /// Bits of an octet: a start bit, eight, and the stop bits. On a bus nine octets are a frame of 135 bits at the most, its gap and what is
    /// stuffed in among them.
    pub(crate) fn octet_bits(&self) -> u32 {
        if self.wiring == LinkWiring::Can { 15 } else { 9 + u32::from(self.stop_bits) }
    }
}

/// How a link is wired.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LinkWiring {
    /// Point to point.
    Rs232,
    /// Two wires that all share.
    Rs485,
    /// A bus of frames.
    Can,
}

/// A link as it stands in the file: what it leaves out depends on the drives that are on it.
pub(super) struct LinkEntry<'t> {
    pub(super) name: &'t str,
    pub(super) at: usize,
    port: Option<String>,
    port_at: usize,
    wiring: LinkWiring,
    wiring_at: usize,
    baud: Option<(u32, usize)>,
    stop_bits: Option<u8>,
    has_echo: bool,
    rate_hz: Option<f64>,
}

/// Reads all links.
pub(super) fn links<'t>(entry: Entry<'t>, faults: &mut Faults<'_>) -> Vec<LinkEntry<'t>> {
    let Some(table) = entry.table(faults) else { return Vec::new() };
    let entries = table.iter().map(|(name, value)| Entry::new(name.get_ref(), value));
    let links: Vec<_> = entries.filter_map(|entry| link(entry, faults)).collect();
    for link in &links {
        let is_twin = |other: &&LinkEntry<'_>| {
            let ports = link.port.as_deref().zip(other.port.as_deref());
            other.port_at < link.port_at && ports.is_some_and(|(one, other)| is_same_port(one, other))
        };
        if let Some(twin) = links.iter().find(is_twin) {
            let message = format!("port: [link.{}] uses it already; one line is one link", twin.name);
            faults.note(link.port_at, message);
        }
    }
    links
}

/// True if both names are of one line, however they are spelled; where one is another name of the other, this machine has to have it.
fn is_same_port(one: &str, other: &str) -> bool {
    let real = |port: &str| port.contains('/').then(|| fs::canonicalize(port).ok()).flatten();
    Path::new(one) == Path::new(other) || real(one).is_some_and(|one| Some(one) == real(other))
}

fn link<'t>(entry: Entry<'t>, faults: &mut Faults<'_>) -> Option<LinkEntry<'t>> {
    let table = entry.table(faults)?;
    let mut section = Section::new(format!("[link.{}]", entry.key), entry.at, table, faults);
    section.require(&["port"]);
    let port = section.text("port");
    let kinds = [("rs232", LinkWiring::Rs232), ("rs485", LinkWiring::Rs485), ("can", LinkWiring::Can)];
    let wiring = section.choice("wiring", &kinds).unwrap_or(LinkWiring::Rs232);
    let wiring_at = section.get("wiring").map_or(entry.at, |entry| entry.at);
    let baud_at = section.get("baud").map_or(entry.at, |entry| entry.at);
    let baud = section.whole_in("baud", 1..=10_000_000).map(|baud| (baud, baud_at));
    let stop_bits = section.whole_in("stop_bits", 1..=2);
    let has_echo = section.get("echo").and_then(|entry| entry.switch(section.faults)).unwrap_or(false);
    let rate_hz = rate(&mut section);
    if wiring == LinkWiring::Can {
        for key in ["stop_bits", "echo"] {
            section.refuse(key, "a CAN bus has none; omit it");
        }
    }
    let port_entry = section.get("port");
    if let (Some(entry), Some(port)) = (port_entry, port.as_deref()) {
        refuse_port(entry, port, wiring, section.faults);
    }
    section.finish();
    Some(LinkEntry {
        name: entry.key,
        at: entry.at,
        port,
        port_at: port_entry.map_or(entry.at, |entry| entry.at),
        wiring,
        wiring_at,
        baud,
        stop_bits,
        has_echo,
        rate_hz,
    })
}

/// Notes a device without its folder, and an interface with one.
fn refuse_port(entry: Entry<'_>, port: &str, wiring: LinkWiring, faults: &mut Faults<'_>) {
    match (wiring, port.contains('/')) {
        (LinkWiring::Can, true) => {
            entry.fault(faults, &format!("{port:?} is not an interface like \"can0\""))
        }
        (LinkWiring::Rs232 | LinkWiring::Rs485, false) => {
            entry.fault(faults, &format!("{port:?} is not a device; write a path such as \"/dev/ttyUSB0\""));
        }
        _ => {}
    }
}

/// `None` for `"auto"`, and where nothing is said.
fn rate(section: &mut Section<'_, '_, '_>) -> Option<f64> {
    let entry = section.get("rate_hz")?;
    if entry.value.as_str() == Some("auto") {
        return None;
    }
    if entry.value.is_str() {
        entry.fault(section.faults, "is neither a number nor \"auto\", the highest rate that fits");
        return None;
    }
    entry.number_in(1.0..=MOST_HZ, section.faults)
}

impl LinkEntry<'_> {
    /// The link for drives of `family`; notes what these cannot do.
    pub(super) fn settle(self, family: Option<DriveFamily>, faults: &mut Faults<'_>) -> Option<Link> {
        if family == Some(DriveFamily::SilverMax) && self.wiring == LinkWiring::Can {
            faults.note(self.wiring_at, "wiring: a SilverMax has no CAN; use \"rs485\" or \"rs232\"");
        }
        let usual = if self.wiring == LinkWiring::Can { CAN_BAUD } else { 57_600 };
        let (asked_baud, baud_at) = self.baud.unwrap_or((usual, self.at));
        let made = match (self.wiring, family) {
            (LinkWiring::Can, _) if !CAN_BAUDS.contains(&asked_baud) => {
                Err(format!("{asked_baud} is outside {CAN_BAUDS:?}, the bit rates of a CAN bus"))
            }
            (LinkWiring::Can, _) | (_, None) => Ok(asked_baud),
            (_, Some(DriveFamily::SilverMax)) => silvermax_baud(asked_baud),
            (_, Some(DriveFamily::Sixpack2)) => sixpack2_baud(asked_baud),
        };
        let baud = made.map_err(|reason| faults.note(baud_at, format!("baud: {reason}"))).ok();
        let usual_stop = match family {
            Some(DriveFamily::Sixpack2) => 1,
            Some(DriveFamily::SilverMax) | None => 2,
        };
        Some(Link {
            name: self.name.to_owned(),
            port: self.port?.into(),
            wiring: self.wiring,
            baud: baud?,
            asked_baud,
            stop_bits: self.stop_bits.unwrap_or(usual_stop),
            has_echo: self.has_echo,
            rate_hz: self.rate_hz,
            family,
        })
    }
}

fn silvermax_baud(asked: u32) -> Result<u32, String> {
    if SILVERMAX_BAUDS.contains(&asked) {
        return Ok(asked);
    }
    let nearest = SILVERMAX_BAUDS.into_iter().min_by_key(|baud| baud.abs_diff(asked)).unwrap_or(57_600);
    Err(format!("{asked} is not a rate of a SilverMax (BRT); the nearest is {nearest}"))
}

/// The rate next to the one asked for: 1,250,000 divided by a whole number.
fn sixpack2_baud(asked: u32) -> Result<u32, String> {
    let (least, most) = (SIXPACK2_BAUDS.start(), SIXPACK2_BAUDS.end());
    if !SIXPACK2_BAUDS.contains(&asked) {
        return Err(format!("{asked} is outside {least}..={most}, the baud rates of a SIXpack 2"));
    }
    let near = ((BAUD_CLOCK + asked / 2) / asked.max(1)).max(1);
    let made = (BAUD_CLOCK + near / 2) / near;
    if f64::from(made.abs_diff(asked)) > TOLERANCE * f64::from(asked) {
        return Err(format!(
            "{asked} cannot be made: a SIXpack 2 divides 1,250,000 by a whole number, and the nearest is {made}"
        ));
    }
    Ok(made)
}
