//! `kinocue play`: one cue in the foreground, a progress line, the report at the end.

use std::io::IsTerminal as _;
use std::net::SocketAddrV4;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use indicatif::{ProgressBar, ProgressStyle};
use signal_hook::consts::{SIGINT, SIGTERM};

use super::{Exit, Failure, OrExit as _};
use crate::app::{Play, PlayError, Played};
use crate::config::{self, Config, from_to_args};
use crate::cue::{self, FaultClass};
use crate::engine::{Rate, Show};
use crate::rt::Live;
use crate::time::ShowTime;
use crate::timeline::Timeline;
use crate::wire::Timing;

/// Plays one cue to the controllers, and reports what became of every frame.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The cue, CSV or MCAP.
    cue: PathBuf,
    /// A controller: HOST:PORT[,name=A1][,axes=6][,offset=0][,fan_out=slice|shared][,dialect=smc|mbox]; repeatable.
    #[arg(long, value_name = "ADDR", required_unless_present = "config", conflicts_with = "config")]
    to: Vec<String>,
    /// Controllers, seats and show settings from a file.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    options: Options,
}
