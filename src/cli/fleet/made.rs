//! Files that `kinocue fleet init` makes: keys, and settings that name them.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

use anyhow::Context as _;
use nkeys::KeyPair;

use crate::cli::{Exit, Failure, OrExit as _};

/// The file of the key for letters of a desk, beside its settings.
pub(super) const LETTERS: &str = "letters.nk";

/// The secret half of a key, as its file has it.
pub(super) fn seed(pair: &KeyPair) -> Result<String, Failure> {
    Ok(pair.seed().context("the key has no secret half").or_exit(Exit::Internal)? + "\n")
}

/// Writes a new file, with its mode from the start on.
pub(super) fn put(path: &Path, text: &str, mode: u32) -> Result<(), Failure> {
    let write = || {
        fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        let mut file = OpenOptions::new().write(true).create_new(true).mode(mode).open(path)?;
        file.write_all(text.as_bytes())
    };
    write().with_context(|| format!("cannot write {}", path.display())).or_exit(Exit::Io)
}
