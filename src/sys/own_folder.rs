//! A folder of one's own for as long as the program runs.

use std::fs::{self, DirBuilder};
use std::io::{self, ErrorKind};
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};

/// Names that are tried.
const TRIES: u32 = 100;

/// A folder that nobody else may look into; removed with all that is in it when this is dropped.
#[derive(Debug)]
pub(crate) struct OwnFolder(PathBuf);

impl OwnFolder {
    /// One in `parent`.
    ///
    /// # Errors
    /// Those of the system; [`ErrorKind::InvalidFilename`] where its name could not stand in a configuration.
    pub(crate) fn make(parent: &Path) -> io::Result<Self> {
        if parent.to_str().is_none() {
            return Err(ErrorKind::InvalidFilename.into());
        }
        let own = |attempt: u32| parent.join(format!("kinocue-{}-{attempt}", std::process::id()));
        // What is there already is never taken for ours: it may belong to somebody who waits for us to write into it.
        let made = (0..TRIES).map(own).find_map(|path| match DirBuilder::new().mode(0o700).create(&path) {
            Ok(()) => Some(Ok(Self(path))),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => None,
            Err(error) => Some(Err(error)),
        });
        made.unwrap_or_else(|| Err(ErrorKind::AlreadyExists.into()))
    }

    /// Where something of that name is in it.
    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a file, and makes the folders that it lies in.
    ///
    /// # Errors
    /// Those of the system.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> io::Result<PathBuf> {
        let path = self.path(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(&path, bytes)?;
        Ok(path)
    }

    /// Removes it.
    ///
    /// # Errors
    /// Those of the system.
    pub(crate) fn remove(mut self) -> io::Result<()> {
        let path = std::mem::take(&mut self.0);
        fs::remove_dir_all(path)
    }
}

impl Drop for OwnFolder {
    fn drop(&mut self) {
        if !self.0.as_os_str().is_empty() {
            let _ = fs::remove_dir_all(&self.0); // another error is on its way
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn it_is_for_its_owner_alone_and_goes_with_all_that_is_in_it() {
        let parent = tempfile::tempdir().unwrap();
        let make = || OwnFolder::make(parent.path()).unwrap();
        let (folder, other) = (make(), make());
        assert_ne!(folder.0, other.0);
        assert_eq!(fs::metadata(&folder.0).unwrap().permissions().mode() & 0o777, 0o700);
        let file = folder.write("cues/one.csv", b"x").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"x");
        let path = folder.0.clone();
        folder.remove().unwrap();
        assert!(!path.exists());
        let path = other.0.clone();
        drop(other);
        assert!(!path.exists());
    }
}
