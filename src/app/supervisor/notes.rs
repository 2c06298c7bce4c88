//! What went wrong lately and no state says.

use std::collections::VecDeque;

/// Notes that are kept.
const MOST: usize = 5;

/// Notes for the warnings, newest last.
#[derive(Debug, Default)]
pub(crate) struct NoteBoard(VecDeque<BoardNote>);

#[derive(Debug)]
struct BoardNote {
    text: String,
    /// It is over once the next show has begun: whoever let that go has dealt with it.
    passes: bool,
}

impl NoteBoard {
    /// Adds one.
    pub(super) fn add(&mut self, text: String, passes: bool) {
        self.0.push_back(BoardNote { text, passes });
        if self.0.len() > MOST {
            self.0.pop_front();
        }
    }

    /// A show has begun.
    pub(super) fn begin_show(&mut self) {
        self.0.retain(|note| !note.passes);
    }

    /// Forgets those that begin so.
    pub(super) fn forget(&mut self, beginning: &str) {
        self.0.retain(|note| !note.text.starts_with(beginning));
    }

    /// All of them, oldest first.
    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = &String> {
        self.0.iter().map(|note| &note.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_over_with_the_next_show_goes_then_and_the_rest_stays_as_far_as_there_is_room() {
        let mut notes = NoteBoard::default();
        notes.add("it was called off".to_owned(), true);
        notes.add("[osc] has changed".to_owned(), false);
        notes.begin_show();
        assert_eq!(notes.iter().collect::<Vec<_>>(), ["[osc] has changed"]);
        (0..MOST).for_each(|n| notes.add(n.to_string(), false));
        assert_eq!(notes.iter().map(String::as_str).collect::<String>(), "01234");
        notes.forget("0");
        assert_eq!(notes.iter().count(), 4);
    }
}
