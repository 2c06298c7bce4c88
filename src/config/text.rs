//! `[text]`: the port that takes lines of text; without the table there is none.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::api::hash;
use super::fault::Faults;
use super::gear::{GearWord, allowed, sources};
use super::section::{Entry, Section};

/// The port that takes lines of plain text over TCP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TextPort {
    /// Where it listens.
    pub(crate) listen: SocketAddrV4,
    /// Whose connections are taken, at least one.
    pub(crate) sources: Vec<Ipv4Addr>,
    /// What they may ask; stop may be asked always.
    pub(crate) allow: Vec<GearWord>,
    /// SHA-256 of the token that the first line of a connection has to show; `None` if none is wanted.
    pub(crate) token: Option<[u8; 32]>,
}

/// Reads the table.
pub(super) fn text(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<TextPort> {
    let mut section = Section::new("[text]", entry.at, entry.table(faults)?, faults);
    section.require(&["listen", "sources"]);
    let listen = section.address("listen");
    let sources = sources(&mut section);
    let allow = allowed(&mut section);
    let token = section.get("token_sha256").map(|entry| hash(entry, section.faults));
    section.finish();
    // One that cannot be read is a fault, and no port without a token.
    let token = token.map_or(Some(None), |token| token.map(Some))?;
    Some(TextPort { listen: listen?, sources: sources?, allow, token })
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
        assert_eq!((port.allow.as_slice(), port.token), (GearWord::DEFAULT.as_slice(), None));
    }

    #[test]
    fn a_port_may_want_a_token_and_list_what_may_be_asked() {
        let text = |more: &str| {
            with(&format!("[text]\nlisten = \"127.0.0.1:1\"\nsources = [\"127.0.0.1\"]\n{more}"))
        };
        let port = text(&format!("allow = [\"park\"]\ntoken_sha256 = \"{}\"", "0f".repeat(32)))
            .unwrap()
            .text
            .unwrap();
        assert_eq!((port.allow.as_slice(), port.token), ([GearWord::Park].as_slice(), Some([0x0f; 32])));
        assert!(
            text("token_sha256 = \"secret\"").unwrap_err()[0]
                .contains("`kinocue token NAME --role ROLE` makes one")
        );
    }

    #[test]
    fn an_unknown_key_is_refused() {
        let faults =
            with("[text]\nlisten = \"127.0.0.1:1\"\nsources = [\"127.0.0.1\"]\nport = 1").unwrap_err();
        assert!(faults[0].contains("port: unknown key in [text]"), "{faults:?}");
    }
}
