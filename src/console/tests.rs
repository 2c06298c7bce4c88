//! The files of the page belong together, ask nobody else for anything, and keep the rules that the server sends with them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use super::{Asset, CSS, HTML, JS, PAGE, VENDOR, asset};

fn text(asset: &Asset) -> &'static str {
    std::str::from_utf8(asset.body).unwrap()
}

/// What stands between two marks, each time.
fn between<'t>(text: &'t str, before: &str, after: &str) -> Vec<&'t str> {
    text.split(before).skip(1).filter_map(|rest| rest.split_once(after).map(|(found, _)| found)).collect()
}

fn ours(content_type: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
    PAGE.iter()
        .filter(move |(_, asset)| asset.content_type == content_type)
        .map(|(path, asset)| (*path, text(asset)))
}

#[test]
fn the_page_is_at_the_root_and_nothing_is_beside_it() {
    assert_eq!(asset("/").unwrap().content_type, HTML);
    assert_eq!(asset("/"), asset("/index.html"));
    assert_eq!(asset("/js/main.js").unwrap().content_type, JS);
    for nothing in [
        "",
        "/js",
        "/js/",
        "/../mod.rs",
        "/tests.rs",
        "/vendor/README.md",
        "//",
        "/INDEX.HTML",
        "/style.css?x",
    ] {
        assert_eq!(asset(nothing), None, "{nothing}");
    }
}

#[test]
fn every_file_of_the_folders_is_built_in() {
    let built_in: BTreeSet<String> = PAGE.iter().map(|(path, _)| format!("page{path}")).collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/console");
    let mut there = BTreeSet::new();
    let mut folders: Vec<PathBuf> = vec![root.join("page")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                there.insert(path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned());
            }
        }
    }
    assert_eq!(built_in, there);
}

#[test]
fn everything_that_a_file_refers_to_is_there() {
    for (path, html) in ours(HTML) {
        for link in between(html, "href=\"", "\"").into_iter().chain(between(html, "src=\"", "\"")) {
            let is_there = match link.strip_prefix('#') {
                Some(id) => html.contains(&format!(" id=\"{id}\"")),
                None => asset(link).is_some(),
            };
            assert!(is_there, "{path} refers to {link}");
        }
    }
    for (path, js) in ours(JS) {
        for import in between(js, " from './", "'") {
            assert!(asset(&format!("/js/{import}")).is_some(), "{path} imports {import}");
        }
    }
}

#[test]
fn every_element_that_a_script_asks_for_is_on_the_page() {
    let html = text(&asset("/").unwrap());
    let ids: BTreeSet<&str> = between(html, " id=\"", "\"").into_iter().collect();
    for (path, js) in ours(JS) {
        for id in between(js, "byId('", "'") {
            assert!(ids.contains(id), "{path} asks for {id}");
        }
    }
    for id in
        between(html, "data-reply=\"", "\"").into_iter().chain(between(html, "aria-labelledby=\"", "\""))
    {
        assert!(ids.contains(id), "there is no {id}");
    }
}

#[test]
fn nothing_refers_to_another_origin() {
    for (path, asset) in PAGE {
        // The one address that a picture has to name is never asked.
        let text = text(asset).replace("http://www.w3.org/2000/svg", "");
        for word in ["://", "src=\"//", "href=\"//", "url(", "@import"] {
            assert!(!text.contains(word), "{path} holds {word}");
        }
    }
    for (path, asset) in VENDOR.iter().filter(|(_, asset)| asset.content_type == CSS) {
        assert!(!text(asset).contains("url("), "{path}");
    }
}

#[test]
fn nothing_is_inline_and_no_data_becomes_markup() {
    for (path, html) in ours(HTML) {
        assert!(!html.contains("<style") && !html.contains("style=\""), "{path}");
        let handler =
            |after: &&str| after.trim_start_matches(|c: char| c.is_ascii_lowercase()).starts_with('=');
        assert_eq!(html.split(" on").skip(1).find(handler), None, "{path}");
        assert!(between(html, "<script", ">").iter().all(|script| script.contains(" src=\"/")), "{path}");
    }
    for (path, js) in ours(JS) {
        for word in [
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "eval(",
            "new Function",
            "cssText",
        ] {
            assert!(!js.contains(word), "{path} holds {word}");
        }
    }
}

#[test]
fn the_modules_stay_small() {
    for (path, asset) in PAGE.iter().filter(|(path, _)| !path.starts_with(TABLES)) {
        assert!(text(asset).lines().count() < 300, "{path}");
    }
}

/// The folder of the tables of texts, one for each language.
const TABLES: &str = "/js/lang/";

/// The English table, whose keys all others have (`app::supervisor::coded`).
fn texts() -> BTreeMap<String, String> {
    let table = text(&asset("/js/lang/en.js").unwrap());
    let json = table.strip_prefix("export default ").and_then(|rest| rest.strip_suffix(";\n")).unwrap();
    serde_json::from_str(json).unwrap()
}

#[test]
fn the_page_has_no_words_of_its_own_but_those_that_are_the_same_in_every_language() {
    let html = text(&asset("/").unwrap());
    let (before, rest) = html.split_once("<noscript>").unwrap();
    let (_, after) = rest.split_once("</noscript>").unwrap();
    let words: BTreeSet<&str> = [before, after]
        .into_iter()
        .flat_map(|part| part.split('<').filter_map(|tag| tag.split_once('>')))
        .map(|(_, words)| words.trim())
        .filter(|words| words.chars().any(char::is_alphabetic))
        .collect();
    let same = ["kinocue", "STOP", "GO", "Language", "−10 s", "+10 s", "60 s", "10 s", "−10 ms", "+10 ms"];
    assert_eq!(words, BTreeSet::from(same));
}

#[test]
fn every_text_that_the_page_says_is_in_the_table_and_none_in_the_table_is_never_said() {
    let texts = texts();
    let scripts: String = ours(JS).filter(|(path, _)| !path.starts_with(TABLES)).map(|(_, js)| js).collect();
    let html = text(&asset("/").unwrap());
    let attributes = ["data-text=\"", "data-aria-label=\"", "data-aria-description=\""];
    let asked = attributes.into_iter().flat_map(|attribute| between(html, attribute, "\""));
    for key in asked.chain(between(&scripts, "words('", "'")) {
        assert!(texts.contains_key(key), "there is no text {key}");
    }
    for key in texts.keys() {
        let counted = key.strip_suffix(".one").or_else(|| key.strip_suffix(".other")).unwrap_or(key);
        let stem = key.rsplit_once('.').map_or("", |(stem, _)| stem);
        let said = [format!("'{key}'"), format!("\"{key}\""), format!("'{counted}'"), format!("`{stem}.${{")];
        let is_said = said.iter().any(|said| scripts.contains(said.as_str()) || html.contains(said.as_str()));
        assert!(is_said || key.starts_with("band."), "nothing says {key}");
    }
}

#[test]
fn what_others_wrote_is_as_they_published_it() {
    let sums = include_str!("vendor/README.md");
    for (path, asset) in VENDOR {
        let sum: String = Sha256::digest(asset.body).iter().map(|byte| format!("{byte:02x}")).collect();
        let name = path.strip_prefix("/vendor/").unwrap();
        assert!(sums.contains(&format!("| `{name}` | {sum} |")), "{name}: {sum}");
    }
}
