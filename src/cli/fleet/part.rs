//! A cue on its way from the engine to a hall: a file that grows from its beginning, so that its length says where to go on, after a cut
//! and after a restart. Whether it is the right one its digest says, once it is whole.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use hyper::body::Bytes;
use rustix::fs::OFlags;

use crate::fleet::{CHUNK, WishedCue};
use crate::library::Hashed;
use crate::sys::folder::Folder;

/// What the name of one ends with, behind the digest of the whole.
const ENDING: &str = ".part";

/// The part of a cue that is here.
#[derive(Debug)]
pub(super) struct CuePart {
    path: PathBuf,
    file: File,
    cue: WishedCue,
    /// Messages of the engine that are in it.
    has: u64,
}

impl CuePart {
    /// What there is of a cue in a folder, which is made where it is missing.
    pub(super) fn open(folder: &Path, cue: &WishedCue) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        let path = folder.join(format!("{}{ENDING}", cue.sha256));
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false).mode(0o600);
        let file =
            options.custom_flags((OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed()).open(&path)?;
        let length = file.metadata()?.len();
        let has = if length == cue.bytes { cue.chunks() } else { (length / CHUNK).min(cue.chunks() - 1) };
        // What was cut in the middle of a message is fetched again.
        file.set_len(has.saturating_mul(CHUNK).min(cue.bytes))?;
        Ok(Self { path, file, cue: cue.clone(), has })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The numbers of the next messages, so many at the most; empty once it is whole.
    pub(super) fn next(&self, most: u64) -> Range<u64> {
        self.has..self.cue.chunks().min(self.has + most)
    }

    /// How much of it is here, 0 to 100.
    pub(super) fn percent(&self) -> u8 {
        u8::try_from(self.has.saturating_mul(100) / self.cue.chunks().max(1)).unwrap_or(100)
    }

    /// Takes the next messages in their order. Waits for the disk.
    pub(super) fn add(&mut self, pieces: &[Bytes]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.has.saturating_mul(CHUNK)))?;
        for piece in pieces {
            if piece.len() as u64 != self.cue.chunk_len(self.has) {
                return Err(io::ErrorKind::InvalidData.into());
            }
            self.file.write_all(piece)?;
            self.has += 1;
        }
        Ok(())
    }

    /// True if it is the file that is wished. Reads all of it.
    pub(super) fn is_right(&mut self) -> io::Result<bool> {
        self.file.seek(SeekFrom::Start(0))?;
        Ok(Hashed::new(&self.file).finish()? == self.cue.sha256)
    }

    /// Has it on the disk under a name of its folder; false where that is taken, unless it may be replaced. Then it is not here any more.
    pub(super) fn put(&self, name: &str, replaces: bool) -> io::Result<bool> {
        self.file.sync_all()?;
        let own = self.path.file_name().and_then(|own| own.to_str()).ok_or(io::ErrorKind::InvalidInput)?;
        let folder = Folder::open(self.path.parent().unwrap_or(Path::new(".")))?;
        let is_put =
            if replaces { folder.rename(own, name).map(|()| true)? } else { folder.rename_new(own, name)? };
        folder.sync()?;
        Ok(is_put)
    }

    /// Removes it.
    pub(super) fn remove(self) -> io::Result<()> {
        fs::remove_file(&self.path)
    }
}

/// Removes parts of what nobody wishes any more.
pub(super) fn sweep(folder: &Path, is_wished: impl Fn(&str) -> bool) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let digest = name.to_str().and_then(|name| name.strip_suffix(ENDING));
        if digest.is_some_and(|digest| digest.len() == 64 && !is_wished(digest)) {
            let _ = fs::remove_file(entry.path()); // it is tried again the next time
        }
    }
}

#[cfg(test)]
mod tests {
    use sha2::{Digest as _, Sha256};

    use super::*;

    fn cue(bytes: &[u8]) -> WishedCue {
        let sha256 = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        WishedCue { sha256, bytes: bytes.len() as u64 }
    }

    fn piece(bytes: &[u8], n: u64) -> Bytes {
        let chunks: Vec<_> = bytes.chunks(usize::try_from(CHUNK).unwrap()).collect();
        Bytes::copy_from_slice(chunks[usize::try_from(n).unwrap()])
    }

    #[test]
    fn a_part_goes_on_where_it_was_cut_and_a_half_message_is_fetched_again() {
        let dir = tempfile::tempdir().unwrap();
        let bytes: Vec<u8> = (0..300_000_u32).flat_map(u32::to_le_bytes).collect();
        let cue = cue(&bytes);
        let mut part = CuePart::open(dir.path(), &cue).unwrap();
        assert_eq!((part.next(8), part.percent()), (0..8, 0));
        part.add(&[piece(&bytes, 0), piece(&bytes, 1)]).unwrap();
        OpenOptions::new().append(true).open(part.path()).unwrap().write_all(b"half").unwrap();
        let mut part = CuePart::open(dir.path(), &cue).unwrap();
        assert_eq!((part.next(2), part.percent()), (2..4, 20));
        part.add(&(2..10).map(|n| piece(&bytes, n)).collect::<Vec<_>>()).unwrap();
        let mut part = CuePart::open(dir.path(), &cue).unwrap();
        assert!(part.next(8).is_empty() && part.percent() == 100);
        assert!(part.is_right().unwrap());
        assert_eq!(fs::read(part.path()).unwrap(), bytes);
    }

    #[test]
    fn what_is_altered_too_short_or_too_long_is_never_right() {
        let dir = tempfile::tempdir().unwrap();
        let bytes = vec![7; 200_000];
        let cue = cue(&bytes);
        let mut part = CuePart::open(dir.path(), &cue).unwrap();
        assert!(part.add(&[Bytes::from_static(b"short")]).is_err());
        part.add(&[piece(&bytes, 0), piece(&vec![8; 200_000], 1)]).unwrap();
        assert!(!part.is_right().unwrap());
        part.remove().unwrap();
        fs::write(dir.path().join(format!("{}.part", cue.sha256)), vec![7; 300_000]).unwrap();
        let part = CuePart::open(dir.path(), &cue).unwrap();
        assert_eq!(part.next(8), 1..2, "its last message is fetched again");
    }

    #[test]
    fn a_part_takes_a_name_that_is_free_or_may_be_replaced_and_no_other() {
        let dir = tempfile::tempdir().unwrap();
        let part = |bytes: &[u8]| {
            let mut part = CuePart::open(dir.path(), &cue(bytes)).unwrap();
            // What could not be put is here still.
            if !part.next(1).is_empty() {
                part.add(&[Bytes::copy_from_slice(bytes)]).unwrap();
            }
            part
        };
        assert!(part(b"one").put("storm.csv", false).unwrap());
        assert!(!part(b"two").put("storm.csv", false).unwrap(), "somebody put it there meanwhile");
        assert_eq!(fs::read(dir.path().join("storm.csv")).unwrap(), b"one");
        assert!(part(b"two").put("storm.csv", true).unwrap());
        assert_eq!(fs::read(dir.path().join("storm.csv")).unwrap(), b"two");
    }

    #[test]
    fn parts_of_what_nobody_wishes_any_more_are_removed_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let (one, two) = (cue(b"one"), cue(b"two"));
        drop((CuePart::open(dir.path(), &one).unwrap(), CuePart::open(dir.path(), &two).unwrap()));
        fs::write(dir.path().join("notes.part"), "").unwrap();
        sweep(dir.path(), |digest| digest == one.sha256);
        let mut left: Vec<_> = fs::read_dir(dir.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        left.sort();
        assert_eq!(left, [format!("{}.part", one.sha256), "notes.part".to_owned()]);
    }
}
