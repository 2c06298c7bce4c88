//! The ports of the serial links of a hall: whether they are there, whether this user may open them, and how long an adapter holds
//! answers back. Nothing is opened: to open a port may reset what is on it.

use std::path::Path;
use std::time::Duration;

use rustix::fs::{Access, access};

use super::FindingLine;
use crate::config::Link;
use crate::config::link::LinkWiring;
use crate::plain;
use crate::sys::serial::{SerialError, latency_timer};

const ID: &str = "link-port";
/// Longer than this an adapter need not hold answers back.
const SHORT: Duration = Duration::from_millis(1);
/// Interfaces of this machine, those of CAN buses among them.
const INTERFACES: &str = "/sys/class/net";

/// A line for each link.
pub(crate) fn of(links: &[Link]) -> Vec<FindingLine> {
    let one = |link: &Link| match link.wiring {
        LinkWiring::Can => judge_bus(link, Path::new(INTERFACES)),
        LinkWiring::Rs232 | LinkWiring::Rs485 => {
            let found = access(&link.port, Access::READ_OK | Access::WRITE_OK);
            let refusal = found.err().map(|errno| SerialError::of(&link.port, errno).to_string());
            judge(link, refusal, latency_timer(&link.port))
        }
    };
    links.iter().map(one).collect()
}

fn judge(link: &Link, refusal: Option<String>, held: Option<Duration>) -> FindingLine {
    let (name, port) = (&link.name, plain::path(&link.port));
    match (refusal, held) {
        (Some(refusal), _) => {
            let (found, fix) = refusal.split_once("; ").unwrap_or((&refusal, "see the log of the system"));
            FindingLine::bad(ID, format!("link {name}: {found}"), fix)
        }
        (None, Some(held)) if held > SHORT => FindingLine::warn(
            ID,
            format!("link {name}: {port}: the adapter holds answers back for {} ms", held.as_millis()),
            "install 60-kinocue-drives.rules, which sets its latency timer to 1 ms",
        ),
        (None, _) => FindingLine::ok(ID, format!("link {name}: {port} is there, and may be opened")),
    }
}

fn judge_bus(link: &Link, interfaces: &Path) -> FindingLine {
    let (name, port) = (&link.name, plain::path(&link.port));
    if interfaces.join(&link.port).exists() {
        return FindingLine::ok(ID, format!("link {name}: there is an interface {port}"));
    }
    FindingLine::bad(
        ID,
        format!("link {name}: {port}: there is no such interface"),
        "plug the adapter in, and look for its name by `ip link`",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Verdict;

    fn link(port: &Path, wiring: LinkWiring) -> Link {
        Link {
            name: "stalls".to_owned(),
            port: port.to_owned(),
            wiring,
            baud: 57_600,
            asked_baud: 57_600,
            stop_bits: 2,
            has_echo: false,
            rate_hz: None,
            family: None,
        }
    }

    #[test]
    fn a_port_that_is_missing_or_forbidden_is_bad_and_an_adapter_that_holds_answers_back_a_warning() {
        let folder = tempfile::tempdir().unwrap();
        let (port, none) = (folder.path().join("ttyUSB0"), folder.path().join("ttyUSB1"));
        std::fs::write(&port, "").unwrap();
        let lines = of(&[link(&port, LinkWiring::Rs485), link(&none, LinkWiring::Rs485)]);
        assert_eq!(lines[0].verdict, Verdict::Ok, "{lines:?}");
        assert_eq!(lines[1].verdict, Verdict::Bad, "{lines:?}");
        assert!(lines[1].found.contains("ttyUSB1") && lines[1].fix.is_some(), "{lines:?}");
        let one = link(&port, LinkWiring::Rs485);
        let forbidden = SerialError::of(&port, rustix::io::Errno::ACCESS).to_string();
        let line = judge(&one, Some(forbidden), None);
        assert!(line.fix.is_some_and(|fix| fix.contains("dialout")), "{}", line.found);
        let slow = judge(&one, None, Some(Duration::from_millis(16)));
        assert_eq!(slow.verdict, Verdict::Warn);
        assert!(slow.found.ends_with("holds answers back for 16 ms"), "{slow:?}");
    }

    #[test]
    fn a_bus_is_an_interface_of_this_machine() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("can0")).unwrap();
        let verdict = |name: &str| judge_bus(&link(Path::new(name), LinkWiring::Can), folder.path()).verdict;
        assert_eq!([verdict("can0"), verdict("can1")], [Verdict::Ok, Verdict::Bad]);
    }
}
