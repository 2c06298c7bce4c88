//! `kinocue man`, for packages.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::CommandFactory as _;

use super::{Cli, Exit, Failure, OrExit as _};

/// Writes the manual pages of all commands.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  mkdir man && kinocue man man && man man/kinocue-play.1")]
pub(super) struct Args {
    /// The folder to write them into; it has to exist.
    dir: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let written = clap_mangen::generate_to(Cli::command(), &args.dir);
    let dir = args.dir.display();
    written.with_context(|| format!("cannot write the manual pages to {dir}")).or_exit(Exit::Io)?;
    Ok(Exit::Done)
}
