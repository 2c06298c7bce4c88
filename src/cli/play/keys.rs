//! From what a terminal sends for a key to what the key asks for.

/// What a key asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum KeyAction {
    /// Pause, or go on after a pause.
    PauseOrResume,
    /// Go on so many seconds of the film later, or earlier.
    Jump(i64),
    /// Stop.
    Stop,
    /// Leave a stop or a fault.
    Clear,
    /// Park, and end.
    Park,
    /// More of motion and vibration by so many percent of the whole, or less.
    Level(i32),
    /// Motion later by so many milliseconds, or earlier.
    Trim(i32),
    /// The same by frames of the film.
    Nudge(i32),
    /// Begin without those that do not answer.
    Agree,
    /// Park as far as the hall may move, and leave.
    Leave,
    /// Say what the keys do.
    Help,
}

/// All keys in one line.
pub(super) const IN_SHORT: &str =
    "space pause  ←→ 5s  s stop  c clear  p park  +- level  ,.<> trim  q end  ? help";

/// What the keys do.
pub(super) const HELP: &str = "\
space    pause, or resume
←  →     5 s back or forward in the film
s        stop: the seats slow down and rest; a soft stop, the emergency stop is hard-wired
c        clear a stop or a fault
p        park the seats, and end
+ -      motion and vibration of all seats 5 % up or down, never above the level at the start
, .      motion 10 ms earlier or later than the film
< >      the same by a frame of the film
y        begin without the controllers that do not answer, where that is asked
q        park the seats that may move, and end; Ctrl-C does the same, and a second one at
         least half a second later ends at once";

/// Where in the bytes of one key we are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Within {
    /// In none.
    #[default]
    None,
    /// After an escape.
    Escape,
    /// In a control sequence, which ends with a letter or ~.
    Sequence,
}

/// Puts bytes together to keys.
#[derive(Debug, Default)]
pub(super) struct KeyDecoder(Within);

impl KeyDecoder {
    /// Takes the next byte; the action, if it ends a key that has one.
    pub(super) const fn take(&mut self, byte: u8) -> Option<KeyAction> {
        match (self.0, byte) {
            (_, 0x1b) => self.0 = Within::Escape,
            (Within::Escape, b'[' | b'O') => self.0 = Within::Sequence,
            (Within::Sequence, b'@'..=b'~') => {
                self.0 = Within::None;
                return match byte {
                    b'C' => Some(KeyAction::Jump(5)),
                    b'D' => Some(KeyAction::Jump(-5)),
                    _ => None,
                };
            }
            (Within::Sequence, _) => {}
            // A key after Esc is that key: an Esc typed by mistake must not swallow a stop.
            (Within::Escape | Within::None, _) => {
                self.0 = Within::None;
                return of_letter(byte);
            }
        }
        None
    }

    /// Nothing came for a while: what has begun is no key.
    pub(super) const fn forget(&mut self) {
        self.0 = Within::None;
    }
}

const fn of_letter(byte: u8) -> Option<KeyAction> {
    Some(match byte.to_ascii_lowercase() {
        b' ' => KeyAction::PauseOrResume,
        b's' => KeyAction::Stop,
        b'c' => KeyAction::Clear,
        b'p' => KeyAction::Park,
        b'+' | b'=' => KeyAction::Level(5),
        b'-' | b'_' => KeyAction::Level(-5),
        b'.' => KeyAction::Trim(10),
        b',' => KeyAction::Trim(-10),
        b'>' => KeyAction::Nudge(1),
        b'<' => KeyAction::Nudge(-1),
        b'y' => KeyAction::Agree,
        b'q' => KeyAction::Leave,
        b'?' | b'h' => KeyAction::Help,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(bytes: &[u8]) -> Vec<KeyAction> {
        let mut decoder = KeyDecoder::default();
        bytes.iter().filter_map(|byte| decoder.take(*byte)).collect()
    }

    #[test]
    fn every_key_of_the_help_does_what_it_says() {
        let all = [
            (" ", KeyAction::PauseOrResume),
            ("s", KeyAction::Stop),
            ("c", KeyAction::Clear),
            ("p", KeyAction::Park),
            ("+", KeyAction::Level(5)),
            ("-", KeyAction::Level(-5)),
            (",", KeyAction::Trim(-10)),
            (".", KeyAction::Trim(10)),
            ("<", KeyAction::Nudge(-1)),
            (">", KeyAction::Nudge(1)),
            ("y", KeyAction::Agree),
            ("q", KeyAction::Leave),
            ("?", KeyAction::Help),
            ("h", KeyAction::Help),
        ];
        for (key, action) in all {
            assert_eq!(typed(key.as_bytes()), [action], "{key}");
        }
    }

    #[test]
    fn a_stop_is_a_stop_also_with_caps_lock_on_or_after_an_escape() {
        for bytes in ["S", "\u{1b}s", "\u{1b}\u{1b}s"] {
            assert_eq!(typed(bytes.as_bytes()), [KeyAction::Stop], "{bytes:?}");
        }
    }

    #[test]
    fn arrows_seek_in_both_modes_that_terminals_have() {
        let both = [KeyAction::Jump(-5), KeyAction::Jump(5)];
        assert_eq!(typed(b"\x1b[D\x1b[C"), both);
        assert_eq!(typed(b"\x1bOD\x1bOC"), both);
    }

    #[test]
    fn other_keys_do_nothing_not_even_by_the_letters_they_are_sent_as() {
        // Delete, page up, F5, the arrows up and down, u umlaut, tab, backspace.
        for bytes in ["\u{1b}[3~", "\u{1b}[5~", "\u{1b}[15~", "\u{1b}OA\u{1b}[B", "ü", "\t", "\u{7f}"] {
            assert_eq!(typed(bytes.as_bytes()), [], "{bytes:?}");
        }
    }

    #[test]
    fn a_sequence_that_does_not_go_on_swallows_no_later_key() {
        let mut decoder = KeyDecoder::default();
        assert_eq!((decoder.take(0x1b), decoder.take(b'[')), (None, None));
        decoder.forget();
        assert_eq!(decoder.take(b's'), Some(KeyAction::Stop));
    }

    #[test]
    fn the_keys_fit_a_line_and_the_help_says_that_the_emergency_stop_is_hard_wired() {
        assert!(IN_SHORT.chars().count() < 80, "{IN_SHORT}");
        assert!(HELP.contains("the emergency stop is hard-wired"));
    }
}
