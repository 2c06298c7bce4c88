//! What is known of the cues of a library, kept across starts of the program, so that nothing is proved twice. It lies beside
//! the cues; where it is missing or damaged, the cues are checked again.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Verdict, kept};
use crate::sys::folder::{Folder, Stamp};

/// Its file; no cue can have that name.
const FILE: &str = ".index.json";
/// While it is written.
const NEW_FILE: &str = ".index.new";

/// What is known of each file, by its name.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Index(BTreeMap<String, Known>);

/// What was found of one file.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Known {
    stamp: Stamp,
    /// The hall that it was checked for.
    hall: String,
    verdict: Verdict,
}

impl Index {
    /// What was kept; nothing where that cannot be read.
    pub(super) fn read(folder: &Folder) -> Self {
        kept(folder, FILE)
    }

    /// What is known of a file with that content, and whether it was found for that hall.
    pub(super) fn get(&self, name: &str, stamp: Stamp, hall: &str) -> Option<(&Verdict, bool)> {
        let known = self.0.get(name).filter(|known| known.stamp == stamp)?;
        Some((&known.verdict, known.hall == hall))
    }

    /// Notes what was found of a file, and forgets files that are gone. That it cannot be kept only costs another check.
    pub(super) fn put(&mut self, folder: &Folder, name: &str, stamp: Stamp, hall: &str, verdict: Verdict) {
        self.0.insert(name.to_owned(), Known { stamp, hall: hall.to_owned(), verdict });
        if let Ok(names) = folder.names() {
            self.0.retain(|name, _| names.binary_search(name).is_ok());
        }
        if let Ok(text) = serde_json::to_vec(self) {
            let _ = folder.replace(FILE, NEW_FILE, &text);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn verdict() -> Verdict {
        Verdict {
            passed: true,
            playable: true,
            faults: Vec::new(),
            more: 0,
            led_faults: Vec::new(),
            sha256: "00".to_owned(),
            digest: None,
            title: None,
            length_s: Some(1.5),
            axes: Some(3),
            effects: Vec::new(),
            mcap: false,
        }
    }

    #[test]
    fn what_is_known_lasts_until_file_or_hall_change() {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path()).unwrap();
        fs::write(dir.path().join("a.csv"), "1").unwrap();
        let stamp = folder.stamp("a.csv").unwrap().unwrap();
        Index::default().put(&folder, "a.csv", stamp, "hall", verdict());
        let again = Index::read(&folder);
        assert_eq!(again.get("a.csv", stamp, "hall"), Some((&verdict(), true)));
        assert_eq!(again.get("a.csv", stamp, "other"), Some((&verdict(), false)));
        fs::write(dir.path().join("a.csv"), "22").unwrap();
        assert_eq!(again.get("a.csv", folder.stamp("a.csv").unwrap().unwrap(), "hall"), None);
    }

    #[test]
    fn a_damaged_index_and_files_that_are_gone_are_forgotten() {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path()).unwrap();
        fs::write(dir.path().join("a.csv"), "1").unwrap();
        fs::write(dir.path().join(FILE), "{\"a.csv\":").unwrap();
        let mut index = Index::read(&folder);
        assert!(index.0.is_empty());
        let stamp = folder.stamp("a.csv").unwrap().unwrap();
        index.put(&folder, "a.csv", stamp, "hall", verdict());
        index.put(&folder, "gone.csv", stamp, "hall", verdict());
        assert_eq!(Index::read(&folder).0.keys().collect::<Vec<_>>(), ["a.csv"]);
    }
}
