//! Sockets in the file system that outlive whoever made them.

use std::io;
use std::os::unix::fs::FileTypeExt as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

/// Listens at `path`, in the place of a socket that nobody listens to any more.
///
/// # Errors
/// Those of the system; [`io::ErrorKind::AddrInUse`] where somebody listens, or something else lies there.
pub(crate) fn listen_in_place(path: &Path) -> io::Result<UnixListener> {
    if is_stale(path) {
        std::fs::remove_file(path)?;
    }
    UnixListener::bind(path)
}

/// True if it is a socket that nobody listens to. A file refuses a connection as well, and is no socket.
fn is_stale(path: &Path) -> bool {
    let is_socket = path.symlink_metadata().is_ok_and(|found| found.file_type().is_socket());
    is_socket
        && UnixStream::connect(path).is_err_and(|error| error.kind() == io::ErrorKind::ConnectionRefused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_socket_that_is_left_is_replaced_and_what_is_served_or_no_socket_stays() {
        let folder = tempfile::tempdir().unwrap();
        let (socket, file) = (folder.path().join("sock"), folder.path().join("file"));
        drop(listen_in_place(&socket).unwrap()); // leaves its file
        let _served = listen_in_place(&socket).unwrap();
        std::fs::write(&file, "kept").unwrap();
        for taken in [&socket, &file] {
            assert_eq!(listen_in_place(taken).unwrap_err().kind(), io::ErrorKind::AddrInUse);
        }
        assert!(UnixStream::connect(&socket).is_ok());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
    }
}
