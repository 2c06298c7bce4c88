//! Files that are no cues, by how they begin.

use std::path::Path;

use super::{CueFaults, Problem};
use crate::kind;

/// Octets that are none of a text where one of them controls something.
const TEXT: usize = 8;

/// Refuses a file that begins so, or has such a name, and is something else than text; what it is follows in words.
pub(super) fn refuse_other_kind(path: &Path, front: &[u8]) -> Result<(), CueFaults> {
    let named =
        ends_in(path, "toml").then_some("TOML: --config takes a configuration, kinocue playlist a playlist");
    let kind = named.or_else(|| other_kind(front));
    kind.map_or(Ok(()), |kind| Err(CueFaults::one(path, Problem::OtherKind(kind))))
}

/// True if the name of a file ends so, in whichever letters.
pub(super) fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending))
}

/// What a file is that begins so and is no cue, with what to do; `None` where it may be one.
fn other_kind(front: &[u8]) -> Option<&'static str> {
    let is_text = |byte: &u8| !byte.is_ascii_control() || byte.is_ascii_whitespace();
    let unknown = || !front.iter().take(TEXT).all(is_text);
    kind::of(front).or_else(|| unknown().then_some("no text, as a film or a picture is not"))
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
        assert!(told("film.mkv", b"\x1a\x45\xdf\xa3\x01").contains("is a Matroska or WebM file; a cue is"));
        assert!(told("x.csv", b"\x01\x02\x03").contains("no text"));
        assert!(told("ride.bag", b"#ROSBAG V2.0\n\x45\0\0\0").contains("is a bag of ROS 1; a cue is"));
        assert!(told("ride.db3", b"SQLite format 3\0\x10").contains("(.db3)"));
        assert!(told("reel.wav", b"RF64\xff\xff\xff\xffWAVEds64").contains("RF64"));
        assert!(
            told("x.csv", b"# title: \x1b]0;x\x07\ntime_ms,a1\n0,2\n").contains("3:3: a1: 2 is outside"),
            "it has always been text"
        );
        assert!(told("hall.toml", b"[show]\n").contains("--config takes a configuration"));
        assert!(told("x.csv", b"\xef\xbb\xbftime_ms,a1\n0,2\n").contains("2:3: a1: 2 is outside"));
    }
}
