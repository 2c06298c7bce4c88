//! The data file is whole, in order and free of contradictions.

use std::collections::{BTreeMap, BTreeSet};

use super::*;

fn numbers(of: impl Fn(Address) -> Option<u8>) -> BTreeSet<u8> {
    table().iter().filter_map(|register| of(register.address)).collect()
}

fn set(ranges: &[RangeInclusive<u8>]) -> BTreeSet<u8> {
    ranges.iter().cloned().flatten().collect()
}

#[test]
fn every_line_of_the_data_file_is_a_register() {
    let table = read(include_str!("../registers.csv")).unwrap();
    assert!(table.iter().count() > 180);
    assert!(read("header\nPA00,too,few").is_err());
}

#[test]
fn every_parameter_of_the_manuals_is_there_and_no_other() {
    let documented = [
        0x00..=0x1b,
        0x1e..=0x29,
        0x30..=0x48,
        0x4c..=0x4d,
        0x50..=0x52,
        0x54..=0x55,
        0x59..=0x59,
        0x5f..=0x62,
        0x70..=0x75,
        0x80..=0x85,
        0x90..=0x98,
        0x9d..=0xa5,
        0xb0..=0xb5,
        0xc0..=0xcb,
        0xcd..=0xcf,
    ];
    let there = numbers(|address| if let Address::Pa(number) = address { Some(number) } else { None });
    assert_eq!(there, set(&documented));
}

#[test]
fn every_monitor_register_of_the_manuals_is_there_and_no_other() {
    let documented = [
        0x00..=0x02,
        0x06..=0x0b,
        0x18..=0x1d,
        0x21..=0x26,
        0x33..=0x35,
        0x37..=0x38,
        0x3f..=0x43,
        0x48..=0x49,
        0x50..=0x55,
        0x5e..=0x5e,
        0x66..=0x66,
        0x80..=0x81,
        0x83..=0x83,
        0x90..=0x95,
        0xf0..=0xf2,
        0xf5..=0xf6,
        0xfe..=0xff,
    ];
    let there = numbers(|address| if let Address::Dp(number) = address { Some(number) } else { None });
    assert_eq!(there, set(&documented));
}

#[test]
fn it_is_sorted_and_no_two_registers_share_a_number_or_a_name() {
    assert!(table().iter().is_sorted_by(|a, b| a.address < b.address));
    let mut names = BTreeMap::new();
    for register in table() {
        let twin = names.insert(register.name.to_lowercase().replace('-', " "), register.address);
        assert_eq!(twin, None, "{} is also called {}", register.address, register.name);
    }
}

#[test]
fn every_default_lies_in_its_range_and_every_register_says_where_it_comes_from() {
    for register in table() {
        let Register { address, min, max, source, .. } = register;
        assert!(min <= max, "{address}");
        for default in [register.default_imax, register.default_smc].into_iter().flatten() {
            assert!(register.range().contains(&default), "{address} defaults to {default}");
        }
        assert!(source.starts_with("IMAX") || source.starts_with("SMC"), "{address}: {source}");
        let section = if matches!(address, Address::Pa(_)) { "2.3.1" } else { "2.3.3" };
        assert!(source.contains(section), "{address}: {source}");
        let smc_only = source.starts_with("SMC");
        assert_eq!(register.dialect == Family::Smc, smc_only, "{address}: {source}");
        assert_eq!(register.dialect == Family::Mbox, !source.contains("SMC"), "{address}: {source}");
    }
}

#[test]
fn every_value_in_words_lies_in_the_range() {
    for register in table() {
        let parts = register.meaning.split(';').filter_map(|part| part.split_once(':'));
        for value in parts.filter_map(|(number, _)| number.trim().parse::<u16>().ok()) {
            assert!(register.range().contains(&value), "{}: {value}", register.address);
        }
    }
}

#[test]
fn only_parameters_have_defaults_and_outlast_a_power_cycle() {
    for register in table() {
        let parameter = matches!(register.address, Address::Pa(_));
        let default = register.default_imax.or(register.default_smc);
        assert!(parameter || default.is_none(), "{}", register.address);
        assert_eq!(register.saved, parameter && !register.flags.command, "{}", register.address);
    }
}

#[test]
fn every_default_of_the_imax_manual_is_there() {
    // Its table ends at PA5f and has PA90 to PA9f besides; the SMC manual's 5.10 has PAa0 to PAb5.
    let listed = |number: u8| matches!(number, 0x00..=0x5f | 0x90..=0x9f);
    for register in table() {
        let Address::Pa(number) = register.address else { continue };
        assert_eq!(register.default_imax.is_some(), listed(number), "{}", register.address);
        let accelerates = matches!(number, 0xa0..=0xa5 | 0xb0..=0xb5);
        assert!(!accelerates || register.default_smc.is_some(), "{}", register.address);
    }
}

#[test]
fn network_settings_are_pa10_to_1b_and_pa20_to_29() {
    let network = table().iter().filter(|register| register.flags.network);
    let there: BTreeSet<_> = network.map(|register| register.address).collect();
    let wanted = set(&[0x10..=0x1b, 0x20..=0x29]);
    assert_eq!(there, wanted.into_iter().map(Address::Pa).collect());
}

#[test]
fn commands_move_or_reset_and_measured_registers_are_never_written() {
    for register in table() {
        let Flags { factory, moves, command, never, .. } = register.flags;
        assert_eq!(command, factory || moves, "{}", register.address);
        let measured = matches!(register.address, Address::Dp(number) if !(0xf0..=0xf2).contains(&number));
        assert!(never || !measured, "{}", register.address);
    }
}

#[test]
fn defaults_follow_the_dialect() {
    let table = table();
    assert_eq!(table.factory(0x07, Dialect::Smc), 3_000);
    assert_eq!(table.factory(0xb3, Dialect::Smc), 1_500);
    assert_eq!(table.factory(0xb3, Dialect::Mbox), 0);
    assert_eq!(table.factory(0x51, Dialect::Mbox), 4);
    assert_eq!(table.factory(0x99, Dialect::Smc), 0);
}

#[test]
fn a_register_is_found_by_number_and_by_name() {
    let offset = table().get(Address::Pa(0x95)).unwrap();
    assert_eq!(offset.name, "axis offset");
    for name in ["axis offset", "Axis-Offset", "axis_offset"] {
        assert_eq!(table().by_name(name), Some(offset));
    }
    assert_eq!(table().by_name("rs-485 homing turns").unwrap().address, Address::Pa(0x3e));
    assert_eq!(table().get(Address::Pa(0x99)), None);
    assert_eq!(table().get(Address::Servo { servo: 1, number: 5 }), None);
}

#[test]
fn a_dialect_has_its_own_registers_and_smc_alone_those_of_drives() {
    let has = |address| [Dialect::Smc, Dialect::Mbox].map(|dialect| table().has(address, dialect));
    assert_eq!(has(Address::Pa(0x95)), [true, true]);
    assert_eq!(has(Address::Pa(0x55)), [true, false]);
    assert_eq!(has(Address::Dp(0x1b)), [false, true]);
    assert_eq!(has(Address::Pa(0x99)), [false, false]);
    assert_eq!(has(Address::Servo { servo: 1, number: 508 }), [true, false]);
}

#[test]
fn values_are_put_in_words() {
    let says = |parameter, value| table().get(Address::Pa(parameter)).unwrap().says(value);
    assert_eq!(says(0x91, 2), Some("holds until a reset"));
    assert_eq!(says(0x55, 3), Some("30 %"));
    assert_eq!(says(0x0d, 500), None);
}
