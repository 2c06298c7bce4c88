//! The rides as the bytes of their files.

use std::io::Cursor;
use std::path::Path;

use kinocue::cue::{self, Source};

use super::rides;
use super::shapes::Ride;

/// Name and bytes of every file in `cues/` that is generated.
pub(crate) fn all() -> Vec<(&'static str, Vec<u8>)> {
    rides::ALL.iter().map(|ride| (ride.file, bytes(ride))).collect()
}

fn bytes(ride: &Ride) -> Vec<u8> {
    let csv = ride.csv().into_bytes();
    if Path::new(ride.file).extension().is_none_or(|extension| extension != "mcap") {
        return csv;
    }
    let cue =
        cue::read(Path::new("ride.csv"), csv.as_slice(), &Source::Native).expect("our own CSV is sound");
    let mut mcap = Cursor::new(Vec::new());
    cue::write_mcap(&cue, &mut mcap).expect("memory takes all bytes");
    mcap.into_inner()
}
