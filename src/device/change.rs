//! What may be written to a controller: checked before anything is sent.

use super::{Address, Assignment, table};
use crate::wire::Dialect;

/// Why a value is not written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum Objection {
    /// It makes no sense there.
    #[error("{address}={value} is outside {min}..={max}, the values of {name}")]
    Range {
        /// Which register.
        address: Address,
        /// What it should have held.
        value: u16,
        /// Its least value.
        min: u16,
        /// Its greatest value.
        max: u16,
        /// What it is called.
        name: &'static str,
    },
    /// The register is not for writing.
    #[error("{address} ({name}) is not written: {}", never(*address))]
    Never {
        /// Which register.
        address: Address,
        /// What it is called.
        name: &'static str,
    },
    /// The controller's dialect has no such register.
    #[error("{address} ({name}) is not a register of {} controllers", dialect_name(*dialect))]
    Dialect {
        /// Which register.
        address: Address,
        /// What it is called.
        name: &'static str,
        /// Whose it is not.
        dialect: Dialect,
    },
    /// A network setting, without being forced.
    #[error(
        "{address} ({name}) is a network setting, and a wrong one makes the controller unreachable; --force writes it"
    )]
    Network {
        /// Which register.
        address: Address,
        /// What it is called.
        name: &'static str,
    },
    /// The factory reset, without being forced.
    #[error("{address}=1 restores all factory settings; --force writes it")]
    Factory {
        /// Which register.
        address: Address,
    },
}

fn never(address: Address) -> &'static str {
    match address {
        Address::Pa(0x00) => "the manuals disagree about its values; set it at the controller itself",
        Address::Pa(_) => "the manuals disagree about which axis it is for; set it at the controller itself",
        _ => "it is measured",
    }
}

/// What a dialect is called in configurations.
#[must_use]
pub(crate) const fn dialect_name(dialect: Dialect) -> &'static str {
    match dialect {
        Dialect::Smc => "smc",
        Dialect::Mbox => "mbox",
    }
}

/// Checks a value for a controller of `dialect`. `force` lets network settings and the factory reset through, and
/// nothing else. What the registers of a drive take is not known here.
///
/// # Errors
/// The [`Objection`].
pub(crate) fn check(assignment: Assignment, dialect: Dialect, force: bool) -> Result<(), Objection> {
    let Assignment { address, value } = assignment;
    let Some(register) = table().get(address) else {
        let name = "a register of a servo drive";
        let has = table().has(address, dialect);
        return if has { Ok(()) } else { Err(Objection::Dialect { address, name, dialect }) };
    };
    let name = register.name.as_str();
    let flags = register.flags;
    if flags.never {
        return Err(Objection::Never { address, name });
    }
    if !register.dialect.has(dialect) {
        return Err(Objection::Dialect { address, name, dialect });
    }
    if !register.range().contains(&value) {
        return Err(Objection::Range { address, value, min: register.min, max: register.max, name });
    }
    if flags.network && !force {
        return Err(Objection::Network { address, name });
    }
    if flags.factory && value == 1 && !force {
        return Err(Objection::Factory { address });
    }
    Ok(())
}

/// True if writing the value moves the seat.
#[must_use]
pub(crate) fn moves(address: Address) -> bool {
    table().get(address).is_some_and(|register| register.flags.moves)
}

/// True if the register keeps what is written to it, so that reading it back proves the write.
#[must_use]
pub(crate) fn keeps(address: Address) -> bool {
    table().get(address).is_none_or(|register| !register.flags.command)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn objection(address: Address, value: u16, dialect: Dialect, force: bool) -> Option<String> {
        check(Assignment { address, value }, dialect, force).err().map(|objection| objection.to_string())
    }

    #[test]
    fn a_value_out_of_range_names_register_value_and_limit() {
        let told = objection(Address::Pa(0x95), 12, Dialect::Smc, true).unwrap();
        assert_eq!(told, "PA95=12 is outside 0..=11, the values of axis offset");
        assert_eq!(objection(Address::Pa(0x95), 11, Dialect::Smc, false), None);
    }

    #[test]
    fn every_network_setting_and_the_factory_reset_need_force() {
        let network = (0x10..=0x1b).chain(0x20..=0x29).map(Address::Pa);
        for address in network {
            let told = objection(address, 1, Dialect::Smc, false).unwrap();
            assert!(told.contains("network setting"), "{told}");
            assert_eq!(objection(address, 1, Dialect::Smc, true), None);
        }
        let factory = Address::Pa(0x0f);
        assert!(objection(factory, 1, Dialect::Smc, false).unwrap().contains("--force"));
        assert_eq!(objection(factory, 1, Dialect::Smc, true), None);
        assert_eq!(objection(factory, 2, Dialect::Smc, false), None, "keeping settings is harmless");
    }

    #[test]
    fn what_the_imax_manual_recommends_is_not_refused() {
        assert_eq!(objection(Address::Pa(0x52), 5, Dialect::Mbox, false), None, "IMAX manual 5.8");
    }

    #[test]
    fn measured_and_disputed_registers_are_not_written_even_by_force() {
        assert!(objection(Address::Dp(0x06), 1, Dialect::Smc, true).unwrap().ends_with("it is measured"));
        for disputed in [0x00, 0x42, 0x48] {
            assert!(objection(Address::Pa(disputed), 1, Dialect::Smc, true).is_some());
        }
    }

    #[test]
    fn a_register_of_the_other_dialect_is_refused() {
        let told = objection(Address::Pa(0x55), 1, Dialect::Mbox, true).unwrap();
        assert_eq!(told, "PA55 (amplitude) is not a register of mbox controllers");
    }

    #[test]
    fn registers_of_drives_pass_and_keep_what_is_written() {
        let servo = Address::Servo { servo: 1, number: 508 };
        assert_eq!(objection(servo, 65_535, Dialect::Smc, false), None);
        assert!(objection(servo, 0, Dialect::Mbox, true).unwrap().contains("not a register of mbox"));
        assert!(keeps(servo) && !moves(servo));
        assert!(moves(Address::Pa(8)) && moves(Address::Dp(0xf0)) && !keeps(Address::Pa(0x0f)));
    }
}
