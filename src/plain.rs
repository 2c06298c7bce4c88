//! Text from anywhere as what it is: whatever a file, a network or a person gives can be shown, and does nothing to the
//! terminal, the log or the line that shows it.

use std::borrow::Cow;
use std::path::Path;

/// The longest name of a file that is shown whole, bytes: no path may be longer.
const PATH_LEN: usize = 4_096;

/// Displays an enum by a word or a phrase for each of its variants.
macro_rules! displayed {
    ($name:ty { $($variant:pat => $words:expr),+ $(,)? }) => {
        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(match self { $($variant => $words),+ })
            }
        }
    };
}
pub(crate) use displayed;

/// The text with its control characters, and those that change the direction of writing, escaped as Rust writes them, and
/// cut after `limit` bytes: whatever a file, a network or a person gives makes one line, and looks like what it is.
#[must_use]
pub(crate) fn escaped(text: &str, limit: usize) -> Cow<'_, str> {
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

/// A name of a few letters, such as a column or a key has, with all that nobody sees in it escaped: spaces of other kinds and characters
/// without a width too, which in prose belong to some languages.
#[must_use]
pub(crate) fn seen(name: &str) -> Cow<'_, str> {
    // Of one that a reader sees the escape is itself, or it behind a backslash.
    let is_unseen = |c: char| c.escape_debug().len() > 2 || misleads(c);
    if !name.contains(is_unseen) {
        return Cow::Borrowed(name);
    }
    let shown = |c: char| if is_unseen(c) { c.escape_default().to_string() } else { c.to_string() };
    Cow::Owned(name.chars().map(shown).collect())
}

/// The name of a file as one line.
#[must_use]
pub(crate) fn path(path: &Path) -> String {
    escaped(&path.to_string_lossy(), PATH_LEN).into_owned()
}

/// The name of a file as one word for a shell; a placeholder where a line cannot show it.
#[must_use]
pub(crate) fn shell(path: &Path) -> String {
    let name = path.to_string_lossy();
    if name.is_empty() || name.contains(misleads) || name.contains('\u{fffd}') {
        return "FILE".to_owned();
    }
    let name = if name.starts_with('-') { format!("./{name}").into() } else { name };
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=,@%:".contains(c);
    if name.chars().all(is_plain) { name.into_owned() } else { format!("'{}'", name.replace('\'', "'\\''")) }
}

/// The text with the same characters escaped, but for line breaks and tabs: for lines of our own that hold what came from
/// elsewhere.
#[must_use]
pub(crate) fn lines(text: &str) -> Cow<'_, str> {
    with(text, |c, out| out.extend(c.escape_default()))
}

/// JSON with the same characters in its strings escaped, as JSON does; it says the same to whoever reads it.
#[must_use]
pub(crate) fn json(text: &str) -> Cow<'_, str> {
    // None of them lies beyond the first plane, where JSON would want two escapes.
    with(text, |c, out| out.push_str(&format!("\\u{:04x}", u32::from(c))))
}

fn with(text: &str, put: impl Fn(char, &mut String)) -> Cow<'_, str> {
    let is_shown = |c: char| matches!(c, '\n' | '\t') || !misleads(c);
    if text.chars().all(is_shown) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    text.chars().for_each(|c| if is_shown(c) { out.push(c) } else { put(c, &mut out) });
    Cow::Owned(out)
}

/// True if a character makes text look like something else: it ends the line, moves the cursor, or turns what follows around
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
    fn what_nobody_sees_in_a_name_is_escaped_and_what_is_seen_is_not() {
        for name in ["a1", "fx_air", "Höhe (mm)", "\"座席\"", "it's a\\b"] {
            assert!(matches!(seen(name), Cow::Borrowed(same) if same == name), "{name}");
        }
        assert_eq!(seen("\u{a0}a1"), "\\u{a0}a1");
        assert_eq!(seen("a\u{200b}1\u{feff}\u{3000}"), "a\\u{200b}1\\u{feff}\\u{3000}");
        assert_eq!(seen("a\t1"), "a\\t1");
    }

    #[test]
    fn the_name_of_a_file_is_one_word_of_a_shell_whatever_is_in_it() {
        for (name, word) in [
            ("cues/storm-2.csv", "cues/storm-2.csv"),
            ("my cue.csv", "'my cue.csv'"),
            ("it's.csv", "'it'\\''s.csv'"),
            ("-rf.csv", "./-rf.csv"),
            ("$(reboot);.csv", "'$(reboot);.csv'"),
            ("Übung.csv", "Übung.csv"),
            ("a\nb.csv", "FILE"),
        ] {
            assert_eq!(shell(Path::new(name)), word, "{name:?}");
        }
    }

    #[test]
    fn lines_of_ours_stay_lines_whatever_they_hold() {
        let ours = "a table\twith cells\nand a line more: ä, 座席\n";
        assert!(matches!(lines(ours), Cow::Borrowed(same) if same == ours));
        assert_eq!(lines("\x1b]0;x\x07\r\u{9b}2J\u{7f}\n"), "\\u{1b}]0;x\\u{7}\\r\\u{9b}2J\\u{7f}\n");
    }

    #[test]
    fn json_says_the_same_when_it_is_escaped() {
        let text = "\u{7f}\u{9b}\u{202e}\u{2028}ä\n\x1b";
        let plain = serde_json::to_string(&text).unwrap();
        let escaped = json(&plain);
        assert!(!escaped.contains(misleads), "{escaped}");
        assert_eq!(serde_json::from_str::<String>(&escaped).unwrap(), text);
    }

    #[test]
    fn the_name_of_a_file_is_one_line() {
        assert_eq!(path(Path::new("a\nkinocue: passed\x07.csv")), "a\\nkinocue: passed\\u{7}.csv");
    }

    #[test]
    fn what_is_too_long_is_cut_between_characters_and_says_so() {
        assert_eq!(escaped("abcdef", 3), "abc…");
        assert_eq!(escaped("ääää", 3), "ä…");
        assert_eq!(escaped("ab\n", 3), "ab…", "an escape is not cut in two");
        assert_eq!(escaped("abc", 3), "abc");
    }
}
