//! What is wrong where a text is no TOML, in the words of somebody who writes a configuration and not a parser.

/// What the parser says first, and what is said instead.
const WORDS: [(&str, &str); 20] = [
    ("string values must be quoted", "a text has to stand in quotes: write {}"),
    (
        "key with no value",
        "there is no = and no value behind {}: a line is key = value, [table] or # a remark",
    ),
    ("missing value", "there is no value behind the =: write one, such as rate_hz = 100"),
    ("missing assignment", "there is no = between the key and its value: write key = value"),
    ("duplicate key", "{} stands there already, further up: keep one of them"),
    ("unclosed array table", "the brackets are not closed: write [[controller]]"),
    ("unclosed table", "the bracket is not closed: write [show]"),
    ("unclosed array", "the list is not closed: it ends with ]"),
    ("unclosed inline table", "the braces are not closed: write { key = value, key = value }"),
    ("missing comma between array", "there is no comma between two values of the list: write [1, 2]"),
    ("missing comma between key", "there is no comma between two keys: write { a = 1, b = 2 }"),
    ("missing key for inline table", "a key is missing between two commas: write { a = 1, b = 2 }"),
    ("invalid unquoted key", "{} is no key: a key is made of letters, digits, _ and -, or stands in quotes"),
    ("unquoted keys cannot be empty", "the key is missing: write key = value"),
    (
        "unexpected key or value",
        "{} is too much here: each key stands on a line of its own, and # begins a remark",
    ),
    (
        "unexpected content",
        "{} is too much here: each key stands on a line of its own, and # begins a remark",
    ),
    ("unexpected leading zero", "{} begins with a 0: write the number without it"),
    ("invalid integer number", "{} is no number: write digits alone, and a text in quotes"),
    ("invalid float", "{} is no number: write 1.5, and a text in quotes"),
    ("invalid boolean", "{} is neither true nor false: write one of these, in small letters"),
];

/// Quotes that word processors write.
const TYPOGRAPHIC: [char; 6] = ['\u{201c}', '\u{201d}', '\u{201e}', '\u{2018}', '\u{2019}', '\u{ab}'];
/// How much of what is wrong is shown, characters.
const SHOWN: usize = 40;

/// What is said of a fault of which the parser says that, about this part of the line.
pub(super) fn in_words(said: &str, part: &str, line: &str) -> String {
    let part: String = part.trim().chars().take(SHOWN).collect();
    if let Some(quote) = line.chars().find(|one| TYPOGRAPHIC.contains(one)) {
        return format!("{quote} is a quote of a word processor: write plain quotes, \"like this\"");
    }
    if has_decimal_comma(line) {
        return "a number has a point, and no comma: write 1.5".to_owned();
    }
    if said.starts_with("invalid") && said.contains(" string") {
        let twice = if line.contains('\\') { "; write a backslash twice, \\\\" } else { "" };
        return format!(
            "the text is not closed by a quote in its line, or has a sign that no text may have{twice}"
        );
    }
    // The parser takes an empty value for a text, and a blank in a key for its end.
    let said = match said {
        said if said.starts_with("string values") && part.is_empty() => "missing value",
        said if said.starts_with("key with no value") && line.contains('=') => "invalid unquoted key",
        said => said,
    };
    let known = WORDS.iter().find(|(begins, _)| said.starts_with(begins));
    known.map_or_else(
        || format!("this cannot be read ({said}): a line is key = value, [table] or # a remark"),
        |(begins, words)| match *begins {
            "string values must be quoted" => words.replace("{}", &format!("{part:?}")),
            // It ends where something is missing.
            _ if part.is_empty() => words.replace("{}", line.trim()),
            _ => words.replace("{}", &part),
        },
    )
}

/// True if a value looks as people of many countries write a number.
fn has_decimal_comma(line: &str) -> bool {
    let Some((_, value)) = line.split_once('=') else { return false };
    let value = value.split('#').next().unwrap_or_default().trim();
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|octet| octet.is_ascii_digit());
    value
        .split_once(',')
        .is_some_and(|(whole, part)| is_number(whole.trim_start_matches('-')) && is_number(part))
}

#[cfg(test)]
mod tests {
    use crate::config::tests::faults_of;

    #[test]
    fn what_is_no_toml_is_told_with_what_to_write_instead() {
        let wrong = [
            ("dir = /var/log/x", "a text has to stand in quotes: write \"/var/log/x\""),
            ("dir = \"/var/log/x", "the text is not closed by a quote"),
            ("dir = \u{201c}/var\u{201d}", "\u{201c} is a quote of a word processor"),
            ("max_age_days", "there is no = and no value behind max_age_days"),
            ("max_age_days =", "there is no value behind the ="),
            ("max_age_days = 1,5", "a number has a point, and no comma"),
            ("max_age_days = 07", "begins with a 0"),
            ("max_age_days = 3 dir = \"/x\"", "is too much here: each key stands on a line of its own"),
            ("max_age_days = 3\nmax_age_days = 4", "max_age_days stands there already"),
            ("hours = [\"10:00\", \"01:30\"", "the list is not closed"),
            ("hours = [\"10:00\" \"01:30\"]", "there is no comma between two values"),
            ("[show", "the bracket is not closed: write [show]"),
            ("max age = 3", "a key is made of letters"),
        ];
        let told = |(line, says): &(&str, &str)| {
            let faults = faults_of(&format!("[log]\n{line}\n"));
            (!faults.iter().any(|fault| fault.contains(says))).then(|| format!("{line}: {faults:?}"))
        };
        let untold: Vec<String> = wrong.iter().filter_map(told).collect();
        assert!(untold.is_empty(), "{untold:#?}");
    }
}
