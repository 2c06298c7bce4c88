//! Programs of others that some tests need. A test that cannot be made fails, unless somebody asked for its absence: one that
//! passes without having looked says what is not so.

use std::io::Write as _;
use std::path::PathBuf;

/// What names, separated by spaces, the programs whose tests are to be skipped where these are not installed.
const WITHOUT: &str = "KINOCUE_TESTS_WITHOUT";

/// Whether the tests of a program can be made. False, said so, where it is not installed and [`WITHOUT`] names it.
///
/// # Panics
/// Where it is not installed and nobody asked for that.
#[allow(dead_code, reason = "each test uses its own part")]
pub(crate) fn is_installed(program: &str) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let mut places = std::env::split_paths(&paths).map(|folder: PathBuf| folder.join(program));
    let without = std::env::var(WITHOUT).unwrap_or_default();
    let installed = is_wanted(program, places.any(|place| place.is_file()), &without);
    if !installed {
        // Straight to the standard error: the test harness keeps what a passed test prints.
        let _ = writeln!(std::io::stderr(), "skipped: {program} is not installed");
    }
    installed
}

/// The same of something that is no program of the path: whether it is there, and how to get it.
///
/// # Panics
/// Where it is not there and nobody asked for that.
#[allow(dead_code, reason = "each test uses its own part")]
pub(crate) fn is_there(name: &str, there: bool, remedy: &str) -> bool {
    if !there {
        let _ = writeln!(std::io::stderr(), "skipped: {name} is not there; {remedy}");
    }
    is_wanted(name, there, &std::env::var(WITHOUT).unwrap_or_default())
}

fn is_wanted(program: &str, installed: bool, without: &str) -> bool {
    assert!(
        installed || without.split_whitespace().any(|name| name == program),
        "{program} is not installed, and this test needs it; install it, or skip its tests with {WITHOUT}={program}"
    );
    installed
}

#[test]
fn a_test_is_skipped_only_where_somebody_asked_for_it() {
    assert!(is_wanted("chromium", true, "") && is_wanted("chromium", true, "chromium"));
    assert!(!is_wanted("chromium", false, "tshark chromium"));
    for without in ["", "tshark", "chromiums"] {
        let refused = std::panic::catch_unwind(|| is_wanted("chromium", false, without));
        assert!(refused.is_err(), "{without:?}");
    }
}
