//! Files that are no cues, by how they begin.

/// What a file is that begins so and is no text, with what to do; `None` where it may be text.
pub(super) fn other_kind(front: &[u8]) -> Option<&'static str> {
    let is_text = |byte: &u8| !byte.is_ascii_control() || byte.is_ascii_whitespace();
    match front {
        [b'P', b'K', 3, 4, ..] => Some("a spreadsheet or an archive: save it as CSV"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("text in UTF-16: save it as UTF-8"),
        _ => (!front.iter().all(is_text)).then_some("no text, as a film or a picture is not"),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::cue::{Source, read};

    #[test]
    fn a_file_of_another_kind_is_called_that_and_no_fault_of_it_is_told() {
        let told = |name: &str, octets: &[u8]| {
            read(Path::new(name), octets, &Source::Native).unwrap_err().to_string()
        };
        assert_eq!(
            told("x.csv", b"PK\x03\x04rest\n"),
            "x.csv: is a spreadsheet or an archive: save it as CSV; a cue is a CSV or MCAP file"
        );
        assert!(told("x.csv", b"\xff\xfet\0i\0").contains("UTF-16: save it as UTF-8"));
        assert!(told("film.mkv", b"\x1a\x45\xdf\xa3\x01").contains("no text"));
        assert!(told("hall.toml", b"[show]\n").contains("--config takes it"));
        assert!(told("x.csv", b"\xef\xbb\xbftime_ms,a1\n0,2\n").contains("2:3: a1: 2 is outside"));
    }
}
