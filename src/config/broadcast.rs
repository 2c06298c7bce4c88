//! `[broadcast.NAME]`: the network whose controllers may get one datagram together; without a table there is none.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::fault::Faults;
use super::section::{Entry, Section};
use super::{Absent, Controller, FanOut, Station};
use crate::wire::Code;

/// A network whose controllers may get one datagram together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BroadcastNetwork {
    /// Its name.
    pub(crate) name: String,
    /// The network.
    pub(crate) network: Network4,
    /// The accept code of what goes to all of it.
    pub(crate) accept: Code,
    /// The port of its controllers.
    pub(crate) port: u16,
    /// All controllers of the configuration that are in it, also those that are out for good.
    pub(crate) members: Vec<String>,
}

impl BroadcastNetwork {
    /// Where one datagram for all of it goes.
    pub(crate) fn address(&self) -> SocketAddrV4 {
        SocketAddrV4::new(self.network.broadcast(), self.port)
    }
}

#[cfg(feature = "harness")]
impl BroadcastNetwork {
    /// Of loopback, with these members.
    pub(crate) fn of_loopback(members: &[&str]) -> Self {
        Self {
            name: "stalls".to_owned(),
            network: Network4 { first: Ipv4Addr::new(127, 0, 0, 0), bits: 8 },
            accept: Code(0x00ff),
            port: 7_408,
            members: members.iter().map(|&name| name.to_owned()).collect(),
        }
    }
}

/// A network of IPv4: its first address, and how many bits all of its addresses have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Network4 {
    first: Ipv4Addr,
    bits: u8,
}

impl Network4 {
    /// The network that is written `192.168.15.0/24`; the reason if that is none, or none that can have a broadcast.
    fn parse(text: &str) -> Result<Self, String> {
        let wanted = || format!("{text:?} is not a network, such as 192.168.15.0/24");
        let (first, bits) = text.split_once('/').ok_or_else(wanted)?;
        let network = Self {
            first: first.parse().map_err(|_| wanted())?,
            bits: bits.parse().ok().filter(|bits| (8..=30).contains(bits)).ok_or_else(wanted)?,
        };
        let begins = Ipv4Addr::from_bits(network.first.to_bits() & network.mask());
        if network.first != begins {
            return Err(format!("a network of {bits} bits begins at {begins}; write {begins}/{bits}"));
        }
        Ok(network)
    }

    const fn mask(self) -> u32 {
        u32::MAX << (32 - self.bits)
    }

    /// The address of all in it.
    pub(crate) const fn broadcast(self) -> Ipv4Addr {
        Ipv4Addr::from_bits(self.first.to_bits() | !self.mask())
    }

    /// Whether an address is in it.
    pub(crate) const fn holds(self, ip: Ipv4Addr) -> bool {
        ip.to_bits() & self.mask() == self.first.to_bits()
    }

    /// How many bits all of its addresses have in common.
    pub(crate) const fn bits(self) -> u8 {
        self.bits
    }
}

/// Reads the table. What is reached together has to be of one kind, and the code has to mean all of the network and nobody else. There is
/// one at the most: whoever is on a wire may take what is broadcast to any network on it, and whose answers are whose nobody could tell.
pub(super) fn broadcast(
    entry: Entry<'_>,
    controllers: &[Controller],
    absent: &[Absent],
    frame_port: u16,
    faults: &mut Faults<'_>,
) -> Option<BroadcastNetwork> {
    let all = || controllers.iter().chain(absent.iter().map(|one| &one.controller));
    let mut read: Option<BroadcastNetwork> = None;
    for (name, value) in entry.table(faults)? {
        let entry = Entry::new(name.get_ref(), value);
        let Some((network, accept)) = one(entry, faults) else { continue };
        if let Some(other) = &read {
            let why = format!(
                "broadcast.{} is there already, and a hall broadcasts to one network: what goes to one may be taken by whoever is on \
                 the same wire; take one of them out",
                other.name
            );
            entry.fault(faults, &why);
            continue;
        }
        let stations = all().filter_map(|one| Some((one, one.station()?)));
        let (members, others): (Vec<_>, Vec<_>) =
            stations.partition(|(_, at)| network.holds(*at.address.ip()));
        let accept = accept.unwrap_or_else(|| narrowest(&members));
        match port_of(&members, &others, network, accept, frame_port) {
            Err(why) => entry.fault(faults, &why),
            Ok(port) => {
                let members = members.iter().map(|(one, _)| one.name.clone()).collect();
                read = Some(BroadcastNetwork { name: entry.key.to_owned(), network, accept, port, members });
            }
        }
    }
    read
}

/// The code that means all of these, and as few others as can be.
fn narrowest(members: &[(&Controller, &Station)]) -> Code {
    let mut codes = members.iter().map(|(_, at)| own_code(at).0 | 0xff);
    let first = codes.next().unwrap_or(Code::ALL.0);
    if codes.all(|other| other == first) { Code(first) } else { Code::ALL }
}

/// The code that a controller knows for its own (PA12, PA13): that of its address, unless its frames have another.
fn own_code(at: &Station) -> Code {
    let own = |(code, address): (u8, u8)| if code == 0xff { address } else { code };
    let ([_, _, xx, yy], [column, row]) = (at.address.ip().octets(), at.code().to_be_bytes());
    Code(u16::from_be_bytes([(column, xx), (row, yy)].map(own)))
}

/// The network, and the code where the table has one.
fn one(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<(Network4, Option<Code>)> {
    let table = entry.table(faults)?;
    let mut section = Section::new(format!("[broadcast.{}]", entry.key), entry.at, table, faults);
    section.require(&["network"]);
    let network = section.get("network").and_then(|entry| {
        let parsed = Network4::parse(entry.text(section.faults)?);
        parsed.map_err(|why| entry.fault(section.faults, &why)).ok()
    });
    let accept = section.get("accept").map(|entry| entry.code(section.faults).map(Code));
    if section.get("alone").and_then(|entry| entry.switch(section.faults)) != Some(true) {
        let why = "needs alone = true: a controller that answers nobody, or another machine, is moved by broadcasts, and nobody here hears \
                   of it; write that once a person has seen that no controller is on this wire but those of this file";
        entry.fault(section.faults, why);
    }
    section.finish();
    Some((network?, accept.map_or(Some(None), |code| code.map(Some))?))
}

/// The one port of these controllers; why one datagram cannot be for all of them, if so.
fn port_of(
    members: &[(&Controller, &Station)],
    others: &[(&Controller, &Station)],
    network: Network4,
    accept: Code,
    frame_port: u16,
) -> Result<u16, String> {
    let [(first, station), rest @ ..] = members else {
        return Err("no controller is in this network; take the table out, or correct the network".to_owned());
    };
    if rest.is_empty() {
        return Err(format!("{} is alone in this network; a broadcast is for two or more", first.name));
    }
    if station.address.port() == frame_port {
        return Err(format!(
            "port {frame_port} is that of [show] bind as well, so that this machine would hear its own broadcasts; bind another"
        ));
    }
    let is_meant = |at: &Station| accept.matches(own_code(at));
    if let Some((one, at)) = others.iter().find(|(_, at)| is_meant(at)) {
        return Err(format!(
            "accept {accept} means {} at {} as well, which is not in this network; give a code that means nobody but its controllers, or \
             take the table out",
            one.name,
            at.address.ip()
        ));
    }
    for (one, at) in members {
        let (name, ip) = (&one.name, *at.address.ip());
        if ip == network.first || ip == network.broadcast() {
            return Err(format!("{ip} of {name} is no single address of this network; correct the network"));
        }
        if !is_meant(at) {
            return Err(format!(
                "accept {accept} does not mean {name} at {ip}; every controller of the network has to take it"
            ));
        }
        let differs = [
            ("port", at.address.port() == station.address.port()),
            ("seat type", one.seat == first.seat),
            ("dialect", at.dialect == station.dialect),
            ("fan_out", at.fan_out == station.fan_out),
            ("vibration_port_octets", at.vibration_port == station.vibration_port),
            ("wide_channel", at.counts_axes == station.counts_axes),
            ("axis_offset", one.axis_offset == first.axis_offset || at.fan_out == FanOut::Shared),
        ];
        if let Some((what, _)) = differs.iter().find(|(_, same)| !same) {
            return Err(format!(
                "{name} has another {what} than {}, so that no frame is for both; take it off this network, or the table out",
                first.name
            ));
        }
    }
    Ok(station.address.port())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Config, ConfigFaults, read};
    use std::path::Path;

    const HALL: &str = "[seat.s]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
        max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
        [[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"192.168.15.1:7408\"\n\
        [[controller]]\nname = \"A2\"\nseat = \"s\"\naddress = \"192.168.15.2:7408\"\n";

    fn hall(more: &str) -> Result<Config, String> {
        read::document(Path::new("hall.toml"), &format!("{HALL}{more}\n")).map_err(|faults| match faults {
            ConfigFaults::Bad(faults) => faults.iter().map(|one| format!("{one}\n")).collect(),
            ConfigFaults::Unreadable { .. } => unreachable!("a text is no file"),
        })
    }

    fn fault(more: &str) -> String {
        hall(more).expect_err("it is refused")
    }

    #[test]
    fn every_controller_of_a_network_gets_its_broadcasts_also_one_that_is_out() {
        assert_eq!(hall("").unwrap().broadcast, None);
        let hall = hall(
            "[[controller]]\nname = \"A3\"\nseat = \"s\"\naddress = \"192.168.15.3:7408\"\nenabled = false\n\
             [[controller]]\nname = \"B1\"\nseat = \"s\"\naddress = \"192.168.16.3:7408\"\n\
             [broadcast.row_a]\nalone = true\nnetwork = \"192.168.15.0/24\"\naccept = \"0fff\"",
        );
        let row = hall.unwrap().broadcast.unwrap();
        assert_eq!(row.address(), "192.168.15.255:7408".parse().unwrap());
        assert_eq!((row.name.as_str(), row.accept, row.members.len()), ("row_a", Code(0x0fff), 3));
        assert_eq!(row.members, ["A1", "A2", "A3"]);
    }

    #[test]
    fn a_network_that_is_none_or_holds_nobody_or_one_alone_is_refused() {
        let with = |network: &str| fault(&format!("[broadcast.a]\nalone = true\nnetwork = \"{network}\""));
        for network in ["192.168.15.0", "192.168.15.0/31", "192.168.15.0/7", "all/24"] {
            assert!(with(network).contains("is not a network, such as 192.168.15.0/24"), "{network}");
        }
        assert!(with("192.168.15.1/24").contains("write 192.168.15.0/24"));
        assert!(with("10.0.0.0/8").contains("no controller is in this network"));
        assert!(with("192.168.15.2/31").contains("is not a network"));
        assert!(hall("[broadcast.a]\nalone = true\nnetwork = \"192.168.15.0/30\"").is_ok());
        assert!(
            fault("[broadcast.a]\nalone = true\naccept = \"0fff\"")
                .contains("has no network, which is needed")
        );
    }

    #[test]
    fn controllers_that_no_frame_is_for_both_of_are_not_reached_together() {
        let beside = |more: &str| {
            fault(&format!(
                "[[controller]]\nname = \"A3\"\nseat = \"s\"\naddress = \"192.168.15.3:{more}\n\
                 [broadcast.a]\nalone = true\nnetwork = \"192.168.15.0/24\""
            ))
        };
        for (more, what) in [
            ("7409\"", "port"),
            ("7408\"\ndialect = \"mbox\"", "dialect"),
            ("7408\"\nfan_out = \"shared\"", "fan_out"),
            ("7408\"\naxis_offset = 3", "axis_offset"),
            ("7408\"\nvibration_port_octets = 4", "vibration_port_octets"),
        ] {
            assert!(beside(more).contains(&format!("A3 has another {what} than A1")), "{more}");
        }
    }

    #[test]
    fn a_code_that_leaves_a_controller_of_the_network_out_is_refused() {
        let with = |accept: &str| {
            hall(&format!(
                "[broadcast.a]\nalone = true\nnetwork = \"192.168.15.0/24\"\naccept = \"{accept}\""
            ))
        };
        assert!(with("ffff").is_ok());
        assert!(with("0eff").unwrap_err().contains("accept 0eff does not mean A1 at 192.168.15.1"));
        assert!(with("ff01").unwrap_err().contains("does not mean A2"));
        assert!(with("0000").unwrap_err().contains("no station accepts"));
        assert!(with("station").unwrap_err().contains("four hex digits"));
    }

    #[test]
    fn the_code_is_as_narrow_as_the_network_lets_it_be_unless_another_is_given() {
        let code = |more: &str| hall(more).unwrap().broadcast.unwrap().accept;
        assert_eq!(code("[broadcast.a]\nalone = true\nnetwork = \"192.168.15.0/24\""), Code(0x0fff));
        let wide = "[[controller]]\nname = \"B1\"\nseat = \"s\"\naddress = \"192.168.14.3:7408\"\n[broadcast.a]\nalone = true\n\
                    network = \"192.168.14.0/23\"";
        assert_eq!(code(wide), Code::ALL);
    }

    #[test]
    fn a_code_that_means_a_controller_outside_of_the_network_is_refused_be_it_enabled_or_not() {
        for enabled in [true, false] {
            for (address, accept) in
                [("192.168.16.3", "ffff"), ("192.168.16.3", "ff03"), ("10.0.15.7", "0fff")]
            {
                let told = fault(&format!(
                    "[[controller]]\nname = \"A3\"\nseat = \"s\"\naddress = \"192.168.15.3:7408\"\n\
                     [[controller]]\nname = \"B1\"\nseat = \"s\"\naddress = \"{address}:7408\"\nenabled = {enabled}\n\
                     [broadcast.a]\nalone = true\nnetwork = \"192.168.15.0/24\"\naccept = \"{accept}\""
                ));
                let wanted = format!("accept {accept} means B1 at {address} as well");
                assert!(told.contains(&wanted), "{told}");
            }
        }
    }

    #[test]
    fn what_a_controller_takes_for_its_own_code_is_what_the_file_has_for_it() {
        let with = |address: &str, code: &str, accept: &str| {
            hall(&format!(
                "[[controller]]\nname = \"B1\"\nseat = \"s\"\naddress = \"{address}:7408\"\naccept = \"{code}\"\n\
                 [broadcast.a]\nalone = true\nnetwork = \"192.168.15.0/24\"\n{accept}"
            ))
        };
        let narrow = "accept = \"0fff\"";
        let elsewhere = with("192.168.16.3", "0f07", narrow).unwrap_err();
        assert!(elsewhere.contains("accept 0fff means B1 at 192.168.16.3 as well"), "{elsewhere}");
        for code in ["1007", "ff07", "ffff", "station"] {
            assert!(with("192.168.16.3", code, narrow).is_ok(), "{code}");
        }
        let member = with("192.168.15.3", "0103", narrow).unwrap_err();
        assert!(member.contains("accept 0fff does not mean B1 at 192.168.15.3"), "{member}");
        assert_eq!(with("192.168.15.3", "0103", "").unwrap().broadcast.unwrap().accept, Code::ALL);
    }

    #[test]
    fn a_second_network_is_refused_wherever_it_is() {
        for other in ["192.168.15.0/24", "192.168.16.0/24", "10.0.0.0/8"] {
            let two = format!(
                "[broadcast.a]\nalone = true\nnetwork = \"192.168.15.0/24\"\n[broadcast.b]\nalone = true\nnetwork = \"{other}\""
            );
            assert!(fault(&two).contains("b: broadcast.a is there already"), "{other}");
        }
    }

    #[test]
    fn nothing_is_broadcast_before_a_person_has_said_that_nobody_else_is_on_the_wire() {
        for alone in ["", "alone = false"] {
            let told = fault(&format!("[broadcast.a]\nnetwork = \"192.168.15.0/24\"\n{alone}"));
            assert!(told.contains("a: needs alone = true"), "{told}");
        }
    }

    #[test]
    fn the_port_of_this_machine_is_refused() {
        let own = fault(
            "[broadcast.a]\nalone = true\nnetwork = \"192.168.15.0/24\"\n[show]\nbind = \"0.0.0.0:7408\"",
        );
        assert!(own.contains("would hear its own broadcasts"), "{own}");
    }
}
