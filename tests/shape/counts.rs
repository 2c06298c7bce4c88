//! What can be counted line by line.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::source::File;

/// A count, and where it was found.
pub(crate) type Found = (f64, String);

fn found(count: usize, place: impl Into<String>) -> Found {
    (f64::from(u32::try_from(count).expect("there are fewer lines")), place.into())
}

/// The greatest of these counts by place.
fn greatest<K: Into<String>>(counts: impl IntoIterator<Item = (K, usize)>) -> Found {
    let (place, count) = counts
        .into_iter()
        .map(|(place, count)| (place.into(), count))
        .max_by_key(|(_, count)| *count)
        .unwrap_or_default();
    found(count, place)
}

/// A line without what it begins with of visibility and qualifiers, and whether it was public without a bound.
fn item(line: &str) -> (&str, bool) {
    let mut rest = line.trim_start();
    let public = rest.starts_with("pub ");
    if let Some(bound) = rest.strip_prefix("pub(") {
        rest = bound.split_once(") ").map_or("", |(_, item)| item);
    }
    for word in ["pub ", "default ", "const ", "async ", "unsafe ", "extern \"C\" "] {
        rest = match rest.strip_prefix(word) {
            Some(item) if word != "const " || item.contains("fn ") => item,
            _ => rest,
        };
    }
    (rest, public)
}

fn is_fn(line: &str) -> bool {
    item(line).0.starts_with("fn ")
}

fn indent(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

fn name_of(text: &str) -> &str {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_').next().unwrap_or_default()
}

/// The type that a block of its own methods begins for; none where it is a trait's.
fn own_impl(line: &str) -> Option<&str> {
    let rest = line.strip_prefix("impl")?;
    let generics = rest.starts_with('<');
    let rest = if generics { rest.split_once("> ")?.1 } else { rest.strip_prefix(' ')? };
    (!line.contains(" for ")).then(|| name_of(rest))
}

pub(crate) fn methods_of_one_type(files: &[File]) -> Found {
    let mut counts = BTreeMap::new();
    for file in files {
        let mut of = None;
        for line in &file.lines {
            of = if line.starts_with("impl") { own_impl(line) } else { of };
            if let Some(name) = of
                && indent(line) == 4
                && is_fn(line)
            {
                *counts.entry(format!("{}::{name}", file.room())).or_default() += 1;
            }
        }
    }
    greatest(counts)
}

/// The items of one kind: their names, and the lines between head and end.
fn blocks<'a>(file: &'a File, kind: &str) -> Vec<(&'a str, &'a [String])> {
    let begins = |line: &'a String| Some((name_of(item(line).0.strip_prefix(kind)?), line));
    let heads = file.lines.iter().enumerate().filter_map(|(at, line)| Some((at, begins(line)?)));
    let body = |(at, (name, head)): (usize, (&'a str, &'a String))| {
        let ends = |line: &String| line.trim_end() == format!("{}}}", &head[..indent(head)]);
        let lines = &file.lines[at + 1..];
        let length = if head.ends_with('{') { lines.iter().position(ends)? } else { 0 };
        Some((name, &lines[..length]))
    };
    heads.filter_map(body).collect()
}

pub(crate) fn bools_of_one_struct(files: &[File]) -> Found {
    let structs = files.iter().flat_map(|file| blocks(file, "struct ").into_iter().map(move |of| (file, of)));
    greatest(structs.map(|(file, (name, lines))| {
        (format!("{}::{name}", file.room()), lines.iter().filter(|line| line.ends_with(": bool,")).count())
    }))
}

/// Enums with five or more of the names that `state` has for what the hall does.
pub(crate) fn encodings_of_state(files: &[File]) -> Found {
    let names = |lines: &[String]| -> Vec<String> {
        let variants = lines.iter().filter(|line| line.trim_start().starts_with(char::is_uppercase));
        variants.map(|line| name_of(line.trim_start()).to_owned()).collect()
    };
    let enums: Vec<(String, Vec<String>)> = files
        .iter()
        .flat_map(|file| blocks(file, "enum ").into_iter().map(move |of| (file, of)))
        .map(|(file, (name, lines))| (format!("{}::{name}", file.room()), names(lines)))
        .collect();
    let (_, state) = enums.iter().find(|(name, _)| name == "state::State").expect("the hall has states");
    let same = |variants: &[String]| variants.iter().filter(|name| state.contains(name)).count();
    let these: Vec<&str> =
        enums.iter().filter(|(_, own)| same(own) >= 5).map(|(name, _)| name.as_str()).collect();
    found(these.len(), these.join(", "))
}

/// Places that put a tick loop together.
pub(crate) fn compositions(files: &[File]) -> Found {
    let builds =
        |line: &str| line.contains("TickLoop {") && !line.contains("struct ") && !line.contains("impl");
    let these: Vec<&str> =
        files.iter().filter(|file| file.code().any(builds)).map(|file| file.path.as_str()).collect();
    found(these.len(), these.join(", "))
}

fn type_names(files: &[File]) -> BTreeMap<&str, usize> {
    let mut counts = BTreeMap::new();
    for line in files.iter().flat_map(File::code) {
        // An associated type bears the trait's name for it.
        let is_associated = indent(line) == 4 && line.trim_start().starts_with("type ");
        let (item, _) = item(line);
        let named = ["struct ", "enum ", "trait ", "type "].iter().find_map(|kind| item.strip_prefix(kind));
        // `Args` is what clap wants.
        if let Some(name) = named.map(name_of).filter(|name| !is_associated && *name != "Args") {
            *counts.entry(name).or_default() += 1;
        }
    }
    counts
}

pub(crate) fn type_names_used_again(files: &[File]) -> Found {
    found(type_names(files).values().filter(|count| **count > 1).count(), "")
}

pub(crate) fn uses_of_one_type_name(files: &[File]) -> Found {
    greatest(type_names(files))
}

/// Functions that say something once to whoever polls: `take_…` and a bool.
pub(crate) fn flags_told_once(files: &[File]) -> Found {
    let polled = |line: &&str| item(line).0.starts_with("fn take_") && line.ends_with("-> bool {");
    found(files.iter().flat_map(File::code).filter(polled).count(), "")
}

/// Sleeps where the hall's life is led.
pub(crate) fn sleeps_of_the_supervisor(files: &[File]) -> Found {
    let led = |file: &&File| file.module.iter().any(|name| name == "keeper" || name == "supervisor");
    let these = files.iter().filter(led).filter(|file| file.room() == "app");
    found(these.flat_map(File::code).filter(|line| line.contains("sleep_until(")).count(), "")
}

pub(crate) fn rooms_that_know_config(files: &[File]) -> Found {
    let knows = |file: &&File| file.room() != "config" && file.code().any(|line| line.contains("config::"));
    let mut rooms: Vec<&str> = files.iter().filter(knows).map(File::room).collect();
    rooms.dedup();
    found(rooms.len(), rooms.join(" "))
}

pub(crate) fn lines_of_code(files: &[File]) -> Found {
    found(files.iter().flat_map(File::code).count(), "")
}

pub(crate) fn public_items(files: &[File]) -> Found {
    found(files.iter().flat_map(File::code).filter(|line| item(line).1).count(), "")
}

pub(crate) fn longest_function(files: &[File]) -> Found {
    greatest(files.iter().flat_map(|file| {
        let heads =
            file.lines.iter().enumerate().filter(|(_, line)| is_fn(line) && !line.ends_with(['}', ';']));
        heads.map(move |(at, head)| {
            let end = format!("{}}}", &head[..indent(head)]);
            let length = file.lines[at..].iter().position(|line| line.starts_with(&end)).unwrap_or(0);
            (format!("{}:{}", file.path, name_of(item(head).0.trim_start_matches("fn "))), length + 1)
        })
    }))
}

pub(crate) fn longest_file(files: &[File]) -> Found {
    let whole = |file: &File| {
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(&file.path)).expect("it is there")
    };
    greatest(files.iter().map(|file| (file.path.clone(), whole(file).lines().count())))
}

/// Plain comments for each hundred lines of the rooms that reckon.
pub(crate) fn reasons(files: &[File]) -> Found {
    let rooms = ["limiter", "proof", "film", "engine"];
    let lines = files.iter().filter(|file| rooms.contains(&file.room())).flat_map(|file| &file.lines);
    let (mut all, mut plain) = (0.0, 0.0);
    for line in lines.map(|line| line.trim()).filter(|line| !line.is_empty()) {
        let documents = line.starts_with("///") || line.starts_with("//!");
        all += 1.0;
        plain += if !documents && (line.starts_with("//") || line.contains(" // ")) { 1.0 } else { 0.0 };
    }
    ((1000.0_f64 * plain / all).floor() / 10.0, String::new())
}

/// Tests of the console that open no browser.
pub(crate) fn console_tests_without_a_browser(_: &[File]) -> Found {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/console/main.rs");
    let text = fs::read_to_string(path).expect("it is there");
    let tests = text.split("#[test]").skip(1);
    found(tests.filter(|test| !test.contains("Browser::start()")).count(), "")
}
