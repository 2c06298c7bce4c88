//! Words that belong together, and words that say that others are there: the point of the film, readings, up to when all is told.

use std::collections::BTreeSet;

use loom::sync::Arc;
use loom::thread;

use super::every_order;
use super::published::{SharedWord, SharedWords};

#[test]
fn words_that_belong_together_are_never_mixed_and_never_older_than_what_was_read_before() {
    let seen = every_order(|| {
        let words = Arc::new(SharedWords::<2>::default());
        let reader = Arc::clone(&words);
        let reads = thread::spawn(move || [reader.get(), reader.get()]);
        (1..=2).for_each(|n| words.put([n, 10 * n]));
        assert_eq!(words.get(), Some((4, [2, 20])), "what was written last is there");
        reads.join().unwrap()
    });
    let (first, second) = (Some((2, [1, 10])), Some((4, [2, 20])));
    // Nothing is seen before the first, and while one is being written.
    let may_come = [None, first, second].map(|one| [None, first, second].map(|other| [one, other]));
    let mut may_come: BTreeSet<_> = may_come.into_iter().flatten().collect();
    // Nor is anything older seen after the last, or nothing.
    may_come.retain(|[before, after]| *before != second || *after == second);
    assert_eq!(seen, may_come);
}

#[test]
fn who_sees_a_word_sees_what_was_published_before_it() {
    let seen = every_order(|| {
        let both = Arc::new((SharedWords::<1>::default(), SharedWord::default()));
        let reader = Arc::clone(&both);
        let reads = thread::spawn(move || (reader.1.get(), reader.0.get().map(|(_, [n])| n)));
        for n in 1..=2 {
            both.0.put([n]);
            both.1.put(n);
        }
        reads.join().unwrap()
    });
    // None beside 1: the second is just being written.
    let may_come =
        [(0, None), (0, Some(1)), (0, Some(2)), (1, None), (1, Some(1)), (1, Some(2)), (2, Some(2))];
    assert_eq!(seen, BTreeSet::from(may_come));
}
