//! Reads one table of a TOML document and notes every fault of it, instead of stopping at the first.

use std::fmt::Display;
use std::net::SocketAddrV4;
use std::ops::RangeInclusive;

use jiff::civil::Time;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::fault::Faults;
use crate::plain;
use crate::time::is_second_60;

/// How alike two words must be, 0 to 1, for one to be taken as a slip for the other.
const ALIKE: f64 = 0.75;

/// The kinds of whole number that settings have.
pub(crate) trait Whole: TryFrom<i64> + PartialOrd + Display {}

impl Whole for i32 {}
impl Whole for u8 {}
impl Whole for u32 {}
impl Whole for usize {}

/// A value and its place.
#[derive(Clone, Copy)]
pub(crate) struct Entry<'t> {
    /// What faults call it: its key.
    pub(crate) key: &'t str,
    /// Its first byte in the text.
    pub(crate) at: usize,
    pub(crate) value: &'t DeValue<'t>,
}

impl<'t> Entry<'t> {
    pub(crate) fn new(key: &'t str, value: &'t Spanned<DeValue<'t>>) -> Self {
        Self { key, at: value.span().start, value: value.get_ref() }
    }

    /// A code of four hex digits that means somebody.
    pub(super) fn code(&self, faults: &mut Faults<'_>) -> Option<u16> {
        let text = self.text(faults)?;
        let hex = text.len() == 4 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        match u16::from_str_radix(text, 16).ok().filter(|_| hex) {
            Some(0) => self.fault(faults, "0000 means that no station accepts the frame; use \"ffff\""),
            Some(code) => return Some(code),
            None => {
                let message =
                    format!("{text:?} is neither \"station\" nor four hex digits, such as \"ffff\"");
                self.fault(faults, &message);
            }
        }
        None
    }

    /// Notes what is wrong with it.
    pub(crate) fn fault(&self, faults: &mut Faults<'_>, message: &str) {
        faults.note(self.at, format!("{}: {message}", self.key));
    }

    fn wrong_type(&self, faults: &mut Faults<'_>, wanted: &str) {
        self.fault(faults, &format!("expected {wanted}, not {}", kind(self.value)));
    }

    pub(crate) fn table(&self, faults: &mut Faults<'_>) -> Option<&'t DeTable<'t>> {
        let table = self.value.as_table();
        if table.is_none() {
            self.wrong_type(faults, "a table");
        }
        table
    }

    /// The values of an array, each under the array's own key.
    pub(crate) fn array(&self, faults: &mut Faults<'_>) -> Option<Vec<Self>> {
        let Some(array) = self.value.as_array() else {
            self.wrong_type(faults, "an array");
            return None;
        };
        Some(array.iter().map(|value| Entry::new(self.key, value)).collect())
    }

    pub(crate) fn text(&self, faults: &mut Faults<'_>) -> Option<&'t str> {
        let text = self.value.as_str();
        match text {
            None => self.wrong_type(faults, "a string"),
            Some(text) if text.trim().is_empty() || text.chars().any(char::is_control) => {
                self.fault(faults, &format!("{text:?} is empty, or has control characters"));
                return None;
            }
            Some(_) => {}
        }
        text
    }

    /// True or false.
    pub(crate) fn switch(&self, faults: &mut Faults<'_>) -> Option<bool> {
        let switch = self.value.as_bool();
        if switch.is_none() {
            self.wrong_type(faults, "true or false");
        }
        switch
    }

    /// One of a few words, as what it stands for.
    pub(crate) fn choice<T: Copy>(&self, choices: &[(&str, T)], faults: &mut Faults<'_>) -> Option<T> {
        let text = self.text(faults)?;
        let chosen = choices.iter().find(|(word, _)| *word == text).map(|&(_, value)| value);
        if chosen.is_none() {
            let words: Vec<_> = choices.iter().map(|(word, _)| *word).collect();
            let hint = did_you_mean(text, words.iter().copied());
            self.fault(faults, &format!("{text:?} is not one of {}{hint}", words.join(", ")));
        }
        chosen
    }

    /// A time of day, `19:00` or `19:00:30`.
    pub(crate) fn time(&self, faults: &mut Faults<'_>) -> Option<Time> {
        let text = self.text(faults)?;
        let digits = |part: &str| part.len() == 2 && part.bytes().all(|byte| byte.is_ascii_digit());
        let spelt = text.split(':').all(digits) && matches!(text.len(), 5 | 8);
        let time = text.parse().ok().filter(|_| spelt && !is_second_60(text));
        if time.is_none() {
            self.fault(faults, &format!("{text:?} is not a time of day, such as \"19:00\" or \"19:00:30\""));
        }
        time
    }

    /// A finite number, whole or not.
    pub(crate) fn number(&self, faults: &mut Faults<'_>) -> Option<f64> {
        let number = match self.value {
            DeValue::Integer(digits) if digits.radix() == 10 => digits.as_str().parse().ok(),
            DeValue::Integer(_) => {
                whole_number(self.value).and_then(|n| u32::try_from(n).ok()).map(f64::from)
            }
            DeValue::Float(digits) => digits.as_str().parse().ok(),
            _ => {
                self.wrong_type(faults, "a number");
                return None;
            }
        };
        let finite = number.filter(|number: &f64| number.is_finite());
        if finite.is_none() {
            self.fault(faults, &format!("{} is not a finite number", shown(self.value)));
        }
        finite
    }

    pub(crate) fn number_in(&self, range: RangeInclusive<f64>, faults: &mut Faults<'_>) -> Option<f64> {
        let number = self.number(faults)?;
        if !range.contains(&number) {
            let (least, most) = (range.start(), range.end());
            self.fault(faults, &format!("{} is outside {least}..={most}", shown(self.value)));
            return None;
        }
        Some(number)
    }

    pub(crate) fn whole_in<T: Whole>(&self, range: RangeInclusive<T>, faults: &mut Faults<'_>) -> Option<T> {
        if !self.value.is_integer() {
            self.wrong_type(faults, "a whole number");
            return None;
        }
        let whole = whole_number(self.value).and_then(|n| T::try_from(n).ok());
        let within = whole.filter(|n| range.contains(n));
        if within.is_none() {
            let (least, most) = (range.start(), range.end());
            self.fault(faults, &format!("{} is outside {least}..={most}", shown(self.value)));
        }
        within
    }
}

/// One table that is being read.
pub(crate) struct Section<'t, 'f, 'x> {
    name: String,
    at: usize,
    table: &'t DeTable<'t>,
    asked: Vec<&'static str>,
    pub(crate) faults: &'f mut Faults<'x>,
}

impl<'t, 'f, 'x> Section<'t, 'f, 'x> {
    /// Starts on the table called `name`, whose header is at byte `at`.
    pub(crate) fn new(
        name: impl Into<String>,
        at: usize,
        table: &'t DeTable<'t>,
        faults: &'f mut Faults<'x>,
    ) -> Self {
        Self { name: name.into(), at, table, asked: Vec::new(), faults }
    }

    /// Notes each key of `keys` that the table has not.
    pub(crate) fn require(&mut self, keys: &[&str]) {
        for key in keys.iter().filter(|key| !self.table.contains_key(**key)) {
            self.faults.note_missing(self.at, format!("{} has no {key}, which is needed", self.name));
        }
    }

    /// The value of `key`, which the section then knows.
    pub(crate) fn get(&mut self, key: &'static str) -> Option<Entry<'t>> {
        self.asked.push(key);
        self.table.get(key).map(|value| Entry::new(key, value))
    }

    /// Notes a key that says nothing here, and why.
    pub(crate) fn refuse(&mut self, key: &'static str, why: &str) {
        if let Some(entry) = self.get(key) {
            entry.fault(self.faults, why);
        }
    }

    pub(crate) fn text(&mut self, key: &'static str) -> Option<String> {
        self.get(key)?.text(self.faults).map(str::to_owned)
    }

    pub(crate) fn number_in(&mut self, key: &'static str, range: RangeInclusive<f64>) -> Option<f64> {
        self.get(key)?.number_in(range, self.faults)
    }

    pub(crate) fn whole_in<T: Whole>(&mut self, key: &'static str, range: RangeInclusive<T>) -> Option<T> {
        self.get(key)?.whole_in(range, self.faults)
    }

    pub(crate) fn above_zero(&mut self, key: &'static str) -> Option<f64> {
        let entry = self.get(key)?;
        let number = entry.number(self.faults)?;
        if number <= 0.0 {
            entry.fault(self.faults, &format!("{} is not above 0", shown(entry.value)));
            return None;
        }
        Some(number)
    }

    pub(crate) fn address(&mut self, key: &'static str) -> Option<SocketAddrV4> {
        let entry = self.get(key)?;
        let text = entry.text(self.faults)?;
        let address = text.parse().ok();
        if address.is_none() {
            entry.fault(
                self.faults,
                &format!("{text:?} is not an IPv4 address and port, such as 192.168.15.201:7408"),
            );
        }
        address
    }

    /// One of a few words, as what it stands for.
    pub(crate) fn choice<T: Copy>(&mut self, key: &'static str, choices: &[(&str, T)]) -> Option<T> {
        self.get(key)?.choice(choices, self.faults)
    }

    /// Notes every key that nothing asked for.
    pub(crate) fn finish(self) {
        for key in self.table.keys().filter(|key| !self.asked.contains(&key.get_ref().as_ref())) {
            let word: &str = key.get_ref();
            let (word, hint) = (plain::seen(word), did_you_mean(word, self.asked.iter().copied()));
            self.faults.note(key.span().start, format!("{word}: unknown key in {}{hint}", self.name));
        }
    }
}

/// `; did you mean x?` for the word most like `word`, or nothing.
pub(crate) fn did_you_mean<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> String {
    let word = word.to_lowercase();
    let likeness = |candidate: &str| strsim::jaro_winkler(&word, &candidate.to_lowercase());
    let best = known.max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    best.filter(|best| likeness(best) >= ALIKE)
        .map_or_else(String::new, |best| format!("; did you mean {best}?"))
}

/// That there is no `what` of that name, with the one that it may be a slip for.
pub(crate) fn there_is_no<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> String {
    format!("there is no {what} {}{}", plain::seen(name), did_you_mean(name, known))
}

fn whole_number(value: &DeValue<'_>) -> Option<i64> {
    let digits = value.as_integer()?;
    i64::from_str_radix(digits.as_str(), digits.radix()).ok()
}

fn shown(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Integer(digits) => digits.to_string(),
        DeValue::Float(digits) => digits.to_string(),
        other => kind(other).to_owned(),
    }
}

fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number with a point",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date or time",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}
