//! This program again, as the controllers.

use std::io::{BufRead as _, BufReader};
use std::net::SocketAddrV4;
use std::process::{Child, Stdio};

use super::again::again;

/// A process of controllers.
pub(crate) struct Peer {
    pub(crate) addresses: Vec<SocketAddrV4>,
    child: Child,
}

impl Peer {
    /// Starts `count` controllers, and waits until they can be sent to.
    pub(crate) fn start(count: usize) -> Self {
        let mut child = again()
            .args(["peer", &count.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("this program can be started again");
        let stdout = child.stdout.take().expect("it is piped");
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line).expect("the controllers tell their addresses");
        let addresses = line.split_whitespace().map(|address| address.parse().expect("an address")).collect();
        Self { addresses, child }
    }
}

impl Drop for Peer {
    /// Closing its stdin ends it.
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}
