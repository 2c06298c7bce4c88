//! Files that are files: what holds bytes that are all there. A pipe or a device in a file's place may never end, or never
//! begin.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read as _};
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::Path;

use rustix::fs::OFlags;

/// Opens a regular file to read it. Never waits for whoever else may open what is there.
///
/// # Errors
/// Of kind [`ErrorKind::IsADirectory`] where it is a folder, [`ErrorKind::InvalidInput`] where it is a pipe, a socket or a
/// device; else what the system says.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    // A pipe would otherwise be waited for until somebody writes to it, and a terminal would become ours.
    let flags = (OFlags::NONBLOCK | OFlags::NOCTTY).bits();
    let file = OpenOptions::new().read(true).custom_flags(flags.cast_signed()).open(path)?;
    let kind = file.metadata()?.file_type();
    match (kind.is_file(), kind.is_dir()) {
        (true, _) => Ok(file),
        (_, true) => Err(ErrorKind::IsADirectory.into()),
        _ => Err(io::Error::new(
            ErrorKind::InvalidInput,
            "it is a pipe or a device, not a file; copy its data to a file, and give that",
        )),
    }
}

/// The text of a file that nobody else may read, of so many bytes at the most; `None` where others may.
///
/// # Errors
/// As [`open`]; where it is not text.
pub(crate) fn secret(path: &Path, most: u64) -> io::Result<Option<String>> {
    let file = open(path)?;
    if file.metadata()?.permissions().mode() & 0o077 != 0 {
        return Ok(None);
    }
    let mut text = String::new();
    file.take(most).read_to_string(&mut text)?;
    Ok(Some(text))
}

/// What to do where files cannot be opened because too many are; `None` where that is not the reason.
pub(crate) fn want_of_files(error: &io::Error) -> Option<&'static str> {
    matches!(error.raw_os_error(), Some(libc::EMFILE | libc::ENFILE))
        .then_some("too many files are open: raise the limit with LimitNOFILE= or `ulimit -n`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_on_a_disk_is_not_what_too_many_open_files_want() {
        let remedy = |errno| want_of_files(&io::Error::from_raw_os_error(errno));
        assert!(remedy(libc::EMFILE).is_some_and(|remedy| remedy.contains("LimitNOFILE")));
        assert_eq!([libc::ENOSPC, libc::EROFS, libc::EIO].map(remedy), [None; 3]);
    }

    #[test]
    fn a_pipe_that_nobody_writes_to_and_a_device_that_never_ends_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
        for path in [pipe.as_path(), Path::new("/dev/zero")] {
            let refused = open(path).unwrap_err();
            assert_eq!(refused.kind(), ErrorKind::InvalidInput, "{refused}");
        }
        assert_eq!(open(folder.path()).unwrap_err().kind(), ErrorKind::IsADirectory);
        assert_eq!(open(&folder.path().join("none")).unwrap_err().kind(), ErrorKind::NotFound);
    }
}
