//! A checker of `OpenMetrics` text that is stricter than what scrapes it: one page in, all its samples or the first fault out.

use std::collections::{BTreeMap, BTreeSet};

/// What a page holds.
#[derive(Debug, Default)]
pub(in crate::metrics) struct Page {
    /// The families that were declared.
    pub(crate) families: BTreeSet<String>,
    /// Each series as it is written, labels included, with its value.
    pub(crate) samples: BTreeMap<String, f64>,
}

struct Family {
    name: String,
    kind: String,
}

/// The page, or what is wrong with it.
pub(in crate::metrics) fn check(text: &str) -> Result<Page, String> {
    let body = text.strip_suffix("# EOF\n").ok_or("it does not end with EOF")?;
    let mut page = Page::default();
    let (mut helped, mut family) = (None, None::<Family>);
    for line in body.lines() {
        let at = |what: &str| format!("{what}: {line}");
        if let Some(help) = line.strip_prefix("# HELP ") {
            let (name, words) = help.split_once(' ').ok_or_else(|| at("HELP without words"))?;
            if words.trim().is_empty() || words.contains('\\') {
                return Err(at("HELP without plain words"));
            }
            helped = Some(name.to_owned());
        } else if let Some(declared) = line.strip_prefix("# TYPE ") {
            let (name, kind) = declared.split_once(' ').ok_or_else(|| at("TYPE without one"))?;
            if helped.take().as_deref() != Some(name) || !page.families.insert(name.to_owned()) {
                return Err(at("TYPE without its HELP, or declared twice"));
            }
            family = Some(Family { name: name.to_owned(), kind: kind.to_owned() });
        } else if helped.is_some() {
            return Err(at("a sample between HELP and TYPE"));
        } else {
            let family = family.as_ref().ok_or_else(|| at("a sample before any TYPE"))?;
            sample(line, family, &mut page).map_err(|why| at(&why))?;
        }
    }
    histograms(&page)?;
    Ok(page)
}

fn sample(line: &str, family: &Family, page: &mut Page) -> Result<(), String> {
    let (series, value) = line.rsplit_once(' ').ok_or("a sample without value")?;
    let value = match value {
        "+Inf" => f64::INFINITY,
        value => value.parse().map_err(|_| "value is not a number")?,
    };
    let (name, labels) = series.split_once('{').map_or((series, None), |(name, rest)| (name, Some(rest)));
    let suffix = name.strip_prefix(family.name.as_str()).ok_or("not of the family above")?;
    let allowed: &[&str] = match family.kind.as_str() {
        "gauge" => &[""],
        "counter" => &["_total"],
        "info" => &["_info"],
        "histogram" => &["_bucket", "_sum", "_count"],
        _ => return Err("unknown kind".into()),
    };
    if !allowed.contains(&suffix) {
        return Err(format!("wrong suffix {suffix:?} for a {}", family.kind));
    }
    if !name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_') {
        return Err("bad name".into());
    }
    if let Some(labels) = labels {
        check_labels(labels.strip_suffix('}').ok_or("label set without end")?)?;
    }
    if value.is_nan() || (family.kind != "gauge" && value < 0.0) {
        return Err("value out of range".into());
    }
    match page.samples.insert(series.to_owned(), value) {
        Some(_) => Err("told twice".into()),
        None => Ok(()),
    }
}

/// `name="value",name="value"`, quotes, backslashes and line breaks escaped.
fn check_labels(mut rest: &str) -> Result<(), String> {
    let mut names = BTreeSet::new();
    loop {
        let (name, value) = rest.split_once("=\"").ok_or("label without quotes")?;
        if !name.bytes().all(|b| b.is_ascii_lowercase()) || !names.insert(name) {
            return Err(format!("label name {name:?}"));
        }
        let mut chars = value.char_indices();
        let end = loop {
            match chars.next().ok_or("label value without end")? {
                (at, '"') => break at,
                (_, '\\') if !matches!(chars.next(), Some((_, '\\' | '"' | 'n'))) => {
                    return Err("label value with an unknown escape".into());
                }
                _ => {}
            }
        };
        match &value[end + 1..] {
            "" => return Ok(()),
            more => rest = more.strip_prefix(',').ok_or("label without comma before it")?,
        }
    }
}

/// Bounds grow, counts never fall, and the last counts all.
fn histograms(page: &Page) -> Result<(), String> {
    for family in &page.families {
        let Some(count) = page.samples.get(&format!("{family}_count")) else { continue };
        let prefix = format!("{family}_bucket{{le=\"");
        let bucket = |(series, count): (&String, &f64)| {
            let bound = series.strip_prefix(&prefix)?.strip_suffix("\"}")?;
            Some((if bound == "+Inf" { f64::INFINITY } else { bound.parse().ok()? }, *count))
        };
        let mut buckets: Vec<(f64, f64)> = page.samples.iter().filter_map(bucket).collect();
        buckets.sort_by(|a, b| a.0.total_cmp(&b.0));
        if !buckets.is_sorted_by(|a, b| a.0 < b.0 && a.1 <= b.1) {
            return Err(format!("{family}: counts are not cumulative"));
        }
        if buckets.last() != Some(&(f64::INFINITY, *count)) {
            return Err(format!("{family}: the last bucket and the count differ"));
        }
    }
    Ok(())
}
