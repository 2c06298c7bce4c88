//! Sockets in the file system: made with their mode before anybody can connect, and never in place of one that is served.

use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, listen, socket_with};

use super::ApiError;

/// The owner and the group of the service may connect, nobody else.
const MODE: u32 = 0o660;
/// Connections that the kernel keeps until they are accepted.
const BACKLOG: i32 = 128;

/// The file of a socket, removed when it is dropped.
#[derive(Debug)]
pub(super) struct SocketFile(PathBuf);

impl Drop for SocketFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0); // a later start replaces what is left
    }
}

/// Listens, without blocking, on a socket at `path`, whose folder has to be there. A socket that a dead process left is
/// replaced.
pub(super) fn unix(path: &Path) -> Result<(UnixListener, SocketFile), ApiError> {
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
    match UnixStream::connect(path) {
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => fs::remove_file(path).map_err(failed),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) if error.kind() != ErrorKind::WouldBlock => Err(failed(error)),
        _ => Err(ApiError::Served { path: path.to_owned() }),
    }
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
