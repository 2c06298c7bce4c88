//! `[buttons.NAME]`: pads and keyboards whose keys ask something of the hall, and whose lamps show how it is; without such a table
//! there are none.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::fault::Faults;
use super::keys::{key_code, lamp_code, names};
use super::section::{Entry, Section, did_you_mean};
use crate::plain;

/// A relay's socket begins so in the configuration.
const RELAY: &str = "relay:";
/// How long a contact may bounce, ms, where the configuration says nothing.
const DEBOUNCE_MS: u32 = 30;

/// A pad.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ButtonPad {
    /// What people call it.
    pub(crate) name: String,
    /// Where it is.
    pub(crate) device: PadDevice,
    /// What a key asks, by its code; at least one.
    pub(crate) keys: Vec<(u16, PadWord)>,
    /// What a lamp shows, by its code.
    pub(crate) lamps: Vec<(u16, PadLamp)>,
    /// A press so soon after the key moved last is its contact that bounces. A stop waits for none of it.
    pub(crate) debounce: Duration,
}

impl ButtonPad {
    /// True if one of its keys stops the seats.
    #[must_use]
    pub(crate) fn has_stop(&self) -> bool {
        self.keys.iter().any(|(_, word)| *word == PadWord::Stop)
    }
}

/// Where a pad is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PadDevice {
    /// A device of the kernel's input layer.
    Event(PathBuf),
    /// The socket of a relay on this machine, which has the device.
    Relay(PathBuf),
}

impl fmt::Display for PadDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Event(path) => f.write_str(&plain::path(path)),
            Self::Relay(path) => write!(f, "{RELAY}{}", plain::path(path)),
        }
    }
}

/// What a key may ask. Arming, homing, clearing and resuming are not among it: nobody sees who presses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PadWord {
    /// To start what a person has armed.
    Go,
    /// To bring the seats to rest.
    Stop,
    /// To hold.
    Pause,
    /// To end a show.
    Park,
    /// To mark this moment in what is recorded.
    Mark,
}

impl PadWord {
    const ALL: [(&'static str, Self); 5] = [
        ("go", Self::Go),
        ("stop", Self::Stop),
        ("pause", Self::Pause),
        ("park", Self::Park),
        ("mark", Self::Mark),
    ];
}

plain::displayed!(PadWord {
    Self::Go => "go",
    Self::Stop => "stop",
    Self::Pause => "pause",
    Self::Park => "park",
    Self::Mark => "mark",
});

/// What a lamp shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PadLamp {
    /// A person has armed the hall; it blinks while GO waits for its second press.
    Armed,
    /// Frames leave that move seats.
    Playing,
    /// The hall is stopped or at fault, or a warning is an error.
    Fault,
}

/// Reads all pads.
pub(super) fn buttons(entry: Entry<'_>, faults: &mut Faults<'_>) -> Vec<ButtonPad> {
    let Some(table) = entry.table(faults) else { return Vec::new() };
    let mut pads: Vec<ButtonPad> = Vec::new();
    for (name, value) in table {
        let entry = Entry::new(name.get_ref(), value);
        let Some(pad) = pad(entry, faults) else { continue };
        if let Some(twin) = pads.iter().find(|other| other.device == pad.device) {
            entry.fault(
                faults,
                &format!("[buttons.{}] has that device already; one device is one pad", twin.name),
            );
        }
        pads.push(pad);
    }
    pads
}

fn pad(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<ButtonPad> {
    let title = format!("[buttons.{}]", entry.key);
    let mut section = Section::new(title, entry.at, entry.table(faults)?, faults);
    section.require(&["device", "keys"]);
    let device = section.get("device").and_then(|entry| device(entry, section.faults));
    let keys = section.get("keys").and_then(|entry| keys(entry, section.faults));
    let lamps = section.get("lamps").map_or_else(Vec::new, |entry| lamps(entry, section.faults));
    let debounce = section.whole_in("debounce_ms", 0..=1_000).unwrap_or(DEBOUNCE_MS);
    section.finish();
    let debounce = Duration::from_millis(debounce.into());
    Some(ButtonPad { name: entry.key.to_owned(), device: device?, keys: keys?, lamps, debounce })
}

fn device(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<PadDevice> {
    let text = entry.text(faults)?;
    let (is_relay, path) = text.strip_prefix(RELAY).map_or((false, text), |path| (true, path));
    if !Path::new(path).is_absolute() {
        let message = format!(
            "{text:?} is no device; give its path as `kinocue buttons` lists it, /dev/input/by-id/..., or relay:/run/kinocue-buttons/NAME.sock"
        );
        entry.fault(faults, &message);
        return None;
    }
    Some(if is_relay { PadDevice::Relay(path.into()) } else { PadDevice::Event(path.into()) })
}

fn keys(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Vec<(u16, PadWord)>> {
    let table = entry.table(faults)?;
    if table.is_empty() {
        entry.fault(faults, "is empty; name at least one key, such as { KEY_ESC = \"stop\" }");
    }
    let mut keys: Vec<(u16, PadWord)> = Vec::new();
    for (name, value) in table {
        let entry = Entry::new(name.get_ref(), value);
        let code = key_code(entry.key);
        match code {
            None => {
                let hint = did_you_mean(entry.key, names().0.iter().map(String::as_str));
                let message =
                    format!("is no key: name it as `kinocue buttons watch` does when it is pressed{hint}");
                entry.fault(faults, &message);
            }
            Some(code) if keys.iter().any(|(other, _)| *other == code) => {
                entry.fault(faults, &format!("key {code} stands there already, by another name"));
            }
            Some(_) => {}
        }
        if let (Some(word), Some(code)) = (word(entry, faults), code) {
            keys.push((code, word));
        }
    }
    Some(keys)
}

fn word(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<PadWord> {
    if let Some(never @ ("arm" | "home" | "clear" | "resume")) = entry.value.as_str() {
        let message =
            format!("{never} is never asked by a button: nobody sees who presses it; ask on the console");
        entry.fault(faults, &message);
        return None;
    }
    entry.choice(&PadWord::ALL, faults)
}

fn lamps(entry: Entry<'_>, faults: &mut Faults<'_>) -> Vec<(u16, PadLamp)> {
    let shows = [("armed", PadLamp::Armed), ("playing", PadLamp::Playing), ("fault", PadLamp::Fault)];
    let mut lamps = Vec::new();
    for (name, value) in entry.table(faults).into_iter().flatten() {
        let entry = Entry::new(name.get_ref(), value);
        let (code, shown) = (lamp_code(entry.key), entry.choice(&shows, faults));
        if code.is_none() {
            entry.fault(faults, &format!("is no lamp; there are {}", names().1.join(", ")));
        }
        lamps.extend(code.zip(shown));
    }
    lamps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::{faults_of, hall_with};

    #[test]
    fn a_pad_says_what_its_keys_ask_and_its_lamps_show() {
        assert_eq!(hall_with("").buttons, []);
        let hall = hall_with(
            "[buttons.desk]\ndevice = \"/dev/input/by-id/usb-pad-event-kbd\"\nkeys = { KEY_F13 = \"go\", KEY_ESC = \"stop\", 700 = \
             \"mark\" }\nlamps = { LED_NUML = \"armed\", LED_SCROLLL = \"fault\" }\n[buttons.stage]\ndevice = \
             \"relay:/run/kinocue-buttons/stage.sock\"\nkeys = { BTN_0 = \"pause\", BTN_1 = \"park\" }\ndebounce_ms = 5\n",
        );
        let [desk, stage] = &hall.buttons[..] else { panic!("{:?}", hall.buttons) };
        let mut keys = desk.keys.clone();
        keys.sort_by_key(|(code, _)| *code);
        assert_eq!(keys, [(1, PadWord::Stop), (183, PadWord::Go), (700, PadWord::Mark)]);
        assert_eq!(desk.lamps.len(), 2);
        assert!(desk.lamps.contains(&(0, PadLamp::Armed)) && desk.lamps.contains(&(2, PadLamp::Fault)));
        assert_eq!((desk.debounce, stage.debounce), (Duration::from_millis(30), Duration::from_millis(5)));
        assert_eq!(stage.device, PadDevice::Relay("/run/kinocue-buttons/stage.sock".into()));
        assert_eq!((desk.has_stop(), stage.has_stop()), (true, false));
    }

    #[test]
    fn what_no_button_may_ask_and_what_is_no_key_is_refused() {
        let wrong = [
            ("", "[buttons.desk] has no device, which is needed"),
            ("keys = { KEY_A = \"arm\" }", "KEY_A: arm is never asked by a button"),
            ("keys = { KEY_A = \"resume\" }", "KEY_A: resume is never asked by a button"),
            ("keys = { KEY_A = \"start\" }", "\"start\" is not one of go, stop, pause, park, mark"),
            ("keys = { KEY_ESCAPE = \"stop\" }", "did you mean KEY_ESC?"),
            ("keys = { KEY_ESC = \"stop\", 1 = \"go\" }", "stands there already, by another name"),
            ("keys = {}", "keys: is empty"),
            ("device = \"pad0\"", "\"pad0\" is no device"),
            ("lamps = { LED_RED = \"fault\" }", "LED_RED: is no lamp; there are LED_NUML"),
            ("lamps = { LED_NUML = \"parked\" }", "\"parked\" is not one of armed, playing, fault"),
            ("debounce_ms = 5000", "debounce_ms: 5000 is outside 0..=1000"),
        ];
        for (text, says) in wrong {
            let faults = faults_of(&format!("[buttons.desk]\n{text}\n"));
            assert!(faults.iter().any(|fault| fault.contains(says)), "{text}: {faults:?}");
        }
        let pad =
            |name| format!("[buttons.{name}]\ndevice = \"/dev/input/event3\"\nkeys = {{ 1 = \"stop\" }}\n");
        let twice = faults_of(&(pad("a") + &pad("b")));
        assert!(twice[0].contains("b: [buttons.a] has that device already"), "{twice:?}");
    }
}
