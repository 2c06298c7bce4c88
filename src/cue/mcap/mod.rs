//! MCAP cues: JSON messages on four topics and a metadata record, so that common viewers show them too.

mod message;
mod read;
mod write;

use crate::channel::{CHANNELS, Channel, ChannelId, Scope};

pub(super) use read::read;
pub use read::recover;
pub use write::write;

/// The name of the metadata record.
const METADATA: &str = "kinocue";
/// The version of the layout of topics and messages.
const VERSION: &str = "1";

/// What a recording is told of by whoever takes it for a cue.
const RECORDING: &str = "it is a recording; `kinocue convert FILE OUT --seat NAME --take sent` makes a cue of what a seat was sent";

/// The topics of a cue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Topic {
    Axes,
    /// A channel of the table.
    Channel(ChannelId),
    Io,
    Marker,
}

impl Topic {
    fn all() -> impl Iterator<Item = Self> {
        let channels = CHANNELS.iter().map(|channel| Self::Channel(channel.id));
        [Self::Axes].into_iter().chain(channels).chain([Self::Io, Self::Marker])
    }

    /// Their names, as a person reads them.
    fn known() -> String {
        let names: Vec<_> = Self::all().map(Self::name).collect();
        let (last, others) = names.split_last().expect("there are topics");
        format!("{} and {last}", others.join(", "))
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Axes => "/cue/axes",
            Self::Channel(channel) => channel.row().topic,
            Self::Io => "/cue/io",
            Self::Marker => "/cue/marker",
        }
    }

    /// The JSON schema of its messages.
    fn schema(self) -> String {
        let schema = match self {
            Self::Axes => {
                r#"{"title":"cue.axes","type":"object","required":["a"],"properties":{"a":{"type":"array","items":{"type":"number"}}}}"#
            }
            Self::Channel(channel) => return schema_of(channel.row()),
            Self::Io => {
                r#"{"title":"cue.io","type":"object","properties":{"effects":{"type":"object","additionalProperties":{"type":"integer"}},"word":{"type":"integer"}}}"#
            }
            Self::Marker => {
                r#"{"title":"cue.marker","type":"object","required":["name"],"properties":{"name":{"type":"string"}}}"#
            }
        };
        schema.to_owned()
    }
}

/// A number for each part of a channel, and the axis where it is one of axes.
fn schema_of(channel: &Channel) -> String {
    let axis = (channel.scope == Scope::Axis).then_some(("axis", "integer"));
    let members = axis.into_iter().chain(channel.parts.iter().map(|part| (part.name, "number")));
    let (names, types): (Vec<_>, Vec<_>) =
        members.map(|(name, kind)| (format!("{name:?}"), format!("{name:?}:{{\"type\":{kind:?}}}"))).unzip();
    format!(
        r#"{{"title":"cue.{}","type":"object","required":[{}],"properties":{{{}}}}}"#,
        channel.topic.trim_start_matches("/cue/"),
        names.join(","),
        types.join(",")
    )
}

#[cfg(test)]
mod tests;
