//! This program again, in a process of its own.

use std::net::SocketAddrV4;
use std::process::{Command, Stdio};

use serde::de::DeserializeOwned;

/// Runs a sender, which `words` name, to its end; gives its outcome.
pub(crate) fn sender<O: DeserializeOwned>(words: &[&str], to: &[SocketAddrV4]) -> O {
    let output = again()
        .args(words)
        .args(to.iter().map(ToString::to_string))
        .stderr(Stdio::inherit())
        .output()
        .expect("this program can be started again");
    assert!(output.status.success(), "the sender {words:?} failed: {}", output.status);
    serde_json::from_slice(&output.stdout).expect("a sender ends with its outcome")
}

/// The program, to be given its arguments.
pub(crate) fn again() -> Command {
    Command::new(std::env::current_exe().expect("the system tells this program's path"))
}
