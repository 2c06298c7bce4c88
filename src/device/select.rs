//! Registers as a person names them: `PA95`, `pa 0x95`, `dp 06..0b`, `dpf0`, `axis-offset`, `servo 1 508..510`, or as the
//! panel of an integrated controller shows them: `CP149`, `cd 006..011`; with `=VALUE` behind them to be written.
//!
//! Numbers of PA and DP are hexadecimal, as both manuals print them; those of CP and CD are decimal, as the panel shows
//! them (SMC manual 2.3); numbers of drives and values are decimal unless they begin with `0x`.

use super::address::CONTROL;
use super::{Address, table};

/// Registers of a drive that one range may name.
const MAX_SERVO_RANGE: usize = 64;
/// How alike two names must be, 0 to 1, for one to be taken as a slip for the other.
const ALIKE: f64 = 0.75;

/// Why words name no registers, or no values for them.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum SelectError {
    /// No number of a register, or a range of them.
    #[error("{word:?} is not a register number; {space} takes {wanted}")]
    Number {
        /// What was read.
        word: String,
        /// Which table.
        space: &'static str,
        /// What belongs there.
        wanted: &'static str,
    },
    /// A range that ends before it begins.
    #[error("{0:?} ends before it begins")]
    Backward(String),
    /// A range of a drive that is too long.
    #[error("{word:?} is {count} registers of a drive; read at most {MAX_SERVO_RANGE} at once")]
    TooMany {
        /// What was read.
        word: String,
        /// How many it names.
        count: usize,
    },
    /// A register that no manual has.
    #[error("{0} is in neither manual; `kinocue register list` shows all")]
    Unknown(Address),
    /// A range in which the manuals have no register.
    #[error("neither manual has a register among {0}; `kinocue register list` shows all")]
    Nothing(String),
    /// No name of a register.
    #[error(
        "{word:?} names no register{hint}; write PA95, dp 06..0b, dpf0, CP149 as the panel shows it, a name of `kinocue \
         register list`, or servo 1 508"
    )]
    Name {
        /// What was read.
        word: String,
        /// A name like it.
        hint: String,
    },
    /// A drive without a register.
    #[error("servo takes the number of a drive, from 1, and of a register: servo 1 508")]
    Servo,
    /// A register without a value.
    #[error("{0} has no value; write {0}=VALUE")]
    NoValue(String),
    /// A value that is no number of a register.
    #[error("{register}={word} is not a whole number of 0..=65535")]
    Value {
        /// Which register.
        register: String,
        /// What was read.
        word: String,
    },
    /// A register with two values.
    #[error("{0} is given two values")]
    Twice(Address),
    /// Nothing was named.
    #[error("no register is given")]
    Nobody,
}

/// Registers that one or a few words name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Selection {
    /// Which, in order.
    pub(crate) addresses: Vec<Address>,
    /// True if a single register was named rather than a range or a table; it must then be there.
    pub(crate) single: bool,
}

/// A value for a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Assignment {
    /// Which register.
    pub(crate) address: Address,
    /// What it shall hold.
    pub(crate) value: u16,
}

/// The registers that `words` name, in the order of the words; all of PA and DP where there are none.
///
/// # Errors
/// A [`SelectError`] for the first words that name none.
pub(crate) fn selections(words: &[String]) -> Result<Vec<Selection>, SelectError> {
    let mut words = SelectionWords::new(words);
    if words.peek().is_none() {
        return Ok(vec![whole(Address::Pa), whole(Address::Dp)]);
    }
    let mut found = Vec::new();
    while words.peek().is_some() {
        found.push(selection(&mut words)?);
    }
    Ok(found)
}

/// The values that `words` give to registers: `PA95=6`, `pa 80..85 = 3000`, `servo 1 508 7`.
///
/// # Errors
/// A [`SelectError`] for the first words that are none; for a register named twice, and where there are no words.
pub(crate) fn assignments(words: &[String]) -> Result<Vec<Assignment>, SelectError> {
    let mut words = SelectionWords::new(words);
    let mut found: Vec<Assignment> = Vec::new();
    while words.peek().is_some() {
        let selection = selection(&mut words)?;
        let register = selection.addresses.first().map(ToString::to_string).unwrap_or_default();
        if words.peek() == Some("=") {
            words.next();
        }
        let word = words.next().ok_or_else(|| SelectError::NoValue(register.clone()))?;
        let value = number(word).ok_or(SelectError::Value { register, word: word.to_owned() })?;
        for address in selection.addresses {
            if found.iter().any(|before| before.address == address) {
                return Err(SelectError::Twice(address));
            }
            found.push(Assignment { address, value });
        }
    }
    if found.is_empty() { Err(SelectError::Nobody) } else { Ok(found) }
}

/// Words one after the other, in small letters, `=` by itself.
struct SelectionWords(Vec<String>, usize);

impl SelectionWords {
    fn new(words: &[String]) -> Self {
        let joined = words.join(" ").to_lowercase().replace('=', " = ");
        Self(joined.split_whitespace().map(str::to_owned).collect(), 0)
    }

    fn peek(&self) -> Option<&str> {
        self.0.get(self.1).map(String::as_str)
    }

    fn next(&mut self) -> Option<&str> {
        self.1 += 1;
        self.0.get(self.1 - 1).map(String::as_str)
    }
}

fn selection(words: &mut SelectionWords) -> Result<Selection, SelectError> {
    let word = words.next().ok_or(SelectError::Nobody)?.to_owned();
    match word.as_str() {
        "pa" => of_table("PA", Address::Pa, words),
        "dp" => of_table("DP", Address::Dp, words),
        "cp" => of_panel(PARAMETERS, words),
        "cd" => of_panel(MONITORS, words),
        "dpf" => control(words),
        "servo" => servo(words),
        _ => attached(&word),
    }
}

/// Registers named by a table and, in the next word, by their numbers; without numbers, the whole table.
fn of_table(
    space: &'static str,
    of: fn(u8) -> Address,
    words: &mut SelectionWords,
) -> Result<Selection, SelectError> {
    match words.peek() {
        Some(next) if begins_with_digits(next) => {
            let next = next.to_owned();
            words.next();
            documented(&next, space, of)
        }
        _ => Ok(whole(of)),
    }
}

/// Names on the panel of an integrated controller count as PA and DP do, in decimal (SMC manual 2.3): CP149 is PA95.
struct PanelName {
    name: &'static str,
    space: &'static str,
    of: fn(u8) -> Address,
}

const PARAMETERS: PanelName = PanelName { name: "CP", space: "PA", of: Address::Pa };
const MONITORS: PanelName = PanelName { name: "CD", space: "DP", of: Address::Dp };

/// `cp 149`, `cd 006..011`; without numbers, the whole table.
fn of_panel(panel: PanelName, words: &mut SelectionWords) -> Result<Selection, SelectError> {
    match words.peek() {
        Some(next) if next.starts_with(|c: char| c.is_ascii_digit()) => {
            let next = next.to_owned();
            words.next();
            on_panel(&next, &panel)
        }
        _ => Ok(whole(panel.of)),
    }
}

/// The documented registers among `numbers` of a panel.
fn on_panel(numbers: &str, panel: &PanelName) -> Result<Selection, SelectError> {
    let bad = || SelectError::Number {
        word: numbers.to_owned(),
        space: panel.name,
        wanted: "000 to 255, or a range like 128..133",
    };
    let decimal = |text: &str| {
        let digits = text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<u8>().ok().filter(|_| digits && text.len() <= 3).ok_or_else(bad)
    };
    let (first, last) = ends(numbers, &panel.name.to_lowercase()).ok_or_else(bad)?;
    let (first, last) = (decimal(first)?, decimal(last)?);
    if last < first {
        return Err(SelectError::Backward(numbers.to_owned()));
    }
    let range = format!("{first:02x}..{last:02x}");
    documented(if numbers.contains('.') { &range } else { &range[..2] }, panel.space, panel.of)
}

/// `dpf 0`: the control registers by their last digit.
fn control(words: &mut SelectionWords) -> Result<Selection, SelectError> {
    let word = words.next().unwrap_or_default().to_owned();
    let bad = || SelectError::Number { word: word.clone(), space: "DPF", wanted: "0 to f" };
    let (first, last) = ends(&word, "dpf").ok_or_else(bad)?;
    let digit = |text: &str| u8::from_str_radix(text, 16).ok().filter(|digit| *digit < 16).ok_or_else(bad);
    let range = format!("{:x}..{:x}", CONTROL + digit(first)?, CONTROL + digit(last)?);
    documented(if first == last { &range[..2] } else { &range }, "DP", Address::Dp)
}

/// `servo 1 508`, `servo 1 PA508..510`.
fn servo(words: &mut SelectionWords) -> Result<Selection, SelectError> {
    let servo = words.next().and_then(number).filter(|servo| *servo > 0).ok_or(SelectError::Servo)?;
    let word = words.next().ok_or(SelectError::Servo)?.to_owned();
    let (first, last) = ends(word.strip_prefix("pa").unwrap_or(&word), "pa").ok_or(SelectError::Servo)?;
    let (first, last) = (number(first).ok_or(SelectError::Servo)?, number(last).ok_or(SelectError::Servo)?);
    if last < first {
        return Err(SelectError::Backward(word));
    }
    let count = usize::from(last - first) + 1;
    if count > MAX_SERVO_RANGE {
        return Err(SelectError::TooMany { word, count });
    }
    let addresses = (first..=last).map(|number| Address::Servo { servo, number }).collect();
    Ok(Selection { addresses, single: first == last })
}

/// `PA95`, `dp06..0b`, or a register's name.
fn attached(word: &str) -> Result<Selection, SelectError> {
    if let Some(register) = table().by_name(word) {
        return Ok(Selection { addresses: vec![register.address], single: true });
    }
    if let Some(numbers) = word.strip_prefix("pa").filter(|numbers| begins_with_digits(numbers)) {
        return documented(numbers, "PA", Address::Pa);
    }
    if let Some(numbers) = word.strip_prefix("dp").filter(|numbers| begins_with_digits(numbers)) {
        return documented(numbers, "DP", Address::Dp);
    }
    for (prefix, panel) in [("cp", PARAMETERS), ("cd", MONITORS)] {
        let digit = |numbers: &&str| numbers.starts_with(|c: char| c.is_ascii_digit());
        if let Some(numbers) = word.strip_prefix(prefix).filter(digit) {
            return on_panel(numbers, &panel);
        }
    }
    Err(SelectError::Name { word: word.to_owned(), hint: alike(word) })
}

fn alike(word: &str) -> String {
    let word = word.replace(['-', '_'], " ");
    let likeness = |name: &str| strsim::jaro_winkler(name, &word);
    let best = table().iter().max_by(|a, b| likeness(&a.name).total_cmp(&likeness(&b.name)));
    best.filter(|register| likeness(&register.name) > ALIKE)
        .map(|register| format!("; did you mean {:?}, {}?", register.name, register.address))
        .unwrap_or_default()
}

/// The documented registers among `numbers`.
fn documented(numbers: &str, space: &'static str, of: fn(u8) -> Address) -> Result<Selection, SelectError> {
    let bad = || SelectError::Number {
        word: numbers.to_owned(),
        space,
        wanted: "00 to ff, or a range like 06..0b",
    };
    let (first, last) = ends(numbers, &space.to_lowercase()).ok_or_else(bad)?;
    let (low, high) = (hex(first).ok_or_else(bad)?, hex(last).ok_or_else(bad)?);
    if high < low {
        return Err(SelectError::Backward(numbers.to_owned()));
    }
    let single = !numbers.contains('.');
    let addresses: Vec<_> = (low..=high).map(of).filter(|address| table().get(*address).is_some()).collect();
    match (addresses.is_empty(), single) {
        (true, true) => Err(SelectError::Unknown(of(low))),
        (true, false) => Err(SelectError::Nothing(format!("{space} {numbers}"))),
        (false, _) => Ok(Selection { addresses, single }),
    }
}

fn whole(of: fn(u8) -> Address) -> Selection {
    let all = (0..=u8::MAX).map(of).filter(|address| table().get(*address).is_some());
    Selection { addresses: all.collect(), single: false }
}

/// First and last of `06..0b`, which may repeat the prefix of its own table (`PA80..PA85`); twice the same of a single one.
/// That of another table is none: `cd` are the digits of PAcd.
fn ends<'t>(text: &'t str, prefix: &str) -> Option<(&'t str, &'t str)> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let last = last.strip_prefix(prefix).unwrap_or(last);
    (!first.is_empty() && !last.is_empty()).then_some((first, last))
}

fn begins_with_digits(text: &str) -> bool {
    let first = text.split("..").next().unwrap_or_default();
    let digits = first.strip_prefix("0x").unwrap_or(first);
    !digits.is_empty() && digits.chars().all(|c| c.is_ascii_hexdigit())
}

fn hex(text: &str) -> Option<u8> {
    let digits = text.strip_prefix("0x").unwrap_or(text);
    (digits.len() <= 2).then(|| u8::from_str_radix(digits, 16).ok()).flatten()
}

/// A number that is decimal unless it begins with `0x`.
fn number(text: &str) -> Option<u16> {
    match text.strip_prefix("0x") {
        Some(digits) => u16::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    fn named(text: &str) -> String {
        match selections(&words(text)) {
            Ok(found) => {
                let all = found.iter().flat_map(|selection| &selection.addresses);
                all.map(ToString::to_string).collect::<Vec<_>>().join(" ")
            }
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn registers_are_named_in_every_way_a_technician_writes_them() {
        for text in ["PA95", "pa95", "pa 95", "pa 0x95", "PA0x95", "axis-offset", "Axis_Offset"] {
            assert_eq!(named(text), "PA95", "{text}");
        }
        for text in ["dpf0", "DPF0", "dp f0", "dpf 0", "dp 0xf0", "reset"] {
            assert_eq!(named(text), "DPF0", "{text}");
        }
        assert_eq!(named("dp 06..0b"), "DP06 DP07 DP08 DP09 DP0a DP0b");
        assert_eq!(named("PA80..PA82 dpf 0..2"), "PA80 PA81 PA82 DPF0 DPF1 DPF2");
        assert_eq!(named("servo 1 508"), "servo 1 508");
        assert_eq!(named("PA02 servo 2 0x1fc..509 dp fe"), "PA02 servo 2 508 servo 2 509 DPFE");
    }

    #[test]
    fn registers_are_named_as_the_panel_of_an_integrated_controller_shows_them() {
        for (text, register) in [("CP149", "PA95"), ("cp 149", "PA95"), ("Cd006", "DP06"), ("cd 240", "DPF0")]
        {
            assert_eq!(named(text), register, "{text}");
        }
        assert_eq!(named("cp128..130 CD006..CD007"), "PA80 PA81 PA82 DP06 DP07");
        assert_eq!(selections(&words("cp")).unwrap(), selections(&words("pa")).unwrap());
        assert!(named("cp 256").contains("CP takes 000 to 255"));
        assert!(named("CP09a").contains("not a register number"));
        assert!(named("CP153").starts_with("PA99 is in neither manual"));
        let given = assignments(&words("CP082=5")).unwrap();
        assert_eq!(given, [Assignment { address: Address::Pa(0x52), value: 5 }]);
    }

    #[test]
    fn every_register_of_the_table_is_found_by_its_own_name_alone_and_as_the_end_of_a_range() {
        for register in table().iter().map(|register| register.address) {
            let name = register.to_string();
            let ways = match register {
                Address::Pa(number) => {
                    vec![
                        format!("pa {number:x}"),
                        format!("CP{number:03}"),
                        format!("cp {number}..CP{number}"),
                    ]
                }
                Address::Dp(number) => {
                    vec![
                        format!("dp 0x{number:x}"),
                        format!("CD{number:03}"),
                        format!("cd {number}..cd{number}"),
                    ]
                }
                Address::Servo { .. } => Vec::new(),
            };
            let range = format!("{name}..{name}");
            for way in [name.clone(), name.to_lowercase(), range].into_iter().chain(ways) {
                assert_eq!(named(&way), name, "{way}");
            }
        }
        assert!(named("PAc0..cd").ends_with(" PAcd"), "{}", named("PAc0..cd"));
        assert_eq!((named("CP192..205"), named("pa c0..PAcd")), (named("PAc0..cd"), named("PAc0..cd")));
        assert!(named("PA80..dp85").contains("is not a register number"), "a range is of one table");
    }

    #[test]
    fn a_range_or_a_table_names_what_the_manuals_have_of_it() {
        assert_eq!(named("pa 98..9d"), "PA98 PA9d");
        assert_eq!(selections(&words("pa")).unwrap()[0].addresses.len(), whole(Address::Pa).addresses.len());
        assert_eq!(selections(&[]).unwrap().len(), 2);
    }

    #[test]
    fn what_names_no_register_is_told_in_one_line() {
        assert!(named("PA99").starts_with("PA99 is in neither manual"));
        assert!(named("pa 99..9c").starts_with("neither manual has a register among PA 99..9c"));
        assert!(named("pa 0x100").contains("\"0x100\" is not a register number"));
        assert!(named("pa 0b..06").contains("ends before it begins"));
        assert!(named("axis-ofset").contains("did you mean \"axis offset\", PA95?"));
        assert!(named("servo 0 508").starts_with("servo takes"));
        assert!(named("servo 1").starts_with("servo takes"));
        assert!(named("servo 1 0..65535").contains("65536 registers"));
        assert!(named("dpf g").contains("0 to f"));
    }

    proptest::proptest! {
        #[test]
        fn no_words_panic(words in proptest::collection::vec("(pa|dp|dpf|cp|cd|servo|=|\\.\\.|0x|[0-9a-f]{1,3}|é| |[A-Z-]{0,4}){0,5}", 0..5)) {
            let _ = selections(&words);
            let _ = assignments(&words);
        }
    }

    #[test]
    fn values_stand_behind_their_registers() {
        let given = |text: &str| match assignments(&words(text)) {
            Ok(found) => {
                found.iter().map(|one| format!("{}={}", one.address, one.value)).collect::<Vec<_>>().join(" ")
            }
            Err(error) => error.to_string(),
        };
        assert_eq!(given("PA95=6 pa 0x93 = 50"), "PA95=6 PA93=50");
        assert_eq!(given("pa 80..81 0xbb8"), "PA80=3000 PA81=3000");
        assert_eq!(given("servo 1 508=7 dpf0=0"), "servo 1 508=7 DPF0=0");
        assert_eq!(given("PA95"), "PA95 has no value; write PA95=VALUE");
        assert_eq!(given("PA95=70000"), "PA95=70000 is not a whole number of 0..=65535");
        assert_eq!(given("PA95=-1"), "PA95=-1 is not a whole number of 0..=65535");
        assert_eq!(given("PA95=1 axis-offset=2"), "PA95 is given two values");
        assert_eq!(assignments(&[]), Err(SelectError::Nobody));
    }
}
