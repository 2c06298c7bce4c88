//! The hall of the demo: its seats, as virtual controllers and as a configuration.

use std::net::SocketAddrV4;

use super::virtual_hall::{VirtualHall, port};
use crate::sim::{Setup, pa};
use crate::sys::own_folder::OwnFolder;
use crate::wire::Dialect;

/// A seat.
pub(super) struct DemoSeat {
    pub(super) name: &'static str,
    row: &'static str,
    axes: u16,
    offset: u16,
    fan_out: &'static str,
}

/// The virtual seats: two with all three axes, and a pair that shares one frame, each taking its own window by PA95.
pub(super) const SEATS: [DemoSeat; 4] = [
    DemoSeat { name: "A1", row: "A", axes: 3, offset: 0, fan_out: "slice" },
    DemoSeat { name: "A2", row: "A", axes: 3, offset: 0, fan_out: "slice" },
    DemoSeat { name: "B1", row: "B", axes: 2, offset: 0, fan_out: "shared" },
    DemoSeat { name: "B2", row: "B", axes: 1, offset: 2, fan_out: "shared" },
];

/// The seats where serial drives move them, each on a line of its own.
pub(super) const DRIVEN: [&str; 2] = ["A1", "A2"];

impl DemoSeat {
    /// Its controller, set as a safe one is, that answers to `host`.
    pub(super) fn setup(&self, host: SocketAddrV4, dialect: Dialect) -> Setup {
        let parameters = vec![(pa::OFFSET, self.offset)];
        Setup { axes: self.axes, parameters, dialect, ..Setup::default() }.safe(host)
    }

    /// Its seat type and its controller, as the configuration has them.
    fn tables(&self, address: SocketAddrV4, dialect: &str) -> String {
        let Self { name, row, axes, offset, fan_out } = self;
        let neutral = vec!["0.5"; usize::from(*axes)].join(", ");
        format!(
            "[seat.{name}]\naxes = {axes}\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\n\
             max_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n\
             neutral = [{neutral}]\n\
             [[controller]]\nname = \"{name}\"\nrow = \"{row}\"\nseat = \"{name}\"\naddress = \"{address}\"\n\
             dialect = \"{dialect}\"\naxis_offset = {offset}\nfan_out = \"{fan_out}\"\nestop_inputs = [1]\n"
        )
    }
}

/// What a line with SilverMax units is in the configuration: its baud and its rate, and what is said of type, drives and motors.
///
/// Neither plays as often as its line could: where this machine is busy virtual units answer late.
const SILVERMAX: (u32, u32, &str, &str, &str) = (
    115_200,
    25,
    "pulses_per_rev = 4000",
    "home = { way = \"switch\", input = 1, toward = \"down\", speed_mm_s = 50, travel_mm = 165, zero_mm = -2.0, together = true }\n\
     torque = { hold = \"60%\", move = \"100%\", full = 20000 }",
    "dialect = \"silvermax\"\nunits = [16, 17, 18]",
);
/// The same of a line with a SIXpack 2.
const SIXPACK2: (u32, u32, &str, &str, &str) = (
    115_200,
    80,
    "pulses_per_rev = 3200",
    "home = { way = \"switch\", toward = \"down\", speed_mm_s = 50, travel_mm = 165, zero_mm = -5.0 }\n\
     clock_divider = 3\njump_mm_s = 70\ncurrent = { peak = 238 }",
    "dialect = \"sixpack2\"\nunit = 1\nmotors = [0, 1, 2]",
);

/// Seats on drives: each a link, a seat type and a controller.
fn driven(
    folder: &OwnFolder,
    (baud, rate_hz, seat, drive, controller): (u32, u32, &str, &str, &str),
) -> impl Iterator<Item = String> {
    DRIVEN.into_iter().map(move |name| {
        let port = quoted(&port(folder, name).to_string_lossy());
        format!(
            "[link.{name}]\nport = {port}\nbaud = {baud}\nrate_hz = {rate_hz}\n\
             [seat.{name}]\naxes = 3\nstroke_mm = 150.0\nlead_mm = 5.0\n\
             max_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n{seat}\n\
             [seat.{name}.drive]\n{drive}\n\
             [[controller]]\nname = \"{name}\"\nrow = \"A\"\nseat = \"{name}\"\naddress = \"link:{name}\"\n{controller}\n"
        )
    })
}

/// The configuration: the seats of this hall, whose controllers answer to `host`; the API listens on a port that the system gives it
/// and knows the token of these lines, and all files are in `folder`.
pub(super) fn hall(
    rate_hz: f64,
    host: SocketAddrV4,
    seats: &VirtualHall,
    token: &str,
    folder: &OwnFolder,
) -> String {
    let path = |name: &str| quoted(&folder.path(name).to_string_lossy());
    let (cues, log) = (path("cues"), path("log"));
    let mut hall = format!(
        "[show]\nname = \"demo\"\nrate_hz = {rate_hz:?}\nbind = \"{host}\"\nlibrary = {cues}\n\
         [log]\ndir = {log}\n\
         [effects]\nair = 1\nwater = 2\nwind = 3\nleg = 4\nsmoke = 5\nlight = 6\n\
         [api]\nlisten = [\"{}:0\"]\nopen_role = \"view\"\n{token}\n",
        host.ip()
    );
    let stations = |dialect: &'static str| {
        let addressed = SEATS.iter().zip(seats.addresses());
        addressed.map(move |(seat, address)| seat.tables(address, dialect))
    };
    match seats {
        VirtualHall::Stations(Dialect::Smc, _) => hall.extend(stations("smc")),
        VirtualHall::Stations(Dialect::Mbox, _) => hall.extend(stations("mbox")),
        VirtualHall::SilverMax(_) => hall.extend(driven(folder, SILVERMAX)),
        VirtualHall::Sixpack2(_) => hall.extend(driven(folder, SIXPACK2)),
    }
    hall
}

/// A text of JSON is one of TOML.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
