//! Goes through the door that `KINOCUE_DOOR` names (`src/harness/doors.rs`) with whatever libFuzzer makes.

#![no_main]

use std::sync::LazyLock;

use kinocue::harness::doors::DOORS;
use libfuzzer_sys::fuzz_target;

static DOOR: LazyLock<fn(&[u8])> = LazyLock::new(|| {
    let name = std::env::var("KINOCUE_DOOR").unwrap_or_default();
    let names = || DOORS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let door = DOORS.iter().find(|(door, _)| *door == name);
    door.unwrap_or_else(|| panic!("KINOCUE_DOOR is {name:?}; give one of {}", names())).1
});

fuzz_target!(|octets: &[u8]| DOOR(octets));
