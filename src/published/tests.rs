use super::*;

#[test]
fn after_as_many_as_can_be_counted_it_counts_anew_and_is_never_taken_for_empty() {
    let words = SharedWords::<1>::at_version(u32::MAX - 3);
    for (word, version) in [(7, u32::MAX - 1), (8, 2), (9, 4)] {
        words.put([word]);
        assert_eq!((words.get(), words.version()), (Some((version, [word])), version));
    }
}

#[test]
fn nothing_is_read_before_the_first_and_while_one_is_written() {
    assert_eq!((SharedWords::<2>::default().get(), SharedWord::default().get()), (None, 0));
    assert_eq!(SharedWords::<2>::at_version(5).get(), None);
}
