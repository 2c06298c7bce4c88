//! How often segments really go to each axis, over lines whose answers take as long as those of the table in docs/drives.md.

use std::time::Duration;

use super::super::*;
use super::bench::*;
use crate::config::drive::DriveFamily;
use crate::config::link::LinkWiring;
use crate::drive::link::{LinkPlay as _, TalkTerms};
use crate::drive::rates::{LinkLoad, USUAL_EXCHANGE};
use crate::motion::SeatType;
use crate::sim::serial::{LineFaults, SerialLine};
use crate::sim::silvermax::{SilverBus, UnitSetup};
use crate::time::MonoTime;

/// What answers take to begin at a serial port of the machine, there on two wires with a reply delay of 15, and over USB; ticks of a unit,
/// of 120 µs, that are as long or longer; and the part of the line that motion may take.
const TURNS: [(u64, u16, f64); 3] = [(300, 3, 0.80), (2_100, 18, 0.80), (2_000, 17, 0.75)];

/// What a link of so many units can carry.
fn load(baud: u32, (delay_us, _, share): (u64, u16, f64), axes: u32) -> LinkLoad {
    LinkLoad {
        family: DriveFamily::SilverMax,
        wiring: LinkWiring::Rs232,
        baud,
        octet_bits: 11,
        axes,
        seat_axes: axes.min(3),
        seats: axes.div_ceil(3),
        exchange_octets: USUAL_EXCHANGE,
        answer_delay: Duration::from_micros(delay_us),
        share,
    }
}

/// How often each axis of a ride was told something, at the least, in each second; and at what rate it was to be.
fn reached(baud: u32, turn: (u64, u16, f64), axes: u8) -> [f64; 2] {
    let now = MonoTime::from_nanos(3_000_000_000);
    let setup = |index: u8| UnitSetup { place: 12_000, adl: turn.1, ..UnitSetup::new(16 + index) };
    let setups: Vec<_> = (0..axes).map(setup).collect();
    let line = SerialLine::new(SilverBus::new(&setups, baud, now), 11, LineFaults::default(), 7);
    let terms = TalkTerms { baud, octet_bits: 11, has_echo: false, is_two_wires: false, is_bus: false };
    let mut talk = Talk::new(VirtualPort::new(line, now), terms);
    let (drive, units) = (drive(SWITCH), (16..16 + axes).collect::<Vec<_>>());
    let (seat, silvermax) =
        (SeatType { axes: usize::from(axes.min(3)), ..seat() }, drive.silvermax.clone().unwrap());
    for units in units.chunks(3) {
        assert_eq!(home_as(&mut talk, &drive, units).0, Ok(()));
    }
    let period = load(baud, turn, axes.into()).period();
    let seats = units.chunks(3).map(|units| SeatUnits {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &drive,
        silvermax: &silvermax,
        units,
    });
    let mut play = Play::over(talk, period, &seats.collect::<Vec<_>>(), |_, _| {}).unwrap();
    play.wait(2.0);
    assert!(play.all_ready(), "{:?}", play.rare());
    play.begin(|at, axis| 0.5 * ride(at, axis));
    play.play(4.0, 0);
    let taken = |play: &Play| {
        let axes =
            (0..play.seats).flat_map(|seat| (0..3).map_while(move |axis| play.stream.axis(seat, axis)));
        axes.map(|axis| (axis.account.acked, axis.dry)).collect::<Vec<_>>()
    };
    let before = taken(&play);
    play.play(10.0, 0);
    let gained =
        taken(&play).into_iter().zip(before).map(|((acked, dry), (before, _))| (acked - before, dry));
    let least = gained.inspect(|(_, dry)| assert_eq!(*dry, 0)).map(|(acked, _)| acked).min().unwrap();
    assert!(play.rare().is_empty(), "{:?}", play.rare());
    [least as f64 / 10.0, 1.0 / period.as_secs_f64()]
}

#[expect(clippy::print_stdout, reason = "the figures are for who asks to see them")]
#[test]
fn each_axis_is_told_as_often_as_the_table_says_within_a_fiftieth() {
    for baud in [57_600, 115_200, 230_400] {
        for (index, turn) in TURNS.into_iter().enumerate() {
            for axes in [1, 3, 6] {
                let [hz, wanted] = reached(baud, turn, axes);
                println!("{baud} {index} {axes}: {hz:.1} of {wanted:.1} Hz");
                assert!((hz / wanted - 1.0).abs() < 0.02, "{baud} {index} {axes}: {hz} of {wanted} Hz");
            }
        }
    }
}
