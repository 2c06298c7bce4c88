//! Network namespaces for machines, made without root, and gone with their holders.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};

use crate::programs::{is_installed, is_there};

/// A machine: a network namespace, held by a process that ends with its standard input.
pub(crate) struct Machine {
    holder: Child,
    /// The process whose user namespace all machines of a net are in.
    first: u32,
}

impl Machine {
    /// The first of a net, with a user namespace of its own; none where that is refused.
    pub(crate) fn first() -> Option<Self> {
        for program in ["unshare", "nsenter", "ip", "tc", "prlimit"] {
            if !is_installed(program) {
                return None;
            }
        }
        let held = Self::hold(Command::new("unshare").args(["--map-root-user", "--net"]));
        let remedy =
            "allow user namespaces (sysctl user.max_user_namespaces, kernel.unprivileged_userns_clone)";
        is_there("namespaces", held.is_some(), remedy).then_some(held?)
    }

    /// Another one of its net.
    pub(crate) fn beside(&self) -> Self {
        let first = self.first;
        let enter = ["--preserve-credentials", "--user", "--target", &first.to_string()].map(str::to_owned);
        let held = Self::hold(Command::new("nsenter").args(enter).args(["unshare", "--net"]));
        let mut machine = held.expect("the first was allowed");
        machine.first = first;
        machine
    }

    fn hold(command: &mut Command) -> Option<Self> {
        command.args(["sh", "-c", "ip link set lo up && echo up && exec cat"]);
        let mut holder = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().ok()?;
        let mut line = String::new();
        BufReader::new(holder.stdout.take()?).read_line(&mut line).ok()?;
        let first = holder.id();
        let machine = Self { holder, first };
        (line == "up\n").then_some(machine)
    }

    /// The process that holds it.
    pub(crate) fn pid(&self) -> u32 {
        self.holder.id()
    }

    /// What has a program start there: a program, and its arguments before those of the other.
    pub(crate) fn enter(&self) -> Vec<String> {
        let pid = self.pid().to_string();
        ["nsenter", "--preserve-credentials", "--user", "--net", "--target", &pid].map(str::to_owned).into()
    }

    /// A command that runs there.
    pub(crate) fn command(&self, program: &str) -> Command {
        let enter = self.enter();
        let mut command = Command::new(&enter[0]);
        command.args(&enter[1..]).arg(program).stdin(Stdio::null());
        command
    }

    /// Does that there: words of `ip` or `tc`, one command a line.
    #[track_caller]
    pub(crate) fn run(&self, script: &str) {
        let ran = self.command("sh").args(["-e", "-c", script]).output().expect("it starts");
        assert!(ran.status.success(), "{script}: {ran:?}");
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        drop(self.holder.stdin.take()); // it ends with that
        let _ = self.holder.wait();
    }
}
