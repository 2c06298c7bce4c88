//! What halls tell elsewhere of their journals, held against the chains of these.

use serde::Deserialize as _;
use serde_json::Value;

use super::chain::{Chain, ChainFindings, JournalKeys};
use super::files::FileKind;
use super::read::LinePlace;
use super::record::Line;
use super::tail::JournalPart;

/// Of what a hall told of one journal, the lines that count, in the order in which they were written.
pub(crate) fn check_told(parts: Vec<JournalPart>, keys: &JournalKeys) -> (Vec<Value>, ChainFindings) {
    let mut parts = parts;
    let number = |part: &JournalPart| part.record["seal"]["n"].as_u64().unwrap_or(0);
    parts.sort_by_cached_key(|part| (number(part), part.file.clone()));
    let mut chain = Chain::new(FileKind::Shows, keys.clone(), None);
    parts.retain(|part| {
        let place = LinePlace { words: format!("{}:{}", part.file, part.line), day: None };
        chain.take(&part.record, Line::deserialize(&part.record).ok().as_ref(), &place)
    });
    (parts.into_iter().map(|part| part.record).collect(), chain.close())
}
