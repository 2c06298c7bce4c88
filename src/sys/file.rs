//! The one way to open a file that somebody else may have put there: regular files alone, never waited for, read up to a bound. A pipe or
//! a device in a file's place may never end, or never begin; a symbolic link in a folder of ours leads to what nobody gave us.
//! `tests/shape` holds all rooms to it.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::Path;

use rustix::fs::OFlags;

/// Opens a regular file that a person has named to read it: the way to it may lead over symbolic links. Never waits for whoever else may
/// open what is there.
///
/// # Errors
/// Of kind [`ErrorKind::IsADirectory`] where it is a folder, [`ErrorKind::InvalidInput`] where it is a pipe, a socket or a
/// device; else what the system says.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    regular(OpenOptions::new().read(true), OFlags::empty(), path)
}

/// Opens a regular file of a folder of ours to read it.
///
/// # Errors
/// As [`open`]; of kind [`ErrorKind::InvalidInput`] where it is a symbolic link as well.
pub(crate) fn open_ours(path: &Path) -> io::Result<File> {
    regular(OpenOptions::new().read(true), OFlags::NOFOLLOW, path)
}

/// Opens a regular file of a folder of ours to write it anew, made where there is none.
///
/// # Errors
/// As [`open_ours`].
pub(crate) fn create_ours(path: &Path) -> io::Result<File> {
    let file = regular(OpenOptions::new().write(true).create(true), OFlags::NOFOLLOW, path)?;
    file.set_len(0)?; // only now is it known to be one
    Ok(file)
}

/// Writes a regular file of a folder of ours anew.
///
/// # Errors
/// As [`create_ours`]; what the disk says.
pub(crate) fn write_ours(path: &Path, octets: impl AsRef<[u8]>) -> io::Result<()> {
    create_ours(path)?.write_all(octets.as_ref())
}

/// The octets of a regular file that a person has named, of so many at the most.
///
/// # Errors
/// As [`open`]; of kind [`ErrorKind::FileTooLarge`] where it is longer.
pub(crate) fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    whole(open(path)?, most)
}

/// The text of a regular file that a person has named, of so many octets at the most.
///
/// # Errors
/// As [`read`]; of kind [`ErrorKind::InvalidData`] where it is not UTF-8.
pub(crate) fn text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read(path, most)?).map_err(|error| io::Error::new(ErrorKind::InvalidData, error))
}

/// All octets of an open file, of which there are so many at the most.
///
/// # Errors
/// As [`read`].
pub(crate) fn whole(file: File, most: u64) -> io::Result<Vec<u8>> {
    let mut octets = Vec::new();
    file.take(most.saturating_add(1)).read_to_end(&mut octets)?;
    if octets.len() as u64 > most {
        let what = format!("it is longer than {most} bytes");
        return Err(io::Error::new(ErrorKind::FileTooLarge, what));
    }
    Ok(octets)
}

/// What the kernel says in a file of its own, below `/proc` or `/sys`.
///
/// # Errors
/// What the system says.
pub(crate) fn of_kernel(path: &Path) -> io::Result<String> {
    std::fs::read_to_string(path)
}

/// Octets that nobody can guess, from the generator of the kernel, which is ready long before a program is.
///
/// # Errors
/// What the system says.
pub(crate) fn random<const N: usize>() -> io::Result<[u8; N]> {
    let mut octets = [0; N];
    File::open("/dev/urandom")?.read_exact(&mut octets)?;
    Ok(octets)
}

fn regular(options: &mut OpenOptions, flags: OFlags, path: &Path) -> io::Result<File> {
    // A pipe would otherwise be waited for until somebody opens its other end, and a terminal would become ours.
    let flags = flags | OFlags::NONBLOCK | OFlags::NOCTTY;
    let is_none = |what| io::Error::new(ErrorKind::InvalidInput, what);
    let file = options.custom_flags(flags.bits().cast_signed()).open(path).map_err(|error| {
        match error.raw_os_error() {
            Some(libc::ELOOP) => is_none("it is a symbolic link, not a file; put the file itself there"),
            Some(libc::ENXIO) => is_none("it is a pipe or a socket, not a file"),
            _ => error,
        }
    })?;
    let kind = file.metadata()?.file_type();
    match (kind.is_file(), kind.is_dir()) {
        (true, _) => Ok(file),
        (_, true) => Err(ErrorKind::IsADirectory.into()),
        _ => Err(is_none("it is a pipe or a device, not a file; copy its data to a file, and give that")),
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
        for path in [pipe.as_path(), Path::new("/dev/null")] {
            assert_eq!(create_ours(path).unwrap_err().kind(), ErrorKind::InvalidInput, "to write it");
        }
    }

    #[test]
    fn a_link_in_a_folder_of_ours_is_neither_read_nor_written_through_and_a_file_ends_at_its_bound() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("theirs"), "12345").unwrap();
        std::os::unix::fs::symlink(at("theirs"), at("link")).unwrap();
        for refused in [open_ours(&at("link")), create_ours(&at("link"))] {
            assert_eq!(refused.unwrap_err().kind(), ErrorKind::InvalidInput);
        }
        assert_eq!(
            (read(&at("link"), 5).unwrap(), text(&at("theirs"), 5).unwrap()),
            (b"12345".to_vec(), "12345".to_owned())
        );
        assert_eq!(read(&at("theirs"), 4).unwrap_err().kind(), ErrorKind::FileTooLarge);
        drop(create_ours(&at("theirs")).unwrap());
        assert_eq!(read(&at("theirs"), 0).unwrap(), b"");
    }
}
