//! The lines before the header of a CSV: what they declare, what they nearly declare, and what a spreadsheet puts around them.

use std::borrow::Cow;
use std::str::FromStr;

use super::fault::{Collector, Place};
use super::problem::Problem;
use super::table::Splitter;
use super::unit::{DeclaredUnit, DeclaredUnits};
use super::{Interpolation, title_of, value};

/// What a comment line before the header can declare.
pub(super) const DECLARED: [&str; 4] = ["kinocue-csv", "title", "units", "interpolation"];
/// Other words that mean one of them, as a letter alone does not show.
const OTHER_WORDS: [(&str, &str); 4] = [
    ("unit", "units"),
    ("interp", "interpolation"),
    ("interpolate", "interpolation"),
    ("interpolated", "interpolation"),
];
/// What people write between a key and its value, on keyboards of any language.
const ASSIGNS: [char; 4] = [':', '=', '：', '＝'];
/// A sentence of more words before its value is one about units, not one that declares them.
const MOST_WORDS: usize = 4;

/// A line before the rows of a CSV.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum HeadLine<'a> {
    /// A comment: the text behind its `#`.
    Comment(Cow<'a, str>),
    /// `sep=;`, by which some spreadsheets are told what separates the columns.
    Separator(char),
    /// Anything else.
    Header,
}

impl<'a> HeadLine<'a> {
    pub(super) fn of(line: &'a str) -> Self {
        if let Some(comment) = comment(line) {
            return Self::Comment(comment);
        }
        let told = line.trim().trim_matches('"').to_ascii_lowercase();
        let mut separator = told.strip_prefix("sep=").unwrap_or_default().chars();
        match (separator.next(), separator.next()) {
            (Some(separator), None) => Self::Separator(separator),
            // That of a tab is trimmed away.
            (None, None) if told == "sep=" => Self::Separator('\t'),
            _ => Self::Header,
        }
    }
}

/// The text of a comment line behind its `#`; a spreadsheet may have put it in quotes, and cells behind it.
pub(super) fn comment(line: &str) -> Option<Cow<'_, str>> {
    let line = line.trim_ascii_start();
    if let Some(comment) = line.strip_prefix('#') {
        return Some(Cow::Borrowed(comment));
    }
    if !line.strip_prefix('"')?.trim_ascii_start().starts_with('#') {
        return None;
    }
    let mut splitter = Splitter::new();
    let cells: Vec<&str> = splitter.split(line).ok()?.iter().collect();
    let filled = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    Some(Cow::Owned(cells[..filled].join(", ").strip_prefix('#')?.to_owned()))
}

/// What the comment lines before the header say.
#[derive(Debug, Default)]
pub(super) struct Declared {
    seen: Vec<&'static str>,
    pub(super) title: Option<String>,
    /// Commas in the line of the title.
    title_commas: usize,
    pub(super) units: DeclaredUnits,
    /// Where they stand, if anywhere.
    units_at: Option<Place>,
    pub(super) interpolation: Interpolation,
    near: Vec<(Place, Near)>,
}

impl Declared {
    /// Takes a comment line, of which `comment` is what is behind its `#`.
    pub(super) fn take(&mut self, number: u64, line: &str, comment: &str, faults: &mut Collector) {
        let Some((key, text)) = declaration(comment) else {
            let place = Place::Text { line: number, column: 1 };
            return self.near.extend(nearly(comment).map(|near| (place, near)));
        };
        let taken = match key {
            "kinocue-csv" if text == "1" => Ok(()),
            "kinocue-csv" => Err("this program reads version 1".to_owned()),
            "title" => {
                self.title = Some(title_of(text)).filter(|title| !title.is_empty());
                self.title_commas = line.matches(',').count();
                Ok(())
            }
            "units" => parsed(text).map(|units| self.units = units),
            _ => parsed(text).map(|interpolation| self.interpolation = interpolation),
        };
        // The value is the end of the line.
        let at = line.trim_end().rfind(text).unwrap_or(0);
        let place = Place::Text { line: number, column: line[..at].chars().count() as u64 + 1 };
        if key == "units" {
            self.units_at = Some(place.clone());
        }
        if self.seen.contains(&key) {
            faults.add(place, Some(key), Problem::DeclaredTwice);
        } else if let Err(allowed) = taken {
            faults.add(place, Some(key), Problem::Declaration { value: value::shortened(text), allowed });
        }
        self.seen.push(key);
    }

    /// Holds what is declared against a header with so many cells, for so many axes.
    pub(super) fn close(&mut self, cells: usize, axes: usize, faults: &mut Collector) {
        // A spreadsheet fills the row of a comment with as many cells as the widest row has.
        if self.title_commas + 1 == cells
            && let Some(title) = &mut self.title
        {
            title.truncate(title.trim_end_matches([',', ' ']).len());
        }
        if let Some((place, problem)) = self.units_at.clone().zip(self.units.misfit(axes)) {
            faults.add(place, Some("units"), problem);
        }
    }

    /// Notes the comments that are nearly declarations. One in other words than a key and its value is none where that key is declared.
    pub(super) fn refuse_near(&self, faults: &mut Collector) {
        let refused = self.near.iter().filter(|(_, near)| near.is_assigned || !self.seen.contains(&near.key));
        refused.for_each(|(place, near)| faults.add(place.clone(), None, near.problem.clone()));
    }
}

/// The key that a comment declares, and the text for it.
fn declaration(comment: &str) -> Option<(&'static str, &str)> {
    let (key, text) = comment.split_once(':')?;
    let key = DECLARED.into_iter().find(|known| key.trim().eq_ignore_ascii_case(known))?;
    // What a spreadsheet adds for the other cells of the row; commas at the end of a title may be its own.
    let text =
        if key == "title" { text.trim() } else { text.trim_matches(|c: char| c == ',' || c.is_whitespace()) };
    Some((key, text))
}

/// True if a comment declares nothing, and so is one for people.
pub(super) fn is_remark(comment: &str) -> bool {
    declaration(comment).is_none()
}

fn parsed<T: FromStr<Err: ToString>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: T::Err| error.to_string())
}

/// A comment that is nearly a declaration.
#[derive(Debug, PartialEq)]
struct Near {
    key: &'static str,
    problem: Problem,
    /// True if it gives a value to a key, rather than being a sentence.
    is_assigned: bool,
}

fn nearly(comment: &str) -> Option<Near> {
    let text = comment.trim_start_matches(|c: char| !c.is_alphanumeric());
    let (found, is_assigned) = match assigned(text) {
        Some(found) => (Some(found), true),
        None => (worded(text), false),
    };
    let (key, value) = found?;
    let refused = match key {
        "units" => parsed::<DeclaredUnits>(&value).err(),
        "interpolation" => parsed::<Interpolation>(&value).err(),
        _ => None,
    };
    let write = match refused {
        None => format!("{:?}", format!("# {key}: {value}")),
        Some(allowed) => format!("\"# {key}: \" and which; {allowed}"),
    };
    let comment = value::shortened(&format!("#{}", comment.trim_end_matches([',', ' '])));
    Some(Near { key, problem: Problem::NearlyDeclared { comment, write }, is_assigned })
}

/// `unit: mm`, `units = mm`: a key that is nearly one of ours, and what it is given.
fn assigned(text: &str) -> Option<(&'static str, String)> {
    let (word, value) = text.split_once(ASSIGNS)?;
    let is_around = |c: char| c.is_whitespace() || ASSIGNS.contains(&c) || ",;\"'".contains(c);
    let value = value.trim_matches(is_around);
    let key = DECLARED.into_iter().find(|known| is_alike(word, known))?;
    // A slip is told from another word, as in "unity: 2022.3 LTS", by what it is given.
    let is_name =
        |part: &str| part.starts_with(char::is_alphabetic) && part.chars().all(char::is_alphanumeric);
    let is_meant = key == "title" || means(word, key) || value.split(',').all(|part| is_name(part.trim()));
    is_meant.then(|| (key, value.to_owned()))
}

/// `units mm`, `unit of positions: mm`: a few words of which one is nearly a key, and the last ones values that it can have.
fn worded(text: &str) -> Option<(&'static str, String)> {
    let is_between = |c: char| c.is_whitespace() || ASSIGNS.contains(&c) || ",;|\"'()[]-_".contains(c);
    let text = text.to_lowercase();
    let words: Vec<&str> = text.split(is_between).filter(|word| !word.is_empty()).collect();
    ["units", "interpolation"].into_iter().find_map(|key| {
        let is_value = |word: &str| match key {
            "units" => word.parse::<DeclaredUnit>().is_ok(),
            _ => word.parse::<Interpolation>().is_ok(),
        };
        let values = words.iter().rev().take_while(|word| **word == "and" || is_value(word)).count();
        let (said, values) = words.split_at(words.len() - values);
        let names_it = said.len() <= MOST_WORDS && said.iter().any(|word| is_alike(word, key));
        let values: Vec<&str> = values.iter().copied().filter(|word| *word != "and").collect();
        (names_it && !values.is_empty()).then(|| (key, values.join(", ")))
    })
}

/// True if a word is a key but for its spelling, or another word for it.
fn means(word: &str, key: &str) -> bool {
    let word = letters(word);
    word == letters(key) || OTHER_WORDS.contains(&(word.as_str(), key))
}

/// True if a word means a key, or is a slip for it.
pub(super) fn is_alike(word: &str, key: &str) -> bool {
    let slips = if key.len() > 8 { 2 } else { 1 };
    means(word, key) || strsim::osa_distance(&letters(word), &letters(key)) <= slips
}

fn letters(word: &str) -> String {
    word.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(comment: &str) -> Option<String> {
        nearly(comment).map(|near| match near.problem {
            Problem::NearlyDeclared { write, .. } => write,
            other => panic!("{other:?}"),
        })
    }

    #[test]
    fn a_comment_that_is_nearly_a_declaration_is_told_as_the_declaration_that_it_would_be() {
        let units = Some("\"# units: mm\"".to_owned());
        for comment in [
            " unit: mm",
            " units = mm",
            "Units=mm",
            "# units: mm",
            "! units : mm",
            " umits: mm",
            " \"units\": mm",
            " units mm",
            " Units are in mm",
            " unit of positions: mm",
            " units:= mm",
            " units：mm",
            " uints: mm,,,",
            " units,mm,,,",
            " position-units: mm",
            " unit [mm]",
        ] {
            assert_eq!(write(comment), units, "{comment}");
        }
        for comment in [
            " interpolation = monotone",
            " Interpolate: monotone",
            " interpolation monotone",
            " interpolaton: monotone",
            " interp. = monotone",
            " the interpolation is monotone",
            " interpolation mode: monotone",
        ] {
            assert_eq!(write(comment).as_deref(), Some("\"# interpolation: monotone\""), "{comment}");
        }
        assert_eq!(write(" titel: A nod").as_deref(), Some("\"# title: A nod\""));
        assert_eq!(write(" Title = A nod").as_deref(), Some("\"# title: A nod\""));
        assert_eq!(write(" kinocue csv = 1").as_deref(), Some("\"# kinocue-csv: 1\""));
        assert_eq!(write(" units are mm, mm and deg").as_deref(), Some("\"# units: mm, mm, deg\""));
        let listed = write(" unit: mm from the zero").expect("it is a unit that is meant");
        assert!(listed.starts_with("\"# units: \" and which; units are fraction"), "{listed}");
    }

    #[test]
    fn a_comment_about_something_else_is_one() {
        for comment in [
            "",
            " ",
            " made by hand",
            " Unity: exported from Unity 2022.3",
            " unity: 2022.3",
            " author: Anna",
            " seat unit 4, row C",
            " time unit: ms",
            " a unit test of the spline",
            " v2: units were wrong in v1",
            " https://example.org/units",
            " up 30 mm, then down",
            " the longest interval between two points is linear",
            " one could hold here",
            " version: 3",
            " kinocue: with kinocue edit",
            "----",
            " = = =",
        ] {
            assert_eq!(nearly(comment), None, "{comment}");
        }
    }

    #[test]
    fn a_spreadsheets_comment_is_read_as_the_comment_that_was_saved() {
        let of = |line| HeadLine::of(line);
        let comment = |text: &'static str| HeadLine::Comment(Cow::Borrowed(text));
        assert_eq!(of("\"# units: mm\""), comment(" units: mm"));
        assert_eq!(of(" \"# units: mm\",,,"), comment(" units: mm"));
        assert_eq!(of("\"# units: mm\",\" deg\",,"), comment(" units: mm, deg"));
        assert_eq!(of("\"# title: the \"\"big\"\" one, again\""), comment(" title: the \"big\" one, again"));
        assert_eq!(of("\"# open"), HeadLine::Header);
        assert_eq!(of("sep=;"), HeadLine::Separator(';'));
        assert_eq!((of("\"SEP=,\""), of("sep=\t")), (HeadLine::Separator(','), HeadLine::Separator('\t')));
        assert_eq!((of("sep=;;"), of("time_ms,a1")), (HeadLine::Header, HeadLine::Header));
    }
}
