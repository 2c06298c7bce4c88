//! Names of cues and playlists: never paths.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// The most characters of an id.
const MAX_LEN: usize = 64;

/// The name of a cue or a playlist: 1 to 64 of a to z, 0 to 9, `_` and `-`, so that it can name one file of one folder alone.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(String);

/// The name of a cue of the library.
pub(crate) type CueId = Id;

/// A text that is no id.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is not an id; an id has 1 to {MAX_LEN} characters of a to z, 0 to 9, _ and -{hint}",
    hint = of_file(.0).map_or_else(String::new, |id| format!("; did you mean {id}?"))
)]
pub struct IdError(String);

/// The id that the file of that name has in the library.
fn of_file(name: &str) -> Option<Id> {
    Path::new(name).file_stem()?.to_str()?.to_ascii_lowercase().parse().ok()
}

impl Id {
    /// Its text.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for Id {
    type Err = IdError;

    fn from_str(text: &str) -> Result<Self, IdError> {
        let letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
        let fits = (1..=MAX_LEN).contains(&text.len()) && text.chars().all(letter);
        if fits { Ok(Self(text.to_owned())) } else { Err(IdError(text.chars().take(MAX_LEN + 1).collect())) }
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_a_plain_word() {
        for good in ["a", "bench-ride", "film_2", "7", "-_", &"x".repeat(64)] {
            assert_eq!(good.parse::<Id>().unwrap().to_string(), good);
        }
    }

    #[test]
    fn a_path_or_anything_else_is_no_id() {
        let long = "x".repeat(65);
        for bad in ["", ".", "..", "../x", "a/b", "A", "a.csv", "a b", "a\0", "ä", "a\n", &long] {
            assert!(bad.parse::<Id>().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn the_name_of_a_file_is_answered_with_its_id() {
        let told = |text: &str| text.parse::<Id>().unwrap_err().to_string();
        for name in ["ride.csv", "cues/ride.csv", "RIDE.csv", "./Ride"] {
            assert!(told(name).ends_with("; did you mean ride?"), "{}", told(name));
        }
        assert!(!told("my ride.csv").contains("did you mean"));
    }

    #[test]
    fn what_is_refused_is_told_shortened_and_escaped() {
        let error = format!("\u{1b}{}", "y".repeat(1000)).parse::<Id>().unwrap_err().to_string();
        assert!(error.len() < 250 && !error.contains('\u{1b}'), "{error}");
    }
}
