//! `kinocue play`.

use super::{Exit, Failure, OrExit as _};

/// Plays one cue to the controllers, and reports what became of every frame.
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(_args: &Args) -> Result<Exit, Failure> {
    Err(anyhow::anyhow!("not built yet")).or_exit(Exit::Internal)
}
