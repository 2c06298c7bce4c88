//! What stands before the IPv4 packet, by link type.

use super::source::array_at;

/// Numbers of link types, as tcpdump.org lists them; a few systems write their own for raw IP.
mod link_type {
    pub(super) const NULL: u16 = 0;
    pub(super) const ETHERNET: u16 = 1;
    pub(super) const RAW_BSD: u16 = 12;
    pub(super) const RAW_OPENBSD: u16 = 14;
    pub(super) const RAW: u16 = 101;
    pub(super) const LOOP: u16 = 108;
    pub(super) const COOKED: u16 = 113;
    pub(super) const IPV4: u16 = 228;
    pub(super) const COOKED_2: u16 = 276;
}

mod ether_type {
    pub(super) const IPV4: u16 = 0x0800;
    pub(super) const VLAN: u16 = 0x8100;
    pub(super) const VLAN_SERVICE: u16 = 0x88a8;
    pub(super) const VLAN_OLD: u16 = 0x9100;
}

/// Bytes of a VLAN tag, whose last two say what follows it.
const VLAN_LEN: usize = 4;
/// The address family of IPv4, on every system.
const FAMILY_IPV4: u32 = 2;

/// A link type that is not known here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UnknownLink;

/// The IPv4 packet that a captured one carries; `None` if it carries something else.
pub(super) fn ipv4(link: u16, bytes: &[u8]) -> Result<Option<&[u8]>, UnknownLink> {
    Ok(match link {
        link_type::ETHERNET => tagged(bytes, 12, 14),
        link_type::COOKED => tagged(bytes, 14, 16),
        link_type::COOKED_2 => tagged(bytes, 0, 20),
        link_type::NULL | link_type::LOOP => of_family(bytes),
        link_type::RAW | link_type::RAW_BSD | link_type::RAW_OPENBSD | link_type::IPV4 => Some(bytes),
        _ => return Err(UnknownLink),
    })
}

/// Behind a header that names its content at `name`, and behind VLAN tags from `content` on.
fn tagged(bytes: &[u8], name: usize, content: usize) -> Option<&[u8]> {
    let mut named = u16::from_be_bytes(array_at(bytes, name)?);
    let mut content = bytes.get(content..)?;
    while matches!(named, ether_type::VLAN | ether_type::VLAN_SERVICE | ether_type::VLAN_OLD) {
        named = u16::from_be_bytes(array_at(content, 2)?);
        content = content.get(VLAN_LEN..)?;
    }
    (named == ether_type::IPV4).then_some(content)
}

/// Behind an address family, in the order of the machine that captured it.
fn of_family(bytes: &[u8]) -> Option<&[u8]> {
    let family: [u8; 4] = array_at(bytes, 0)?;
    let is_ipv4 = u32::from_be_bytes(family) == FAMILY_IPV4 || u32::from_le_bytes(family) == FAMILY_IPV4;
    bytes.get(4..).filter(|_| is_ipv4)
}
