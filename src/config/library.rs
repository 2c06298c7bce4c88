//! `[library]`: what the cue library takes in, and where the playlists are.

use std::path::{Path, PathBuf};

use super::fault::Faults;
use super::section::{Entry, Section};

/// Why playlists are not kept among the cues: of both it is noted beside them what a fleet brought, and under one name.
pub(crate) const ONE_FOLDER: &str =
    "the playlists cannot be in the folder of the cues (library of [show]); name another folder";

/// What the library and the playlists are kept in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Store {
    /// The longest cue that can be uploaded, MiB, 1 to 2,048.
    pub(crate) max_cue_mib: u32,
    /// The most memory that a cue may take to be checked, and so to be played, MiB, 64 to 8,192.
    pub(crate) max_memory_mib: u32,
    /// The folder with the playlists; none for `playlists` beside the library.
    pub(crate) playlists: Option<PathBuf>,
    /// The folder of what the service keeps, where that is not the package's.
    pub(crate) kept_in: Option<PathBuf>,
}

impl Default for Store {
    fn default() -> Self {
        Self { max_cue_mib: 256, max_memory_mib: 768, playlists: None, kept_in: None }
    }
}

/// Reads the table; the folder of the cues is that one.
pub(super) fn store(entry: Entry<'_>, library: &Path, faults: &mut Faults<'_>) -> Option<Store> {
    let default = Store::default();
    let mut section = Section::new("[library]", entry.at, entry.table(faults)?, faults);
    let playlists_at = section.get("playlists");
    let playlists = playlists_at.and_then(|entry| entry.text(section.faults)).map(PathBuf::from);
    if let (Some(entry), Some(folder)) = (playlists_at, &playlists)
        && folder == library
    {
        entry.fault(section.faults, ONE_FOLDER);
    }
    let store = Store {
        max_cue_mib: section.whole_in("max_cue_mib", 1..=2048).unwrap_or(default.max_cue_mib),
        max_memory_mib: section.whole_in("max_memory_mib", 64..=8192).unwrap_or(default.max_memory_mib),
        playlists,
        kept_in: None,
    };
    section.finish();
    Some(store)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::config::tests::{faults_of, hall_with};

    #[test]
    fn playlists_lie_beside_the_library_unless_told_otherwise() {
        let hall = hall_with("[show]\nlibrary = \"/srv/hall/cues\"\n");
        assert_eq!(hall.playlists(), Path::new("/srv/hall/playlists"));
        assert_eq!((hall.store.max_cue_mib, hall.store.max_memory_mib), (256, 768));
        let hall =
            hall_with("[library]\nmax_cue_mib = 8\nmax_memory_mib = 2048\nplaylists = \"/srv/lists\"\n");
        assert_eq!((hall.playlists().as_path(), hall.store.max_cue_mib), (Path::new("/srv/lists"), 8));
        assert_eq!(hall.store.max_memory_mib, 2048);
    }

    #[test]
    fn what_the_library_cannot_be_told_is_refused() {
        let faults = faults_of("[library]\nmax_cue_mib = 4096\npath = \"x\"\n");
        assert!(faults[0].ends_with("max_cue_mib: 4096 is outside 1..=2048"), "{faults:?}");
        assert!(faults[1].contains("path: unknown key in [library]"), "{faults:?}");
        let faults = faults_of("[show]\nlibrary = \"/srv/cues\"\n[library]\nplaylists = \"/srv/./cues/\"\n");
        assert!(faults[0].contains("the playlists cannot be in the folder of the cues"), "{faults:?}");
    }
}
