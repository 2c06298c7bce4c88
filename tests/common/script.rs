//! Programs that tests write and run.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// Makes a program of that text. Written by a process of its own: what another test starts meanwhile would hold the file open for writing,
/// and nothing that is runs.
pub(crate) fn make(path: &Path, text: &str) {
    let write = ["-c", "cat > \"$0\" && chmod 755 \"$0\""];
    let mut shell =
        Command::new("sh").args(write).arg(path).stdin(Stdio::piped()).spawn().expect("a shell runs");
    shell.stdin.take().expect("it is a pipe").write_all(text.as_bytes()).expect("it reads");
    assert!(shell.wait().expect("it ends").success(), "the folder is ours");
}
