//! The names of recordings, which surfaces take from outside.

/// True if that is the name of a recording of ours: a time, and what it is of.
pub(crate) fn is_recording(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    let stem = name.strip_suffix(".mcap").filter(|stem| stem.len() < 200 && stem.chars().all(plain));
    let is_time = |(at, byte): (usize, u8)| match at {
        4 | 7 | 13 | 16 | 19 => byte == b'-',
        10 => byte == b'T',
        _ => byte.is_ascii_digit(),
    };
    stem.is_some_and(|stem| stem.len() > 20 && stem.bytes().take(20).enumerate().all(is_time))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_from_outside_leads_to_no_other_file() {
        assert!(is_recording("2026-01-01T10-00-00-show-one.mcap"));
        for bad in [
            "x.mcap",
            "../2026-01-01T10-00-00-show-one.mcap",
            "2026-01-01T10-00-00-../../x.mcap",
            "2026-01-01T10-00-00-a.part.mcap",
            "2026-01-01T10-00-00-show-one.mcap\0",
            "2026-01-01T10-00-00-.mcap",
            "",
        ] {
            assert!(!is_recording(bad), "{bad}");
        }
    }
}
