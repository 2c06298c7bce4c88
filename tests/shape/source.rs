//! The code without its tests, line by line. It is formatted by rustfmt, so that indentation says what belongs to what.

use std::fs;
use std::path::{Path, PathBuf};

/// A file of `src`, without what is built for tests alone.
pub(crate) struct File {
    /// Its place in the project.
    pub(crate) path: String,
    /// Its module, from the room on; empty for the root of the crate.
    pub(crate) module: Vec<String>,
    pub(crate) lines: Vec<String>,
}

impl File {
    pub(crate) fn room(&self) -> &str {
        self.module.first().map_or("", String::as_str)
    }

    /// Its lines that are neither blank nor nothing but a comment.
    pub(crate) fn code(&self) -> impl Iterator<Item = &str> {
        let lines = self.lines.iter().map(String::as_str);
        lines.filter(|line| !line.trim().is_empty() && !line.trim_start().starts_with("//"))
    }
}

/// Every file of the program, the harness left out.
pub(crate) fn read() -> Vec<File> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    collect(&source, &mut paths);
    paths.sort();
    let mut of_tests = vec![vec!["harness".to_owned()]];
    let all: Vec<File> = paths.iter().map(|path| file(&source, path, &mut of_tests)).collect();
    all.into_iter().filter(|file| !of_tests.iter().any(|module| file.module.starts_with(module))).collect()
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("its entry can be read").path();
        if path.is_dir() {
            collect(&path, paths);
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            paths.push(path);
        }
    }
}

fn file(source: &Path, path: &Path, of_tests: &mut Vec<Vec<String>>) -> File {
    let within = path.strip_prefix(source).expect("it is in there").with_extension("");
    let mut module: Vec<String> =
        within.iter().map(|part| part.to_str().expect("names are text").to_owned()).collect();
    if ["mod", "lib", "main"].contains(&module[module.len() - 1].as_str()) {
        module.pop();
    }
    let text = fs::read_to_string(path).expect("it can be read");
    let lines = without_tests(&text, |name| of_tests.push([&module[..], &[name.to_owned()]].concat()));
    File { path: format!("src/{}.rs", within.display()), module, lines }
}

/// Leaves out each item under `#[cfg(test)]`, up to the brace that stands below its first letter; `module` is told of those that
/// are files of their own.
fn without_tests(text: &str, mut module: impl FnMut(&str)) -> Vec<String> {
    let mut lines = text.lines();
    let mut kept = Vec::new();
    while let Some(line) = lines.next() {
        if line.trim() != "#[cfg(test)]" {
            kept.push(line.to_owned());
            continue;
        }
        let end = format!("{}}}", &line[..line.len() - line.trim_start().len()]);
        let head = lines.by_ref().find(|line| !line.trim_start().starts_with("#[")).unwrap_or_default();
        if let Some(name) = head.strip_suffix(';').and_then(|head| head.split("mod ").nth(1)) {
            module(name);
        } else if !head.ends_with([';', '}']) {
            lines.find(|line| line.starts_with(&end));
        }
    }
    kept
}
