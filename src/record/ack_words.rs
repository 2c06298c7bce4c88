//! What records of the ack thread are written with.

use crate::belief::Fall;

/// Why a lane falls out, each by its place here.
pub(super) const FALLS: [Fall; 5] = [Fall::Gap, Fall::Astray, Fall::PutBack, Fall::Stale, Fall::Stopped];

/// Begins a record that is of a controller.
pub(super) fn of(out: &mut Vec<u8>, kind: u8, controller: usize) {
    out.push(kind);
    out.extend_from_slice(&u16::try_from(controller).unwrap_or(u16::MAX).to_le_bytes());
}

pub(super) fn place<T: PartialEq>(all: &[T], one: &T) -> u8 {
    all.iter().position(|other| other == one).and_then(|at| u8::try_from(at).ok()).unwrap_or(u8::MAX)
}
