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

/// What is left of names that shall go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LeftThere {
    /// Nothing is there.
    Nothing,
    /// A file that was brought is there.
    Brought,
    /// Only what people put there.
    Theirs,
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

    /// What is left of these names.
    pub(crate) fn left_there(&self, folder: &Folder, names: &[String]) -> io::Result<LeftThere> {
        let mut left = LeftThere::Nothing;
        for name in names {
            if folder.stamp(name)?.is_some_and(|stamp| self.has(name, stamp)) {
                return Ok(LeftThere::Brought);
            }
            if folder.has(name)? {
                left = LeftThere::Theirs;
            }
        }
        Ok(left)
    }

    /// Gives a file its name, where nothing is there but what was brought; false where people have put something there meanwhile, which
    /// stays. Whatever was looked at before, people may do that until the very last.
    pub(crate) fn put(&self, folder: &Folder, from: &str, to: &str) -> io::Result<bool> {
        Ok(folder.rename_new(from, to)? || folder.rename_over(from, to, |stamp| self.has(to, stamp))?)
    }

    /// Removes what was brought of these names, and forgets it.
    pub(crate) fn remove(&mut self, folder: &Folder, names: &[String]) -> io::Result<()> {
        for name in names {
            self.remove_one(folder, name)?;
        }
        folder.sync()?;
        self.forget_gone(folder);
        Ok(())
    }

    /// Removes what was brought of a name.
    pub(crate) fn remove_one(&self, folder: &Folder, name: &str) -> io::Result<()> {
        let is_brought = folder.stamp(name)?.is_some_and(|stamp| self.has(name, stamp));
        if is_brought { folder.remove(name) } else { Ok(()) }
    }

    fn forget_gone(&mut self, folder: &Folder) {
        self.0.retain(|file| folder.stamp(&file.name).ok().flatten() == Some(file.stamp));
    }

    /// Adds a file that is about to get its name, and forgets those that are gone.
    pub(crate) fn note(&mut self, folder: &Folder, name: String, stamp: Stamp) {
        self.forget_gone(folder);
        self.0.push(BroughtFile { name, stamp });
    }

    /// How many there are.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }
}
