//! How frames are sent, where an argument says otherwise than the configuration.

use std::net::SocketAddrV4;

use anyhow::anyhow;

use super::exit::{Exit, Failure, OrExit as _};
use crate::config::{Config, too_seldom};

/// The frame port, acks and spinning.
#[derive(Debug, clap::Args)]
pub(super) struct StreamArgs {
    /// The frame port [default: 0.0.0.0:8410, or the configuration's]; port 0 takes any.
    #[arg(long, value_name = "ADDR")]
    bind: Option<SocketAddrV4>,

    /// Request an ack on every Nth frame, N - 1 periods of at most 50 ms in all [default: 1, or the configuration's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000), conflicts_with = "no_acks")]
    ack_every: Option<u32>,

    /// Request no acks, and read none.
    #[arg(long)]
    pub(super) no_acks: bool,

    /// Wake up this long before each tick and spin, 0 to 900 µs: less lateness, more processor time [default: 0, or the
    /// configuration's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=900))]
    spin_us: Option<u32>,
}

impl StreamArgs {
    /// Puts what was said into a configuration whose rate is the one to come.
    ///
    /// # Errors
    /// Why acks would be requested too seldom there.
    pub(super) fn put_into(&self, config: &mut Config) -> Result<(), Failure> {
        let (show, has_drives) = (&mut config.show, !config.links.is_empty());
        show.bind = self.bind.unwrap_or(show.bind);
        show.ack_every = self.ack_every.unwrap_or(show.ack_every);
        show.spin_us = self.spin_us.unwrap_or(show.spin_us);
        match too_seldom(show, has_drives).filter(|_| !self.no_acks) {
            None => Ok(()),
            Some(why) => Err(anyhow!("--ack-every {}: {why}", show.ack_every)).or_exit(Exit::Usage),
        }
    }
}
