//! Names that a person has given, and nothing has.

use anyhow::anyhow;

use super::{Exit, Failure};
use crate::config::there_is_no;

/// Names that are listed, at most.
const LISTED: usize = 12;

/// That there is no `what` of that name: what it may be a slip for, and what there is.
pub(super) fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Failure {
    let mut listed: Vec<_> = known.clone().take(LISTED).collect();
    let more = known.clone().count().saturating_sub(LISTED);
    let rest = format!("{more} more");
    listed.extend((more > 0).then_some(rest.as_str()));
    let there_are = if listed.is_empty() { "none".to_owned() } else { listed.join(", ") };
    let error = anyhow!("{}; there are: {there_are}", there_is_no(what, name, known));
    Failure { exit: Exit::NoInput, error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_is_answered_with_the_one_like_it_and_with_those_there_are() {
        let failure = unknown("controller", "B11", ["A1", "B1"].into_iter());
        assert_eq!(
            (failure.exit, failure.to_string().as_str()),
            (Exit::NoInput, "there is no controller B11; did you mean B1?; there are: A1, B1")
        );
        assert!(unknown("seat", "a1", ["A1", "B1"].into_iter()).to_string().contains("did you mean A1?"));
        let many: Vec<String> = (0..64).map(|seat| format!("S{seat}")).collect();
        let told = unknown("seat", "x", many.iter().map(String::as_str)).to_string();
        assert!(told.ends_with("S10, S11, 52 more"), "{told}");
        assert!(unknown("row", "C", [].into_iter()).to_string().ends_with("there are: none"));
    }
}
