//! A pad that another process has the device of: so the service that moves seats may open none, and reads nobody's keyboard.

use std::io::{self, Read as _, Write as _};
use std::os::fd::{AsFd as _, OwnedFd};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::event::{InputRecords, LEN, beat, lamp};
use super::line::{GREETING, wait};
use crate::sys::clock::Monotonic;
use crate::sys::evdev;
use crate::sys::unix_socket::listen_in_place;
use crate::time::{Clock as _, MonoTime};

/// How often a hall is given a sign of life, and a device that is gone is looked for.
const BEAT: Duration = Duration::from_secs(1);
/// Octets that are passed on at a time.
const AT_ONCE: usize = 64 * LEN;
/// Lamps that a device may have (LED_CNT).
const LAMPS: u16 = 16;

/// Passes a device on to one hall at a socket.
#[derive(Debug)]
pub(crate) struct ButtonRelay {
    device_at: PathBuf,
    listener: UnixListener,
    device: Option<std::fs::File>,
    hall: Option<Listener>,
    beat_at: MonoTime,
}

/// The hall that hears the device.
#[derive(Debug)]
struct Listener {
    stream: UnixStream,
    /// What it says of lamps.
    records: InputRecords,
}

impl ButtonRelay {
    /// One that serves a device at `NAME.sock` in a folder, in the place of one that is over.
    ///
    /// # Errors
    /// Those of the system: another relay serves that socket, or there is no such folder.
    pub(crate) fn serve(name: &str, device: &Path, folder: &Path) -> io::Result<Self> {
        let socket = folder.join(format!("{name}.sock"));
        let listener = listen_in_place(&socket)?;
        listener.set_nonblocking(true)?;
        // Who may hear it, and so take the place of the hall, is a matter of the folder.
        std::fs::set_permissions(&socket, std::fs::Permissions::from_mode(0o666))?;
        let beat_at = MonoTime::default();
        Ok(Self { device_at: device.to_owned(), listener, device: None, hall: None, beat_at })
    }

    /// Relays for a second at the most; says what is new of the device or the hall.
    pub(crate) fn step(&mut self) -> Option<String> {
        let now = Monotonic.now();
        if now >= self.beat_at {
            self.beat_at = now + BEAT;
            if let Some(news) = self.look(evdev::open_alone) {
                return Some(news);
            }
        }
        let (device, hall) = (self.device.as_ref(), self.hall.as_ref());
        let all =
            [Some(self.listener.as_fd()), device.map(|one| one.as_fd()), hall.map(|one| one.stream.as_fd())];
        let [calls, says, answers] = wait(all, self.beat_at.since(now));
        let news = if says { self.pass() } else { None };
        news.or_else(|| if answers { self.light() } else { None })
            .or_else(|| if calls { self.let_in() } else { None })
    }

    /// Opens a device that is not there, and says to the hall that all is well where it is.
    fn look(&mut self, open: impl FnOnce(&Path) -> io::Result<OwnedFd>) -> Option<String> {
        if self.device.is_some() {
            return if self.tell(&beat()) { None } else { Some(self.part("it does not read")) };
        }
        match open(&self.device_at) {
            Ok(device) => {
                self.device = Some(device.into());
                Some("is read".to_owned())
            }
            Err(error) => Some(format!("is not read: {error}")),
        }
    }

    /// Passes on what the device says.
    fn pass(&mut self) -> Option<String> {
        let mut octets = [0; AT_ONCE];
        match self.device.as_mut()?.read(&mut octets) {
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {
                None
            }
            Ok(count @ 1..) => (!self.tell(&octets[..count])).then(|| self.part("it does not read")),
            _ => {
                (self.device, self.hall) = (None, None);
                Some("is gone; plug it in again".to_owned())
            }
        }
    }

    /// True unless there is a hall that does not take it all at once.
    fn tell(&mut self, octets: &[u8]) -> bool {
        let Some(hall) = &mut self.hall else { return true };
        hall.stream.write(octets).is_ok_and(|count| count == octets.len())
    }

    /// Lights lamps as the hall says.
    fn light(&mut self) -> Option<String> {
        let (hall, device) = (self.hall.as_mut()?, self.device.as_mut()?);
        let mut octets = [0; AT_ONCE];
        match hall.stream.read(&mut octets) {
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {
                None
            }
            Ok(count @ 1..) => {
                let _ = device.write_all(&hall.records.lamps(&octets[..count])); // a device that is gone is told as it is read
                None
            }
            _ => Some(self.part("it has closed")),
        }
    }

    /// The hall is gone: nothing is lit any more.
    fn part(&mut self, why: &str) -> String {
        self.hall = None;
        if let Some(device) = &mut self.device {
            let dark = |code| device.write_all(&lamp(code, false));
            let _ = (0..LAMPS).try_for_each(dark); // a device that is gone is told as it is read
        }
        format!("has no hall any more: {why}")
    }

    /// Lets a hall in, where there is a device, and no other hall.
    fn let_in(&mut self) -> Option<String> {
        let (mut stream, _) = self.listener.accept().ok()?;
        self.device.as_ref()?; // whoever calls meanwhile is let go
        if self.hall.is_some() {
            return Some("is heard by another hall already; one more was turned away".to_owned());
        }
        stream.set_nonblocking(true).and_then(|()| stream.write_all(GREETING)).ok()?;
        self.hall = Some(Listener { stream, records: InputRecords::default() });
        Some("is heard by a hall".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::super::event::{InputKind, key};
    use super::super::line::PadLine;
    use super::*;
    use crate::config::PadDevice;

    struct Desk {
        _folder: tempfile::TempDir,
        relay: ButtonRelay,
        at: PadDevice,
        /// The end of the device where keys are pressed, and lamps lit.
        keys: UnixStream,
    }

    /// A relay of a device that is there.
    fn desk() -> Desk {
        let folder = tempfile::tempdir().unwrap();
        let mut relay = ButtonRelay::serve("desk", Path::new("/dev/input/none"), folder.path()).unwrap();
        let keys = plug_in(&mut relay);
        let at = PadDevice::Relay(folder.path().join("desk.sock"));
        Desk { _folder: folder, relay, at, keys }
    }

    fn plug_in(relay: &mut ButtonRelay) -> UnixStream {
        let (keys, device) = UnixStream::pair().unwrap();
        device.set_nonblocking(true).unwrap();
        keys.set_nonblocking(true).unwrap();
        assert_eq!(relay.look(|_| Ok(device.into())).as_deref(), Some("is read"));
        keys
    }

    impl Desk {
        /// A hall that comes while the relay relays.
        fn join(&mut self) -> io::Result<PadLine> {
            let at = self.at.clone();
            let hall = std::thread::spawn(move || PadLine::open(&at));
            while !hall.is_finished() {
                self.relay.beat_at = Monotonic.now() + Duration::from_millis(5);
                self.relay.step();
            }
            hall.join().unwrap()
        }
    }

    #[test]
    fn presses_go_to_the_hall_and_lamps_alone_come_back() {
        let mut desk = desk();
        let mut hall = desk.join().unwrap();
        desk.keys.write_all(&key(1, 1, Monotonic.now())).unwrap();
        assert_eq!(desk.relay.pass(), None);
        let heard = hall.read(Monotonic.now()).unwrap();
        assert_eq!(heard.iter().map(|event| event.kind).collect::<Vec<_>>(), [InputKind::Down(1)]);
        hall.light(2, true).unwrap();
        // What no lamp is, a hall writes to no device: a key would be pressed by it.
        let forged = key(30, 1, Monotonic.now());
        desk.relay.hall.as_mut().unwrap().records = InputRecords::of(&forged);
        assert_eq!(desk.relay.light(), None);
        let mut written = [0; 1_000];
        let count = desk.keys.read(&mut written).unwrap();
        assert_eq!(written[..count], lamp(2, true));
    }

    #[test]
    fn a_hall_learns_that_the_device_is_gone_and_comes_again_when_it_is_back() {
        let mut desk = desk();
        let mut hall = desk.join().unwrap();
        let Err(refused) = desk.join() else { panic!("one hall at a time") };
        assert!(refused.to_string().contains("another hall has it"), "{refused}");
        desk.keys.shutdown(std::net::Shutdown::Both).unwrap();
        assert_eq!(desk.relay.pass().as_deref(), Some("is gone; plug it in again"));
        assert!(hall.read(Monotonic.now()).is_err());
        assert!(desk.join().unwrap_err().to_string().contains("no device at present"));
        desk.keys = plug_in(&mut desk.relay);
        assert!(desk.join().is_ok());
    }

    #[test]
    fn nothing_is_lit_once_the_hall_is_gone() {
        let mut desk = desk();
        drop(desk.join().unwrap());
        assert!(desk.relay.light().unwrap().starts_with("has no hall any more"));
        let mut written = [0; 2_000];
        let count = desk.keys.read(&mut written).unwrap();
        assert_eq!(written[..count], (0..LAMPS).flat_map(|code| lamp(code, false)).collect::<Vec<_>>());
        assert!(desk.join().is_ok(), "another may come");
    }

    #[test]
    fn a_hall_gets_a_sign_of_life_and_one_that_does_not_read_is_let_go() {
        let mut desk = desk();
        let mut hall = desk.join().unwrap();
        assert_eq!(desk.relay.look(|_| panic!("it is there")), None);
        assert_eq!(hall.read(Monotonic.now()).unwrap().len(), 1);
        let parted = (0..100_000).find_map(|_| desk.relay.look(|_| panic!("it is there")));
        assert!(parted.unwrap().contains("it does not read"));
    }
}
