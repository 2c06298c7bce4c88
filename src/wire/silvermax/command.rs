//! The commands by number: three letters, class, parameters with their ranges (command reference, pages 183 to 215).

/// When a drive takes a command (pages 13, 14).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Class {
    /// At any time.
    A,
    /// While it neither moves nor runs a program.
    B,
    /// The same, and it runs the program.
    C,
    /// The same, and can be part of a program; after EMT also during a motion.
    D,
    /// In a program alone.
    E,
}

/// What the command reference says of a command.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Command {
    /// Its number.
    pub(crate) number: u8,
    /// Its three letters; those of both where two share a number.
    pub(crate) mnemonic: &'static str,
    /// When it is taken.
    pub(crate) class: Class,
    /// Its parameters in their order.
    pub(crate) parameters: &'static [Parameter],
}

/// A parameter: its name, its octets in binary, and what it may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Parameter {
    /// What it is.
    pub(crate) name: &'static str,
    octets: usize,
    least: i64,
    most: i64,
}

impl Parameter {
    /// True if the parameter may be so.
    pub(crate) const fn takes(&self, value: i64) -> bool {
        self.least <= value && value <= self.most
    }

    /// Reads it from the front of binary octets.
    pub(super) fn read<'a>(&self, octets: &'a [u8]) -> Option<(i64, &'a [u8])> {
        let (own, rest) = octets.split_at_checked(self.octets)?;
        let unsigned = own.iter().fold(0, |value, octet| value << 8 | i64::from(*octet));
        let whole = 1_i64 << (8 * self.octets);
        let is_negative = self.least < 0 && unsigned >= whole / 2;
        Some((if is_negative { unsigned - whole } else { unsigned }, rest))
    }
}

const fn word(name: &'static str) -> Parameter {
    Parameter { name, octets: 2, least: 0, most: 65_535 }
}

const fn number(name: &'static str, least: i64, most: i64) -> Parameter {
    Parameter { name, octets: 2, least, most }
}

const fn long(name: &'static str, least: i64, most: i64) -> Parameter {
    Parameter { name, octets: 4, least, most }
}

const fn position(name: &'static str) -> Parameter {
    long(name, i32::MIN as i64, i32::MAX as i64)
}

const fn torque(name: &'static str) -> Parameter {
    number(name, 0, 32_767)
}

const REGISTER: Parameter = number("register", 10, 40);
const ANY_REGISTER: Parameter = number("register", 0, 211);
const VALUE: Parameter = position("value");
const ACCELERATION: Parameter = long("acceleration", 1, 0x3fff_ffff);
const VELOCITY: Parameter = long("velocity", 0, i32::MAX as i64);
const SIGNED_VELOCITY: Parameter = position("velocity");
// Codes of inputs are negative, masks go up to 65535 (page 132).
const STOP_ENABLE: Parameter = number("stop_enable", -14, 65_535);
const STOP_STATE: Parameter = word("stop_state");
const RAMP: Parameter = long("ramp_ticks", 0, 65_534);
const TOTAL: Parameter = long("total_ticks", 2, i32::MAX as i64);
const LINE: Parameter = number("line", 1, 7);
const LOCATION: Parameter = number("location", 0, 199);
// Bits of a status word, or the code of an input where two commands share a number (pages 130 to 140).
const ENABLE: Parameter = word("enable");
const STATE: Parameter = word("state");

use Class::{A, B, C, D, E};

/// What is known of a command by its number.
pub(crate) fn command(number: u8) -> Option<&'static Command> {
    COMMANDS.binary_search_by_key(&number, |command| command.number).ok().map(|at| &COMMANDS[at])
}

const fn row(number: u8, mnemonic: &'static str, class: Class, parameters: &'static [Parameter]) -> Command {
    Command { number, mnemonic, class, parameters }
}

/// In the order of their numbers. IMS is 253 and IMQ 254 by their pages (92, 94); the cross reference swaps them.
static COMMANDS: &[Command] = &[
    row(0, "POL", A, &[]),
    row(1, "CPL", A, &[word("mask")]),
    row(2, "HLT", A, &[]),
    row(3, "STP", A, &[long("deceleration", -1, 0x1fff_ffff)]),
    row(4, "RST", A, &[]),
    row(5, "RVN", A, &[]),
    row(6, "RPB", A, &[number("length", 1, 8), number("address", 0, 199)]),
    row(7, "WPB", B, &[]),
    row(8, "CLP", B, &[]),
    row(9, "SDL", B, &[]),
    row(10, "RUN", C, &[]),
    row(11, "WRI", A, &[REGISTER, VALUE]),
    row(12, "RRG", A, &[ANY_REGISTER]),
    row(13, "SPR", B, &[number("address", 0, 3839)]),
    row(14, "LPR", B, &[number("address", 0, 3839)]),
    row(15, "VMI", A, &[position("acceleration"), SIGNED_VELOCITY, STOP_ENABLE, STOP_STATE]),
    row(17, "SSP", B, &[]),
    row(18, "SSE", B, &[]),
    row(20, "RIS", A, &[]),
    row(21, "RIO", A, &[]),
    row(
        25,
        "IMW",
        A,
        &[
            long("ticks", 0, i32::MAX as i64),
            position("position"),
            long("acceleration", 1, i32::MAX as i64),
            VELOCITY,
        ],
    ),
    row(128, "END", D, &[]),
    row(134, "MAV", D, &[position("position"), ACCELERATION, VELOCITY, STOP_ENABLE, STOP_STATE]),
    row(135, "MRV", D, &[position("distance"), ACCELERATION, VELOCITY, STOP_ENABLE, STOP_STATE]),
    row(137, "JRE", E, &[ANY_REGISTER, VALUE, LOCATION]),
    row(138, "WCL", D, &[ANY_REGISTER, LOCATION]),
    row(139, "WCW", D, &[ANY_REGISTER, LOCATION]),
    row(140, "DLY", D, &[position("ticks")]),
    row(141, "WDL", D, &[]),
    row(142, "GCL", D, &[]),
    row(143, "GOL", D, &[]),
    row(144, "ZTG", D, &[]),
    row(145, "ZTP", D, &[]),
    row(146, "TTP", D, &[]),
    row(147, "CME", D, &[]),
    row(
        148,
        "CTC",
        D,
        &[
            torque("velocity_1_feedback"),
            torque("velocity_2_feedback"),
            torque("velocity_feedforward"),
            torque("acceleration_feedback"),
            torque("acceleration_feedforward"),
            torque("proportional"),
            torque("integrator"),
        ],
    ),
    row(
        149,
        "TQL",
        D,
        &[torque("closed_hold"), torque("closed_move"), torque("open_hold"), torque("open_move")],
    ),
    row(150, "AHC", D, &[number("open_to_closed", 0, 35), number("closed_to_open", -35, 35)]),
    row(151, "ERL", D, &[number("moving", 0, 32_767), number("holding", 0, 32_767), word("delay_ticks")]),
    row(152, "OLP", D, &[number("counts", -7, 79)]),
    row(154, "WRP", D, &[REGISTER, VALUE]),
    row(155, "IDT", D, &[number("group_unit", 257, 65_278)]),
    row(156, "LRP", D, &[number("address", 0, 3839)]),
    row(159, "VMP", D, &[ACCELERATION, SIGNED_VELOCITY, STOP_ENABLE, STOP_STATE]),
    row(160, "RAV", D, &[REGISTER, ACCELERATION, VELOCITY, STOP_ENABLE, STOP_STATE]),
    row(161, "RRV", D, &[REGISTER, ACCELERATION, VELOCITY, STOP_ENABLE, STOP_STATE]),
    row(162, "JMP/JOI", E, &[ENABLE, STATE, LOCATION]),
    row(163, "CIS", D, &[]),
    row(164, "CKS", D, &[word("enable"), word("state")]),
    row(165, "CLC", D, &[word("operation_register")]),
    row(167, "KMC", D, &[word("enable"), word("state")]),
    row(
        168,
        "MCT",
        D,
        &[
            torque("mc1"),
            torque("mc2"),
            torque("mc3"),
            torque("mc4"),
            torque("mc5"),
            torque("mc6"),
            torque("mc7"),
            torque("mc8"),
        ],
    ),
    row(169, "FLC", D, &[torque("velocity_1"), torque("velocity_2"), torque("acceleration")]),
    row(170, "EEM", D, &[]),
    row(171, "DEM/DDB", D, &[]),
    row(172, "PAC", D, &[number("p_adv", 0, 15), number("p2_adv", 0, 600), number("p3_adv", 0, 37)]),
    row(173, "ADL", D, &[word("ticks")]),
    row(174, "BRT", D, &[word("code")]),
    row(176, "MAT", D, &[position("position"), RAMP, TOTAL, STOP_ENABLE, STOP_STATE]),
    row(177, "MRT", D, &[position("distance"), RAMP, TOTAL, STOP_ENABLE, STOP_STATE]),
    row(178, "RAT", D, &[REGISTER, RAMP, TOTAL, STOP_ENABLE, STOP_STATE]),
    row(179, "RRT", D, &[REGISTER, RAMP, TOTAL, STOP_ENABLE, STOP_STATE]),
    row(180, "SSD", D, &[number("scale", -32_768, 32_767)]),
    row(181, "KMR", D, &[word("address")]),
    row(182, "KED", D, &[]),
    row(183, "KDD", D, &[]),
    row(184, "DIR", D, &[number("reverse", 0, 1)]),
    row(185, "PRO", D, &[word("protocol")]),
    row(186, "SIF", D, &[number("interface", 0, 1)]),
    row(187, "EDL", D, &[]),
    row(188, "CIO", D, &[LINE, number("setting", -1, 1)]),
    row(189, "MDS", D, &[number("count", 1, 256), number("encoder", 0, 1), number("format", 0, 2)]),
    row(190, "MDC", D, &[]),
    row(191, "MDT", D, &[number("mode", 0, 2)]),
    row(192, "SEE", D, &[number("index_state", 0, 1), number("index_source", 0, 1), number("style", 0, 4)]),
    row(193, "ARI", D, &[number("channel", 1, 9), REGISTER]),
    row(194, "WBS", D, &[number("input", 1, 14), number("state", 0, 1)]),
    row(195, "SCF", D, &[torque("shape")]),
    row(196, "RSM", D, &[number("registers", 1, 10), ANY_REGISTER, number("address", 0, 3839)]),
    row(197, "RLM", D, &[number("registers", 1, 10), ANY_REGISTER, number("address", 0, 3839)]),
    row(198, "RSN", D, &[ANY_REGISTER, number("address", 0, 3839)]),
    row(199, "RLN", D, &[ANY_REGISTER, number("address", 0, 3839)]),
    row(201, "PCL/PCI", D, &[LOCATION, ENABLE, STATE]),
    row(202, "PRT/PRI", D, &[ENABLE, STATE]),
    row(204, "WBE", D, &[number("input", 1, 14), number("edge", 0, 1)]),
    row(205, "SOB", D, &[LINE]),
    row(206, "COB", D, &[LINE]),
    row(207, "ACR", D, &[number("channel", 0, 8), REGISTER]),
    row(208, "PLR", D, &[number("process", 0, 3839)]),
    row(211, "CAI", D, &[word("address")]),
    row(212, "LVT", D, &[number("volts", 0, 100)]),
    row(213, "OVT", D, &[number("volts", 0, 100)]),
    row(214, "MTT", D, &[number("celsius", 0, 70)]),
    row(215, "CLC", D, &[word("operation"), ANY_REGISTER]),
    row(216, "PIM", D, &[number("filter", 0, 32_767), STOP_ENABLE, STOP_STATE]),
    row(217, "VIM", D, &[number("filter", 0, 32_767), STOP_ENABLE, STOP_STATE]),
    row(218, "TIM", D, &[number("filter", 0, 32_767), STOP_ENABLE, STOP_STATE]),
    row(219, "AHM", D, &[number("mode", 0, 1)]),
    row(221, "SSL", D, &[number("register", 0, 39)]),
    row(222, "TRU", D, &[torque("final"), number("increment", 1, 32_767)]),
    row(223, "RSD", D, &[REGISTER]),
    row(225, "EMT", D, &[]),
    row(226, "DMT", D, &[]),
    row(227, "EMD", D, &[]),
    row(228, "DMD", D, &[]),
    row(229, "HSM", D, &[]),
    row(230, "AHD", D, &[word("ticks")]),
    row(231, "PCG", D, &[]),
    row(232, "PCM", D, &[]),
    row(233, "XRV", D, &[REGISTER, STOP_ENABLE, STOP_STATE]),
    row(234, "XAV", D, &[REGISTER, STOP_ENABLE, STOP_STATE]),
    row(235, "XRT", D, &[REGISTER, STOP_ENABLE, STOP_STATE]),
    row(236, "XAT", D, &[REGISTER, STOP_ENABLE, STOP_STATE]),
    row(237, "GOC", D, &[number("offset", -32_767, 32_767)]),
    row(238, "JNA", E, &[ENABLE, STATE, LOCATION]),
    row(239, "JOR", E, &[ENABLE, STATE, LOCATION]),
    row(240, "PMC", D, &[STOP_ENABLE, STOP_STATE]),
    row(241, "PMV", D, &[STOP_ENABLE, STOP_STATE]),
    row(242, "PMX", D, &[]),
    row(243, "DLC", D, &[]),
    row(244, "SLC", D, &[]),
    row(245, "PCP", D, &[number("register", 0, 40)]),
    row(248, "ATR", D, &[REGISTER, VALUE]),
    row(249, "PMO", D, &[STOP_ENABLE, STOP_STATE]),
    row(250, "JAN", E, &[ENABLE, STATE, LOCATION]),
    row(251, "EDH", D, &[]),
    row(252, "DIF", D, &[number("line", 0, 7), word("ticks")]),
    row(253, "IMS", D, &[]),
    row(254, "IMQ", D, &[]),
];
