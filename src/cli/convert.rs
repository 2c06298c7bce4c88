//! `kinocue convert`.

use super::{Exit, Failure, OrExit as _};

/// Turns a cue from one format into another.
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(_args: &Args) -> Result<Exit, Failure> {
    Err(anyhow::anyhow!("not built yet")).or_exit(Exit::Internal)
}
