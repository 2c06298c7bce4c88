//! Datagrams as the manuals lay them out (chapter 2.2.2), read and written octet by octet.

/// A frame of motion, absolute or relative.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) absolute: bool,
    pub(crate) number: u32,
    pub(crate) time_ms: u32,
    pub(crate) axes: usize,
    pub(crate) positions: [i32; 12],
    /// Port Out, and whether it asks any axis to vibrate.
    pub(crate) outputs: u16,
    pub(crate) shakes: bool,
    /// Period, eighths of a millisecond, and amplitude, pulses, of the vibration of its axes.
    pub(crate) shake: [(u16, u16); 6],
}

/// What a controller receives.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Heard {
    Motion(Frame),
    Read { channel: u16, start: u16, num: u16 },
    Write { channel: u16, start: u16, value: u16 },
    Else,
}

pub(crate) fn u16_at(octets: &[u8], at: usize) -> u16 {
    octets.get(at..at + 2).map_or(0, |two| u16::from_be_bytes([two[0], two[1]]))
}

fn u32_at(octets: &[u8], at: usize) -> u32 {
    octets.get(at..at + 4).map_or(0, |four| u32::from_be_bytes([four[0], four[1], four[2], four[3]]))
}

/// Whether it is for all of a network rather than for one or for whoever gets it.
pub(crate) fn is_to_all(octets: &[u8]) -> bool {
    let accept = u16_at(octets, 8);
    accept != 0xffff && accept & 0xff == 0xff
}

/// Whether the sender wants an answer.
pub(crate) fn wants_reply(octets: &[u8]) -> bool {
    u16_at(octets, 10) != 0
}

pub(crate) fn hear(octets: &[u8]) -> Heard {
    if octets.len() < 16 || u16_at(octets, 0) != 0x55aa {
        return Heard::Else;
    }
    let (function, channel) = (u16_at(octets, 4), u16_at(octets, 6));
    match function {
        0x1301 | 0x1401 | 0x1801 | 0x1901 => motion(octets, function, channel),
        0x1101 => Heard::Read { channel, start: u16_at(octets, 12), num: u16_at(octets, 14) },
        0x1201 => Heard::Write { channel, start: u16_at(octets, 12), value: u16_at(octets, 16) },
        _ => Heard::Else,
    }
}

/// Whether it is a frame of motion whose Time is longer than that.
pub(crate) fn takes_longer(octets: &[u8], ms: u32) -> bool {
    matches!(hear(octets), Heard::Motion(frame) if frame.time_ms > ms)
}

fn motion(octets: &[u8], function: u16, channel: u16) -> Heard {
    let vibrating = function >= 0x1801;
    let axes = match channel {
        0 => 3,
        1 => 6,
        2 => octets.len().saturating_sub(26) / 4,
        n => usize::from(n),
    };
    let needed = if vibrating { 22 + 8 * axes } else { 26 + 4 * axes };
    if axes > 12 || octets.len() < needed {
        return Heard::Else;
    }
    let mut positions = [0; 12];
    for (axis, position) in positions.iter_mut().enumerate().take(axes) {
        *position = u32_at(octets, 20 + 4 * axis).cast_signed();
    }
    let absolute = matches!(function, 0x1301 | 0x1801);
    let (number, time_ms) = (u32_at(octets, 12), u32_at(octets, 16));
    let outputs = u16_at(octets, 20 + 4 * axes);
    let shakes = vibrating && octets[22 + 4 * axes..].iter().any(|octet| *octet != 0);
    let shark = 22 + 4 * axes;
    let of = |axis: usize| (u16_at(octets, shark + 4 * axis), u16_at(octets, shark + 4 * axis + 2));
    let shake = std::array::from_fn(|axis| if vibrating && axis < axes { of(axis) } else { (0, 0) });
    Heard::Motion(Frame { absolute, number, time_ms, axes, positions, outputs, shakes, shake })
}

/// The answer to a frame: the frame again, with the inputs in place of the outputs.
pub(crate) fn motion_reply(octets: &[u8], x: u8, error: u16, inputs: u16) -> Vec<u8> {
    let mut reply = octets.to_vec();
    reply[5] = x;
    reply[8..12].fill(0);
    if x > 2 {
        reply[6..8].copy_from_slice(&error.to_be_bytes());
    }
    let axes = match u16_at(octets, 6) {
        0 => 3,
        1 => 6,
        2 => octets.len().saturating_sub(26) / 4,
        n => usize::from(n),
    };
    if let Some(port) = reply.get_mut(20 + 4 * axes..22 + 4 * axes) {
        port.copy_from_slice(&inputs.to_be_bytes());
    }
    reply
}

/// The answer to a register request, which it begins with.
pub(crate) fn register_reply(octets: &[u8], x: u8, error: u16, words: &[u16]) -> Vec<u8> {
    let mut reply = octets[..16].to_vec();
    reply[5] = x;
    reply[8..12].fill(0);
    if x > 2 {
        reply[6..8].copy_from_slice(&error.to_be_bytes());
    }
    for word in words {
        reply.extend_from_slice(&word.to_be_bytes());
    }
    reply
}

/// A status report, 0x3101.
pub(crate) fn report(id: u16, positions: &[i32], inputs: u16) -> Vec<u8> {
    let mut report = vec![0x33, 0xcc, 0, 0, 0x31, 0x01];
    report.extend_from_slice(&id.to_be_bytes());
    report.extend_from_slice(&(positions.len() as u16).to_be_bytes());
    for position in positions {
        report.extend_from_slice(&position.to_be_bytes());
    }
    report.resize(report.len() + 4 * positions.len(), 0);
    for word in [0, 0, inputs] {
        report.extend_from_slice(&u16::to_be_bytes(word));
    }
    report
}

/// Where an answer to a read has axes, from 0, and their places, pulses; none where it is no answer about positions.
pub(crate) fn told_places(octets: &[u8], high_first: bool) -> Option<Vec<(usize, i32)>> {
    const POSITIONS: [u16; 6] = [0x06, 0x08, 0x0a, 0x21, 0x23, 0x25];
    let is_answer = octets.len() >= 16 && octets[4] == 0x11 && u16_at(octets, 6) == 0;
    let first = POSITIONS.iter().position(|start| *start == u16_at(octets, 12)).filter(|_| is_answer)?;
    let place = |index: usize| {
        let [one, other] = [0, 2].map(|at| u32::from(u16_at(octets, 16 + 4 * index + at)));
        let bits = if high_first { one << 16 | other } else { other << 16 | one };
        (first + index, bits.cast_signed())
    };
    Some((0..usize::from(u16_at(octets, 14)) / 2).map(place).collect())
}

/// The same of a status report.
pub(crate) fn report_places(octets: &[u8]) -> Option<Vec<(usize, i32)>> {
    let is_report = octets.len() > 10 && u16_at(octets, 0) == 0x33cc && octets[4] == 0x31;
    let place = |axis: usize| (axis, u32_at(octets, 10 + 4 * axis).cast_signed());
    is_report.then(|| (0..usize::from(u16_at(octets, 8))).map(place).collect())
}
