//! `kinocue film-player`: what the service becomes a player by. Not a copy of the service, which would slow its real-time thread down.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::process::Command;

use anyhow::Context as _;

use super::{Exit, Failure, OrExit as _};
use crate::sys::child::become_program;

/// Turns into a player of films that ends with the process that started it.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The process that starts it.
    #[arg(long, value_name = "PID")]
    parent: u32,
    /// The player and its arguments.
    #[arg(last = true, required = true)]
    program: Vec<OsString>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let [program, rest @ ..] = &args.program[..] else { return Ok(Exit::Usage) };
    let error = become_program(Command::new(program).args(rest), args.parent);
    let exit = if error.kind() == ErrorKind::NotFound { Exit::NoInput } else { Exit::Io };
    Err(error).with_context(|| format!("{} cannot be started", program.to_string_lossy())).or_exit(exit)
}
