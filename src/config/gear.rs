//! Show-control gear: `sources = ["10.0.0.5"]`, the senders that a port accepts, and `allow = ["go"]`, the commands open to them.

use std::net::Ipv4Addr;

use super::fault::Faults;
use super::section::{Entry, Section};

/// What gear may ask at the most, over OSC or by lines of text; a stop is always taken. Arming, homing and clearing are not
/// among it: the address that something comes from proves nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum GearWord {
    /// To start what a person has armed.
    Go,
    /// To hold.
    Pause,
    /// To go on, after a pause of gear's own.
    Resume,
    /// To bring the seats to park.
    Park,
    /// To go on elsewhere in the cue.
    Seek,
    /// To move the motion against the film.
    Trim,
    /// Levels and effects, up to what a person has set.
    Levels,
    /// To take seats out, and in again those that gear took out.
    Seats,
}

impl GearWord {
    /// All of them, by the words of the configuration.
    pub(crate) const ALL: [(&'static str, Self); 8] = [
        ("go", Self::Go),
        ("pause", Self::Pause),
        ("resume", Self::Resume),
        ("park", Self::Park),
        ("seek", Self::Seek),
        ("trim", Self::Trim),
        ("levels", Self::Levels),
        ("seats", Self::Seats),
    ];
    /// What it may ask where nothing is said.
    pub(crate) const DEFAULT: [Self; 5] = [Self::Go, Self::Pause, Self::Resume, Self::Levels, Self::Seats];
}

/// Reads the list of what may be asked; [`GearWord::DEFAULT`] where it is left out.
pub(super) fn allowed(section: &mut Section<'_, '_, '_>) -> Vec<GearWord> {
    let Some(entry) = section.get("allow") else { return GearWord::DEFAULT.to_vec() };
    let words = entry.array(section.faults).unwrap_or_default();
    words.iter().filter_map(|entry| allowed_word(*entry, section.faults)).collect()
}

/// Reads the list, which has to name somebody: a port for everybody is nothing that one gets by leaving a line out.
pub(super) fn sources(section: &mut Section<'_, '_, '_>) -> Option<Vec<Ipv4Addr>> {
    let entry = section.get("sources")?;
    let entries = entry.array(section.faults)?;
    if entries.is_empty() {
        entry.fault(section.faults, "is empty; list the addresses of the gear that may send commands");
    }
    let addresses = entries.into_iter().filter_map(|entry| source(entry, section)).collect();
    Some(addresses)
}

fn source(entry: Entry<'_>, section: &mut Section<'_, '_, '_>) -> Option<Ipv4Addr> {
    let text = entry.text(section.faults)?;
    let address = text.parse::<Ipv4Addr>().ok().filter(|address| !address.is_unspecified());
    if address.is_none() {
        entry.fault(section.faults, &format!("{text:?} is not an IPv4 address, such as 10.0.0.5"));
    }
    address
}

fn allowed_word(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<GearWord> {
    let text = entry.text(faults)?;
    let found = GearWord::ALL.iter().find(|(word, _)| *word == text).map(|&(_, word)| word);
    // Whoever lists what is allowed will list it too.
    if found.is_none() && text != "stop" {
        let message = match text {
            "arm" | "home" | "clear" => format!("{text} is never allowed to show-control gear"),
            _ => {
                let words = GearWord::ALL.map(|(word, _)| word).join(", ");
                format!("{text:?} is not one of {words}, stop")
            }
        };
        entry.fault(faults, &message);
    }
    found
}
