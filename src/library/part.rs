//! A part of a cue's file, with the digest of the whole.

use std::os::unix::fs::FileExt as _;

use super::{CueId, Library, file_problem};
use crate::control::{Code, Problem};
use crate::sys::folder::Stamp;
use crate::sys::lock::lock;

/// A part of the file of a cue.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct FilePart {
    /// SHA-256 of the whole file, hexadecimal.
    pub(crate) sha256: String,
    /// How long the whole file is, bytes.
    pub(crate) whole: u64,
    /// True if it is MCAP; CSV if not.
    pub(crate) mcap: bool,
    /// The part.
    pub(crate) bytes: Vec<u8>,
}

impl Library {
    /// The part of that number, from 0, of a cue in parts of `size` bytes each but the last.
    ///
    /// # Errors
    /// Where there is no such cue or part, the cue was not checked yet, or it changes.
    pub(crate) fn part(&self, id: &CueId, n: u64, size: u64) -> Result<FilePart, Problem> {
        let cue = self.cue(id)?;
        let known =
            lock(&self.inner.index).get(&cue.name, cue.stamp, "").map(|(verdict, _)| verdict.sha256.clone());
        let sha256 = known.ok_or_else(|| {
            Problem::new(Code::State, format!("the cue {id} was not checked yet"), "try again in a while")
        })?;
        let whole = cue.stamp.size;
        let from = n.checked_mul(size).filter(|from| *from < whole).ok_or_else(|| {
            let detail = format!("there is no part {n} of the {whole} bytes of {id}");
            Problem::new(Code::Value, detail, "ask for the parts that there are")
        })?;
        let mut bytes = vec![0; usize::try_from(size.min(whole - from)).unwrap_or(0)];
        let read = cue.file.read_exact_at(&mut bytes, from).and_then(|()| Stamp::of(&cue.file));
        if read.map_err(|error| file_problem("read the cue", &error))? != cue.stamp {
            let detail = format!("the cue {id} changed while it was being read");
            return Err(Problem::new(Code::File, detail, "fetch it again"));
        }
        Ok(FilePart { sha256, whole, mcap: cue.name.ends_with(".mcap"), bytes })
    }
}
