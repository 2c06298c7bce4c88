//! Text from anywhere as one honest line.

use std::borrow::Cow;

/// The text with its control characters, and those that change the direction of writing, escaped as Rust writes them, and
/// cut after `limit` octets: whatever a file, a network or a person gives makes one line, and looks like what it is.
#[must_use]
pub fn escaped(text: &str, limit: usize) -> Cow<'_, str> {
    if text.len() <= limit && !text.contains(misleads) {
        return Cow::Borrowed(text);
    }
    let mut line = String::with_capacity(text.len().min(limit));
    for c in text.chars() {
        let before = line.len();
        if misleads(c) {
            line.extend(c.escape_default());
        } else {
            line.push(c);
        }
        if line.len() > limit {
            line.truncate(before);
            line.push('…');
            break;
        }
    }
    Cow::Owned(line)
}

/// Whether a character makes text look like something else: it ends the line, moves the cursor, or turns what follows around
/// (Unicode Standard Annex 9, explicit directional formatting characters; line and paragraph separators).
fn misleads(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_text_stays_as_it_is() {
        for text in
            ["", "parked: all seats at rest", "Sitz ä, 座席", "tabs are controls? no: a space is none"]
        {
            assert!(matches!(escaped(text, 80), Cow::Borrowed(same) if same == text));
        }
    }

    #[test]
    fn line_breaks_escapes_and_turned_text_are_shown_not_obeyed() {
        assert_eq!(escaped("ok\nMESSAGE=forged", 80), "ok\\nMESSAGE=forged");
        assert_eq!(escaped("\x1b[2Jgone", 80), "\\u{1b}[2Jgone");
        assert_eq!(escaped("a\u{202e}csv.exe", 80), "a\\u{202e}csv.exe");
        assert_eq!(escaped("nul\0tab\tcr\r", 80), "nul\\u{0}tab\\tcr\\r");
    }

    #[test]
    fn what_is_too_long_is_cut_between_characters_and_says_so() {
        assert_eq!(escaped("abcdef", 3), "abc…");
        assert_eq!(escaped("ääää", 3), "ä…");
        assert_eq!(escaped("ab\n", 3), "ab…", "an escape is not cut in two");
        assert_eq!(escaped("abc", 3), "abc");
    }
}
