//! The settings of controllers as a file: kept, read again, and compared with what a controller holds.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::net::SocketAddrV4;

use serde::{Deserialize, Serialize};

use super::change::dialect_name;
use super::{Address, Register, table};
use crate::wire::Dialect;

/// The version of the file.
const VERSION: u32 = 1;

/// What registers hold.
pub(crate) type Values = BTreeMap<Address, u16>;

/// Why a text is no settings file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// No TOML, or not of this shape.
    #[error("is not a settings file")]
    Shape(#[source] Box<toml::de::Error>),
    /// A later version.
    #[error("is a settings file of version {0}; this kinocue reads version {VERSION}")]
    Version(u32),
    /// Nobody's settings.
    #[error("has no settings of any controller")]
    Empty,
    /// A key that is no parameter.
    #[error("controller {controller}: {key} is not a parameter of the manuals, PA00 to PAcf")]
    Key {
        /// Whose.
        controller: String,
        /// What stands there.
        key: String,
    },
}

/// The settings of one controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Saved {
    /// Its name.
    pub(crate) name: String,
    /// Where it was reached.
    pub(crate) address: SocketAddrV4,
    /// The dialect it was read in.
    pub(crate) dialect: Dialect,
    /// Its parameters.
    pub(crate) values: Values,
}

/// The settings of a seat on serial drives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SavedDrives {
    /// Its name.
    pub(crate) name: String,
    /// Its link.
    pub(crate) address: String,
    /// Unit and register, as `16.R38`, with what that holds.
    pub(crate) registers: BTreeMap<String, i64>,
}

/// All that a file has.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SavedHall {
    /// Controllers on the network.
    pub(crate) controllers: Vec<Saved>,
    /// Seats on links.
    pub(crate) drives: Vec<SavedDrives>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    kinocue_settings: u32,
    #[serde(default)]
    controller: BTreeMap<String, Section>,
    #[serde(default)]
    drives: BTreeMap<String, DriveSection>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveSection {
    address: String,
    registers: BTreeMap<String, i64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    address: SocketAddrV4,
    dialect: Spelling,
    parameters: BTreeMap<String, u16>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Spelling {
    Smc,
    Mbox,
}

/// The parameters of a controller that are settings: all but those that are commands.
pub(crate) fn parameters(dialect: Dialect) -> impl Iterator<Item = &'static Register> {
    let parameter = |register: &&Register| matches!(register.address, Address::Pa(_));
    table().of(dialect).filter(parameter).filter(|register| !register.flags.command)
}

/// The settings as the text of a file.
#[must_use]
pub(crate) fn text(all: &[Saved], drives: &[SavedDrives]) -> String {
    let mut text = String::from("# Parameters of motion controllers, read by `kinocue register save`.\n");
    let done = "a String takes what is written to it";
    writeln!(text, "kinocue_settings = {VERSION}").expect(done);
    for one in all {
        let name = quoted(&one.name);
        writeln!(text, "\n[controller.{name}]").expect(done);
        writeln!(text, "address = \"{}\"\ndialect = \"{}\"", one.address, dialect_name(one.dialect))
            .expect(done);
        writeln!(text, "\n[controller.{name}.parameters]").expect(done);
        for (address, value) in &one.values {
            let what = table().get(*address).map_or("", |register| register.name.as_str());
            writeln!(text, "{address} = {value:<6} # {what}").expect(done);
        }
    }
    for one in drives {
        let name = quoted(&one.name);
        writeln!(text, "\n[drives.{name}]\naddress = {}", quoted(&one.address)).expect(done);
        writeln!(text, "\n[drives.{name}.registers]").expect(done);
        for (register, value) in &one.registers {
            writeln!(text, "\"{register}\" = {value}").expect(done);
        }
    }
    text
}

/// A name as a key of TOML.
fn quoted(name: &str) -> String {
    let mut quoted = String::from("\"");
    for c in name.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

/// Reads the text of a settings file.
///
/// # Errors
/// A [`SettingsError`] for the first thing in it that does not belong there.
pub fn parse(text: &str) -> Result<SavedHall, SettingsError> {
    let document: Document = toml::from_str(text).map_err(|error| SettingsError::Shape(Box::new(error)))?;
    if document.kinocue_settings != VERSION {
        return Err(SettingsError::Version(document.kinocue_settings));
    }
    if document.controller.is_empty() && document.drives.is_empty() {
        return Err(SettingsError::Empty);
    }
    let controllers = document.controller.into_iter().map(|(name, section)| saved(name, section));
    let drives = document.drives.into_iter().map(|(name, section)| SavedDrives {
        name,
        address: section.address,
        registers: section.registers,
    });
    Ok(SavedHall { controllers: controllers.collect::<Result<_, _>>()?, drives: drives.collect() })
}

fn saved(name: String, section: Section) -> Result<Saved, SettingsError> {
    let mut values = Values::new();
    for (key, value) in section.parameters {
        let digits = key.strip_prefix("PA").filter(|digits| digits.len() == 2);
        let number = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        let known = number.map(Address::Pa).filter(|address| table().get(*address).is_some());
        let address = known.ok_or(SettingsError::Key { controller: name.clone(), key })?;
        values.insert(address, value);
    }
    let dialect = match section.dialect {
        Spelling::Smc => Dialect::Smc,
        Spelling::Mbox => Dialect::Mbox,
    };
    Ok(Saved { name, address: section.address, dialect, values })
}

/// A parameter that differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct Difference {
    /// Which one.
    #[serde(rename = "register")]
    pub(crate) address: Address,
    /// What the file has.
    pub(crate) saved: u16,
    /// What the controller has.
    pub(crate) found: u16,
}

/// True if two controllers with the same settings may differ here: their own addresses.
#[must_use]
pub(crate) fn is_own(address: Address) -> bool {
    table().get(address).is_some_and(|register| register.flags.identity)
}

/// Where `found` differs from `saved`, in order. A controller's own address is left out unless `own` is set; a register
/// that only one of them has is left out too.
#[must_use]
pub(crate) fn differences(saved: &Values, found: &Values, own: bool) -> Vec<Difference> {
    let pairs = saved.iter().filter_map(|(address, saved)| Some((*address, *saved, *found.get(address)?)));
    pairs
        .filter(|(address, saved, found)| saved != found && (own || !is_own(*address)))
        .map(|(address, saved, found)| Difference { address, saved, found })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saved(name: &str) -> Saved {
        let factory = |register: &Register| (register.address, register.default(Dialect::Smc).unwrap_or(0));
        Saved {
            name: name.to_owned(),
            address: "192.168.15.201:7408".parse().unwrap(),
            dialect: Dialect::Smc,
            values: parameters(Dialect::Smc).map(factory).collect(),
        }
    }

    #[test]
    fn a_file_reads_back_as_it_was_written() {
        let all = [saved("A1"), saved("row \"B\" \\ 2\u{7f}")];
        let registers = BTreeMap::from([("16.R38".to_owned(), -800), ("16.R39".to_owned(), 120_800)]);
        let drives = SavedDrives { name: "L1".to_owned(), address: "link:stalls".to_owned(), registers };
        let text = text(&all, std::slice::from_ref(&drives));
        assert!(text.contains("PA95 = 0      # axis offset"), "{text}");
        assert_eq!(parse(&text).unwrap(), SavedHall { controllers: all.into(), drives: vec![drives] });
    }

    #[test]
    fn commands_are_no_settings() {
        let all: Vec<_> = parameters(Dialect::Smc).map(|register| register.address).collect();
        assert!(!all.contains(&Address::Pa(0x08)) && !all.contains(&Address::Pa(0x0f)));
        assert!(all.contains(&Address::Pa(0x90)) && all.contains(&Address::Pa(0x14)));
    }

    #[test]
    fn exactly_what_differs_is_named_and_a_controllers_own_address_is_not() {
        let before = saved("A1").values;
        let mut after = before.clone();
        for (number, value) in [(0x07, 2_000), (0x55, 5), (0x95, 6), (0x13, 202), (0x14, 7_409), (0x1b, 7)] {
            after.insert(Address::Pa(number), value);
        }
        let named = |own| -> Vec<String> {
            differences(&before, &after, own).iter().map(|one| one.address.to_string()).collect()
        };
        assert_eq!(named(false), ["PA07", "PA55", "PA95"]);
        assert_eq!(named(true), ["PA07", "PA13", "PA14", "PA1b", "PA55", "PA95"]);
    }

    #[test]
    fn what_is_no_settings_file_is_refused_in_words() {
        let error = |text: &str| {
            let error = parse(text).unwrap_err();
            std::error::Error::source(&error).map_or_else(|| error.to_string(), ToString::to_string)
        };
        let head = "kinocue_settings = 1\n[controller.A]\naddress = \"127.0.0.1:7408\"\ndialect = \"smc\"\n";
        assert!(error("kinocue_settings = 2").contains("version 2"));
        assert!(error("kinocue_settings = 1").contains("no settings of any"));
        assert!(error(&format!("{head}parameters = {{ PA99 = 1 }}")).contains("PA99 is not a parameter"));
        assert!(error(&format!("{head}parameters = {{ PA95 = 70000 }}")).contains("70000"));
        assert!(error(&format!("{head}parameters = {{}}\ncolour = 1")).contains("colour"));
        assert!(!error("\u{0}").is_empty());
    }
}
