//! MCAP cues: JSON messages on four topics and a metadata record, so that common viewers show them too.

mod message;
mod read;
mod record;
mod walk;
mod write;
mod zstd;

pub(super) use read::read;
pub use read::recover;
pub use write::write;

/// What every MCAP file begins and ends with (mcap.dev/spec).
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// The name of the metadata record.
const METADATA: &str = "kinocue";
/// The version of the layout of topics and messages.
const VERSION: &str = "1";

/// The topics of a cue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Topic {
    Axes,
    Vibration,
    Io,
    Marker,
}

impl Topic {
    const ALL: [Self; 4] = [Self::Axes, Self::Vibration, Self::Io, Self::Marker];

    const fn name(self) -> &'static str {
        match self {
            Self::Axes => "/cue/axes",
            Self::Vibration => "/cue/vibration",
            Self::Io => "/cue/io",
            Self::Marker => "/cue/marker",
        }
    }

    /// The JSON schema of its messages.
    const fn schema(self) -> &'static str {
        match self {
            Self::Axes => {
                r#"{"title":"cue.axes","type":"object","required":["a"],"properties":{"a":{"type":"array","items":{"type":"number"}}}}"#
            }
            Self::Vibration => {
                r#"{"title":"cue.vibration","type":"object","required":["axis","hz","amp"],"properties":{"axis":{"type":"integer"},"hz":{"type":"number"},"amp":{"type":"number"}}}"#
            }
            Self::Io => {
                r#"{"title":"cue.io","type":"object","properties":{"effects":{"type":"object","additionalProperties":{"type":"integer"}},"word":{"type":"integer"}}}"#
            }
            Self::Marker => {
                r#"{"title":"cue.marker","type":"object","required":["name"],"properties":{"name":{"type":"string"}}}"#
            }
        }
    }
}

#[cfg(test)]
mod tests;
