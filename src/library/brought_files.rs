//! Which files of a folder a fleet brought. What people put there is theirs: a file counts as brought only where it is the very one that
//! was noted when it came, by its inode, its length and when it was written. All else is never replaced.

use std::io;

use serde::{Deserialize, Serialize};

use crate::sys::folder::{Folder, Stamp};

/// Files that were brought. One is noted before it is put into its place, so that a crash leaves none that nobody knows.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct BroughtFiles(Vec<BroughtFile>);

/// A file that was brought.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct BroughtFile {
    name: String,
    stamp: Stamp,
}

impl BroughtFiles {
    /// True of a file that was brought and is still the same.
    fn has(&self, name: &str, stamp: Stamp) -> bool {
        self.0.iter().any(|file| file.name == name && file.stamp == stamp)
    }

    /// True if nothing of that name is there but what was brought.
    pub(crate) fn has_no_other(&self, folder: &Folder, name: &str) -> io::Result<bool> {
        // What is there and is no regular file is nobody's to replace either.
        Ok(!folder.has(name)? || folder.stamp(name)?.is_some_and(|stamp| self.has(name, stamp)))
    }

    /// Adds a file that is about to get its name, and forgets those that are gone.
    pub(crate) fn note(&mut self, folder: &Folder, name: String, stamp: Stamp) {
        self.0.retain(|file| folder.stamp(&file.name).ok().flatten() == Some(file.stamp));
        self.0.push(BroughtFile { name, stamp });
    }

    /// How many there are.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }
}
