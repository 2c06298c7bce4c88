//! Sockets in the file system: made with their mode before anybody can connect, and never in place of one that is served.

use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, listen, socket_with};

use super::ApiError;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// The owner and the group of the service may connect, nobody else.
const MODE: u32 = 0o660;
/// How long the socket of a dead process may seem to live.
const AFTERLIFE: Duration = Duration::from_millis(500);
/// Connections that the kernel keeps until they are accepted.
const BACKLOG: i32 = 128;

/// The file of a socket, removed when it is dropped.
#[derive(Debug)]
pub(crate) struct SocketFile(PathBuf);

impl Drop for SocketFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0); // a later start replaces what is left
    }
}

/// Listens, without blocking, on a socket at `path`, whose folder has to be there. A socket that a dead process left is
/// replaced.
pub(crate) fn unix(path: &Path) -> Result<(UnixListener, SocketFile), ApiError> {
    let failed = |source| ApiError::Socket { path: path.to_owned(), source };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // Of two programs that start at once one looks and binds after the other.
    let lock = File::open(folder).map_err(|source| ApiError::Folder { path: folder.to_owned(), source })?;
    lock.lock().map_err(failed)?;
    make_room(path)?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let listener = || -> io::Result<UnixListener> {
        let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
        bind(&socket, &SocketAddrUnix::new(path)?)?;
        fs::set_permissions(path, Permissions::from_mode(MODE))?;
        listen(&socket, BACKLOG)?; // only now can anybody connect
        Ok(UnixListener::from(socket))
    };
    Ok((listener().map_err(failed)?, SocketFile(path.to_owned())))
}

/// Removes a socket that nobody serves.
fn make_room(path: &Path) -> Result<(), ApiError> {
    let failed = |source| ApiError::Socket { path: path.to_owned(), source };
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(failed(error)),
        Ok(found) if !found.file_type().is_socket() => {
            return Err(ApiError::NoSocket { path: path.to_owned() });
        }
        Ok(_) => {}
    }
    let until = Monotonic.now() + AFTERLIFE;
    loop {
        match UnixStream::connect(path) {
            Err(error) if error.kind() == ErrorKind::ConnectionRefused => {
                return fs::remove_file(path).map_err(failed);
            }
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            Err(error) if error.kind() != ErrorKind::WouldBlock => return Err(failed(error)),
            Ok(stream) if hangs_up(&stream, until) => {}
            _ => return Err(ApiError::Served { path: path.to_owned() }),
        }
    }
}

/// True if the other end goes away until then: a child that this or a dead process has just forked holds all its sockets for
/// an instant, until it executes its program, and serves none.
fn hangs_up(stream: &UnixStream, until: MonoTime) -> bool {
    let left = Timespec::try_from(until.since(Monotonic.now())).expect("a moment fits");
    let mut ends = [PollFd::new(stream, PollFlags::RDHUP)];
    // A signal is as good as an end: it is looked at once more.
    let ended = poll(&mut ends, Some(&left)).map_or_else(|error| error == Errno::INTR, |ready| ready > 0);
    ended && Monotonic.now() < until
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o7777
    }

    #[test]
    fn a_socket_is_for_owner_and_group_and_goes_when_it_is_closed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("control.sock");
        let (listener, file) = unix(&path).unwrap();
        assert_eq!(mode(&path), MODE);
        assert!(UnixStream::connect(&path).is_ok());
        drop((listener, file));
        assert!(!path.exists());
    }

    #[test]
    fn a_socket_of_a_dead_process_is_replaced_and_a_live_one_is_not() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("control.sock");
        drop(UnixListener::bind(&path).unwrap()); // leaves its file
        let (_listener, _file) = unix(&path).unwrap();
        assert!(matches!(unix(&path), Err(ApiError::Served { .. })));
        assert!(UnixStream::connect(&path).is_ok(), "it still serves");
    }

    #[test]
    fn a_dead_socket_that_a_forked_child_holds_for_an_instant_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("control.sock");
        let held = UnixListener::bind(&path).unwrap();
        let child = std::thread::spawn(move || {
            // It goes once somebody has been taken in by it.
            poll(&mut [PollFd::new(&held, PollFlags::IN)], None).unwrap();
        });
        let (_listener, _file) = unix(&path).unwrap();
        child.join().unwrap();
        assert!(UnixStream::connect(&path).is_ok(), "the new one serves");
    }

    #[test]
    fn a_file_in_the_way_stays_and_a_missing_folder_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("notes");
        fs::write(&path, "mine").unwrap();
        assert!(matches!(unix(&path), Err(ApiError::NoSocket { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
        let error = unix(&dir.path().join("gone/control.sock")).unwrap_err();
        assert!(error.to_string().contains("gone"), "{error}");
    }
}
