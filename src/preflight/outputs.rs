//! Checks if an output is on when it is called for, and then alone.

use super::{Check, Notes, Subject};

pub(super) fn judge(subject: &Subject<'_>, notes: &mut Notes) {
    if subject.pa(0x9d) == Some(1) {
        let found = "PA9d = 1: ignores the outputs of frames, so effects never switch";
        notes.add(Check::OutputsIgnored, found, "set PA9d = 0, or remove its effects from the configuration");
    }
    if let Some(value) = subject.pa(0x05).filter(|value| *value != 0) {
        let found =
            format!("PA05 = {value}: outputs are inverted, so every effect is on while it should be off");
        notes.add(Check::OutputsInverted, found, "set PA05 = 0, or accept it if relays invert it again");
    }
    if let Some(word) = subject.pa(0x9f).filter(|word| *word != 0) {
        let outputs: Vec<_> = (1..=16)
            .filter(|output| word & (1 << (output - 1)) != 0)
            .map(|output| format!("Y{output:02}"))
            .collect();
        let found = format!("PA9f = {word}: switches {} on as soon as it has power", outputs.join(" and "));
        notes.add(Check::PowerOnOutputs, found, "set PA9f = 0");
    }
}
