//! The commands: one small file each; arguments in, exit code out.

use std::borrow::Cow;
use std::process::{self, ExitCode};
use std::{panic, thread};

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use crate::wire::VibrationPort;
use crate::{api, plain};

mod ask;
mod bounds;
mod buttons;
mod check;
mod client;
mod completions;
mod convert;
mod decode;
mod demo;
mod doctor;
mod draw_recording;
mod drives;
mod edit;
mod exit;
mod figures;
mod film_player;
mod fit;
mod fleet;
mod help;
mod home;
mod info;
mod latency;
mod load;
mod man;
mod metres;
mod names;
mod places;
mod play;
mod plot;
mod plot_recording;
mod preflight;
mod print;
mod prove;
mod record;
mod register;
mod rehearsal;
mod replay;
mod report;
mod serve;
mod sim;
mod stream;
mod sync;
mod table;
mod targets;
mod token;

pub(crate) use exit::{Exit, Failure, OrExit};

const AFTER: &str = "\
Examples:
  kinocue demo                                  a complete hall, with nothing to set up
  kinocue check cues/*.csv examples/hall.toml   lists every fault of cues and configurations
  kinocue play cues/coaster.csv --to 127.0.0.1:7408    plays one cue, controlled by keys
  kinocue serve --rehearse                      runs a hall of simulated seats, which the commands below Run and Lead control

kinocue COMMAND --help shows the options of each command, with examples.

Exit codes:
  0   done                        70  a fault of kinocue       76   a controller refused
  1   a check failed              71  the system refused       77   not allowed
  64  usage                       74  input or output failed   78   bad configuration
  65  bad cue                     75  not ready, or held by    79   another master sends
  66  no such file or name            another program          130  a second Ctrl-C
  69  nobody answers";

/// Plays motion cues to the seats of a theatre, in time with a film.
///
/// Not a safety device: the protocol has no stop command, so the emergency stop is hard-wired.
#[derive(Debug, Parser)]
#[command(name = "kinocue", version, max_term_width = 100, after_help = AFTER)]
struct Cli {
    #[command(subcommand)]
    command: ProgramCommand,
}

#[derive(Debug, Subcommand)]
enum ProgramCommand {
    Demo(demo::Args),
    Play(play::Args),
    Sim(sim::Args),
    Check(check::Args),
    Info(info::Args),
    Plot(plot::Args),
    Convert(convert::Args),
    Fit(fit::Args),
    Edit(edit::Args),
    Decode(decode::Args),
    Preflight(preflight::Args),
    Register(register::Args),
    Sync(sync::Args),
    Home(home::Args),
    Buttons(buttons::Args),
    Doctor(doctor::Args),
    Serve(serve::Args),
    Latency(latency::Args),
    Report(report::Args),
    Record(record::Args),
    Replay(replay::Args),
    Token(token::Args),
    Fleet(fleet::Args),
    #[command(flatten)]
    Client(client::ClientCommand),
    Completions(completions::Args),
    #[command(hide = true)]
    Known(client::KnownArgs),
    /// Checks and proves one cue for the library, as a process of the lowest priority.
    #[command(hide = true)]
    Prove(prove::Args),
    /// Draws one recording for the console, as a process of the lowest priority.
    #[command(hide = true)]
    DrawRecording(draw_recording::Args),
    #[command(hide = true)]
    FilmPlayer(film_player::Args),
    #[command(hide = true)] // for those who make packages
    Man(man::Args),
}

/// Runs the program on the process's arguments and says how it ends.
#[must_use]
pub fn main() -> ExitCode {
    end_on_panic();
    let parsed =
        help::grouped(Cli::command()).try_get_matches().and_then(|given| Cli::from_arg_matches(&given));
    let cli = match parsed {
        Ok(cli) => cli,
        Err(error) => {
            let exit = if error.use_stderr() { Exit::Usage } else { Exit::Done };
            tell_usage(&error);
            return exit.into();
        }
    };
    match run(cli.command) {
        Ok(exit) => exit.into(),
        Err(failure) => {
            print::tell(&format!("kinocue: {failure}"));
            failure.exit.into()
        }
    }
}

/// Says what is wrong with the arguments, or what was asked about them: in colours, unless that would bring a control character
/// of an argument to the terminal.
fn tell_usage(error: &clap::Error) {
    let text = error.render().to_string();
    match plain::lines(&text) {
        Cow::Owned(escaped) => print::tell(escaped.trim_end()),
        Cow::Borrowed(_) => {
            let _ = error.print(); // a closed terminal is no reason to end otherwise
        }
    }
}

/// Has a panic end the program at once, wherever it happens but where a request is served: what is left of a program without
/// its tick thread, or its supervisor, must not go on as if it were whole. Without frames the seats stay
/// put: the safe outcome.
fn end_on_panic() {
    let tell = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        tell(panic);
        // Nor does what records end what it records.
        let is_apart = [api::THREAD, "recorder", "recover"].map(Some);
        if !is_apart.contains(&thread::current().name()) {
            process::abort();
        }
    }));
}

fn run(command: ProgramCommand) -> Result<Exit, Failure> {
    match command {
        ProgramCommand::Demo(args) => demo::run(&args),
        ProgramCommand::Play(args) => play::run(&args),
        ProgramCommand::Sim(args) => sim::run(&args),
        ProgramCommand::Check(args) => check::run(&args),
        ProgramCommand::Info(args) => info::run(&args),
        ProgramCommand::Plot(args) => plot::run(&args),
        ProgramCommand::Convert(args) => convert::run(&args),
        ProgramCommand::Fit(args) => fit::run(&args),
        ProgramCommand::Edit(args) => edit::run(&args),
        ProgramCommand::Decode(args) => decode::run(&args),
        ProgramCommand::Preflight(args) => preflight::run(&args),
        ProgramCommand::Register(args) => register::run(&args),
        ProgramCommand::Sync(args) => sync::run(&args),
        ProgramCommand::Home(args) => home::run(&args),
        ProgramCommand::Buttons(args) => buttons::run(&args),
        ProgramCommand::Doctor(args) => doctor::run(&args),
        ProgramCommand::Serve(args) => serve::run(&args),
        ProgramCommand::Latency(args) => latency::run(&args),
        ProgramCommand::Report(args) => report::run(&args),
        ProgramCommand::Record(args) => record::run(&args),
        ProgramCommand::Replay(args) => replay::run(&args),
        ProgramCommand::Token(args) => token::run(&args),
        ProgramCommand::Fleet(args) => fleet::run(&args),
        ProgramCommand::Client(command) => client::run(&command),
        ProgramCommand::Completions(args) => completions::run(&args),
        ProgramCommand::Known(args) => client::known(&args),
        ProgramCommand::Prove(args) => prove::run(&args),
        ProgramCommand::DrawRecording(args) => draw_recording::run(&args),
        ProgramCommand::FilmPlayer(args) => film_player::run(&args),
        ProgramCommand::Man(args) => man::run(&args),
    }
}

/// Bytes of Port Out in vibration frames.
fn vibration_port(text: &str) -> Result<VibrationPort, String> {
    let port = text.parse().ok().and_then(VibrationPort::of_bytes);
    port.ok_or_else(|| "it is 2 or 4".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::Next;

    /// Words that mean a request where they stand in a next action.
    const REQUESTS: [&str; 11] =
        ["arm", "clear", "disable", "disarm", "go", "home", "load", "park", "pause", "preflight", "resume"];

    #[test]
    fn every_request_that_a_next_action_names_is_a_command_and_on_the_page() {
        let page = include_str!("../console/page/index.html");
        let seat = include_str!("../console/page/js/controller.js");
        let commands = Cli::command();
        let mut named = std::collections::BTreeSet::new();
        for next in Next::ALL {
            let words = next.to_string();
            let words = words.split(|letter: char| !letter.is_ascii_alphabetic());
            named.extend(words.filter_map(|word| REQUESTS.into_iter().find(|request| *request == word)));
        }
        for request in &named {
            assert!(commands.find_subcommand(request).is_some(), "kinocue {request}");
            let is_on_page = match *request {
                "disable" => seat.contains("disable"),
                "disarm" => page.contains("id=\"arm\""),
                "load" => page.contains("id=\"cues\""),
                "preflight" => page.contains("id=\"preflight-run\""),
                button => page.contains(&format!("id=\"{button}\"")),
            };
            assert!(is_on_page, "{request} on the page");
        }
        assert!(
            ["arm", "clear", "disable", "home", "park"].iter().all(|word| named.contains(word)),
            "{named:?}"
        );
    }
}
