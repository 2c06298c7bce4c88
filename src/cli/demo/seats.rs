//! The hall of the demo: its seats, as virtual controllers and as a configuration.

use std::fmt::Write as _;
use std::net::SocketAddrV4;

use crate::sim::{Setup, pa};
use crate::sys::own_folder::OwnFolder;

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

impl DemoSeat {
    /// Its controller, set as a safe one is, that answers to `host`.
    pub(super) fn setup(&self, host: SocketAddrV4) -> Setup {
        let setup =
            Setup { axes: self.axes, parameters: vec![(pa::OFFSET, self.offset)], ..Setup::default() };
        setup.safe(host)
    }

    /// Its seat type and its controller, as the configuration has them.
    fn tables(&self, address: SocketAddrV4) -> String {
        let Self { name, row, axes, offset, fan_out } = self;
        let neutral = vec!["0.5"; usize::from(*axes)].join(", ");
        format!(
            "[seat.{name}]\naxes = {axes}\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\n\
             max_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n\
             neutral = [{neutral}]\n\
             [[controller]]\nname = \"{name}\"\nrow = \"{row}\"\nseat = \"{name}\"\naddress = \"{address}\"\n\
             axis_offset = {offset}\nfan_out = \"{fan_out}\"\nestop_inputs = [1]\n"
        )
    }
}

/// The configuration: these controllers answer to `host`, the API listens on a port that the system gives it and knows the
/// token of these lines, and all files are in `folder`.
pub(super) fn hall(
    rate_hz: f64,
    host: SocketAddrV4,
    controllers: &[SocketAddrV4],
    token: &str,
    folder: &OwnFolder,
) -> String {
    // A text of JSON is one of TOML.
    let path = |name: &str| serde_json::Value::from(folder.path(name).to_string_lossy()).to_string();
    let (cues, log) = (path("cues"), path("log"));
    let mut hall = format!(
        "[show]\nname = \"demo\"\nrate_hz = {rate_hz:?}\nbind = \"{host}\"\nlibrary = {cues}\n\
         [log]\ndir = {log}\n\
         [effects]\nair = 1\nwater = 2\nwind = 3\nleg = 4\nsmoke = 5\nlight = 6\n\
         [api]\nlisten = [\"{}:0\"]\nopen_role = \"view\"\n{token}\n",
        host.ip()
    );
    for (seat, address) in SEATS.iter().zip(controllers) {
        write!(hall, "{}", seat.tables(*address)).expect("a String takes what is written to it");
    }
    hall
}
