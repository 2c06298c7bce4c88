//! What health and observer are told beside frames and datagrams, as octets of a record: kind, controller, and what it says.

use super::ack_words::{FALLS, of, place};
use super::cursor::Cursor;
use crate::health::HealthInput::{
    self, Alive, Ambiguous, Answered, BeatKept, BeatSent, Count, Counted, FellOut, Homed, Joined, Killed,
    LookAnew, LostZero, Moved, OtherAxes, OtherSent, Outside, Part, Pushed, ReadSent, Refused, Seen, Wide,
    Zero,
};
use crate::health::{self, Continuity, Identity, Sighting};
use crate::motion::Pulses;
use crate::observe::{Look, StopSign};

const SIGNS: [StopSign; 4] = [StopSign::Unsure, StopSign::Asked, StopSign::Held, StopSign::Over];
/// What stands for an axis where there is none.
const NONE: u8 = u8::MAX;

pub(super) fn write_input(out: &mut Vec<u8>, input: HealthInput) {
    let mut put = |kind: u8, controller: usize, octets: &[u8]| {
        of(out, kind, controller);
        out.extend_from_slice(octets);
    };
    match input {
        Part(controller, takes_part) => put(32, controller, &[takes_part.into()]),
        Refused(controller) => put(33, controller, &[]),
        Alive(controller, at) => put(34, controller, &at.as_nanos().to_le_bytes()),
        Answered(controller, at) => put(35, controller, &at.as_nanos().to_le_bytes()),
        ReadSent(controller, datagrams) => put(36, controller, &datagrams.to_le_bytes()),
        OtherSent(controller, datagrams) => put(37, controller, &datagrams.to_le_bytes()),
        BeatSent(controller, at) => put(38, controller, &at.as_nanos().to_le_bytes()),
        Zero(controller, homed) => put(39, controller, &[homed.into()]),
        Killed(controller, axis, cause) => {
            let [low, high] = cause.to_le_bytes();
            put(40, controller, &[octet(axis), low, high]);
        }
        LostZero(controller) => put(41, controller, &[]),
        Wide(controller) => put(42, controller, &[]),
        Seen(controller, sighting, at) => {
            put(43, controller, &of_sighting(&sighting));
            out.extend_from_slice(&at.as_nanos().to_le_bytes());
        }
        OtherAxes(controller, drives) => put(44, controller, &drives.to_le_bytes()),
        Count(controller, packets) => put(45, controller, &packets.to_le_bytes()),
        Moved(controller) => put(46, controller, &[]),
        FellOut(controller, why) => put(47, controller, &[place(&FALLS, &why)]),
        Outside(controller, outside) => {
            let (axis, pulses) = outside.map_or((NONE, Pulses(0)), |(axis, pulses)| (octet(axis), pulses));
            put(48, controller, &[axis]);
            out.extend_from_slice(&pulses.0.to_le_bytes());
        }
        Ambiguous(controller, ambiguous) => put(49, controller, &[ambiguous.into()]),
        Homed(controller) => put(50, controller, &[]),
        Joined(group) => put(51, group, &[]),
        LookAnew(group) => put(52, group, &[]),
        Pushed(controller, pushed) => {
            put(53, controller, &[pushed.map_or(NONE, |pushed| octet(pushed.axis))]);
            let places = pushed.map_or([0; 2], |pushed| [pushed.at, pushed.held]);
            places.iter().for_each(|place| out.extend_from_slice(&place.to_le_bytes()));
        }
        Counted(controller) => put(55, controller, &[]),
        BeatKept(controller, at) => put(54, controller, &at.as_nanos().to_le_bytes()),
    }
}

pub(super) fn read_input(kind: u8, of: usize, from: &mut Cursor<'_>) -> Option<HealthInput> {
    Some(match kind {
        32 => Part(of, from.u8()? != 0),
        33 => Refused(of),
        34 => Alive(of, from.time()?),
        35 => Answered(of, from.time()?),
        36 => ReadSent(of, from.u32()?),
        37 => OtherSent(of, from.u32()?),
        38 => BeatSent(of, from.time()?),
        39 => Zero(of, from.u8()? != 0),
        40 => Killed(of, from.u8()?.into(), from.u16()?),
        41 => LostZero(of),
        42 => Wide(of),
        43 => Seen(of, sighting(from)?, from.time()?),
        44 => OtherAxes(of, from.u16()?),
        45 => Count(of, from.u16()?),
        46 => Moved(of),
        47 => FellOut(of, *FALLS.get(usize::from(from.u8()?))?),
        48 => {
            let (axis, pulses) = (from.u8()?, Pulses(i32::from_le_bytes(from.take()?)));
            Outside(of, (axis != NONE).then_some((axis.into(), pulses)))
        }
        49 => Ambiguous(of, from.u8()? != 0),
        50 => Homed(of),
        51 => Joined(of),
        52 => LookAnew(of),
        53 => {
            let (axis, mut place) = (from.u8()?, || Some(i32::from_le_bytes(from.take()?)));
            let (at, held) = (place()?, place()?);
            Pushed(of, (axis != NONE).then_some(health::Pushed { axis: axis.into(), at, held }))
        }
        54 => BeatKept(of, from.time()?),
        55 => Counted(of),
        _ => return None,
    })
}

fn octet(axis: usize) -> u8 {
    u8::try_from(axis).unwrap_or(NONE)
}

fn of_sighting(sighting: &Sighting) -> [u8; 16] {
    let Sighting { identity, error, alarm, continuity, homed } = *sighting;
    let Identity { version, minor_version, work_mode, axes } = identity;
    let (kind, packets) = match continuity {
        Continuity::Packets(packets) => (0, packets),
        Continuity::Answers => (1, 0),
        Continuity::Mark => (2, 0),
    };
    let mut octets = [0; 16];
    let words = [version, minor_version, work_mode, axes, error, alarm, packets];
    let (cells, _) = octets.as_chunks_mut::<2>();
    cells.iter_mut().zip(words).for_each(|(cell, word)| *cell = word.to_le_bytes());
    (octets[14], octets[15]) = (kind, homed.into());
    octets
}

fn sighting(from: &mut Cursor<'_>) -> Option<Sighting> {
    let [version, minor_version, work_mode, axes] = [from.u16()?, from.u16()?, from.u16()?, from.u16()?];
    let [error, alarm, packets] = [from.u16()?, from.u16()?, from.u16()?];
    let continuity = match from.u8()? {
        0 => Continuity::Packets(packets),
        1 => Continuity::Answers,
        2 => Continuity::Mark,
        _ => return None,
    };
    let identity = Identity { version, minor_version, work_mode, axes };
    Some(Sighting { identity, error, alarm, continuity, homed: from.u8()? != 0 })
}

pub(super) fn write_look(out: &mut Vec<u8>, look: Look) {
    out.push(place(&SIGNS, &look.stop));
    out.push(look.inputs.is_some().into());
    out.extend_from_slice(&look.inputs.unwrap_or_default().to_le_bytes());
}

pub(super) fn read_look(from: &mut Cursor<'_>) -> Option<Look> {
    let stop = *SIGNS.get(usize::from(from.u8()?))?;
    let (is_told, inputs) = (from.u8()? != 0, from.u16()?);
    Some(Look { stop, inputs: is_told.then_some(inputs) })
}
