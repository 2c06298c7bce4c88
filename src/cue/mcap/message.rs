//! The JSON of the messages.

use std::fmt;

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error as _, MapAccess, Visitor};

use crate::channel::{Channel, MAX_PARTS, Sample, Scope};

/// `/cue/axes`: the position of every axis, axis 1 first.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Axes {
    pub(super) a: Vec<f64>,
}

/// A channel of the table: a number for each of its parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackMessage {
    /// The axis, counted from 1; 1 for a channel of the hall.
    pub(super) axis: usize,
    pub(super) sample: Sample,
}

/// Reads those of a channel.
pub(super) struct MessageOf(pub(super) &'static Channel);

impl<'de> DeserializeSeed<'de> for MessageOf {
    type Value = TrackMessage;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<TrackMessage, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for MessageOf {
    type Value = TrackMessage;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a number for each part of {}", self.0.topic)
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<TrackMessage, M::Error> {
        let Self(channel) = self;
        let mut axis = (channel.scope == Scope::Hall).then_some(1);
        let mut values = [None; MAX_PARTS];
        while let Some(name) = map.next_key::<String>()? {
            let part = channel.parts.iter().position(|part| part.name == name);
            let twice = match part {
                Some(part) => values[part].replace(map.next_value()?).is_some(),
                None if name == "axis" && channel.scope == Scope::Axis => {
                    axis.replace(map.next_value()?).is_some()
                }
                None => return Err(M::Error::custom(format_args!("unknown field `{name}`"))),
            };
            if twice {
                return Err(M::Error::custom(format_args!("duplicate field `{name}`")));
            }
        }
        let mut sample = Sample::default();
        for ((part, value), there) in channel.parts.iter().zip(values).zip(&mut sample.0) {
            *there = value.ok_or_else(|| M::Error::missing_field(part.name))?;
        }
        Ok(TrackMessage { axis: axis.ok_or_else(|| M::Error::missing_field("axis"))?, sample })
    }
}

/// `/cue/io`: effects that change, or the raw output word.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct IoMessage {
    pub(super) effects: Option<Switches>,
    pub(super) word: Option<u16>,
}

/// `/cue/marker`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MarkerMessage {
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
