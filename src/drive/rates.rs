//! How often a link of drives can tell each of its axes something new: octets, bits and delays into a period. The share of the
//! line that polls take is left free. Pure; any thread.

use std::fmt;
use std::path::Path;
use std::time::Duration;

use crate::config::drive::DriveFamily;
use crate::config::link::{Link, LinkWiring};
use crate::config::{Config, Controller};
use crate::drive::LOOP;
use crate::time::nanos;

/// Octets of a SilverMax segment and its ack, as most are.
pub(crate) const USUAL_EXCHANGE: u32 = 45;
/// From the last bit of a request to the first of its answer, the delay that the drive is set to apart: at a UART of the machine,
/// and by a USB adapter whose latency timer is 1.
const UART_TURN: Duration = Duration::from_micros(300);
const USB_TURN: Duration = Duration::from_micros(2_000);
/// How long a SilverMax on two wires waits before it answers: ADL 15, in ticks of 120 µs.
const RS485_DELAY: Duration = Duration::from_micros(1_800);
/// How long a SIXpack 2 waits before it answers, unless it is told otherwise (CMD $40).
const SIXPACK2_DELAY: Duration = Duration::from_micros(6_000);
/// Octets of a message of a SIXpack 2, and targets to a query, which is answered by as many octets.
const SIXPACK2_OCTETS: u32 = 9;
const TARGETS_A_QUERY: u32 = 10;
/// The part of a line that motion may take; polls take the rest, over USB a quarter.
const SHARE: f64 = 0.80;
const USB_SHARE: f64 = 0.75;

/// Baud rates that are worth changing to.
const SILVERMAX_BAUDS: [u32; 3] = [57_600, 115_200, 230_400];
const SIXPACK2_BAUDS: [u32; 4] = [56_818, 113_636, 125_000, 250_000];

/// What a link has to carry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinkLoad {
    /// What its drives are.
    pub(crate) family: DriveFamily,
    /// How it is wired.
    pub(crate) wiring: LinkWiring,
    /// Bits a second.
    pub(crate) baud: u32,
    /// As [`Link::octet_bits`].
    pub(crate) octet_bits: u32,
    /// Axes that it moves, at least one.
    pub(crate) axes: u32,
    /// Those of its largest seat, none of which two lines may share.
    pub(crate) seat_axes: u32,
    /// Its seats, at least one.
    pub(crate) seats: u32,
    /// Octets of a SilverMax segment and its ack.
    pub(crate) exchange_octets: u32,
    /// From the end of a request to the beginning of its answer.
    pub(crate) answer_delay: Duration,
    /// The part of the line that motion may take, 0 to 1.
    pub(crate) share: f64,
}

impl LinkLoad {
    /// What a link of a hall carries, with delays as its kind of port has them; `None` if no axis is on it. Disabled seats count:
    /// they may be put in again.
    #[must_use]
    pub(crate) fn of(link: &Link, config: &Config) -> Option<Self> {
        let is_on_it = |one: &&Controller| one.drives().is_some_and(|drives| drives.link == link.name);
        let on_it = config.named().filter(is_on_it);
        let each: Vec<u32> = on_it.map(|one| u32::try_from(one.seat.axes).unwrap_or(u32::MAX)).collect();
        let axes = each.iter().sum();
        let family = link.family.filter(|_| axes > 0)?;
        let is_usb = is_usb(&link.port);
        let delay = match (family, link.wiring) {
            (DriveFamily::SilverMax, LinkWiring::Rs485) => RS485_DELAY,
            // On a bus there is no transmitter to wait for.
            (DriveFamily::SilverMax, _) | (_, LinkWiring::Can) => Duration::ZERO,
            (DriveFamily::Sixpack2, _) => SIXPACK2_DELAY,
        };
        Some(Self {
            family,
            wiring: link.wiring,
            baud: link.baud,
            octet_bits: link.octet_bits(),
            axes,
            seat_axes: each.iter().copied().max().unwrap_or(axes),
            seats: u32::try_from(each.len()).unwrap_or(u32::MAX),
            exchange_octets: USUAL_EXCHANGE,
            answer_delay: delay + if is_usb { USB_TURN } else { UART_TURN },
            share: if is_usb && family == DriveFamily::SilverMax { USB_SHARE } else { SHARE },
        })
    }

    /// The shortest period that fits, in whole microseconds: in each of them all axes are told something once.
    #[must_use]
    pub(crate) fn period(&self) -> Duration {
        let bit = 1.0 / f64::from(self.baud.max(1));
        let targets = f64::from(TARGETS_A_QUERY);
        let octets = |count: u32| f64::from(count * self.octet_bits) * bit;
        let delay = self.answer_delay.as_secs_f64();
        let an_axis = match self.family {
            DriveFamily::SilverMax => octets(self.exchange_octets) + delay,
            // Targets, and now and then a query and its answer.
            DriveFamily::Sixpack2 => (octets(SIXPACK2_OCTETS * (TARGETS_A_QUERY + 2)) + delay) / targets,
        };
        self.on_ticks(f64::from(self.axes) * an_axis / self.share)
    }

    /// So long or a little longer: whole microseconds, on a bus the ticks of its drives.
    fn on_ticks(&self, seconds: f64) -> Duration {
        let micros = whole_micros(seconds);
        Duration::from_micros(match self.wiring {
            // What comes between two rounds of the drive's loop is of no use.
            LinkWiring::Can => micros.next_multiple_of(nanos(LOOP) / 1_000),
            LinkWiring::Rs232 | LinkWiring::Rs485 => micros,
        })
    }

    /// Times a second at the most.
    #[must_use]
    pub(crate) fn rate_hz(&self) -> f64 {
        1.0 / self.period().as_secs_f64()
    }

    /// The period of a link that is to play at `wanted` times a second, or as often as it can.
    ///
    /// # Errors
    /// [`TooSlow`] where so much does not fit.
    pub(crate) fn period_for(&self, wanted: Option<f64>) -> Result<Duration, TooSlow> {
        let Some(wanted_hz) = wanted else { return Ok(self.period()) };
        let period = self.on_ticks(1.0 / wanted_hz);
        if period >= self.period() { Ok(period) } else { Err(TooSlow { load: *self, wanted_hz }) }
    }

    /// What would make it faster: times a second, and the words of it, the slowest first.
    #[must_use]
    pub(crate) fn changes(&self) -> Vec<(f64, String)> {
        let bauds = self.bauds().iter().copied().filter(|baud| *baud > self.baud);
        let bauds: Vec<u32> = std::iter::once(self.baud).chain(bauds).collect();
        let mut changes = Vec::new();
        for links in 1..=self.seats {
            for &baud in &bauds {
                let apart = (links > 1).then(|| format!("{links} links"));
                let quicker = (baud > self.baud).then(|| format!("baud = {baud}"));
                let words: Vec<_> = quicker.into_iter().chain(apart).collect();
                let words =
                    if words.is_empty() { "rate_hz = \"auto\"".to_owned() } else { words.join(" and ") };
                changes.push((Self { baud, ..self.shared_by(links) }.rate_hz(), words));
            }
        }
        changes.sort_by(|one, other| one.0.total_cmp(&other.0));
        changes
    }

    /// What the fullest of so many links carries, where its seats are shared out over them.
    fn shared_by(&self, links: u32) -> Self {
        let seats = self.seats.div_ceil(links);
        Self { axes: self.axes.min(seats * self.seat_axes), seats, ..*self }
    }

    /// Baud rates that are worth changing to.
    const fn bauds(&self) -> &'static [u32] {
        match (self.family, self.wiring) {
            (_, LinkWiring::Can) => &[],
            (DriveFamily::SilverMax, _) => &SILVERMAX_BAUDS,
            (DriveFamily::Sixpack2, _) => &SIXPACK2_BAUDS,
        }
    }

    /// What to do for so many times a second, each with the number that fits.
    #[must_use]
    pub(crate) fn remedy(&self, wanted_hz: f64) -> String {
        let none = || format!("no link carries so much; at the most {} Hz fit here", short(self.rate_hz()));
        self.carries(wanted_hz).unwrap_or_else(none)
    }

    /// What carries so many, if anything does.
    pub(crate) fn carries(&self, wanted_hz: f64) -> Option<String> {
        let fits = |load: &Self| load.rate_hz() >= wanted_hz;
        let baud = self.bauds().iter().copied().filter(|baud| *baud > self.baud);
        let baud = baud.into_iter().find(|baud| fits(&Self { baud: *baud, ..*self }));
        let links = (2..=self.seats).find(|links| fits(&self.shared_by(*links)));
        match (baud, links) {
            (Some(baud), Some(links)) => Some(format!("use baud = {baud}, or {links} links")),
            (Some(baud), None) => Some(format!("use baud = {baud}")),
            (None, Some(links)) => Some(format!("use {links} links")),
            (None, None) => None,
        }
    }
}

/// A link that is to play more often than it can.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TooSlow {
    load: LinkLoad,
    wanted_hz: f64,
}

impl fmt::Display for TooSlow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { load, wanted_hz } = self;
        let (most, remedy) = (short(load.rate_hz()), load.remedy(*wanted_hz));
        let noun = if load.axes == 1 { "axis plays" } else { "axes play" };
        write!(f, "{} {noun} at {most} Hz at {} baud, not at {wanted_hz}; {remedy}", load.axes, load.baud)
    }
}

/// Rounded down to hundredths, whole from 100 on: what is told can also be asked for.
pub(crate) fn short(hz: f64) -> String {
    let steps = if hz < 100.0 { 100.0 } else { 1.0 };
    // A whole number may come out a hair below itself.
    format!("{}", (hz * steps + 1e-6).floor() / steps)
}

/// True if the port is a USB adapter, by its name.
pub(super) fn is_usb(port: &Path) -> bool {
    let name = port.to_string_lossy();
    ["ttyUSB", "ttyACM", "/usb-"].iter().any(|mark| name.contains(mark))
}

/// Not less, and at least one.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within range after the clamp")]
fn whole_micros(seconds: f64) -> u64 {
    // A sum of fractions may lie a hair above the whole number that it is.
    (seconds * 1e6 - 1e-6).ceil().clamp(1.0, 1e12) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Octets of a segment and its ack where all numbers are the longest there are.
    const LONGEST_EXCHANGE: u32 = 52;

    fn silver(baud: u32, delay: Duration, axes: u32) -> LinkLoad {
        LinkLoad {
            family: DriveFamily::SilverMax,
            wiring: LinkWiring::Rs232,
            baud,
            octet_bits: 11,
            axes,
            seat_axes: 1,
            seats: axes,
            exchange_octets: USUAL_EXCHANGE,
            answer_delay: delay,
            share: SHARE,
        }
    }

    fn six(baud: u32, delay: Duration, axes: u32) -> LinkLoad {
        LinkLoad {
            family: DriveFamily::Sixpack2,
            octet_bits: 10,
            answer_delay: delay + UART_TURN,
            ..silver(baud, delay, axes)
        }
    }

    /// Holds rates for 1, 3 and 6 axes against those expected, to the nearest hertz.
    fn assert_rates(loads: [LinkLoad; 3], expected: [f64; 3]) {
        assert_eq!(loads.map(|load| load.rate_hz().round()), expected, "{:?}", loads[0]);
    }

    #[test]
    fn silvermax_rates_are_those_of_the_table() {
        for (baud, delay, expected) in [
            (57_600, UART_TURN, [90.0, 30.0, 15.0]),
            (57_600, UART_TURN + RS485_DELAY, [75.0, 25.0, 12.0]),
            (115_200, UART_TURN, [174.0, 58.0, 29.0]),
            (230_400, UART_TURN, [327.0, 109.0, 54.0]),
        ] {
            assert_rates([1, 3, 6].map(|axes| silver(baud, delay, axes)), expected);
        }
    }

    #[test]
    fn polling_over_usb_takes_a_quarter_of_a_silvermax_link() {
        for (baud, expected) in
            [(57_600, [71.0, 24.0, 12.0]), (115_200, [119.0, 40.0, 20.0]), (230_400, [181.0, 60.0, 30.0])]
        {
            let loads = [1, 3, 6].map(|axes| LinkLoad { share: USB_SHARE, ..silver(baud, USB_TURN, axes) });
            assert_rates(loads, expected);
        }
    }

    #[test]
    fn sixpack_rates_are_four_fifths_of_what_fills_the_line() {
        // The rates that fill the line, for three axes and for six.
        for (baud, delay_ms, whole) in [
            (19_231, 6, [53.0, 27.0]),
            (56_818, 6, [132.0, 66.0]),
            (56_818, 2, [156.0, 78.0]),
            (113_636, 6, [211.0, 105.0]),
            (113_636, 2, [282.0, 141.0]),
        ] {
            for (axes, whole) in [3, 6].into_iter().zip(whole) {
                let load = six(baud, Duration::from_millis(delay_ms), axes);
                let full = LinkLoad { share: 1.0, ..load };
                assert!((full.rate_hz() - whole).abs() < 0.6, "{full:?}: {}", full.rate_hz());
                assert!((load.rate_hz() / full.rate_hz() - 0.8).abs() < 0.001);
            }
        }
    }

    #[test]
    fn a_bus_plays_on_the_ticks_of_its_drives() {
        let wiring = LinkWiring::Can;
        let bus = |axes| LinkLoad { wiring, octet_bits: 15, ..six(500_000, Duration::ZERO, axes) };
        assert_eq!([3, 6].map(|axes| bus(axes).rate_hz()), [500.0, 250.0]);
        assert_eq!(bus(3).period_for(Some(300.0)), Ok(Duration::from_millis(4)));
    }

    #[test]
    fn a_period_is_whole_microseconds_and_never_shorter_than_what_fits() {
        let load = silver(57_600, UART_TURN, 3);
        assert_eq!(load.period(), Duration::from_micros(33_352));
        assert_eq!(load.period_for(None), Ok(load.period()));
        assert_eq!(load.period_for(Some(25.0)), Ok(Duration::from_millis(40)));
        let longest = LinkLoad { exchange_octets: LONGEST_EXCHANGE, ..load };
        assert!((26.0..27.0).contains(&longest.rate_hz()));
        let slow = load.period_for(Some(31.0)).unwrap_err().to_string();
        assert_eq!(slow, "3 axes play at 29.98 Hz at 57600 baud, not at 31; use baud = 115200, or 2 links");
    }

    #[test]
    fn the_remedy_names_what_would_fit() {
        let load = silver(57_600, UART_TURN, 6);
        assert_eq!(load.remedy(25.0), "use baud = 115200, or 2 links");
        assert_eq!(load.remedy(50.0), "use baud = 230400, or 6 links");
        assert_eq!(load.remedy(80.0), "use 6 links");
        assert_eq!(load.remedy(400.0), "no link carries so much; at the most 14.99 Hz fit here");
        let fastest = silver(230_400, UART_TURN, 1);
        assert_eq!(fastest.remedy(400.0), "no link carries so much; at the most 326 Hz fit here");
        for hz in [10.0, 25.0, 50.0] {
            let remedied = LinkLoad { baud: 230_400, ..load };
            assert!(remedied.period_for(Some(hz)).is_ok(), "{hz}");
        }
    }

    #[test]
    fn no_remedy_shares_a_seat_between_two_links() {
        let seats = |axes: u32| LinkLoad { seat_axes: axes, seats: 6 / axes, ..silver(57_600, UART_TURN, 6) };
        assert_eq!(seats(3).remedy(25.0), "use baud = 115200, or 2 links");
        assert_eq!(seats(3).remedy(50.0), "use baud = 230400");
        assert_eq!(seats(6).remedy(25.0), "use baud = 115200");
        assert_eq!(seats(3).remedy(80.0), "no link carries so much; at the most 14.99 Hz fit here");
        // Two seats of two axes and one of one: one line has two of them.
        let uneven = LinkLoad { seat_axes: 2, seats: 3, ..silver(57_600, UART_TURN, 5) };
        assert_eq!(uneven.remedy(25.0), "use baud = 115200, or 3 links");
        assert_eq!(uneven.remedy(20.0), "use baud = 115200, or 2 links");
    }

    #[test]
    fn the_rate_that_is_told_can_be_asked_for() {
        for load in
            [silver(57_600, UART_TURN, 3), silver(57_600, USB_TURN, 5), six(113_636, SIXPACK2_DELAY, 3)]
        {
            let told: f64 = short(load.rate_hz()).parse().unwrap();
            assert!(load.period_for(Some(told)).is_ok(), "{told}");
            assert!(load.rate_hz() - told < 1.0, "{told}");
        }
        assert_eq!([25.0, 500.0, 29.999].map(short), ["25", "500", "29.99"]);
    }

    #[test]
    fn a_port_is_a_usb_adapter_by_its_name() {
        for port in ["/dev/ttyUSB0", "/dev/ttyACM1", "/dev/serial/by-id/usb-FTDI_FT232R-if00-port0"] {
            assert!(is_usb(Path::new(port)), "{port}");
        }
        assert!(!is_usb(Path::new("/dev/ttyS0")));
    }
}
