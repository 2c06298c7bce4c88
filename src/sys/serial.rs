//! Serial lines: opened for one program alone, raw, at any baud rate; and pseudo-terminals, by which a simulator is such a line.
//! A line is read and written with an absolute deadline and never waited for longer. Threads of links; the tick thread has none.

use std::fs;
use std::path::Path;
use std::time::Duration;

use rustix::fs::{FlockOperation, Mode, OFlags, flock};
use rustix::io::Errno;
use rustix::ioctl::{Getter, NoArg, Opcode, Setter, ioctl};
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, SpecialCodeIndex, ioctl_tiocexcl, ioctl_tiocnxcl, isatty,
    tcgetattr, tcsetattr,
};

use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

mod fault;
mod octets;
pub(crate) mod pty;
#[cfg(test)]
mod tests;

pub(in crate::sys) use fault::QUEUE;
pub(crate) use fault::{CanError, PortFault, SerialError};
pub(crate) use octets::OctetLine;

/// How far the baud rate that is made may be from the one that was asked for: two ends together may differ by 4 %.
const BAUD_TOLERANCE: f64 = 0.02;

/// A driver hands over what has come at once (linux/tty_flags.h).
const ASYNC_LOW_LATENCY: i32 = 1 << 13;
/// The driver turns the line (linux/serial.h).
const RS485_ENABLED: u32 = 1;
const RS485_RTS_ON_SEND: u32 = 1 << 1;

/// Where drivers of USB adapters say how long they hold answers back.
const USB_SERIAL: &str = "/sys/bus/usb-serial/devices";

/// The stop bits of an octet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopBits {
    /// Ten bits an octet.
    One,
    /// Eleven bits an octet.
    Two,
}

/// How a line is to be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SerialSettings {
    /// Bits a second, any whole number.
    pub(crate) baud: u32,
    /// At the end of each octet; eight data bits without parity come before.
    pub(crate) stop_bits: StopBits,
    /// Two wires, of which somebody has to let go after sending.
    pub(crate) is_rs485: bool,
}

/// Who lets go of the two wires of RS-485 after sending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Turning {
    /// Nobody needs to: it is not RS-485.
    None,
    /// The driver does, and has said so.
    ByDriver,
    /// The driver knows nothing of it: the adapter has to do it by itself.
    ByAdapter,
}

/// A serial line that is ours alone until this is dropped.
#[derive(Debug)]
pub(crate) struct SerialPort {
    line: OctetLine,
    baud: u32,
    turning: Turning,
    is_quick: bool,
}

impl SerialPort {
    /// Opens a line, sets it, and forgets what came before.
    ///
    /// # Errors
    /// A [`SerialError`] that says what to do.
    pub(crate) fn open(path: &Path, settings: SerialSettings) -> Result<Self, SerialError> {
        let refused = |errno| SerialError::of(path, errno);
        // Without NONBLOCK a line without a carrier is waited for; with a controlling terminal its hang-up would end us.
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let fd = rustix::fs::open(path, flags, Mode::empty()).map_err(refused)?;
        if !isatty(&fd) {
            return Err(SerialError::NoLine(path.to_owned()));
        }
        // The lock tells programs that look, the exclusive mode stops those that do not; it does not stop root.
        flock(&fd, FlockOperation::NonBlockingLockExclusive).map_err(refused)?;
        ioctl_tiocexcl(&fd).map_err(refused)?;
        // From here on the exclusive mode is given up where this is dropped.
        let mut port = Self { line: OctetLine(fd), baud: 0, turning: Turning::None, is_quick: false };
        port.is_quick = port.hurry();
        port.turning = if settings.is_rs485 { port.turn(path)? } else { Turning::None };
        port.set(path, settings)?;
        port.line.discard().map_err(|_| SerialError::Vanished(path.to_owned()))?;
        Ok(port)
    }

    /// Sets rate and stop bits, and reads back what the driver made of them.
    ///
    /// # Errors
    /// [`SerialError::Baud`] where the rate is more than 2 % off, [`SerialError::StopBits`] where they are others.
    pub(crate) fn set(&mut self, path: &Path, settings: SerialSettings) -> Result<(), SerialError> {
        let refused = |errno| SerialError::of(path, errno);
        let mut modes = tcgetattr(&self.line).map_err(refused)?;
        modes.make_raw();
        modes.input_modes -= InputModes::IXON | InputModes::IXOFF | InputModes::IXANY | InputModes::INPCK;
        modes.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
        modes.control_modes -= ControlModes::HUPCL | ControlModes::CRTSCTS;
        modes.control_modes.set(ControlModes::CSTOPB, settings.stop_bits == StopBits::Two);
        modes.special_codes[SpecialCodeIndex::VMIN] = 0;
        modes.special_codes[SpecialCodeIndex::VTIME] = 0;
        modes.set_speed(settings.baud).map_err(refused)?;
        tcsetattr(&self.line, OptionalActions::Now, &modes).map_err(refused)?;
        // The call succeeds if any of it was taken.
        let made = tcgetattr(&self.line).map_err(refused)?;
        self.baud = made.output_speed();
        let (wanted, off) = (settings.baud, f64::from(self.baud) - f64::from(settings.baud));
        if off.abs() > BAUD_TOLERANCE * f64::from(wanted) {
            return Err(SerialError::Baud { path: path.to_owned(), wanted, made: self.baud });
        }
        let has_two = made.control_modes.contains(ControlModes::CSTOPB);
        if has_two != (settings.stop_bits == StopBits::Two) {
            return Err(SerialError::StopBits { path: path.to_owned(), can: if has_two { 2 } else { 1 } });
        }
        Ok(())
    }

    /// Its octets.
    pub(crate) fn line(&self) -> &OctetLine {
        &self.line
    }

    /// Bits a second as the driver says that it makes them.
    pub(crate) fn baud(&self) -> u32 {
        self.baud
    }

    /// Who lets go of the wires.
    pub(crate) fn turning(&self) -> Turning {
        self.turning
    }

    /// True if the driver hands over at once what has come, by what it says itself.
    pub(crate) fn is_quick(&self) -> bool {
        self.is_quick
    }

    /// Holds the line in a break for so long, which every receiver takes for the end of what came before.
    ///
    /// # Errors
    /// A [`PortFault`] where the port is gone.
    #[expect(unsafe_code, reason = "the library's break lasts a quarter of a second at least")]
    pub(crate) fn send_break(&self, span: Duration) -> Result<(), PortFault> {
        // SAFETY: neither takes an argument.
        unsafe { ioctl(&self.line, NoArg::<{ code(libc::TIOCSBRK) }>::new()) }?;
        Monotonic.sleep_until(Monotonic.now() + span);
        // SAFETY: as above.
        Ok(unsafe { ioctl(&self.line, NoArg::<{ code(libc::TIOCCBRK) }>::new()) }?)
    }

    /// Asks the driver to hand over at once what has come, which any user may; says if it will.
    #[expect(unsafe_code, reason = "no library has it")]
    fn hurry(&self) -> bool {
        // SAFETY: TIOCGSERIAL writes a `serial_struct`.
        let read = || unsafe { ioctl(&self.line, Getter::<{ code(libc::TIOCGSERIAL) }, SerialInfo>::new()) };
        let Ok(mut info) = read() else { return false };
        info.flags |= ASYNC_LOW_LATENCY;
        // SAFETY: TIOCSSERIAL reads a `serial_struct`.
        let set = unsafe { Setter::<{ code(libc::TIOCSSERIAL) }, SerialInfo>::new(info) };
        // SAFETY: as above.
        let _ = unsafe { ioctl(&self.line, set) }; // what is read back counts
        read().is_ok_and(|info| info.flags & ASYNC_LOW_LATENCY != 0)
    }

    /// Has the driver turn the line, if it knows how to.
    #[expect(unsafe_code, reason = "no library has it")]
    fn turn(&self, path: &Path) -> Result<Turning, SerialError> {
        let wanted = Rs485 { flags: RS485_ENABLED | RS485_RTS_ON_SEND, ..Rs485::default() };
        // SAFETY: TIOCSRS485 reads and writes a `serial_rs485`, which is a copy of ours.
        let set = unsafe { Setter::<{ code(libc::TIOCSRS485) }, Rs485>::new(wanted) };
        // SAFETY: as above.
        match unsafe { ioctl(&self.line, set) } {
            Ok(()) => {}
            Err(Errno::NOTTY | Errno::INVAL | Errno::OPNOTSUPP) => return Ok(Turning::ByAdapter),
            Err(errno) => return Err(SerialError::of(path, errno)),
        }
        // SAFETY: TIOCGRS485 writes a `serial_rs485`.
        let made = unsafe { ioctl(&self.line, Getter::<{ code(libc::TIOCGRS485) }, Rs485>::new()) };
        match made {
            Ok(made) if made.flags & RS485_ENABLED != 0 => Ok(Turning::ByDriver),
            _ => Err(SerialError::Rs485(path.to_owned())),
        }
    }
}

impl Drop for SerialPort {
    fn drop(&mut self) {
        // A terminal that somebody else holds open would stay closed to all others, and a child that is just being started keeps the lock.
        let _ = ioctl_tiocnxcl(&self.line); // it may be gone
        let _ = flock(&self.line, FlockOperation::Unlock);
    }
}

/// A request as the library has them.
#[expect(clippy::cast_possible_truncation, reason = "requests have 32 bits (linux/ioctl.h)")]
const fn code(request: libc::Ioctl) -> Opcode {
    request as Opcode
}

/// `struct serial_struct` (linux/serial.h).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
struct SerialInfo {
    kind: i32,
    line: i32,
    port: u32,
    irq: i32,
    flags: i32,
    fifo_size: i32,
    divisor: i32,
    baud_base: i32,
    close_delay: u16,
    io_type: u8,
    reserved: u8,
    hub6: i32,
    closing_wait: u16,
    closing_wait2: u16,
    iomem_base: usize,
    iomem_reg_shift: u16,
    port_high: u32,
    iomap_base: libc::c_ulong,
}

/// `struct serial_rs485` (linux/serial.h); delays in milliseconds.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
struct Rs485 {
    flags: u32,
    before_send: u32,
    after_send: u32,
    padding: [u32; 5],
}

/// How long the driver of a USB adapter holds answers back; `None` where the port is no such adapter, or does not say.
pub(crate) fn latency_timer(port: &Path) -> Option<Duration> {
    latency_timer_in(Path::new(USB_SERIAL), port)
}

fn latency_timer_in(devices: &Path, port: &Path) -> Option<Duration> {
    // Names in /dev/serial are links.
    let device = fs::canonicalize(port).ok()?;
    let text = fs::read_to_string(devices.join(device.file_name()?).join("latency_timer")).ok()?;
    text.trim().parse().ok().map(Duration::from_millis)
}
