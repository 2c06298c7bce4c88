//! Devices of the kernel's input layer (`/dev/input/event*`): opened for one program alone, with their events on the clock of the
//! machine; and what they say they are. Threads of buttons.

use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::path::Path;

use rustix::fs::{Mode, OFlags, open};
use rustix::ioctl::{IntegerSetter, Opcode, Setter, Updater, ioctl, opcode};

/// Octets in which the kernel has a bit for each key (KEY_CNT), and for each lamp.
const KEY_OCTETS: usize = 96;
const LAMP_OCTETS: usize = 2;

const VERSION: Opcode = opcode::read::<i32>(b'E', 0x01);
const NAME: Opcode = opcode::read::<[u8; 256]>(b'E', 0x06);
const KEYS: Opcode = opcode::read::<[u8; KEY_OCTETS]>(b'E', 0x21);
const LAMPS: Opcode = opcode::read::<[u8; LAMP_OCTETS]>(b'E', 0x31);
const GRAB: Opcode = opcode::write::<i32>(b'E', 0x90);
const CLOCK: Opcode = opcode::write::<i32>(b'E', 0xa0);

/// What a device says of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct InputFacts {
    /// Its name.
    pub(crate) name: String,
    /// The codes of the keys that it has.
    pub(crate) keys: Vec<u16>,
    /// The codes of its lamps.
    pub(crate) lamps: Vec<u16>,
}

/// Opens a device: no other program, no console and no screen gets its keys until this is dropped. Nobody waits for what is read of it.
///
/// # Errors
/// Those of the system, in words with what to do.
pub(crate) fn open_alone(path: &Path) -> io::Result<OwnedFd> {
    let device = open_shared(path, OFlags::RDWR)?;
    take_alone(&device).map_err(|error| match error.kind() {
        io::ErrorKind::ResourceBusy => say(&error, "another program has it to itself; end that"),
        _ => error,
    })?;
    Ok(device)
}

/// What a device is; nothing is taken from anybody.
///
/// # Errors
/// Those of the system, in words with what to do.
pub(crate) fn facts(path: &Path) -> io::Result<InputFacts> {
    let device = open_shared(path, OFlags::RDONLY)?;
    Ok(InputFacts { name: name(&device)?, keys: bits(&keys(&device)?), lamps: bits(&lamps(&device)?) })
}

/// Opens a device that others read as well.
///
/// # Errors
/// Those of the system, in words with what to do.
pub(crate) fn open_shared(path: &Path, access: OFlags) -> io::Result<OwnedFd> {
    let flags = access | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    let refused = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => say(&error, "plug it in, or name it as `kinocue buttons` lists it"),
        io::ErrorKind::PermissionDenied => {
            say(&error, "become a member of the group input, or have kinocue-buttons.service read it")
        }
        _ => error,
    };
    let device = open(path, flags, Mode::empty()).map_err(|errno| refused(errno.into()))?;
    is_input(&device)?;
    Ok(device)
}

fn say(error: &io::Error, remedy: &str) -> io::Error {
    io::Error::new(error.kind(), format!("{error}; {remedy}"))
}

fn is_input(device: &OwnedFd) -> io::Result<()> {
    let mut version = 0;
    update::<VERSION, i32>(device, &mut version).map_err(|_| {
        io::Error::new(io::ErrorKind::InvalidInput, "it is no input device; `kinocue buttons` lists those")
    })
}

#[expect(unsafe_code, reason = "no library has it")]
fn take_alone(device: &OwnedFd) -> io::Result<()> {
    // SAFETY: EVIOCSCLOCKID reads an int.
    let clock = unsafe { Setter::<CLOCK, i32>::new(libc::CLOCK_MONOTONIC) };
    // SAFETY: as above.
    unsafe { ioctl(device.as_fd(), clock) }?;
    // SAFETY: EVIOCGRAB takes a number, not what it points to.
    let grab = unsafe { IntegerSetter::<GRAB>::new_usize(1) };
    // SAFETY: as above.
    Ok(unsafe { ioctl(device.as_fd(), grab) }?)
}

fn name(device: &OwnedFd) -> io::Result<String> {
    let mut octets = [0; 256];
    update::<NAME, _>(device, &mut octets)?;
    let text = octets.split(|octet| *octet == 0).next().unwrap_or_default();
    Ok(String::from_utf8_lossy(text).into_owned())
}

fn keys(device: &OwnedFd) -> io::Result<[u8; KEY_OCTETS]> {
    let mut octets = [0; KEY_OCTETS];
    update::<KEYS, _>(device, &mut octets)?;
    Ok(octets)
}

fn lamps(device: &OwnedFd) -> io::Result<[u8; LAMP_OCTETS]> {
    let mut octets = [0; LAMP_OCTETS];
    update::<LAMPS, _>(device, &mut octets)?;
    Ok(octets)
}

/// Has the kernel write into a value, no more than the size that is part of `OPCODE`.
#[expect(unsafe_code, reason = "no library has it")]
fn update<const OPCODE: Opcode, T>(device: &OwnedFd, value: &mut T) -> io::Result<()> {
    // SAFETY: each opcode of this file is made of the type that it is asked with, all of whose octets may be anything.
    let get = unsafe { Updater::<OPCODE, T>::new(value) };
    // SAFETY: as above.
    Ok(unsafe { ioctl(device.as_fd(), get) }?)
}

/// The numbers of the bits that are set.
fn bits(octets: &[u8]) -> Vec<u16> {
    let bit = |number: &u16| octets[usize::from(number / 8)] & (1 << (number % 8)) != 0;
    (0..u16::try_from(8 * octets.len()).expect("96 octets")).filter(bit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bit_stands_for_a_key() {
        assert_eq!(bits(&[0b10, 0, 0b1000_0001]), [1, 16, 23]);
        assert_eq!(bits(&[0; KEY_OCTETS]), [0_u16; 0]);
    }

    #[test]
    fn what_is_no_input_device_is_said_to_be_none() {
        let error = open_alone(Path::new("/dev/null")).unwrap_err().to_string();
        assert!(error.starts_with("it is no input device"), "{error}");
        let error = facts(Path::new("/dev/input/by-id/none")).unwrap_err().to_string();
        assert!(error.contains("plug it in"), "{error}");
    }
}
