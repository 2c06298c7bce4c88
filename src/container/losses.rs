//! The account of what is lost of a file while what is whole is read: where, of what times, and how many messages.

use mcap::records::op;

use super::{Trouble, message};

/// Stretches that are kept account of.
const MOST: usize = 10_000;

/// A stretch of a file of which nothing can be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LostStretch {
    /// Octets of the file.
    pub(crate) octets: u64,
    /// Log times between which its messages are, ns since 1970: those of the index, or else of the messages before and behind it. `None` where
    /// nothing bounds them.
    pub(crate) span: (Option<u64>, Option<u64>),
    /// Messages in it, where the file counts them elsewhere.
    pub(crate) messages: Option<u64>,
    /// Why.
    pub(crate) trouble: Trouble,
}

/// What was wrong with a file, and what is lost of it.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Salvaged {
    /// What is wrong with the file beside that.
    pub(crate) trouble: Option<Trouble>,
    /// What cannot be read, in the order of the file; the first of it.
    pub(crate) lost: Vec<LostStretch>,
    /// Stretches beyond these.
    pub(crate) more: u64,
    /// Messages that are lost in all, where the file says so.
    pub(crate) messages: Option<u64>,
}

/// What is lost so far.
#[derive(Debug, Default)]
pub(super) struct Losses {
    stretches: Vec<LostStretch>,
    more: u64,
    /// Messages that were read, and the newest log time of these.
    saved: u64,
    pub(super) newest: Option<u64>,
    /// The last stretches end with the next message that is read.
    open: usize,
    /// Messages of the chunk that was lost last, while the records behind it index these.
    indexed: Option<u64>,
}

impl Losses {
    /// A record was read.
    pub(super) fn saved(&mut self, opcode: u8, body: &[u8]) {
        self.end_of_indexes();
        let Some((_, log_time, _)) = Some(body).filter(|_| opcode == op::MESSAGE).and_then(message) else {
            return;
        };
        self.saved += 1;
        self.newest = Some(self.newest.map_or(log_time, |newest| newest.max(log_time)));
        let open = std::mem::take(&mut self.open);
        let first = self.stretches.len() - open;
        self.stretches[first..].iter_mut().for_each(|one| one.span.1 = one.span.1.or(Some(log_time)));
    }

    /// A chunk of so many octets is lost; `span` is what the index at the end says of it.
    pub(super) fn chunk(&mut self, octets: u64, span: Option<(u64, u64)>, trouble: Trouble) {
        self.end_of_indexes();
        self.lose(octets, span, None, trouble);
        self.indexed = Some(0);
    }

    /// The messages of a channel in the chunk that was last, lost or not: their number, for no sum says that their times are right.
    pub(super) fn index(&mut self, body: &[u8]) {
        /// Octets before the entries of an index, and of an entry.
        const ENTRIES: (usize, usize) = (6, 16);
        if let Some(count) = &mut self.indexed {
            *count += (body.len().saturating_sub(ENTRIES.0) / ENTRIES.1) as u64;
        }
    }

    /// So many octets are none; `is_end` where the file has no record behind them.
    pub(super) fn gap(&mut self, octets: u64, span: Option<(u64, u64)>, is_end: bool) {
        self.indexes();
        let trouble = if is_end { Trouble::CutShort } else { Trouble::Damaged("it is no record".to_owned()) };
        self.lose(octets, span, None, trouble);
    }

    /// The file ends before its end: what came after is lost, whether a record of it was begun or not.
    pub(super) fn cut(&mut self) {
        if self.stretches.last().is_none_or(|last| last.trouble != Trouble::CutShort) {
            self.gap(0, None, true);
        }
    }

    /// Some of the indexes of the chunk before are lost: they count it no more.
    pub(super) fn indexes(&mut self) {
        self.indexed = None;
    }

    fn lose(&mut self, octets: u64, span: Option<(u64, u64)>, messages: Option<u64>, trouble: Trouble) {
        if self.stretches.len() >= MOST {
            self.more += 1;
            return;
        }
        self.open += usize::from(span.is_none());
        let span = span.map_or((self.newest, None), |(from, until)| (Some(from), Some(until)));
        self.stretches.push(LostStretch { octets, span, messages, trouble });
    }

    /// All indexes of the chunk that was lost have gone by: there were so many messages in it.
    fn end_of_indexes(&mut self) {
        let count = self.indexed.take().filter(|count| *count > 0);
        if let (Some(count), Some(stretch)) = (count, self.stretches.last_mut()) {
            stretch.messages = Some(count);
        }
    }

    /// True once something is lost.
    pub(super) const fn any(&self) -> bool {
        !self.stretches.is_empty()
    }

    /// What it comes to; `all` are the messages of the whole file.
    pub(super) fn into_salvaged(mut self, trouble: Option<Trouble>, all: Option<u64>) -> Salvaged {
        self.end_of_indexes();
        let each = || self.stretches.iter().map(|one| one.messages).sum::<Option<u64>>();
        let messages = all.map(|all| all.saturating_sub(self.saved)).or_else(each);
        let messages = messages.filter(|_| all.is_some() || self.more == 0);
        Salvaged { trouble, lost: self.stretches, more: self.more, messages }
    }
}
