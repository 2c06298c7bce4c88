//! `kinocue demo`.

use super::{Exit, Failure, OrExit as _};

/// Plays the bench ride to virtual controllers, with nothing to set up.
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(_args: &Args) -> Result<Exit, Failure> {
    Err(anyhow::anyhow!("not built yet")).or_exit(Exit::Internal)
}
