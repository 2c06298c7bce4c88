//! The chain of seals as a reader holds it against the lines that there are: what is missing, and what no service of this hall wrote.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use jiff::civil::Date;
use serde_json::Value;

use super::files::FileKind;
use super::read::LinePlace;
use super::record::{Line, day_of};
use super::seal::{Seal, Sealed, Tip};

/// Whose lines count.
#[derive(Debug, Clone, Default)]
pub(crate) struct JournalKeys {
    /// These, and those that one of them has signed; where there are none, that of the first line.
    known: BTreeSet<String>,
    /// Lines without a seal count nowhere, not even before the first that has one.
    strict: bool,
}

impl JournalKeys {
    /// Of these alone.
    pub(crate) fn only(keys: impl IntoIterator<Item = String>) -> Self {
        Self { known: keys.into_iter().collect(), strict: true }
    }

    /// Of these, or of whoever sealed the first line where there are none; and what was written before lines were sealed.
    pub(crate) fn any_of(keys: impl IntoIterator<Item = String>) -> Self {
        Self { known: keys.into_iter().collect(), strict: false }
    }

    /// Of these as well.
    pub(super) fn learn(&mut self, keys: &BTreeSet<String>) {
        self.known.extend(keys.iter().cloned());
    }
}

/// The lines of one kind that were read so far.
#[derive(Debug)]
pub(crate) struct Chain {
    kind: FileKind,
    keys: JournalKeys,
    /// By number: the hash of each, the hash of the one before it, and where it stands.
    links: BTreeMap<u64, (String, String, String)>,
    /// The last line of the file before the first that is read.
    before: Option<Tip>,
    /// The newest of a day so far.
    of_day: Option<(Date, u64)>,
    unsealed: u64,
    late: Grouped,
    strangers: BTreeMap<String, Grouped>,
    faults: Vec<String>,
}

/// Lines of which the first is named and the others are counted.
#[derive(Debug, Default)]
struct Grouped {
    first: String,
    count: u64,
}

impl Grouped {
    fn add(&mut self, place: &LinePlace) {
        if self.count == 0 {
            self.first.clone_from(&place.words);
        }
        self.count += 1;
    }

    /// One line, or how many from where on.
    fn words(&self) -> String {
        match self.count {
            1 => self.first.clone(),
            count => format!("{count} lines from {} on", self.first),
        }
    }
}

impl Chain {
    pub(super) fn new(kind: FileKind, keys: JournalKeys, before: Option<Tip>) -> Self {
        let before = before.filter(|tip| tip.n > 0);
        Self {
            kind,
            keys,
            links: BTreeMap::new(),
            before,
            of_day: None,
            unsealed: 0,
            late: Grouped::default(),
            strangers: BTreeMap::new(),
            faults: Vec::new(),
        }
    }

    /// True if a line counts. To be asked in the order in which lines stand in the journal.
    pub(super) fn take(&mut self, record: &Value, line: Option<&Line>, place: &LinePlace) -> bool {
        match Sealed::of(self.kind, record) {
            Sealed::No if self.keys.strict || self.before.is_some() || !self.links.is_empty() => {
                self.late.add(place);
                false
            }
            Sealed::No => {
                self.unsealed += 1;
                true
            }
            Sealed::Forged => {
                self.faults
                    .push(format!("{}: altered, or put in: its seal is not of what it says", place.words));
                false
            }
            Sealed::Yes(seal, hash) => self.counts_sealed(seal, hash, line, place),
        }
    }

    fn counts_sealed(&mut self, seal: Seal, hash: String, line: Option<&Line>, place: &LinePlace) -> bool {
        if self.keys.known.is_empty() {
            self.keys.known.insert(seal.key.clone());
        }
        if !self.keys.known.contains(&seal.key) {
            self.strangers.entry(seal.key).or_default().add(place);
            return false;
        }
        if let Some(Line::Key { new, .. }) = line {
            self.keys.known.insert(new.clone());
        }
        match self.links.get(&seal.n) {
            // A fleet tells some again.
            Some((known, ..)) if *known == hash && place.day.is_none() => return false,
            Some((_, _, first)) => {
                self.faults.push(format!("{}: a second line {}, beside {first}", place.words, seal.n));
                return false;
            }
            None => {}
        }
        self.check_place(seal.n, line, place);
        self.links.insert(seal.n, (hash, seal.prev, place.words.clone()));
        true
    }

    /// A line stands in a file of its own day, behind those that came before it.
    fn check_place(&mut self, n: u64, line: Option<&Line>, place: &LinePlace) {
        let Some(day) = place.day else { return };
        let own = line.and_then(|line| day_of(line.at()));
        if own.is_some_and(|own| own != day) {
            self.faults.push(format!("{}: a line of another day stands here", place.words));
        }
        let newest = self.of_day.filter(|(of, _)| *of == day).map_or(0, |(_, newest)| newest);
        if n < newest {
            self.faults.push(format!("{}: line {n} stands behind line {newest}", place.words));
        }
        self.of_day = Some((day, newest.max(n)));
    }

    /// What is wrong with all that was read, and what is to be known of it beside that.
    pub(super) fn close(self) -> ChainFindings {
        let mut faults = self.faults;
        let first = self.links.first_key_value().map_or(0, |(first, _)| *first);
        let before = self.before.filter(|tip| tip.n < first);
        let mut last = before.map(|tip| (tip.n, tip.hash, "the file before".to_owned()));
        for (n, (hash, prev, place)) in self.links {
            match &last {
                Some((m, _, at)) if m + 1 < n => faults.push(missing(*m, n, at, &place)),
                Some((m, hash, at)) if *hash != prev => {
                    faults.push(format!(
                        "{place}: line {n} was written behind another line {m} than that of {at}"
                    ));
                }
                _ => {}
            }
            last = Some((n, hash, place));
        }
        if self.late.count > 0 {
            let words = self.late.words();
            faults.push(format!(
                "{words}: without a seal: put in, or of a version that sealed none; not counted"
            ));
        }
        for (key, of) in &self.strangers {
            faults.push(format!(
                "{}: sealed by {key}, which is no key of this journal; not counted",
                of.words()
            ));
        }
        ChainFindings { faults, unsealed: self.unsealed, keys: self.keys.known }
    }
}

fn missing(after: u64, before: u64, from: &str, to: &str) -> String {
    match before - after - 1 {
        1 => format!("line {} is missing, between {from} and {to}", after + 1),
        count => {
            format!("{count} lines, {} to {}, are missing, between {from} and {to}", after + 1, before - 1)
        }
    }
}

impl ChainFindings {
    /// What is found of another chain as well.
    pub(crate) fn add(&mut self, other: Self) {
        self.faults.extend(other.faults);
        self.unsealed += other.unsealed;
        self.keys.extend(other.keys);
    }
}

/// What a chain comes to.
#[derive(Debug, Default)]
pub(crate) struct ChainFindings {
    /// What is missing, or counts for nothing.
    pub(crate) faults: Vec<String>,
    /// Lines that were written before there were seals.
    pub(crate) unsealed: u64,
    /// The keys whose lines counted.
    pub(crate) keys: BTreeSet<String>,
}
