//! `kinocue completions`.

use clap::CommandFactory as _;

use super::{Cli, Exit, Failure, print};

/// Prints shell completions.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kinocue completions bash > ~/.local/share/bash-completion/completions/kinocue"
)]
pub(super) struct Args {
    /// The shell.
    shell: clap_complete::Shell,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "kinocue", &mut script);
    print::data(&String::from_utf8_lossy(&script))?;
    Ok(Exit::Done)
}
