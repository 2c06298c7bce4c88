//! `kinocue decode`.

use super::{Exit, Failure, OrExit as _};

/// Puts a message of the protocol in words.
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(_args: &Args) -> Result<Exit, Failure> {
    Err(anyhow::anyhow!("not built yet")).or_exit(Exit::Internal)
}
