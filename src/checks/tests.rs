//! The table of checks.

use super::*;

#[test]
fn each_check_has_a_name_of_its_own_in_kebab_case() {
    for (index, check) in Check::ALL.iter().enumerate() {
        assert_eq!(check.id().parse(), Ok(*check));
        assert!(check.id().bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-'), "{check}");
        assert!(Check::ALL[..index].iter().all(|before| before.id() != check.id()), "{check}");
    }
    assert_eq!("estop".parse::<Check>(), Err(UnknownCheck));
}

#[test]
fn checks_are_explained_in_whole_sentences() {
    for check in Check::ALL {
        assert!(check.why().ends_with('.'), "{check}");
        assert!(!check.why().contains("  "), "{check}");
    }
}

#[test]
fn silence_and_present_trouble_cannot_be_accepted() {
    for check in
        [Check::NoAnswer, Check::RegisterUnread, Check::Route, Check::EmergencyStopActive, Check::ActiveError]
    {
        assert!(!check.can_be_accepted(), "{check}");
    }
    assert!(Check::EstopDisabled.can_be_accepted() && Check::FastForward.can_be_accepted());
    assert!(!Check::Version.can_be_accepted());
}
