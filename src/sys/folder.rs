//! A folder of plain files. Nothing here follows a symbolic link out of it, waits on a pipe, or names anything outside it.

use std::fs::File;
use std::io::{self, Write as _};
use std::os::fd::{AsFd as _, OwnedFd};
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, CWD, Dir, FileType, FlockOperation, Mode, OFlags, RenameFlags, renameat_with};
use rustix::io::Errno;
use serde::{Deserialize, Serialize};

/// What tells one content of a file from another without reading it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Stamp {
    /// Bytes.
    pub(crate) size: u64,
    /// When it was last written: seconds and nanoseconds since 1970.
    mtime: (i64, u64),
    inode: u64,
}

impl Stamp {
    pub(crate) fn of(file: &File) -> io::Result<Self> {
        use std::os::unix::fs::MetadataExt as _;
        let metadata = file.metadata()?;
        let mtime = (metadata.mtime(), metadata.mtime_nsec().unsigned_abs());
        Ok(Self { size: metadata.len(), mtime, inode: metadata.ino() })
    }

    /// True if `other` was written after this.
    pub(crate) fn is_before(&self, other: &Self) -> bool {
        self.mtime < other.mtime
    }
}

/// An open folder.
#[derive(Debug)]
pub(crate) struct Folder {
    fd: OwnedFd,
    path: PathBuf,
}

impl Folder {
    /// Opens a folder. The way to it may lead over symbolic links: it comes from the configuration.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        Ok(Self { fd: rustix::fs::openat(CWD, path, flags, Mode::empty())?, path: path.to_owned() })
    }

    /// Where a file of it is.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The names of all that is in it, sorted, as far as they are UTF-8.
    pub(crate) fn names(&self) -> io::Result<Vec<String>> {
        let mut names = Vec::new();
        for entry in Dir::read_from(self.fd.as_fd())? {
            match entry?.file_name().to_str() {
                Ok("." | "..") | Err(_) => {}
                Ok(name) => names.push(name.to_owned()),
            }
        }
        names.sort_unstable();
        Ok(names)
    }

    /// Opens a regular file to read it; `None` if there is nothing of that name, or something else.
    pub(crate) fn file(&self, name: &str) -> io::Result<Option<(File, Stamp)>> {
        // Without NONBLOCK, opening a pipe would wait for somebody to write to it.
        let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let fd = match rustix::fs::openat(&self.fd, name, flags, Mode::empty()) {
            Ok(fd) => fd,
            Err(Errno::NOENT | Errno::LOOP | Errno::NXIO) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        if FileType::from_raw_mode(rustix::fs::fstat(&fd)?.st_mode) != FileType::RegularFile {
            return Ok(None);
        }
        let file = File::from(fd);
        let stamp = Stamp::of(&file)?;
        Ok(Some((file, stamp)))
    }

    /// The stamp of a regular file; `None` if there is no such.
    pub(crate) fn stamp(&self, name: &str) -> io::Result<Option<Stamp>> {
        Ok(self.file(name)?.map(|(_, stamp)| stamp))
    }

    /// True if there is anything of that name.
    pub(crate) fn has(&self, name: &str) -> io::Result<bool> {
        match rustix::fs::statat(&self.fd, name, AtFlags::SYMLINK_NOFOLLOW) {
            Ok(_) => Ok(true),
            Err(Errno::NOENT) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Makes a new file, locked for as long as it is open, so that [`Folder::remove_abandoned`] leaves it alone.
    pub(crate) fn create(&self, name: &str) -> io::Result<File> {
        let flags = OFlags::RDWR | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let mode = Mode::RUSR | Mode::WUSR | Mode::RGRP;
        let fd = rustix::fs::openat(&self.fd, name, flags, mode)?;
        rustix::fs::flock(&fd, FlockOperation::NonBlockingLockExclusive)?;
        Ok(File::from(fd))
    }

    /// Opens a regular file, made where there is none, to write at its end.
    pub(crate) fn append(&self, name: &str) -> io::Result<File> {
        let flags = OFlags::RDWR
            | OFlags::APPEND
            | OFlags::CREATE
            | OFlags::NOFOLLOW
            | OFlags::NONBLOCK
            | OFlags::CLOEXEC;
        let mode = Mode::RUSR | Mode::WUSR | Mode::RGRP;
        let fd = rustix::fs::openat(&self.fd, name, flags, mode)?;
        if FileType::from_raw_mode(rustix::fs::fstat(&fd)?.st_mode) != FileType::RegularFile {
            return Err(io::Error::other(format!("{name} is not a regular file")));
        }
        Ok(File::from(fd))
    }

    /// Marks the folder as being written to, for as long as this is open; false where somebody else has.
    pub(crate) fn claim(&self) -> bool {
        rustix::fs::flock(&self.fd, FlockOperation::NonBlockingLockExclusive).is_ok()
    }

    /// True if somebody has claimed the folder.
    pub(crate) fn is_claimed(&self) -> bool {
        let shared = rustix::fs::flock(&self.fd, FlockOperation::NonBlockingLockShared);
        if shared.is_ok() {
            let _ = rustix::fs::flock(&self.fd, FlockOperation::Unlock);
        }
        shared == Err(Errno::WOULDBLOCK)
    }

    /// Removes a file that nobody has locked.
    pub(crate) fn remove_abandoned(&self, name: &str) -> io::Result<()> {
        if let Some((file, _)) = self.file(name)?
            && rustix::fs::flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok()
        {
            self.remove(name)?;
        }
        Ok(())
    }

    /// Puts a file in the place of another, at once.
    pub(crate) fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        Ok(rustix::fs::renameat(&self.fd, from, &self.fd, to)?)
    }

    /// Gives a file a name that nothing has; false where something has it, which stays.
    pub(crate) fn rename_new(&self, from: &str, to: &str) -> io::Result<bool> {
        match renameat_with(&self.fd, from, &self.fd, to, RenameFlags::NOREPLACE) {
            Ok(()) => Ok(true),
            Err(Errno::EXIST) => Ok(false),
            // A file system that does not know how: a look before has to do.
            Err(Errno::INVAL | Errno::NOSYS) if !self.has(to)? => self.rename(from, to).map(|()| true),
            Err(Errno::INVAL | Errno::NOSYS) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Puts a file in the place of one that is still that very one; false where something else is there by then, which stays.
    pub(crate) fn rename_over(
        &self,
        from: &str,
        to: &str,
        is_it: impl Fn(Stamp) -> bool,
    ) -> io::Result<bool> {
        match renameat_with(&self.fd, from, &self.fd, to, RenameFlags::EXCHANGE) {
            Ok(()) if self.stamp(from)?.is_some_and(&is_it) => self.remove(from).map(|()| true),
            Ok(()) => {
                renameat_with(&self.fd, from, &self.fd, to, RenameFlags::EXCHANGE)?;
                Ok(false)
            }
            Err(Errno::NOENT) => self.rename_new(from, to),
            Err(Errno::INVAL | Errno::NOSYS) if self.stamp(to)?.is_some_and(&is_it) => {
                self.rename(from, to).map(|()| true)
            }
            Err(Errno::INVAL | Errno::NOSYS) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Puts a file of those bytes in the place of another, by way of `unfinished`: from the old whole to the new whole, whatever crashes.
    /// The name is on the disk after [`Folder::sync`].
    ///
    /// # Errors
    /// Those of the disk; where somebody has `unfinished` locked. What was there stays, and nothing of the new file.
    pub(crate) fn replace(&self, name: &str, unfinished: &str, bytes: &[u8]) -> io::Result<()> {
        self.remove_abandoned(unfinished)?;
        let mut file = self.create(unfinished)?;
        let written = file.write_all(bytes).and_then(|()| file.sync_all());
        written.and_then(|()| self.rename(unfinished, name)).inspect_err(|_| {
            let _ = self.remove(unfinished); // it takes room, and the next one removes what is left
        })
    }

    /// Removes a file; that there is none is no error.
    pub(crate) fn remove(&self, name: &str) -> io::Result<()> {
        match rustix::fs::unlinkat(&self.fd, name, AtFlags::empty()) {
            Ok(()) | Err(Errno::NOENT) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Has the folder's own entries on the disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        Ok(rustix::fs::fsync(&self.fd)?)
    }
}

impl Drop for Folder {
    /// Closing alone keeps a claim for as long as a child that is just being started has the same open folder.
    fn drop(&mut self) {
        let _ = rustix::fs::flock(&self.fd, FlockOperation::Unlock);
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn only_regular_files_of_the_folder_itself_are_opened() {
        let outside = tempfile::tempdir().unwrap();
        fs::write(outside.path().join("secret"), "x").unwrap();
        let inside = tempfile::tempdir().unwrap();
        let at = |name: &str| inside.path().join(name);
        symlink(outside.path().join("secret"), at("link")).unwrap();
        symlink("/dev/zero", at("zero")).unwrap();
        fs::create_dir(at("folder")).unwrap();
        rustix::fs::mknodat(CWD, at("pipe"), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        fs::write(at("plain"), "abc").unwrap();
        let folder = Folder::open(inside.path()).unwrap();
        for name in ["link", "zero", "folder", "pipe", "missing"] {
            assert!(folder.file(name).unwrap().is_none(), "{name}");
        }
        assert_eq!(folder.stamp("plain").unwrap().unwrap().size, 3);
    }

    #[test]
    fn a_file_is_replaced_as_a_whole_and_where_it_cannot_be_nothing_of_the_new_one_stays() {
        let inside = tempfile::tempdir().unwrap();
        let at = |name: &str| inside.path().join(name);
        fs::write(at("kept"), "old and long").unwrap();
        fs::write(at("kept.new"), "of a crash").unwrap();
        let folder = Folder::open(inside.path()).unwrap();
        folder.replace("kept", "kept.new", b"new").unwrap();
        assert_eq!(fs::read(at("kept")).unwrap(), b"new");
        fs::create_dir(at("folder")).unwrap();
        assert!(folder.replace("folder", "folder.new", b"new").is_err());
        let busy = folder.create("busy.new").unwrap();
        assert!(folder.replace("kept", "busy.new", b"newer").is_err(), "somebody writes it");
        drop(busy);
        assert_eq!(folder.names().unwrap(), ["busy.new", "folder", "kept"]);
        assert_eq!(fs::read(at("kept")).unwrap(), b"new");
    }

    #[test]
    fn a_file_that_somebody_writes_is_not_taken_for_abandoned() {
        let inside = tempfile::tempdir().unwrap();
        let folder = Folder::open(inside.path()).unwrap();
        let mut file = folder.create("new").unwrap();
        file.write_all(b"half").unwrap();
        folder.remove_abandoned("new").unwrap();
        assert!(folder.stamp("new").unwrap().is_some());
        drop(file);
        folder.remove_abandoned("new").unwrap();
        assert!(folder.stamp("new").unwrap().is_none());
    }

    #[test]
    fn a_claim_ends_with_who_made_it_though_a_child_that_is_being_started_has_the_folder_open() {
        let inside = tempfile::tempdir().unwrap();
        let [writer, reader] = [(), ()].map(|()| Folder::open(inside.path()).unwrap());
        assert!(writer.claim() && reader.is_claimed());
        let _of_child = writer.fd.try_clone().unwrap(); // as between fork and exec
        drop(writer);
        assert!(!reader.is_claimed());
    }

    #[test]
    fn a_file_takes_the_place_of_nothing_or_of_the_very_one_that_was_there_and_of_no_other() {
        let inside = tempfile::tempdir().unwrap();
        let at = |name: &str| inside.path().join(name);
        let folder = Folder::open(inside.path()).unwrap();
        fs::write(at("new"), "1").unwrap();
        fs::write(at("theirs"), "x").unwrap();
        assert!(!folder.rename_new("new", "theirs").unwrap() && folder.rename_new("new", "own").unwrap());
        assert_eq!(folder.names().unwrap(), ["own", "theirs"]);
        let own = folder.stamp("own").unwrap().unwrap();
        fs::write(at("next"), "2").unwrap();
        for other in ["theirs", "link"] {
            let _ = symlink("/dev/null", at("link"));
            assert!(!folder.rename_over("next", other, |stamp| stamp == own).unwrap(), "{other}");
        }
        assert_eq!([fs::read(at("theirs")).unwrap(), fs::read(at("next")).unwrap()], [b"x", b"2"]);
        assert!(folder.rename_over("next", "own", |stamp| stamp == own).unwrap());
        fs::write(at("more"), "3").unwrap();
        assert!(folder.rename_over("more", "gone", |_| true).unwrap(), "nothing is there by then");
        assert_eq!(
            (fs::read(at("own")).unwrap(), fs::read(at("gone")).unwrap()),
            (b"2".to_vec(), b"3".to_vec())
        );
        assert_eq!(folder.names().unwrap(), ["gone", "link", "own", "theirs"]);
    }

    #[test]
    fn another_content_has_another_stamp() {
        let inside = tempfile::tempdir().unwrap();
        let folder = Folder::open(inside.path()).unwrap();
        fs::write(inside.path().join("a"), "1").unwrap();
        let first = folder.stamp("a").unwrap().unwrap();
        fs::write(inside.path().join("b"), "2").unwrap();
        folder.rename("b", "a").unwrap();
        assert_ne!(folder.stamp("a").unwrap().unwrap(), first);
        assert_eq!(folder.names().unwrap(), ["a"]);
    }
}
