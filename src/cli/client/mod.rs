//! The commands that speak with a running daemon: one request each over its control socket, in the words of its API.

mod cues;
mod events;
mod film;
pub(in crate::cli) mod http;
mod known;
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
mod test;
mod view;
mod watch;

pub(super) use cues::{FileBody, id_of as cue_id_of};
pub(super) use film::{UseArgs, choose as choose_film_source, show as show_film};
pub(super) use known::{KnownArgs, known};
pub(super) use record::dump as dump_record;
pub(super) use reply::ServiceProblem;
pub(super) use server::ServerArgs;
pub(super) use show::{home, preflight};
pub(super) use stop::ask_stop;

use super::{Exit, Failure};

/// The client's commands.
#[derive(Debug, clap::Subcommand)]
pub(super) enum ClientCommand {
    Status(status::Args),
    Watch(watch::Args),
    #[command(flatten)]
    Show(show::ShowCommand),
    Stop(stop::Args),
    #[command(flatten)]
    Playlist(playlist::PlaylistCommand),
    #[command(flatten)]
    Levels(levels::LevelsCommand),
    #[command(flatten)]
    Cues(cues::CuesCommand),
    Test(test::Args),
    Mark(record::MarkArgs),
}

pub(super) fn run(command: &ClientCommand) -> Result<Exit, Failure> {
    match command {
        ClientCommand::Status(args) => status::run(args),
        ClientCommand::Watch(args) => watch::run(args),
        ClientCommand::Show(command) => show::run(command),
        ClientCommand::Stop(args) => stop::run(args),
        ClientCommand::Playlist(command) => playlist::run(command),
        ClientCommand::Levels(command) => levels::run(command),
        ClientCommand::Cues(command) => cues::run(command),
        ClientCommand::Test(args) => test::run(args),
        ClientCommand::Mark(args) => record::mark(args),
    }
}
