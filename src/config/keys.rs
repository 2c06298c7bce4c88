//! Names of keys and lamps as the kernel has them (linux/input-event-codes.h), of those that pads and keyboards have.

/// The greatest code of a key (KEY_MAX).
pub(crate) const LAST_KEY: u16 = 0x2ff;

/// Names of keys with codes one after the other, from the first one's on.
const KEYS: [(u16, &str, &str); 10] = [
    (
        1,
        "KEY_",
        "ESC 1 2 3 4 5 6 7 8 9 0 MINUS EQUAL BACKSPACE TAB Q W E R T Y U I O P LEFTBRACE RIGHTBRACE ENTER LEFTCTRL A S D F G H \
         J K L SEMICOLON APOSTROPHE GRAVE LEFTSHIFT BACKSLASH Z X C V B N M COMMA DOT SLASH RIGHTSHIFT KPASTERISK LEFTALT SPACE \
         CAPSLOCK F1 F2 F3 F4 F5 F6 F7 F8 F9 F10 NUMLOCK SCROLLLOCK KP7 KP8 KP9 KPMINUS KP4 KP5 KP6 KPPLUS KP1 KP2 KP3 KP0 KPDOT",
    ),
    (86, "KEY_", "102ND F11 F12"),
    (
        96,
        "KEY_",
        "KPENTER RIGHTCTRL KPSLASH SYSRQ RIGHTALT LINEFEED HOME UP PAGEUP LEFT RIGHT END DOWN PAGEDOWN INSERT DELETE",
    ),
    (113, "KEY_", "MUTE VOLUMEDOWN VOLUMEUP POWER KPEQUAL KPPLUSMINUS PAUSE"),
    (163, "KEY_", "NEXTSONG PLAYPAUSE PREVIOUSSONG STOPCD"),
    (183, "KEY_", "F13 F14 F15 F16 F17 F18 F19 F20 F21 F22 F23 F24"),
    (0x100, "BTN_", "0 1 2 3 4 5 6 7 8 9"),
    (0x110, "BTN_", "LEFT RIGHT MIDDLE SIDE EXTRA FORWARD BACK TASK"),
    (0x120, "BTN_", "TRIGGER THUMB THUMB2 TOP TOP2 PINKIE BASE BASE2 BASE3 BASE4 BASE5 BASE6"),
    (0x130, "BTN_", "SOUTH EAST C NORTH WEST Z TL TR TL2 TR2 SELECT START MODE THUMBL THUMBR"),
];

/// Names of lamps, from code 0 on.
const LAMPS: &str = "NUML CAPSL SCROLLL COMPOSE KANA SLEEP SUSPEND MUTE MISC MAIL CHARGING";

fn keys() -> impl Iterator<Item = (u16, String)> {
    let named = |(first, kind, names): (u16, &'static str, &'static str)| {
        (first..).zip(names.split(' ')).map(move |(code, name)| (code, format!("{kind}{name}")))
    };
    KEYS.into_iter().flat_map(named)
}

fn lamps() -> impl Iterator<Item = (u16, String)> {
    (0..).zip(LAMPS.split(' ')).map(|(code, name)| (code, format!("LED_{name}")))
}

/// The code of a key, by its name or its number.
pub(super) fn key_code(name: &str) -> Option<u16> {
    let number = name.parse().ok().filter(|code| (1..=LAST_KEY).contains(code));
    number.or_else(|| code_of(keys(), name))
}

/// The code of a lamp, by its name.
pub(super) fn lamp_code(name: &str) -> Option<u16> {
    code_of(lamps(), name)
}

fn code_of(mut all: impl Iterator<Item = (u16, String)>, name: &str) -> Option<u16> {
    all.find(|(_, one)| one == name).map(|(code, _)| code)
}

/// All names of keys, and of lamps.
pub(super) fn names() -> (Vec<String>, Vec<String>) {
    (keys().map(|(_, name)| name).collect(), lamps().map(|(_, name)| name).collect())
}

/// What a configuration calls a key: its name, or its number.
#[must_use]
pub(crate) fn key_name(code: u16) -> String {
    keys().find(|(one, _)| *one == code).map_or_else(|| code.to_string(), |(_, name)| name)
}

/// What a configuration calls a lamp; none for one that it cannot name.
#[must_use]
pub(crate) fn lamp_name(code: u16) -> Option<String> {
    lamps().find(|(one, _)| *one == code).map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_the_codes_that_the_kernel_gives_them() {
        // linux/input-event-codes.h.
        let kernel = [
            ("KEY_ESC", 1),
            ("KEY_ENTER", 28),
            ("KEY_RIGHTSHIFT", 54),
            ("KEY_SPACE", 57),
            ("KEY_F10", 68),
            ("KEY_KPDOT", 83),
            ("KEY_F12", 88),
            ("KEY_KPENTER", 96),
            ("KEY_DELETE", 111),
            ("KEY_PAUSE", 119),
            ("KEY_PLAYPAUSE", 164),
            ("KEY_F13", 183),
            ("KEY_F24", 194),
            ("BTN_9", 0x109),
            ("BTN_TASK", 0x117),
            ("BTN_BASE6", 0x12b),
            ("BTN_THUMBR", 0x13e),
        ];
        for (name, code) in kernel {
            assert_eq!((key_code(name), key_name(code)), (Some(code), name.to_owned()));
        }
        assert_eq!((lamp_code("LED_NUML"), lamp_code("LED_CHARGING")), (Some(0), Some(10)));
        assert_eq!((key_code("700"), key_name(700)), (Some(700), "700".to_owned()));
        assert!(["0", "768", "F13", "key_esc", ""].into_iter().all(|name| key_code(name).is_none()));
    }
}
