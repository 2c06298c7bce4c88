//! How the links of a hall play: on which grid, and how far ahead; and that in words.

use std::time::Duration;

use super::link::{Family as _, Lead, StreamTerms};
use super::rates::{LinkLoad, is_usb, short};
use super::silvermax::SilverMax;
use super::sixpack2::{OrderGap, Reach, Sixpack2};
use crate::config::drive::DriveFamily;
use crate::config::drive::sixpack2::Sixpack2Drive;
use crate::config::link::LinkWiring;
use crate::config::{Config, Controller, Link};
use crate::motion::{AxisGeometry, MAX_LEAD, SeatType};
use crate::plain;
use crate::time::Rate;
use crate::wire::sixpack2::{WAKING_DIVISOR, baud_of};

/// Below this a hard ride is half a millimetre beside its cue.
const LEAST_HZ: f64 = 15.0;

impl StreamTerms {
    /// Those of a link of a hall that has seats on it; none where it has none.
    ///
    /// # Errors
    /// Why it cannot play, with what would.
    pub(crate) fn of(link: &Link, config: &Config) -> Result<Option<Self>, String> {
        let Some(load) = LinkLoad::of(link, config) else { return Ok(None) };
        let fault = |why: String| format!("[link.{}]: {why}", link.name);
        let period = load.period_for(link.rate_hz).map_err(|slow| fault(slow.to_string()))?;
        let terms = Self { period, tick: Rate::from_hz(config.show.rate_hz).period() };
        let (lead, most) = (terms.lead(load.family), MAX_LEAD);
        if lead > most {
            let Lead { periods, ticks } = Lead::of(load.family);
            let least_hz = f64::from(periods) / most.saturating_sub(ticks * terms.tick).as_secs_f64();
            let (lead, most, remedy) = (lead.as_millis(), most.as_millis(), quicker(&load, least_hz));
            return Err(fault(format!("its seats would follow {lead} ms ahead, over {most} ms; {remedy}")));
        }
        Ok(Some(terms))
    }

    /// How long before a seat is there its poses have to come.
    pub(crate) fn lead(self, family: DriveFamily) -> Duration {
        Lead::of(family).over(self)
    }
}

/// What to do for so many times a second: where the link carries them, it is `rate_hz` that keeps it from them.
fn quicker(load: &LinkLoad, least_hz: f64) -> String {
    let whole = least_hz.ceil();
    match load.rate_hz() {
        most if most >= whole => format!("raise rate_hz to {whole} or more, or omit it"),
        most if most >= least_hz => "omit rate_hz".to_owned(),
        _ => load.remedy(least_hz),
    }
}

impl Lead {
    const fn of(family: DriveFamily) -> Self {
        match family {
            DriveFamily::SilverMax => SilverMax::LEAD,
            DriveFamily::Sixpack2 => Sixpack2::LEAD,
        }
    }
}

/// What the links of a hall play at, in words, and which of them cannot play so: they are to play more often than they can, or
/// would lead their seats too far ahead.
#[must_use]
pub(crate) fn in_words(config: &Config) -> (Vec<String>, Vec<String>) {
    let (mut told, mut faults) = (Vec::new(), Vec::new());
    told.extend(alike(config));
    for link in &config.links {
        told.extend(other_baud(link));
        told.extend(changing_name(link));
        let Some(load) = LinkLoad::of(link, config) else {
            told.push(format!("link {} has no controller", link.name));
            continue;
        };
        match (load.period_for(link.rate_hz), StreamTerms::of(link, config)) {
            (Err(slow), _) => faults.push(format!("rate_hz of [link.{}]: {slow}", link.name)),
            (_, Err(why)) => faults.push(why),
            (Ok(period), Ok(_)) => {
                told.push(plays_at(link, &load, period));
                told.extend(damaged(link, config, &load, period));
            }
        }
    }
    (told, faults)
}

/// Seats of several links whose drives have the same numbers.
fn alike(config: &Config) -> Option<String> {
    let has_twin = |one: &&Controller| one.drives().is_some_and(|drives| !drives.twins.is_empty());
    let names: Vec<_> = config.named().filter(has_twin).map(|one| one.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} have units of the same numbers: if their adapters or plugs change places while the units are off, homing takes one seat for \
             another; give each unit of the hall a number of its own",
            names.join(", ")
        )
    })
}

/// A port whose name is given out anew at each start.
fn changing_name(Link { name, port, .. }: &Link) -> Option<String> {
    let file = port.file_name()?.to_str()?;
    ["ttyUSB", "ttyACM"].iter().any(|mark| file.starts_with(mark)).then(|| {
        format!(
            "link {name}: {} may be the adapter of another line after the next start; use its link in /dev/serial/by-id",
            plain::path(port)
        )
    })
}

/// What became of the baud rate that the file asks for, where that is another.
fn other_baud(Link { name, baud, asked_baud, .. }: &Link) -> Option<String> {
    (baud != asked_baud).then(|| format!("link {name} runs at {baud} baud, the nearest rate to {asked_baud}"))
}

/// How far an order that is damaged on its way leads a motor of a SIXpack 2, where its answers are as slow as they may be. Frames on a bus have a
/// checksum.
fn damaged(link: &Link, config: &Config, load: &LinkLoad, period: Duration) -> Option<String> {
    if load.wiring == LinkWiring::Can {
        return None;
    }
    let octet = |baud: u32| Duration::from_secs(1) * load.octet_bits / baud.max(1);
    let gap = |asked: u32| {
        let (octets, delay) = ([load.baud, asked].map(octet), OrderGap::LONGEST_DELAY);
        OrderGap { period, octets, motors: load.axes, delay }.longest()
    };
    // A unit that is lost may have been restarted: it is looked for as it wakes, too.
    let gaps = [load.baud, baud_of(WAKING_DIVISOR)?].map(gap);
    let on_it = |one: &&Controller| one.drives().is_some_and(|drives| drives.link == link.name);
    let seats: Vec<_> = config.named().filter(on_it).filter_map(six_of).collect();
    let reach = |(six, seat): &(&Sixpack2Drive, &SeatType)| {
        let of_axis = |axis: &AxisGeometry| {
            let reach = Reach::of(axis, six.clock_divider);
            (reach.led_mm(gaps[0], axis.max_velocity), reach.stopped_mm(gaps[1]))
        };
        seat.own().iter().map(of_axis).collect::<Vec<_>>()
    };
    let reaches = seats.iter().flat_map(reach);
    let (led, stopped) = reaches.max_by(|one, other| one.1.total_cmp(&other.1))?;
    let mut words = format!(
        "link {}: an order that is damaged on its way leads a motor up to {led:.0} mm beside its way, or {stopped:.0} mm where nothing \
         leads its seat, before the next one ends it",
        link.name
    );
    let slower = |(six, seat): &(&Sixpack2Drive, &SeatType)| {
        let divider = six.slower_clock(seat)?;
        Some(format!("; clock_divider = {divider} is enough for {}, and makes it less", seat.name))
    };
    words.extend(seats.iter().find_map(slower));
    Some(words)
}

fn six_of(one: &Controller) -> Option<(&Sixpack2Drive, &SeatType)> {
    Some((one.drives()?.drive.sixpack2.as_ref()?, &one.seat))
}

fn plays_at(link: &Link, load: &LinkLoad, period: Duration) -> String {
    let hz = 1.0 / period.as_secs_f64();
    let noun = if load.axes == 1 { "axis" } else { "axes" };
    let mut words = format!("plays at {} Hz on link {}, {} {noun}", short(hz), link.name, load.axes);
    if is_usb(&link.port) {
        words += ", by a USB adapter whose latency timer is 1 ms";
    }
    if hz < LEAST_HZ {
        words += &format!("; that is rough, for {LEAST_HZ} Hz {}", load.remedy(LEAST_HZ));
    }
    words
}
