//! Rows of seats as a person lists them: `A`, `A,C`, `A-C`, `1-12`.

/// The rows that a text lists, each once, in its order.
pub(super) fn parse_rows(text: &str) -> Result<Vec<String>, String> {
    let mut rows: Vec<String> = Vec::new();
    for part in text.split(',').map(str::trim) {
        if part.is_empty() {
            return Err("a row has no name; write A, or A,C, or A-C".to_owned());
        }
        for row in range(part)? {
            if !rows.contains(&row) {
                rows.push(row);
            }
        }
    }
    Ok(rows)
}

/// From letter to letter or from number to number; anything else is a name as it is.
fn range(part: &str) -> Result<Vec<String>, String> {
    let Some((from, to)) = part.split_once('-') else { return Ok(vec![part.to_owned()]) };
    let backward = || format!("{part} runs backward; write the lower row first");
    if let (Some(from), Some(to)) = (letter(from), letter(to))
        && from.is_ascii_uppercase() == to.is_ascii_uppercase()
    {
        let rows: Vec<String> = (from..=to).map(String::from).collect();
        return if rows.is_empty() { Err(backward()) } else { Ok(rows) };
    }
    if let (Ok(from), Ok(to)) = (from.parse::<u16>(), to.parse::<u16>()) {
        return match to.checked_sub(from) {
            None => Err(backward()),
            Some(count) if count >= 1_000 => Err(format!("{part} is more than 1000 rows")),
            Some(_) => Ok((from..=to).map(|row| row.to_string()).collect()),
        };
    }
    Ok(vec![part.to_owned()])
}

fn letter(text: &str) -> Option<char> {
    let mut chars = text.chars();
    chars.next().filter(|c| c.is_ascii_alphabetic() && chars.next().is_none())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_listed_or_spanned() {
        for (text, rows) in [
            ("A", vec!["A"]),
            ("A-C", vec!["A", "B", "C"]),
            ("A,C", vec!["A", "C"]),
            ("A-B, B-C", vec!["A", "B", "C"]),
            ("9-11", vec!["9", "10", "11"]),
            ("C-C", vec!["C"]),
            ("balcony-left", vec!["balcony-left"]),
            ("A-c", vec!["A-c"]),
        ] {
            assert_eq!(parse_rows(text).unwrap(), rows, "{text}");
        }
    }

    #[test]
    fn what_spans_nothing_or_too_much_is_refused() {
        for text in ["", "A,", "C-A", "9-1", "0-60000"] {
            assert!(parse_rows(text).is_err(), "{text}");
        }
    }
}
