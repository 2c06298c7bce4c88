//! What every register is: one data file, `registers.csv`, read once. The commands, preflight, the virtual controllers
//! and the documentation all ask this table.

use std::ops::RangeInclusive;
use std::sync::OnceLock;

use serde::Serialize;

use super::Address;
use crate::wire::Dialect;

/// The columns of the data file.
const COLUMNS: usize = 12;

/// Whose register it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Family {
    /// Every controller has it.
    Both,
    /// The SMC manual alone has it.
    Smc,
    /// The IMAX manual alone has it; MBOX controllers go by that.
    Mbox,
}

impl Family {
    /// True if a controller of `dialect` has it.
    #[must_use]
    pub(crate) const fn has(self, dialect: Dialect) -> bool {
        matches!((self, dialect), (Self::Both, _) | (Self::Smc, Dialect::Smc) | (Self::Mbox, Dialect::Mbox))
    }
}

/// What has to be heeded before a register is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub(crate) struct Flags {
    /// A network setting: a wrong one makes the controller unreachable.
    pub(crate) network: bool,
    /// The controller's own address or hardware address; in no two controllers the same.
    pub(crate) identity: bool,
    /// Can take back the factory settings.
    pub(crate) factory: bool,
    /// Writing it moves the seat.
    pub(crate) moves: bool,
    /// Writing it does something; it does not read what was written.
    pub(crate) command: bool,
    /// Not to be written: it is measured, or the manuals disagree about it.
    pub(crate) never: bool,
}

/// What a register is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Register {
    /// Which one.
    #[serde(rename = "register")]
    pub address: Address,
    /// What it is called, in lower case; like no other's.
    pub(crate) name: String,
    /// The unit of its values; empty for plain numbers.
    pub(crate) unit: &'static str,
    /// The least value that makes sense.
    pub(crate) min: u16,
    /// The greatest value that makes sense.
    pub(crate) max: u16,
    /// Its value in the factory by the IMAX manual; `None` if that has none.
    pub(crate) default_imax: Option<u16>,
    /// The same by the SMC manual, where that says anything of its own.
    pub(crate) default_smc: Option<u16>,
    /// Whose it is.
    pub(crate) dialect: Family,
    /// True if PA0f = 2 keeps it over a power cycle.
    pub(crate) saved: bool,
    /// What has to be heeded before it is written.
    pub(crate) flags: Flags,
    /// Where the manuals have it: manual and section.
    pub(crate) source: &'static str,
    /// What its values mean, parted by semicolons; may be empty.
    pub(crate) meaning: &'static str,
}

impl Register {
    /// Its value in a controller of `dialect` as it leaves the factory, where a manual tells.
    #[must_use]
    pub(crate) fn default(&self, dialect: Dialect) -> Option<u16> {
        match dialect {
            Dialect::Smc => self.default_smc.or(self.default_imax),
            Dialect::Mbox => self.default_imax,
        }
    }

    /// The values that make sense.
    #[must_use]
    pub(crate) const fn range(&self) -> RangeInclusive<u16> {
        self.min..=self.max
    }

    /// What `value` means, where the manuals put it in words.
    #[must_use]
    pub(crate) fn says(&self, value: u16) -> Option<&'static str> {
        self.meaning.split(';').find_map(|part| {
            let (number, words) = part.split_once(':')?;
            (number.trim().parse() == Ok(value)).then_some(words.trim())
        })
    }
}

/// Every register that the manuals document, parameters first, in the order of their numbers.
#[derive(Debug)]
pub struct Table(Vec<Register>);

impl Table {
    /// All of them.
    pub(crate) fn iter(&self) -> std::slice::Iter<'_, Register> {
        self.0.iter()
    }

    /// Those that controllers of `dialect` have.
    pub fn of(&self, dialect: Dialect) -> impl Iterator<Item = &Register> {
        self.0.iter().filter(move |register| register.dialect.has(dialect))
    }

    /// The register at an address; none for drives and where the manuals have nothing.
    #[must_use]
    pub(crate) fn get(&self, address: Address) -> Option<&Register> {
        self.0.binary_search_by_key(&address, |register| register.address).ok().map(|index| &self.0[index])
    }

    /// True if controllers of `dialect` have what is at an address. Drives can be asked through SMC controllers only;
    /// which registers they have, their own manuals say.
    #[must_use]
    pub(crate) fn has(&self, address: Address, dialect: Dialect) -> bool {
        match self.get(address) {
            Some(register) => register.dialect.has(dialect),
            None => address.is_servo() && dialect == Dialect::Smc,
        }
    }

    /// The register called `name`; capitals do not matter, and `-` and `_` stand for spaces.
    #[must_use]
    pub(crate) fn by_name(&self, name: &str) -> Option<&Register> {
        let name = name.to_lowercase().replace(['-', '_'], " ");
        self.0.iter().find(|register| register.name.to_lowercase().replace('-', " ") == name)
    }

    /// The factory value of a parameter for a controller of `dialect`; 0 if the manuals say nothing.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn factory(&self, parameter: u8, dialect: Dialect) -> u16 {
        self.get(Address::Pa(parameter)).and_then(|register| register.default(dialect)).unwrap_or(0)
    }
}

impl<'t> IntoIterator for &'t Table {
    type Item = &'t Register;
    type IntoIter = std::slice::Iter<'t, Register>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// The one table of registers.
///
/// # Panics
/// Never: a test reads the same data file.
#[must_use]
pub fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| read(include_str!("registers.csv")).expect("a test reads this very file"))
}

/// Reads the data file; a fault names its line.
fn read(text: &'static str) -> Result<Table, String> {
    let rows = text.lines().zip(1..).filter(|(line, _)| !line.starts_with('#')).skip(1); // the header
    let mut registers = Vec::new();
    for (line, number) in rows {
        let row = row(line).ok_or_else(|| format!("line {number} is not a register: {line}"))?;
        registers.extend(row);
    }
    Ok(Table(registers))
}

/// The registers of one row of the data file.
fn row(line: &'static str) -> Option<Vec<Register>> {
    let columns: [&'static str; COLUMNS] = line.splitn(COLUMNS, ',').collect::<Vec<_>>().try_into().ok()?;
    let [numbers, name, unit, min, max, imax, smc, dialect, saved, flags, source, meaning] = columns;
    let (space, numbers) = numbers.split_at_checked(2)?;
    let of: fn(u8) -> Address = match space {
        "PA" => Address::Pa,
        "DP" => Address::Dp,
        _ => return None,
    };
    let (first, last) = numbers.split_once("..").unwrap_or((numbers, numbers));
    let hex = |digits| u8::from_str_radix(digits, 16).ok();
    let optional = |text: &str| if text.is_empty() { Some(None) } else { text.parse().ok().map(Some) };
    let register = Register {
        address: of(hex(first)?),
        name: name.to_owned(),
        unit,
        min: min.parse().ok()?,
        max: max.parse().ok()?,
        default_imax: optional(imax)?,
        default_smc: optional(smc)?,
        dialect: family(dialect)?,
        saved: yes(saved)?,
        flags: read_flags(flags)?,
        source,
        meaning,
    };
    let run = (hex(first)?..=hex(last)?).zip(1..);
    Some(run.map(|(number, n): (u8, u8)| numbered(&register, of(number), n)).collect())
}

fn numbered(register: &Register, address: Address, n: u8) -> Register {
    Register { address, name: register.name.replace("{n}", &n.to_string()), ..register.clone() }
}

fn family(text: &str) -> Option<Family> {
    match text {
        "both" => Some(Family::Both),
        "smc" => Some(Family::Smc),
        "mbox" => Some(Family::Mbox),
        _ => None,
    }
}

fn yes(text: &str) -> Option<bool> {
    match text {
        "yes" => Some(true),
        "no" => Some(false),
        _ => None,
    }
}

fn read_flags(text: &str) -> Option<Flags> {
    let mut flags = Flags::default();
    for flag in text.split_whitespace() {
        match flag {
            "network" => flags.network = true,
            "identity" => flags.identity = true,
            "factory" => flags.factory = true,
            "moves" => flags.moves = true,
            "command" => flags.command = true,
            "never" => flags.never = true,
            _ => return None,
        }
    }
    Some(flags)
}

#[cfg(test)]
mod tests;
