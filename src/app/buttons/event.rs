//! What a device of the kernel's input layer says, in records of 24 octets (`struct input_event`, linux/input.h, on machines of 64
//! bits), and what lights its lamps.

use crate::time::MonoTime;

/// Octets of a record.
pub(super) const LEN: usize = 24;

/// Kinds of records (linux/input-event-codes.h).
const SYN: u16 = 0;
const KEY: u16 = 1;
const LED: u16 = 0x11;
/// The kernel had no room for what came before.
const SYN_DROPPED: u16 = 3;

/// One record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct InputEvent {
    /// When the device said it.
    pub(super) at: MonoTime,
    /// What.
    pub(super) kind: InputKind,
}

/// What a record says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum InputKind {
    /// A key went down.
    Down(u16),
    /// It came up.
    Up(u16),
    /// Records are lost: nobody knows which.
    Dropped,
    /// A key that is held, or nothing of keys.
    Other,
}

/// Reads a record.
pub(super) fn read(record: &[u8; LEN]) -> InputEvent {
    let [seconds, micros] = [0, 8].map(|from| {
        let octets: [u8; 8] = std::array::from_fn(|place| record[from + place]);
        u64::try_from(i64::from_ne_bytes(octets)).unwrap_or(0)
    });
    let [kind, code] = [16, 18].map(|from| u16::from_ne_bytes([record[from], record[from + 1]]));
    let value = i32::from_ne_bytes([record[20], record[21], record[22], record[23]]);
    let at = seconds.saturating_mul(1_000_000_000).saturating_add(micros.saturating_mul(1_000));
    let kind = match (kind, code, value) {
        (KEY, code, 1) => InputKind::Down(code),
        (KEY, code, 0) => InputKind::Up(code),
        (SYN, SYN_DROPPED, _) => InputKind::Dropped,
        _ => InputKind::Other,
    };
    InputEvent { at: MonoTime::from_nanos(at), kind }
}

/// Records that come in pieces.
#[derive(Debug, Default)]
pub(crate) struct InputRecords(Vec<u8>);

impl InputRecords {
    /// The codes of keys that went down in what was read next.
    pub(crate) fn pressed(&mut self, octets: &[u8]) -> Vec<u16> {
        let down = |event: InputEvent| match event.kind {
            InputKind::Down(code) => Some(code),
            _ => None,
        };
        self.take(octets).into_iter().filter_map(down).collect()
    }

    /// Reads what is whole of what came; the rest is kept.
    pub(super) fn take(&mut self, octets: &[u8]) -> Vec<InputEvent> {
        self.whole(octets).iter().map(read).collect()
    }

    /// What is for lamps of what came; the rest that is not whole is kept.
    pub(super) fn lamps(&mut self, octets: &[u8]) -> Vec<u8> {
        self.whole(octets).iter().filter(|one| is_for_lamps(one)).flatten().copied().collect()
    }

    /// As after these, before any were read.
    #[cfg(test)]
    pub(super) fn of(octets: &[u8]) -> Self {
        Self(octets.to_vec())
    }

    fn whole(&mut self, octets: &[u8]) -> Vec<[u8; LEN]> {
        self.0.extend_from_slice(octets);
        let (records, rest) = self.0.as_chunks();
        let (records, rest) = (records.to_vec(), rest.to_vec());
        self.0 = rest;
        records
    }
}

/// The octets that light a lamp, or have it dark.
pub(super) fn lamp(code: u16, is_lit: bool) -> [u8; 2 * LEN] {
    let mut both = [0; 2 * LEN];
    both[..LEN].copy_from_slice(&record(LED, code, i32::from(is_lit)));
    both[LEN..].copy_from_slice(&record(SYN, 0, 0));
    both
}

/// A record that says nothing: a relay lives.
pub(super) fn beat() -> [u8; LEN] {
    record(SYN, 0, 0)
}

/// True if a record is for lamps alone: nothing else is ever written to a device.
fn is_for_lamps(record: &[u8; LEN]) -> bool {
    matches!(u16::from_ne_bytes([record[16], record[17]]), LED | SYN)
}

fn record(kind: u16, code: u16, value: i32) -> [u8; LEN] {
    let mut record = [0; LEN];
    record[16..18].copy_from_slice(&kind.to_ne_bytes());
    record[18..20].copy_from_slice(&code.to_ne_bytes());
    record[20..].copy_from_slice(&value.to_ne_bytes());
    record
}

/// The octets of a key, as the kernel gives them.
#[cfg(test)]
pub(super) fn key(code: u16, value: i32, at: MonoTime) -> [u8; LEN] {
    let mut octets = record(KEY, code, value);
    octets[..8].copy_from_slice(&(at.as_nanos() / 1_000_000_000).to_ne_bytes());
    octets[8..16].copy_from_slice(&(at.as_nanos() % 1_000_000_000 / 1_000).to_ne_bytes());
    octets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_read_as_the_kernel_writes_it() {
        assert_eq!(LEN, size_of::<libc::input_event>());
        // Of a keyboard: ESC goes down at 12.345678 s, little-endian.
        let down = [12, 0, 0, 0, 0, 0, 0, 0, 0x4e, 0x46, 5, 0, 0, 0, 0, 0, 1, 0, 1, 0, 1, 0, 0, 0];
        let at = MonoTime::from_nanos(12_345_678_000);
        assert_eq!(read(&down), InputEvent { at, kind: InputKind::Down(1) });
        assert_eq!(down, key(1, 1, at));
        for (value, kind) in
            [(0, InputKind::Up(1)), (2, InputKind::Other), (-1, InputKind::Other), (3, InputKind::Other)]
        {
            assert_eq!(read(&key(1, value, at)).kind, kind, "{value}");
        }
        assert_eq!(read(&record(SYN, SYN_DROPPED, 0)).kind, InputKind::Dropped);
        assert_eq!(read(&beat()).kind, InputKind::Other);
        assert_eq!(read(&record(4, 4, 1)).kind, InputKind::Other, "a scan code is no key");
        let odd = read(&[0xff; LEN]);
        assert_eq!(odd.kind, InputKind::Other);
    }

    #[test]
    fn a_lamp_is_lit_by_a_record_of_lamps_and_nothing_else_is_written() {
        let octets = lamp(2, true);
        let (both, []) = octets.as_chunks::<LEN>() else { panic!("two records") };
        assert_eq!(both[0][16..], [0x11, 0, 2, 0, 1, 0, 0, 0]);
        assert!(both.iter().all(is_for_lamps) && is_for_lamps(&beat()));
        assert!(!is_for_lamps(&key(1, 1, MonoTime::default())));
        assert!(!is_for_lamps(&[0xff; LEN]));
    }
}
