//! Runs of lines that stand in two places.

use std::collections::{BTreeSet, HashMap};

use crate::source::File;

/// How many lines make a run.
const RUN: usize = 6;
/// How many letters a run has at least whose names do not count.
const LETTERS: usize = 90;

/// Pairs of places where a run is the same to the letter.
pub(crate) fn to_the_letter(files: &[File]) -> (f64, String) {
    pairs(files, 0, |line| line.to_owned())
}

/// Pairs of places where a run is the same but for names, numbers and texts.
pub(crate) fn but_for_names(files: &[File]) -> (f64, String) {
    pairs(files, LETTERS, nameless)
}

fn pairs(files: &[File], letters: usize, reduce: impl Fn(&str) -> String) -> (f64, String) {
    let texts: Vec<Vec<String>> =
        files.iter().map(|file| telling(file).iter().map(|line| reduce(line)).collect()).collect();
    let mut places: HashMap<&[String], Vec<(usize, usize)>> = HashMap::new();
    for (file, lines) in texts.iter().enumerate() {
        for (at, run) in lines.windows(RUN).enumerate() {
            if run.iter().map(String::len).sum::<usize>() >= letters {
                places.entry(run).or_default().push((file, at));
            }
        }
    }
    let mut same = BTreeSet::new();
    for of_run in places.values() {
        for (index, one) in of_run.iter().enumerate() {
            same.extend(of_run[index + 1..].iter().map(|other| (*one, *other)));
        }
    }
    // Of a run that is longer the first lines count; one that overlaps itself is a list.
    let apart =
        |one: &(usize, usize), other: &(usize, usize)| one.0 != other.0 || one.1.abs_diff(other.1) >= RUN;
    let first = |one: &(usize, usize), other: &(usize, usize)| {
        one.1 == 0 || other.1 == 0 || !same.contains(&((one.0, one.1 - 1), (other.0, other.1 - 1)))
    };
    let begun: Vec<_> = same.iter().filter(|(one, other)| first(one, other) && apart(one, other)).collect();
    let between: BTreeSet<String> =
        begun.iter().map(|(one, other)| format!("{} {}", files[one.0].path, files[other.0].path)).collect();
    let few: Vec<String> = between.into_iter().take(if letters == 0 { usize::MAX } else { 0 }).collect();
    (f64::from(u32::try_from(begun.len()).expect("there are fewer lines")), few.join("; "))
}

/// The lines of a file that tell something: no imports, no attributes, no comments behind them, nor who may see them.
fn telling(file: &File) -> Vec<&str> {
    let mut importing = false;
    let mut lines = Vec::new();
    for line in file.code().map(str::trim) {
        let unveiled =
            line.split_once(") ").filter(|_| line.starts_with("pub(")).map_or(line, |(_, rest)| rest);
        let unveiled = unveiled.trim_start_matches("pub ");
        if importing || unveiled.starts_with("use ") || unveiled.starts_with("mod ") {
            importing = !line.ends_with(';') && !line.ends_with('{');
            importing |= line.ends_with('{') && unveiled.starts_with("use ");
        } else if !line.starts_with("#[") {
            lines.push(unveiled.split(" // ").next().unwrap_or(unveiled));
        }
    }
    lines
}

/// A line with one letter for each name, number and text; keywords stand.
fn nameless(line: &str) -> String {
    const KEPT: &[&str] = &[
        "else", "fn", "for", "if", "impl", "let", "match", "mut", "pub", "return", "self", "Self", "struct",
        "while",
    ];
    let mut reduced = String::new();
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let taken = match letter {
            '"' => rest[1..].find('"').map_or(rest.len(), |end| end + 2),
            _ if word > 0 => word,
            _ => letter.len_utf8(),
        };
        let (part, behind) = rest.split_at(taken);
        reduced.push_str(if letter != '"' && (word == 0 || KEPT.contains(&part)) { part } else { "x" });
        rest = behind;
    }
    reduced
}
