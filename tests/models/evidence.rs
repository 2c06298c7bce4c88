//! What the ack thread has seen of a lane, and up to when it has told all: from the ack thread to the tick thread.

use std::collections::BTreeSet;
use std::time::Duration;

use loom::sync::Arc;
use loom::thread;

use super::every_order;
use super::published::SharedWord;
use super::time::MonoTime;
use super::wire::FrameNo;

#[allow(dead_code, reason = "models need a part of it")]
#[path = "../../src/belief/evidence.rs"]
mod program;

use program::{EvidenceTable, Reading};

/// The nth reading: all that it says is n.
#[expect(clippy::cast_precision_loss, reason = "a handful")]
fn reading(n: u64) -> Reading {
    let at = MonoTime::default() + Duration::from_millis(n);
    Reading { sways: n as f64, ..Reading::at_rest([n as f64; 2], at) }
}

#[test]
fn a_reading_is_seen_whole_or_not_at_all_and_its_version_is_its_own() {
    let seen = every_order(|| {
        let table = Arc::new(EvidenceTable::of(1));
        let tick = Arc::clone(&table);
        let reads = thread::spawn(move || tick.lane(0).unwrap().reading());
        (1..=2).for_each(|n| table.lane(0).unwrap().on_reading(&reading(n)));
        let seen = reads.join().unwrap();
        seen.map(|(version, seen)| {
            assert_eq!(seen, reading(u64::from(version / 2)), "of version {version}");
            version
        })
    });
    assert_eq!(seen, BTreeSet::from([None, Some(2), Some(4)]));
}

#[test]
fn a_frame_that_was_told_of_is_seen_to_be_acked_and_the_newest_ack_never_goes_back() {
    let seen = every_order(|| {
        let both = Arc::new((EvidenceTable::of(1), SharedWord::default()));
        let tick = Arc::clone(&both);
        let reads = thread::spawn(move || {
            // In the order of `Places::take_evidence`: first up to when all is told, then what was seen.
            let look = || (tick.1.get(), tick.0.lane(0).unwrap().acked().map_or(0, |frame| frame.0));
            let (_, before) = look();
            let (told, acked) = look();
            (told, acked, before <= acked)
        });
        // The second frame is overtaken by the third.
        for (told, frame) in [(1, 1), (2, 3), (3, 2)] {
            both.0.lane(0).unwrap().on_ack(FrameNo(frame));
            both.1.put(told);
        }
        reads.join().unwrap()
    });
    let may_come = [(0, 0), (0, 1), (0, 3), (1, 1), (1, 3), (2, 3), (3, 3)];
    assert_eq!(seen, may_come.map(|(told, acked)| (told, acked, true)).into_iter().collect());
}
