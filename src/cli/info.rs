//! `kinocue info`.

use super::{Exit, Failure, OrExit as _};

/// Shows what a cue holds.
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(_args: &Args) -> Result<Exit, Failure> {
    Err(anyhow::anyhow!("not built yet")).or_exit(Exit::Internal)
}
