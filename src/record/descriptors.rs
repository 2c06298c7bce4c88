//! What viewers read whole recordings by: the messages of `full` as protobuf describes them.

use prost::Message as _;

/// What viewers read blocks by: a `FileDescriptorSet` of the messages above (protobuf's `descriptor.proto`).
pub(crate) fn descriptors() -> Vec<u8> {
    const UINT32: i32 = 13;
    const MESSAGE: i32 = 11;
    const BYTES: i32 = 12;
    let field = |(number, (name, of)): (i32, &(&str, FieldKind))| {
        let (kind, is_repeated, type_name) = match of {
            FieldKind::Count => (UINT32, false, None),
            FieldKind::Bytes => (BYTES, false, None),
            FieldKind::Many(message) => (MESSAGE, true, Some(format!(".kinocue.{message}"))),
        };
        let label = if is_repeated { 3 } else { 1 };
        FieldDescriptor {
            name: (*name).to_owned(),
            number,
            label,
            kind,
            type_name: type_name.unwrap_or_default(),
        }
    };
    let message = |(name, fields): (&str, &[(&str, FieldKind)])| MessageDescriptor {
        name: name.to_owned(),
        field: (1..).zip(fields).map(field).collect(),
    };
    let file = FileDescriptor {
        name: "kinocue.proto".to_owned(),
        package: "kinocue".to_owned(),
        message_type: MESSAGES.into_iter().map(message).collect(),
        syntax: "proto3".to_owned(),
    };
    FileDescriptors { file: vec![file] }.encode_to_vec()
}

enum FieldKind {
    Count,
    Bytes,
    Many(&'static str),
}

const MESSAGES: [(&str, &[(&str, FieldKind)]); 5] = [
    (
        "Sent",
        &[
            ("ticks", FieldKind::Count),
            ("tick_columns", FieldKind::Many("Column")),
            ("lanes", FieldKind::Many("Lane")),
        ],
    ),
    (
        "Lane",
        &[
            ("lane", FieldKind::Count),
            ("frames", FieldKind::Count),
            ("frame_columns", FieldKind::Many("Column")),
            ("positions", FieldKind::Many("Column")),
            ("asked", FieldKind::Many("Column")),
            ("vibration", FieldKind::Many("Column")),
            ("raw", FieldKind::Bytes),
        ],
    ),
    (
        "Acks",
        &[
            ("runs", FieldKind::Many("Column")),
            ("count", FieldKind::Count),
            ("chunks", FieldKind::Many("Column")),
            ("controllers", FieldKind::Many("Replies")),
            ("others", FieldKind::Bytes),
        ],
    ),
    (
        "Replies",
        &[
            ("controller", FieldKind::Count),
            ("replies", FieldKind::Many("Column")),
            ("fates", FieldKind::Many("Column")),
        ],
    ),
    ("Column", &[("packed", FieldKind::Bytes)]),
];

#[derive(Clone, PartialEq, prost::Message)]
struct FileDescriptors {
    #[prost(message, repeated, tag = "1")]
    file: Vec<FileDescriptor>,
}

#[derive(Clone, PartialEq, prost::Message)]
struct FileDescriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(string, tag = "2")]
    package: String,
    #[prost(message, repeated, tag = "4")]
    message_type: Vec<MessageDescriptor>,
    #[prost(string, tag = "12")]
    syntax: String,
}

#[derive(Clone, PartialEq, prost::Message)]
struct MessageDescriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, repeated, tag = "2")]
    field: Vec<FieldDescriptor>,
}

#[derive(Clone, PartialEq, prost::Message)]
struct FieldDescriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(int32, tag = "3")]
    number: i32,
    #[prost(int32, tag = "4")]
    label: i32,
    #[prost(int32, tag = "5")]
    kind: i32,
    #[prost(string, tag = "6")]
    type_name: String,
}
