//! `[text]`: the port that takes lines of text; without the table there is none.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::fault::Faults;
use super::section::{Entry, Section};
use super::sources::sources;

/// The port that takes lines of plain text over TCP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextPort {
    /// Where it listens.
    pub listen: SocketAddrV4,
    /// Whose connections are taken, at least one.
    pub sources: Vec<Ipv4Addr>,
}

/// Reads the table.
pub(super) fn text(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<TextPort> {
    let mut section = Section::new("[text]", entry.at, entry.table(faults)?, faults);
    section.require(&["listen", "sources"]);
    let listen = section.address("listen");
    let sources = sources(&mut section);
    section.finish();
    Some(TextPort { listen: listen?, sources: sources? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::with;

    #[test]
    fn a_port_names_whom_it_takes_lines_from() {
        assert_eq!(with("").unwrap().text, None);
        let port = "[text]\nlisten = \"127.0.0.1:7411\"\nsources = [\"127.0.0.1\", \"10.0.0.5\"]";
        let port = with(port).unwrap().text.unwrap();
        assert_eq!(port.sources, [Ipv4Addr::LOCALHOST, Ipv4Addr::new(10, 0, 0, 5)]);
    }

    #[test]
    fn an_unknown_key_is_refused() {
        let faults =
            with("[text]\nlisten = \"127.0.0.1:1\"\nsources = [\"127.0.0.1\"]\nallow = []").unwrap_err();
        assert!(faults[0].contains("allow: unknown key in [text]"), "{faults:?}");
    }
}
