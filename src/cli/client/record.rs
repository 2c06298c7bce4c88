//! `kinocue mark` and `kinocue record dump`: what a person has the running service keep.

use serde_json::json;

use super::server::ServerArgs;
use crate::cli::{Exit, Failure, print};

/// Marks this moment.
///
/// The service keeps the last minute and the next ten seconds as an incident, whatever the hall does. TEXT is optional.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue mark
  kinocue mark \"B2 jerked\"

Exit codes: 0 marked, 75 nothing is being recorded")]
pub(in crate::cli) struct MarkArgs {
    /// What was seen.
    #[arg(value_name = "TEXT")]
    text: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
}

pub(super) fn mark(args: &MarkArgs) -> Result<Exit, Failure> {
    let MarkArgs { text, server } = args;
    let body = text.as_ref().map_or_else(|| json!({}), |text| json!({ "text": text }));
    let status = server.post("/api/v1/record/mark", &body)?;
    if !server.json {
        let at = status.show.as_ref().map(|show| format!(" at {:.1} s of the film", show.position_s));
        print::tell(&format!("kinocue: marked{}", at.unwrap_or_default()));
    }
    Ok(server.tell(&status))
}

/// Has the running service write the contents of its flight recorder to an incident file.
pub(in crate::cli) fn dump(server: &ServerArgs) -> Result<Exit, Failure> {
    server.act("/api/v1/record/dump", &json!({}))
}
