//! Circles of modules within a room: such of one folder as need each other, be it by way of others.

use std::collections::{BTreeMap, BTreeSet};

use crate::source::File;

type Graph<'a> = BTreeMap<&'a str, BTreeSet<&'a str>>;

/// How many circles there are, and who is in each.
pub(crate) fn within_rooms(files: &[File]) -> (f64, String) {
    let modules: BTreeSet<&[String]> = files.iter().map(|file| file.module.as_slice()).collect();
    let mut folders: BTreeMap<&[String], Graph<'_>> = BTreeMap::new();
    for file in files {
        let uses = paths(file).into_iter().filter_map(|path| resolve(&file.module, &path, &modules));
        for used in uses {
            let same = file.module.iter().zip(used).take_while(|(one, other)| one == other).count();
            if let (1.., Some(from), Some(to)) = (same, file.module.get(same), used.get(same)) {
                folders.entry(&used[..same]).or_default().entry(from).or_default().insert(to);
            }
        }
    }
    let circles: Vec<String> = folders.iter().flat_map(|(folder, graph)| circles(folder, graph)).collect();
    (f64::from(u32::try_from(circles.len()).expect("few")), circles.join("; "))
}

fn circles(folder: &[String], graph: &Graph<'_>) -> BTreeSet<String> {
    let reach: BTreeMap<&str, BTreeSet<&str>> =
        graph.keys().map(|from| (*from, reached(graph, from))).collect();
    let meets = |one: &str, other: &str| {
        reach[one].contains(other) && reach.get(other).is_some_and(|back| back.contains(one))
    };
    let members = |of: &str| reach[of].iter().copied().filter(|other| meets(of, other)).collect::<Vec<_>>();
    let circles = graph.keys().map(|of| members(of)).filter(|members| members.len() > 1);
    circles.map(|members| format!("{}: {}", folder.join("::"), members.join(" "))).collect()
}

fn reached<'a>(graph: &Graph<'a>, from: &str) -> BTreeSet<&'a str> {
    let mut found = BTreeSet::new();
    let mut waiting: Vec<&str> = graph.get(from).into_iter().flatten().copied().collect();
    while let Some(next) = waiting.pop() {
        if found.insert(next) {
            waiting.extend(graph.get(next).into_iter().flatten());
        }
    }
    found
}

/// The module that a path leads into, seen from another.
fn resolve<'a>(from: &[String], path: &[String], modules: &BTreeSet<&'a [String]>) -> Option<&'a [String]> {
    let mut place = from.to_vec();
    let mut steps = path.iter().map(String::as_str).peekable();
    while let Some(step) = steps.next_if(|step| ["crate", "super", "self"].contains(step)) {
        match step {
            "crate" => place.clear(),
            "super" => drop(place.pop()),
            _ => {}
        }
    }
    for step in steps {
        place.push(step.to_owned());
        if !modules.contains(place.as_slice()) {
            place.pop();
            break;
        }
    }
    modules.get(place.as_slice()).copied()
}

/// Every path in a file that begins in this crate, groups taken apart.
fn paths(file: &File) -> Vec<Vec<String>> {
    let text: String = file.code().flat_map(|line| [line, "\n"]).collect();
    let begins = |word: &&str| text.match_indices(*word).map(|(at, _)| at).collect::<Vec<_>>();
    let starts = ["crate::", "super::", "self::"].iter().flat_map(begins);
    let whole =
        starts.filter(|at| !text[..*at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':'));
    whole.flat_map(|at| Paths { rest: &text[at..] }.read()).collect()
}

/// Reads one path, or a group of them.
struct Paths<'a> {
    rest: &'a str,
}

impl Paths<'_> {
    fn read(&mut self) -> Vec<Vec<String>> {
        self.rest = self.rest.trim_start();
        if let Some(group) = self.rest.strip_prefix('{') {
            self.rest = group;
            return self.group();
        }
        let end = self.rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        let step = || word.to_owned();
        let Some(more) = rest.strip_prefix("::").filter(|_| !word.is_empty()) else {
            return vec![vec![step()]];
        };
        self.rest = more;
        let behind = self.read();
        behind.into_iter().map(|path| [vec![step()], path].concat()).collect()
    }

    fn group(&mut self) -> Vec<Vec<String>> {
        let mut all = Vec::new();
        loop {
            self.rest = self.rest.trim_start();
            if let Some(behind) = self.rest.strip_prefix('}') {
                self.rest = behind;
                return all;
            }
            let before = self.rest.len();
            all.extend(self.read());
            // `as other`, `*` and commas say nothing of where it leads.
            let end = self.rest.find([',', '}', '\n']).unwrap_or(self.rest.len());
            self.rest = self.rest[end..].trim_start_matches([',', '\n']);
            if self.rest.len() == before || self.rest.is_empty() {
                return all;
            }
        }
    }
}
