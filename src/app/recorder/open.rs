//! What is being recorded.

use std::fs::File;
use std::io::BufWriter;

use super::disk::PartFile;
use super::link::ShowStart;
use crate::record::{Counts, Recording};
use crate::time::MonoTime;

/// A recording that is being written.
pub(super) struct OpenFile {
    pub(super) file: Recording<BufWriter<File>>,
    pub(super) disk: PartFile,
    pub(super) counts: Counts,
}

/// A show that is recorded, whether a file of it is open or not.
pub(super) struct OpenRecording {
    pub(super) start: ShowStart,
    pub(super) part: u32,
    pub(super) file: Option<OpenFile>,
    /// When the next file is tried, where the last has failed.
    pub(super) again_at: Option<MonoTime>,
    /// Until when it goes on, once it is over.
    pub(super) until: Option<MonoTime>,
    pub(super) report: Option<Vec<u8>>,
}
