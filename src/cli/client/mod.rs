//! The commands that speak with a running daemon: one request each over its control socket, in the words of its API.

mod cues;
mod events;
mod film;
mod http;
mod levels;
mod panel;
mod playlist;
mod record;
mod reply;
mod rows;
mod server;
mod show;
mod status;
mod stop;
mod table;
mod test;
mod view;
mod watch;

pub(super) use film::{UseArgs, choose as choose_film_source, show as show_film};
pub(super) use record::dump as dump_record;
pub(super) use server::ServerArgs;
pub(super) use show::{home, preflight};

use super::{Exit, Failure};

/// The client's commands.
#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    Status(status::Args),
    Watch(watch::Args),
    #[command(flatten)]
    Show(show::Command),
    Stop(stop::Args),
    #[command(flatten)]
    Playlist(playlist::Command),
    #[command(flatten)]
    Levels(levels::Command),
    #[command(flatten)]
    Cues(cues::Command),
    Test(test::Args),
    Mark(record::MarkArgs),
}

pub(super) fn run(command: &Command) -> Result<Exit, Failure> {
    match command {
        Command::Status(args) => status::run(args),
        Command::Watch(args) => watch::run(args),
        Command::Show(command) => show::run(command),
        Command::Stop(args) => stop::run(args),
        Command::Playlist(command) => playlist::run(command),
        Command::Levels(command) => levels::run(command),
        Command::Cues(command) => cues::run(command),
        Command::Test(args) => test::run(args),
        Command::Mark(args) => record::mark(args),
    }
}
