//! The help of the program: its commands in groups of what people do.

use std::fmt::Write as _;

use clap::Command;

/// What people do, and with which commands.
const GROUPS: [(&str, &[&str]); 9] = [
    ("Try it, without seats", &["demo", "sim"]),
    ("Make and check cues", &["check", "info", "plot", "fit", "edit", "convert"]),
    ("Play one cue, or follow a film", &["play", "sync"]),
    ("Set up a hall", &["preflight", "home", "register", "doctor", "latency", "token", "buttons"]),
    (
        "Run a hall: the service, and what it plays",
        &["serve", "reload", "cues", "upload", "load", "playlist", "select"],
    ),
    (
        "Lead its show",
        &[
            "status", "watch", "arm", "go", "pause", "resume", "seek", "stop", "park", "disarm", "clear",
            "test",
        ],
    ),
    ("Set how much the seats do", &["level", "trim", "effects", "preset", "disable", "enable"]),
    ("Lead many halls", &["fleet"]),
    ("Afterwards", &["report", "mark", "record", "replay", "decode"]),
];

const TEMPLATE: &str =
    "{about-with-newline}\n{usage-heading} {usage}\n\n{subcommands-in-groups}Options:\n{options}{after-help}";

/// The program with its commands in groups.
pub(super) fn grouped(program: Command) -> Command {
    let template = TEMPLATE.replace("{subcommands-in-groups}", &groups(&program));
    program.help_template(template)
}

fn groups(program: &Command) -> String {
    let mut text = String::new();
    for (title, names) in GROUPS {
        let _ = writeln!(text, "{title}:"); // a String takes it
        for name in names {
            let about = program.find_subcommand(name).and_then(Command::get_about).map(ToString::to_string);
            let _ = writeln!(text, "  {name:<11} {}", about.unwrap_or_default());
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::Cli;

    /// What is shown of every command, and belongs to no group.
    const BESIDE: [&str; 2] = ["completions", "help"];

    #[test]
    fn every_command_is_in_one_group_and_its_line_fits_a_terminal() {
        let mut program = Cli::command();
        program.build();
        let all: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        for command in program.get_subcommands().filter(|command| !command.is_hide_set()) {
            let name = command.get_name();
            let times = all.iter().filter(|one| **one == name).count();
            assert_eq!(times, usize::from(!BESIDE.contains(&name)), "{name}");
        }
        assert!(all.iter().all(|name| program.find_subcommand(name).is_some()));
        for line in groups(&program).lines() {
            assert!(line.chars().count() <= 80 && !line.trim_end().ends_with("  "), "{line}");
        }
    }
}
