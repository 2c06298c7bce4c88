//! Files and settings: what people write by hand, and what programs like this one wrote.

use std::path::Path;

use super::{is_plain, seen};
use crate::config::Config;
use crate::film::timecode::Label;
use crate::playlist::Playlist;
use crate::settings::Settings;
use crate::{capture, config, device, latency, record, replay};

/// Faults are told in plain lines; what has none keeps the bounds that docs/configuration.md gives.
pub(super) fn config(text: &str) {
    match config::parse(Path::new("h.toml"), text) {
        Ok(config) => config_keeps_bounds(&config),
        Err(faults) => assert!(is_plain(&faults.to_string()), "{:?}", faults.to_string()),
    }
}

fn config_keeps_bounds(config: &Config) {
    assert!((1.0..=1000.0).contains(&config.show.rate_hz), "{}", config.show.rate_hz);
    for seat in &config.seats {
        assert!(!seat.name.chars().any(char::is_control), "{:?}", seat.name);
    }
    for controller in &config.controllers {
        assert!(!controller.name.is_empty() && config.named().any(|named| named.name == controller.name));
    }
    for preset in &config.presets {
        let levels = [preset.motion, preset.vibration];
        assert!(levels.into_iter().flatten().all(|level| (0.0..=1.0).contains(&level)), "{levels:?}");
    }
}

pub(super) fn playlist(text: &str) {
    match Playlist::parse(Path::new("p.toml"), text) {
        Ok(playlist) => {
            assert!(!playlist.entries.is_empty());
            for entry in &playlist.entries {
                let levels = [entry.level, entry.vibration];
                assert!(levels.into_iter().flatten().all(|level| (0.0..=1.0).contains(&level)));
                assert!(entry.trim_ms.is_none_or(|ms| (-500..=500).contains(&ms)));
            }
        }
        Err(faults) => assert!(is_plain(&faults.to_string()), "{:?}", faults.to_string()),
    }
}

/// What people set is read again as it was from the text of it.
pub(super) fn settings(text: &str) {
    let Ok(settings) = Settings::parse(text) else { return };
    assert_eq!(Settings::parse(&settings.text()), Ok(settings));
}

pub(super) fn registers(text: &str) {
    seen(device::settings::parse(text));
}

pub(super) fn label(text: &str) {
    let Ok(label) = text.parse::<Label>() else { return };
    assert_eq!(label.to_string().parse(), Ok(label));
}

pub(super) fn recording(octets: &[u8]) {
    seen(record::summarize(octets));
}

pub(super) fn replay(octets: &[u8]) {
    seen(replay::replay(octets));
}

pub(super) fn captured(octets: &[u8]) {
    let Ok(mut capture) = capture::Capture::open(octets) else { return };
    let mut packets = 0;
    while let Ok(Some(packet)) = capture.packet() {
        seen(packet.content());
        packets += 1;
        assert!(packets <= octets.len(), "each packet takes octets of the file");
    }
}

pub(super) fn latency(octets: &[u8]) {
    seen(latency::read(octets));
}
