//! Seals of lines: each has the number of its line in the chain of its kind, the hash of the line before it, and a signature of both and
//! of what the line says. Who has not the key of the service makes no line that passes for one of its.

use std::fs::{self, Permissions};
use std::io::{self, Write as _};
use std::os::unix::fs::{FileExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nkeys::{KeyPair, KeyPairType};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use super::files::{self, FileId, FileKind};
use super::read::MAX_LINE;
use crate::sys::file::{create_ours, read, secret, write_ours};
use crate::sys::folder::{Folder, Stamp};

/// The file of the key in the state folder, and that of the one before it, for as long as that has not signed the new one.
pub(crate) const KEY: &str = "journal.nk";
const OLD_KEY: &str = "journal.old.nk";
/// How far the chains have come, beside the key: a journal that is lost, or cut short, does not begin them anew.
const TIPS: &str = "journal.tips";
/// The longest file of a key, and of the tips.
const LONGEST: u64 = 256;
const LONGEST_TIPS: u64 = 4_096;
/// The beginning of all that is signed: a signature that was made for another purpose seals no line.
const DOMAIN: &str = "kinocue journal 1";
/// What the seal of a line is called there.
const SEAL: &str = "seal";

/// The seal of a line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Seal {
    /// Which line of its chain it is, from 1.
    pub(super) n: u64,
    /// SHA-256 of the line before, with its seal; of nothing where there was none.
    pub(super) prev: String,
    /// The public half of the key.
    pub(super) key: String,
    /// The signature (Ed25519), base64.
    sig: String,
}

/// The newest line of a chain.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Tip {
    pub(super) n: u64,
    pub(super) hash: String,
    /// Who sealed it.
    pub(super) key: String,
}

/// A new key for journals. It is of another type than those that log in at an engine or sign letters.
#[must_use]
pub(crate) fn new_journal_key() -> KeyPair {
    KeyPair::new_module()
}

/// True of the public half of a key for journals.
#[must_use]
pub(crate) fn is_journal_key(public: &str) -> bool {
    KeyPair::from_public_key(public).is_ok_and(|pair| pair.key_pair_type() == KeyPairType::Module)
}

impl Seal {
    /// Seals what a line says as the one behind `before`.
    fn of(pair: &KeyPair, kind: FileKind, before: &Tip, record: &Value) -> Option<Self> {
        let (n, prev) = (before.n + 1, before.hash.clone());
        let sig = pair.sign(&signed(kind, n, &prev, record)).ok()?;
        Some(Self { n, prev, key: pair.public_key(), sig: STANDARD.encode(sig) })
    }

    /// True if its key has sealed a line of that kind which says this.
    fn is_of(&self, kind: FileKind, record: &Value) -> bool {
        let Ok(pair) = KeyPair::from_public_key(&self.key) else { return false };
        let text = || signed(kind, self.n, &self.prev, record);
        is_journal_key(&self.key)
            && STANDARD.decode(&self.sig).is_ok_and(|sig| pair.verify(&text(), &sig).is_ok())
    }
}

fn signed(kind: FileKind, n: u64, prev: &str, record: &Value) -> Vec<u8> {
    format!("{DOMAIN}\n{kind:?}\n{n}\n{prev}\n{record}").into_bytes()
}

/// What is hashed of a line, as a person may check it with other programs: its JSON with sorted keys and no spaces.
pub(super) fn hash(record: &Value) -> String {
    Sha256::digest(record.to_string()).iter().map(|octet| format!("{octet:02x}")).collect()
}

/// What a line says of its seal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Sealed {
    /// It has none.
    No,
    /// It has one that its key did not make for it.
    Forged,
    /// It has one, which is valid, and that hash.
    Yes(Seal, String),
}

impl Sealed {
    /// Of a line of that kind.
    pub(super) fn of(kind: FileKind, record: &Value) -> Self {
        let hash = || hash(record);
        let mut bare = record.clone();
        let Some(seal) = bare.as_object_mut().and_then(|record| record.remove(SEAL)) else { return Self::No };
        match serde_json::from_value::<Seal>(seal) {
            Ok(seal) if seal.is_of(kind, &bare) => Self::Yes(seal, hash()),
            _ => Self::Forged,
        }
    }
}

/// Seals lines with the key of the service.
#[derive(Debug)]
pub(crate) struct Sealer {
    pair: KeyPair,
    /// The key before it, which is still to sign it.
    old: Option<KeyPair>,
    folder: PathBuf,
    /// For each kind, once that is known.
    tips: [Option<Tip>; 2],
}

impl Sealer {
    /// With the key of that folder, which is made where there is none.
    ///
    /// # Errors
    /// Why lines are not sealed, and what to do.
    pub(crate) fn of(folder: &Path) -> Result<Self, String> {
        let path = folder.join(KEY);
        let pair = match read_key(&path)? {
            Some(pair) => pair,
            None => make_key(&path).map_err(|error| {
                format!(
                    "{} cannot be made: {error}; give the service a folder it may write to",
                    path.display()
                )
            })?,
        };
        let old = read_key(&folder.join(OLD_KEY))?;
        Ok(Self { pair, old, folder: folder.to_owned(), tips: [None, None] })
    }

    /// The public half of its key.
    pub(crate) fn public_key(&self) -> String {
        self.pair.public_key()
    }

    /// True if the newest line about shows was sealed with another key: the next one has to say so.
    pub(super) fn has_new_key(&mut self, journal: &Folder) -> bool {
        let key = self.public_key();
        let tip = self.tip(journal, FileKind::Shows);
        !tip.key.is_empty() && tip.key != key
    }

    /// A line with its seal, and what its chain has come to with it; `is_change` if it says that the key is a new one, which the one before
    /// signs where that is there.
    pub(super) fn seal(
        &mut self,
        journal: &Folder,
        (kind, is_change): (FileKind, bool),
        line: &[u8],
    ) -> Option<(Vec<u8>, Tip)> {
        let before = self.tip(journal, kind).clone();
        let old = self.old.as_ref().filter(|old| is_change && old.public_key() == before.key);
        let mut record: Value = serde_json::from_slice(line).ok()?;
        let seal = Seal::of(old.unwrap_or(&self.pair), kind, &before, &record)?;
        let text = serde_json::to_string(&seal).ok()?;
        let key = if is_change { self.public_key() } else { seal.key.clone() };
        record.as_object_mut()?.insert(SEAL.to_owned(), serde_json::to_value(&seal).ok()?);
        let mut line = line.trim_ascii_end().strip_suffix(b"}")?.to_vec();
        line.extend_from_slice(format!(",\"{SEAL}\":{text}}}\n").as_bytes());
        Some((line, Tip { n: seal.n, hash: hash(&record), key }))
    }

    /// A line is on the disk with which its chain has come to this.
    pub(super) fn advance(&mut self, kind: FileKind, is_change: bool, tip: Tip) {
        self.tips[kind as usize] = Some(tip);
        let text = serde_json::to_vec(&self.tips).unwrap_or_default();
        // Whatever is cut off of it, the journal itself says the rest.
        let _ = write_ours(&self.folder.join(TIPS), text);
        if is_change && self.old.take().is_some() {
            let _ = fs::remove_file(self.folder.join(OLD_KEY));
        }
    }

    /// After a write that failed: nobody knows what came of the line.
    pub(super) fn forget(&mut self, kind: FileKind) {
        self.tips[kind as usize] = None;
    }

    /// The newest line of a chain: the newer one of what stands in the journal, and of what was told to stand there.
    fn tip(&mut self, journal: &Folder, kind: FileKind) -> &Tip {
        let folder = &self.folder;
        self.tips[kind as usize].get_or_insert_with(|| {
            let told = read(&folder.join(TIPS), LONGEST_TIPS).unwrap_or_default();
            let told: [Option<Tip>; 2] = serde_json::from_slice(&told).unwrap_or_default();
            let there = newest(journal, kind).unwrap_or_default();
            let told = told.into_iter().nth(kind as usize).flatten();
            told.filter(|told| told.n > there.n).unwrap_or(there)
        })
    }
}

fn read_key(path: &Path) -> Result<Option<KeyPair>, String> {
    let name = path.display();
    let text = match secret(path, LONGEST) {
        Ok(Some(text)) => text,
        Ok(None) => return Err(format!("others may read {name}: `chmod 600` it")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(format!("cannot read {name}: {error}")),
    };
    let pair = KeyPair::from_seed(text.trim()).ok().filter(|pair| is_journal_key(&pair.public_key()));
    pair.map(Some)
        .ok_or_else(|| format!("{name} has no key of a journal: move it away, and a new one is made"))
}

fn make_key(path: &Path) -> io::Result<KeyPair> {
    let pair = new_journal_key();
    let seed = pair.seed().map_err(io::Error::other)?;
    let mut file = create_ours(path)?;
    // Before anything is in it.
    file.set_permissions(Permissions::from_mode(0o600))?;
    file.write_all(format!("{seed}\n").as_bytes())?;
    file.sync_all()?;
    Ok(pair)
}

/// The newest line of a kind that stands in the journal. A clock that was set back may have it stand in any file.
fn newest(journal: &Folder, kind: FileKind) -> io::Result<Tip> {
    let names = files::all(journal)?.into_iter().filter(|file| file.kind == kind);
    let tips = names.map(|file| last_of(journal, file)).collect::<io::Result<Vec<_>>>()?;
    Ok(tips.into_iter().flatten().max_by_key(|tip| tip.n).unwrap_or_default())
}

/// The last whole line of a file that is a record; its number is 0 where it has no seal.
pub(super) fn last_of(journal: &Folder, id: FileId) -> io::Result<Option<Tip>> {
    let Some((file, _)) = journal.file(&id.name())? else { return Ok(None) };
    let size = Stamp::of(&file)?.size;
    let from = size.saturating_sub(2 * MAX_LINE);
    let mut text = vec![0; usize::try_from(size - from).unwrap_or_default()];
    file.read_exact_at(&mut text, from)?;
    let lines = text.split(|octet| *octet == b'\n').rev();
    let record = lines.filter_map(|line| serde_json::from_slice::<Value>(line).ok()).next();
    Ok(record.map(|record| match Sealed::of(id.kind, &record) {
        Sealed::Yes(Seal { n, key, .. }, hash) => Tip { n, hash, key },
        _ => Tip { n: 0, hash: hash(&record), key: String::new() },
    }))
}
