//! `kinocue buttons`: which input devices there are, what their keys are called, and a relay of them for a service that opens none.

use std::fs;
use std::io::Read as _;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use rustix::fs::OFlags;

use super::{Exit, Failure, OrExit as _, print, table};
use crate::app::buttons::{ButtonRelay, InputRecords};
use crate::config::{key_name, lamp_name};
use crate::sys::clock::Monotonic;
use crate::sys::evdev::{InputFacts, facts, open_shared};
use crate::time::Clock as _;

/// Shows pads and keyboards, and what their keys are called.
///
/// Without a command it lists the devices, best by the name that stays (`/dev/input/by-id`), with their keys and lamps. `[buttons]`
/// of a configuration says what keys ask of a hall.
#[derive(Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "\
Examples:
  kinocue buttons
  kinocue buttons watch --seconds 5
  kinocue buttons relay desk=/dev/input/by-id/usb-0a05_KEY-event-kbd --folder /tmp"
)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Option<ButtonsCommand>,
}

#[derive(Debug, clap::Subcommand)]
enum ButtonsCommand {
    Watch(WatchArgs),
    Relay(RelayArgs),
}

/// Prints what each key is called that is pressed; others hear it as well.
#[derive(Debug, clap::Args)]
struct WatchArgs {
    /// The devices [default: all that may be read].
    #[arg(value_name = "DEVICE")]
    devices: Vec<PathBuf>,
    /// End after this many seconds [default: at Ctrl-C].
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: Option<u32>,
}

/// Reads pads for services that may not open them.
///
/// It takes each device for itself, and passes it on at NAME.sock to one hall on this machine, whose device is
/// relay:FOLDER/NAME.sock. It waits for a device that is gone.
#[derive(Debug, clap::Args)]
struct RelayArgs {
    /// The pads.
    #[arg(required = true, value_name = "NAME=DEVICE", value_parser = named)]
    pads: Vec<(String, PathBuf)>,
    /// The folder of the sockets; whoever may enter it can take the place of the hall.
    #[arg(long, value_name = "DIR", default_value = "/run/kinocue-buttons")]
    folder: PathBuf,
}

/// Where the system names input devices: by what they are first.
const FOLDERS: [&str; 2] = ["/dev/input/by-id", "/dev/input"];
/// How often devices are looked at.
const LOOK: Duration = Duration::from_millis(20);

pub(super) fn run(Args { command }: &Args) -> Result<Exit, Failure> {
    match command {
        None => list(),
        Some(ButtonsCommand::Watch(args)) => watch(args),
        Some(ButtonsCommand::Relay(args)) => relay(args),
    }
}

fn named(text: &str) -> Result<(String, PathBuf), String> {
    let is_name = |name: &str| name.chars().all(|one| one.is_ascii_alphanumeric() || "-_".contains(one));
    let pad = text
        .split_once('=')
        .filter(|(name, device)| !name.is_empty() && is_name(name) && device.starts_with('/'));
    pad.map(|(name, device)| (name.to_owned(), device.into())).ok_or_else(|| {
        "write NAME=DEVICE, a name of letters, digits, - and _, and a path such as /dev/input/by-id/..."
            .to_owned()
    })
}

/// The devices there are, each by its best name.
fn devices() -> Vec<PathBuf> {
    let mut found: Vec<(PathBuf, PathBuf)> = Vec::new();
    for folder in FOLDERS {
        let mut paths: Vec<PathBuf> =
            fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path())).collect();
        paths.sort();
        for path in paths.into_iter().filter(|path| path.to_string_lossy().contains("event")) {
            let Ok(real) = path.canonicalize() else { continue };
            if !real.is_dir() && !found.iter().any(|(_, other)| *other == real) {
                found.push((path, real));
            }
        }
    }
    found.into_iter().map(|(path, _)| path).collect()
}

fn list() -> Result<Exit, Failure> {
    let devices = devices();
    if devices.is_empty() {
        print::tell("kinocue: this machine has no input device (/dev/input); plug one in");
        return Ok(Exit::Done);
    }
    let row = |path: &PathBuf| match facts(path) {
        Ok(InputFacts { name, keys, lamps }) => {
            let lamps: Vec<String> = lamps.into_iter().filter_map(lamp_name).collect();
            [path.display().to_string(), name, few(&keys), lamps.join(" ")]
        }
        Err(error) => [path.display().to_string(), error.to_string(), String::new(), String::new()],
    };
    print::out(&table::table(["device", "name", "keys", "lamps"], devices.iter().map(row)))?;
    print::tell("kinocue buttons watch DEVICE shows what a key is called when it is pressed");
    Ok(Exit::Done)
}

/// The keys of a device: all of a pad's, some of a keyboard's.
fn few(keys: &[u16]) -> String {
    const FEW: usize = 12;
    let names: Vec<String> = keys.iter().take(FEW).map(|code| key_name(*code)).collect();
    let more = if keys.len() > FEW { format!(" and {} more", keys.len() - FEW) } else { String::new() };
    names.join(" ") + &more
}

fn watch(args: &WatchArgs) -> Result<Exit, Failure> {
    let (all, named) = (devices(), &args.devices);
    let mut open = Vec::new();
    for path in if named.is_empty() { &all } else { named } {
        match open_shared(path, OFlags::RDONLY) {
            Ok(device) => open.push((path, fs::File::from(device), InputRecords::default())),
            Err(error) => print::tell(&format!("kinocue: {}: {error}", path.display())),
        }
    }
    if open.is_empty() {
        let why = anyhow::anyhow!("no input device can be read; `kinocue buttons` lists those there are");
        return Err(Failure { exit: Exit::NoInput, error: why });
    }
    print::tell("press a key; Ctrl-C ends");
    let mut at = Monotonic.now();
    let end = args.seconds.map(|seconds| at + Duration::from_secs(seconds.into()));
    while end.is_none_or(|end| at < end) && !open.is_empty() {
        open.retain_mut(|(path, device, records)| {
            let mut octets = [0; 1_536];
            match device.read(&mut octets) {
                Ok(count) => records
                    .pressed(&octets[..count])
                    .iter()
                    .all(|code| print::out(&format!("{}: {}\n", path.display(), key_name(*code))).is_ok()),
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => true,
                Err(error) => {
                    print::tell(&format!("kinocue: {}: {error}", path.display()));
                    false
                }
            }
        });
        at = at + LOOK;
        Monotonic.sleep_until(at);
    }
    Ok(Exit::Done)
}

fn relay(args: &RelayArgs) -> Result<Exit, Failure> {
    let serve = |(name, device): &(String, PathBuf)| {
        let relay = ButtonRelay::serve(name, device, &args.folder);
        let context = |error| {
            anyhow::Error::new(error).context(args.folder.join(format!("{name}.sock")).display().to_string())
        };
        relay.map(|relay| (name.clone(), relay)).map_err(context).or_system()
    };
    let relays = args.pads.iter().map(serve).collect::<Result<Vec<_>, _>>()?;
    thread::scope(|threads| {
        for (name, relay) in relays {
            threads.spawn(move || serve_for_ever(&name, relay));
        }
    });
    Ok(Exit::Done)
}

/// Says of a pad what is new, once.
fn serve_for_ever(name: &str, mut relay: ButtonRelay) {
    let mut said = String::new();
    loop {
        if let Some(news) = relay.step().filter(|news| *news != said) {
            print::tell(&format!("{name}: {news}"));
            said = news;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pad_for_a_relay_has_a_name_and_a_device() {
        assert_eq!(
            named("desk=/dev/input/event3").unwrap(),
            ("desk".to_owned(), PathBuf::from("/dev/input/event3"))
        );
        for wrong in
            ["/dev/input/event3", "=/dev/input/event3", "../x=/dev/input/event3", "desk=event3", "desk="]
        {
            assert!(named(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn of_a_keyboard_some_keys_are_named() {
        assert_eq!(few(&[1, 183]), "KEY_ESC KEY_F13");
        assert!(few(&(1..=100).collect::<Vec<_>>()).ends_with("KEY_MINUS and 88 more"));
    }
}
