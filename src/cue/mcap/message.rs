//! The JSON of the messages.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};

/// `/cue/axes`: the position of every axis, axis 1 first.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Axes {
    pub(super) a: Vec<f64>,
}

/// `/cue/vibration`: of one axis, counted from 1.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Vibration {
    pub(super) axis: usize,
    pub(super) hz: f64,
    pub(super) amp: f64,
}

/// `/cue/io`: effects that change, or the raw output word.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Io {
    pub(super) effects: Option<Switches>,
    pub(super) word: Option<u16>,
}

/// `/cue/marker`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Marker {
    pub(super) name: String,
}

/// Effects by name in the order of the text, which a map would lose.
#[derive(Debug)]
pub(super) struct Switches(pub(super) Vec<(String, i64)>);

impl<'de> Deserialize<'de> for Switches {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Switches;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("effects by name, each 0 or 1")
            }

            fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Switches, M::Error> {
                let mut switches = Vec::new();
                while let Some(switch) = map.next_entry()? {
                    switches.push(switch);
                }
                Ok(Switches(switches))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}
