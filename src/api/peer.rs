//! Who is at the other end of a connection.

use std::fmt;
use std::io::Read as _;
use std::net::IpAddr;
use std::path::Path;
use std::sync::Arc;

use crate::control::{Role, Surface, Who};
use crate::sys::file;

/// Of the table of users no more is read.
const MAX_USERS_LEN: u64 = 1 << 20;

/// The other end of a connection.
#[derive(Debug, Clone)]
pub(super) enum Peer {
    /// A process of this machine that may open the control socket, by the name of its user.
    Socket(Arc<str>),
    /// A process of this machine that may open the fleet socket, likewise. It is nobody by itself.
    Fleet(Arc<str>),
    /// Another machine, or this one by its loopback address.
    Tcp(IpAddr),
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Socket(name) | Self::Fleet(name) => f.write_str(name),
            Self::Tcp(address) => address.fmt(f),
        }
    }
}

/// Whoever may open a socket in the file system is engineer.
pub(super) fn local(name: &str) -> Who {
    Who { role: Role::Engineer, surface: Surface::Socket, name: name.to_owned() }
}

/// Whoever may open the fleet's sockets may look and stop, and carry what others have signed.
pub(super) fn link(name: &str) -> Who {
    Who { role: Role::View, surface: Surface::Fleet, name: name.to_owned() }
}

/// The users of this machine, as they were when the sockets opened: whoever serves one reads no file, as a stop may come next.
#[derive(Debug, Clone)]
pub(super) struct Users(Arc<str>);

impl Users {
    /// Reads the table of users.
    pub(super) fn read() -> Self {
        let mut table = String::new();
        let read = file::open(Path::new("/etc/passwd"));
        let read = read.and_then(|file| file.take(MAX_USERS_LEN).read_to_string(&mut table));
        Self(read.map_or_else(|_| "".into(), |_| table.into()))
    }

    /// The name of a user, as the kernel says who it is (`SO_PEERCRED`); `uid N` where the table has none.
    pub(super) fn name(&self, uid: u32) -> String {
        name_in(&self.0, uid).unwrap_or_else(|| format!("uid {uid}"))
    }
}

/// `name:password:uid:…`, a line each.
fn name_in(table: &str, uid: u32) -> Option<String> {
    let mut users = table.lines().map(|line| line.split(':'));
    users.find_map(|mut fields| {
        let name = fields.next()?;
        let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_graphic());
        (plain && fields.nth(1)?.parse() == Ok(uid)).then(|| name.to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_is_named_as_the_table_of_users_has_it() {
        let table = "root:x:0:0:root:/root:/bin/sh\n\nbroken\nanna:x:1000:1000::/home/anna:/bin/sh\n";
        assert_eq!(name_in(table, 1000).as_deref(), Some("anna"));
        assert_eq!(name_in(table, 1001), None);
        assert_eq!(name_in("an na:x:1:1", 1), None, "what could be taken for more than a name");
        let users = Users::read();
        assert_eq!(users.name(0), "root");
        assert_eq!(users.name(4_000_000_000), "uid 4000000000");
    }
}
