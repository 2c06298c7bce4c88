//! The two formats of figures, of which whoever asks gets the one that it prefers: `OpenMetrics`, and the older text of Prometheus.

use std::fmt::Write as _;

/// The types of the two.
const OPEN: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
const PLAIN: &str = "text/plain; version=0.0.4; charset=utf-8";

/// The page in the format that `accept`, the header of that name, prefers, and its type. Without a preference it is the older one, which
/// every reader knows.
#[must_use]
pub(crate) fn negotiated(accept: Option<&str>, page: String) -> (&'static str, String) {
    let accept = accept.unwrap_or_default();
    let open = quality(accept, "application/openmetrics-text");
    if open > 0.0 && open >= quality(accept, "text/plain") { (OPEN, page) } else { (PLAIN, plain(&page)) }
}

/// How much a type is wanted by its name, 0 to 1.
fn quality(accept: &str, wanted: &str) -> f64 {
    let of = |range: &str| {
        let mut parts = range.split(';').map(str::trim);
        let is_it = parts.next().is_some_and(|name| name.eq_ignore_ascii_case(wanted));
        let quality = || parts.find_map(|part| part.strip_prefix("q=")?.parse::<f64>().ok()).unwrap_or(1.0);
        is_it.then(quality)
    };
    accept.split(',').filter_map(of).fold(0.0, f64::max)
}

/// `OpenMetrics` as the older text: a counter and an info are named there as their samples are, an info is a gauge, and the end is not said.
fn plain(page: &str) -> String {
    let mut out = String::with_capacity(page.len());
    let mut lines = page.lines().peekable();
    let mut kind = "";
    while let Some(line) = lines.next() {
        let comment = line.strip_prefix("# ").map(|comment| comment.splitn(3, ' ').collect::<Vec<_>>());
        let Some(comment) = comment else {
            out.extend([line, "\n"]);
            continue;
        };
        let [what, family, rest] = comment[..] else { continue };
        if what == "HELP" {
            // That of the line behind it, which has the type.
            kind = lines.peek().and_then(|line| line.rsplit(' ').next()).unwrap_or_default();
        }
        let (suffix, kind) = match kind {
            "counter" => ("_total", "counter"),
            "info" => ("_info", "gauge"),
            other => ("", other),
        };
        let _ = match what {
            "HELP" => writeln!(out, "# HELP {family}{suffix} {rest}"),
            "TYPE" => writeln!(out, "# TYPE {family}{suffix} {kind}"),
            _ => Ok(()),
        }; // a String takes it
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_asks_gets_the_format_that_it_prefers() {
        let prometheus = "application/openmetrics-text;version=1.0.0;q=0.5,application/openmetrics-text;version=0.0.1;q=0.4,\
            text/plain;version=0.0.4;q=0.3,*/*;q=0.2";
        for (accept, is_open) in [
            (Some(prometheus), true),
            (Some("application/openmetrics-text"), true),
            (Some("application/openmetrics-text; version=1.0.0; charset=utf-8"), true),
            (Some("text/plain;version=0.0.4"), false),
            (Some("text/plain, application/openmetrics-text;q=0.1"), false),
            (Some("application/openmetrics-text;q=0"), false),
            (Some("*/*"), false),
            (Some(""), false),
            (None, false),
        ] {
            let (kind, page) = negotiated(accept, "# EOF\n".to_owned());
            assert_eq!(
                (kind.starts_with("application/"), page.contains("EOF")),
                (is_open, is_open),
                "{accept:?}"
            );
        }
    }

    #[test]
    fn the_older_text_names_families_as_their_samples_and_does_not_say_its_end() {
        let page = "# HELP k_a Of a.\n# TYPE k_a counter\nk_a_total{x=\"# EOF\"} 2\n# HELP k_build About.\n# TYPE k_build info\n\
            k_build_info{version=\"1\"} 1\n# HELP k_g G.\n# TYPE k_g gauge\nk_g 0.5\n# EOF\n";
        let plain = "# HELP k_a_total Of a.\n# TYPE k_a_total counter\nk_a_total{x=\"# EOF\"} 2\n# HELP k_build_info About.\n\
            # TYPE k_build_info gauge\nk_build_info{version=\"1\"} 1\n# HELP k_g G.\n# TYPE k_g gauge\nk_g 0.5\n";
        assert_eq!(super::plain(page), plain);
    }
}
