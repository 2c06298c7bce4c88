//! The film in the status of the hall.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::super::model::Coded;

/// The film of a hall, by the best of its sources.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct FilmStatus {
    /// One word: `absent`, `acquiring`, `locked`, `freewheeling`, `stopped`, `ended`, `jumped`, `reverse`, `shuttle`, `unusable` or
    /// `lost`.
    pub(crate) state: String,
    /// What that means.
    pub(crate) cause: String,
    /// What a person does next about it.
    pub(crate) next: String,
    /// The code of that.
    pub(crate) next_coded: Coded,
    /// True if the show that is loaded follows it.
    pub(crate) leads: bool,
    /// The source that leads, as it is configured; null while none can.
    pub(crate) source: Option<String>,
    /// Where the film is in the cue, s; null while nobody knows.
    pub(crate) position_s: Option<f64>,
    /// How much faster than the clock it runs, millionths.
    pub(crate) rate_ppm: Option<f64>,
    /// How far ahead of the film, less the trim, the seats are, ms; null while they follow none.
    pub(crate) error_ms: Option<f64>,
    /// The label of the frame that the leading source is at, if it has labels.
    pub(crate) timecode: Option<String>,
    /// A source that ranks higher, or any where a person chose, and says something else.
    pub(crate) disagrees: Option<FilmDisagreement>,
    /// The source that a person chose; null while the ranking decides.
    pub(crate) chosen: Option<String>,
    /// How often another source took over.
    pub(crate) switches: u64,
    /// How often seats have joined it since the hall was opened.
    pub(crate) joins: u64,
    /// All sources, in their ranking.
    pub(crate) sources: Vec<FilmSourceStatus>,
}

/// A source that says something else than the one that leads, and ranks higher or was passed over by hand; a person has to decide.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct FilmDisagreement {
    /// As it is configured.
    pub(crate) source: String,
    /// How far it is ahead of the one that leads, s.
    pub(crate) ahead_s: f64,
}

/// A source that tells where the film is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct FilmSourceStatus {
    /// As it is configured.
    pub(crate) source: String,
    /// One word, as of the film.
    pub(crate) state: String,
    /// What that means, and what is wrong with the source.
    pub(crate) cause: String,
    /// What is wrong with it; null if nothing is.
    pub(crate) trouble: Option<String>,
    /// Where the film is in the cue by this source, s.
    pub(crate) position_s: Option<f64>,
    /// The label of the frame that it is at, if it has labels.
    pub(crate) timecode: Option<String>,
    /// How much faster than the clock it runs, millionths.
    pub(crate) rate_ppm: Option<f64>,
    /// Deviation of where it is, ms.
    pub(crate) sigma_ms: Option<f64>,
    /// True if it is good enough to lead.
    pub(crate) may_lead: bool,
    /// How often nothing was heard of it.
    pub(crate) dropouts: u64,
    /// For how long the film was taken to run on meanwhile, s.
    pub(crate) freewheel_s: f64,
    /// Samples that were too far off to be used.
    pub(crate) rejected: u64,
    /// How often the film jumped by it.
    pub(crate) jumps: u64,
    /// How loud its line is, dB of full scale, where it has one.
    pub(crate) level_dbfs: Option<f64>,
    /// What others sent in its place, and was not heard.
    pub(crate) foreign: u64,
    /// What it sent that says nothing of a film.
    pub(crate) garbage: u64,
}
