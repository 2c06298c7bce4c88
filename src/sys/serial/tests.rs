//! Lines by pseudo-terminals: what passes, who is refused, what is noticed.

use std::fs;
use std::iter;
use std::path::Path;
use std::time::Duration;

use rustix::io::Errno;
use rustix::termios::{ControlModes, tcgetattr};

use super::pty::Pty;
use super::*;
use crate::sys::clock::Monotonic;
use crate::time::MonoTime;

const SETTINGS: SerialSettings = SerialSettings { baud: 57_600, stop_bits: StopBits::Two, is_rs485: false };

fn soon() -> MonoTime {
    Monotonic.now() + Duration::from_secs(10)
}

fn past() -> MonoTime {
    MonoTime::from_nanos(0)
}

/// Reads exactly so many octets.
fn read<const N: usize>(line: &OctetLine) -> [u8; N] {
    let mut octets = [0; N];
    let mut count = 0;
    while count < N {
        let more = line.read(&mut octets[count..], soon()).unwrap();
        assert_ne!(more, 0, "after {count} octets");
        count += more;
    }
    octets
}

#[test]
fn octets_pass_a_line_unchanged_in_both_directions() {
    let pty = Pty::open().unwrap();
    let port = SerialPort::open(pty.path(), SETTINGS).unwrap();
    let all: [u8; 256] = std::array::from_fn(|octet| u8::try_from(octet).unwrap());
    assert_eq!(port.line().write(&all, soon()), Ok(256));
    assert_eq!(read::<256>(pty.line()), all);
    assert_eq!(pty.line().write(&all, soon()), Ok(256));
    assert_eq!(read::<256>(port.line()), all, "no control character, no translation, no echo");
    assert_eq!(port.line().read(&mut [0], past()), Ok(0));
    assert_eq!(pty.line().read(&mut [0], past()), Ok(0));
    assert_eq!(port.line().unsent(), Ok(0));
}

#[test]
fn a_second_program_is_told_that_another_has_the_line_until_that_one_closes_it() {
    let pty = Pty::open().unwrap();
    let first = SerialPort::open(pty.path(), SETTINGS).unwrap();
    let refused = SerialPort::open(pty.path(), SETTINGS).unwrap_err();
    assert!(matches!(refused, SerialError::Taken(_)), "{refused:?}");
    assert!(refused.to_string().contains("another program has it"), "{refused}");
    drop(first);
    SerialPort::open(pty.path(), SETTINGS).unwrap();
}

#[test]
fn what_is_no_line_is_named_with_its_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("stalls");
    fs::write(&file, b"").unwrap();
    let open = |path: &Path| SerialPort::open(path, SETTINGS).unwrap_err();
    for path in [file.as_path(), folder.path(), Path::new("/dev/null")] {
        assert!(matches!(open(path), SerialError::NoLine(_)), "{:?}", open(path));
    }
    let missing = open(&folder.path().join("none"));
    assert!(matches!(missing, SerialError::Missing(_)), "{missing:?}");
    assert!(missing.to_string().ends_with("use its link in /dev/serial/by-id"), "{missing}");
    for errno in [Errno::ACCESS, Errno::PERM] {
        let refused = SerialError::of(&file, errno).to_string();
        assert!(refused.contains("dialout") && refused.contains("kinocue-drives.conf"), "{refused}");
    }
    assert!(matches!(SerialError::of(&file, Errno::NODEV), SerialError::Vanished(_)));
}

#[test]
fn a_line_that_is_unplugged_has_vanished() {
    let pty = Pty::open().unwrap();
    let port = SerialPort::open(pty.path(), SETTINGS).unwrap();
    drop(pty);
    assert_eq!(port.line().read(&mut [0; 8], soon()), Err(PortFault::Vanished));
    assert_eq!(port.line().write(b"@16 0\r", soon()), Err(PortFault::Vanished));
}

#[test]
fn a_simulated_line_outlives_whoever_opens_it() {
    let pty = Pty::open().unwrap();
    for _ in 0..2 {
        let port = SerialPort::open(pty.path(), SETTINGS).unwrap();
        assert_eq!(port.line().write(b"x", soon()), Ok(1));
        assert_eq!(read::<1>(pty.line()), *b"x");
        drop(port);
        assert_eq!(pty.line().read(&mut [0], past()), Ok(0));
    }
}

#[test]
fn what_came_before_a_line_is_opened_is_forgotten() {
    let pty = Pty::open().unwrap();
    assert_eq!(pty.line().write(b"# 10 000C\r", soon()), Ok(10));
    let port = SerialPort::open(pty.path(), SETTINGS).unwrap();
    assert_eq!(port.line().read(&mut [0; 16], past()), Ok(0));
}

#[test]
fn any_whole_baud_rate_is_set_and_read_back_and_changed_on_an_open_line() {
    let pty = Pty::open().unwrap();
    let mut port = SerialPort::open(pty.path(), SETTINGS).unwrap();
    assert_eq!(port.baud(), 57_600);
    for baud in [19_231, 56_818, 113_636, 125_000, 250_000] {
        let settings = SerialSettings { baud, stop_bits: StopBits::One, ..SETTINGS };
        port.set(pty.path(), settings).unwrap();
        assert_eq!(port.baud(), baud);
    }
    let modes = tcgetattr(port.line()).unwrap().control_modes;
    assert!(modes.contains(ControlModes::CLOCAL) && !modes.contains(ControlModes::CSTOPB));
    assert!(!modes.intersects(ControlModes::HUPCL | ControlModes::CRTSCTS));
}

#[test]
fn what_a_driver_lacks_is_not_taken_for_done() {
    let pty = Pty::open().unwrap();
    let port = SerialPort::open(pty.path(), SerialSettings { is_rs485: true, ..SETTINGS }).unwrap();
    assert_eq!((port.turning(), port.is_quick()), (Turning::ByAdapter, false));
    assert_eq!(port.send_break(Duration::from_millis(1)), Ok(()));
}

#[test]
fn a_driver_that_takes_no_more_is_not_waited_for_past_the_deadline() {
    let pty = Pty::open().unwrap();
    let port = SerialPort::open(pty.path(), SETTINGS).unwrap();
    let many = vec![0x55; 1 << 20];
    // The kernel makes room while it hands over what it took, so a write after one that was cut short may take a little more.
    let tries = iter::repeat_with(|| port.line().write(&many, past()).unwrap());
    let taken: usize = tries.take(many.len()).take_while(|taken| *taken > 0).sum();
    assert!((1..many.len()).contains(&taken), "{taken} octets of {}", many.len());
    port.line().discard().unwrap();
}

#[test]
fn the_latency_timer_is_that_of_the_device_behind_a_link() {
    let folder = tempfile::tempdir().unwrap();
    let devices = folder.path().join("devices");
    fs::create_dir_all(devices.join("ttyUSB7")).unwrap();
    fs::write(devices.join("ttyUSB7/latency_timer"), "16\n").unwrap();
    let [device, link] = ["ttyUSB7", "usb-FTDI-port0"].map(|name| folder.path().join(name));
    fs::write(&device, b"").unwrap();
    std::os::unix::fs::symlink(&device, &link).unwrap();
    assert_eq!(latency_timer_in(&devices, &link), Some(Duration::from_millis(16)));
    assert_eq!(latency_timer_in(&devices, &folder.path().join("none")), None);
    assert_eq!(latency_timer_in(&folder.path().join("none"), &device), None);
    assert_eq!(latency_timer(Path::new("/dev/null")), None, "it is no adapter");
}

#[test]
fn the_structures_are_as_long_as_those_of_the_kernel() {
    let word = size_of::<usize>();
    assert_eq!(size_of::<SerialInfo>(), if word == 8 { 72 } else { 60 });
    assert_eq!(size_of::<Rs485>(), 32);
}
