//! Why something asked was not done, for every surface: one stable code each, with what to do.

use std::fmt;

use serde::Serialize;
use utoipa::ToSchema;

use super::Who;
use super::model::words;
use crate::config::{Role, there_is_no};
use crate::state::Refusal;

words! {
    /// The kind of a problem. Its word is stable: programs may rely on it.
    #[non_exhaustive]
    pub Code {
        /// The state of the hall does not allow it.
        State = "state",
        /// Who asked may not.
        Role = "role",
        /// Nobody knows who asked, or their token is wrong.
        Token = "token",
        /// A value is not what it may be.
        Value = "value",
        /// There is nothing of that name.
        Unknown = "unknown",
        /// What is there cannot be asked that way.
        Method = "method",
        /// It is longer than may be.
        Size = "size",
        /// It is written in a form that is not read here.
        Media = "media",
        /// The cue cannot be read, or asks for what the hall does not have.
        Cue = "cue",
        /// The cue breaks limits; or a playlist or configuration does not pass.
        Check = "check",
        /// It came more than two seconds after it was asked.
        Late = "late",
        /// The page or program that asked is not one of this server's.
        Origin = "origin",
        /// Too much at once.
        Busy = "busy",
        /// The hall did not answer in time.
        Timeout = "timeout",
        /// A file could not be read or written.
        File = "file",
        /// It is not built, or turned off in the configuration.
        Off = "off",
        /// A fault of our own.
        Internal = "internal",
    }
}

/// What stands against what an engineer has to ask.
pub(crate) const NEEDS_ENGINEER: &str = "needs-engineer";
/// What stands against what a busy hall does not take in time.
pub(crate) const NOT_TAKEN: &str = "not-taken";

/// Why something was not done (RFC 9457).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct Problem {
    /// The status of the HTTP reply.
    pub(crate) status: u16,
    /// Which kind.
    pub code: Code,
    /// What went wrong, with the value and the limit; no full stop.
    pub detail: String,
    /// What stands against it, by a stable word, where the state of the hall does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) why: Option<&'static str>,
    /// What to do.
    pub remedy: String,
    /// Every fault, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<String>,
}

impl Code {
    /// The status of the HTTP reply.
    #[must_use]
    pub(crate) const fn status(self) -> u16 {
        match self {
            Self::Value => 400,
            Self::Token => 401,
            Self::Role | Self::Origin => 403,
            Self::Unknown => 404,
            Self::Method => 405,
            Self::State | Self::Late => 409,
            Self::Size => 413,
            Self::Media => 415,
            Self::Cue | Self::Check => 422,
            Self::Busy => 429,
            Self::File | Self::Internal => 500,
            Self::Off => 501,
            Self::Timeout => 503,
        }
    }
}

impl Problem {
    /// One of that kind.
    #[must_use]
    pub fn new(code: Code, detail: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            status: code.status(),
            code,
            detail: detail.into(),
            why: None,
            remedy: remedy.into(),
            faults: Vec::new(),
        }
    }

    /// That there is no `what` of that name, with the one that it may be a slip for.
    pub(crate) fn unknown<'a>(
        what: &str,
        name: &str,
        known: impl Iterator<Item = &'a str>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::new(Code::Unknown, there_is_no(what, name, known), remedy)
    }

    /// That who asked may not, for want of a role.
    pub(crate) fn role(what: &str, least: Role, who: &Who) -> Self {
        let detail = format!("{what} needs the role {least}, and {} has {}", who.name, who.role);
        let why = (least == Role::Engineer).then_some(NEEDS_ENGINEER);
        Self { why, ..Self::new(Code::Role, detail, "ask somebody with that role") }
    }

    /// That no film leads shows here.
    pub(crate) fn no_film() -> Self {
        Self::new(Code::Unknown, "this hall follows no film", "configure its sources in [sync], and reload")
    }

    /// The same, with every fault.
    #[must_use]
    pub fn with(mut self, faults: Vec<String>) -> Self {
        self.faults = faults;
        self
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Self {
        let Refusal { state, asked, why } = refusal;
        let detail = format!("cannot {asked} while {state}: {}", why.words());
        Self { why: Some(why.code()), ..Self::new(Code::State, detail, why.remedy()) }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.detail, self.remedy)?;
        self.faults.iter().try_for_each(|fault| write!(f, "\n{fault}"))
    }
}

impl std::error::Error for Problem {}
