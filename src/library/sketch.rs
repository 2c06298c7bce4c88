//! Recordings as pictures.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A recording, drawn.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub(crate) struct RecordingPicture {
    /// What it is of.
    pub(crate) title: String,
    /// What a person has to know first.
    pub(crate) sentence: String,
    /// The seat that is drawn.
    pub(crate) seat: String,
    /// All that are in the recording.
    pub(crate) seats: Vec<String>,
    /// The picture, SVG, for a dark screen. It loads nothing and runs nothing; texts of the recording are escaped.
    pub(crate) svg: String,
}

/// What the process that draws says.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Sketch {
    /// The picture.
    Picture(Box<RecordingPicture>),
    /// Why there is none.
    Fault(String),
}
