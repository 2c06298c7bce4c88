//! What is to be played: a cue, a playlist, an entry of it.

use serde_json::json;

use super::known::{KnownKind, names};
use super::server::ServerArgs;
use super::view::{next_start, percent, time};
use crate::cli::table::table;
use crate::cli::{Exit, Failure, print};
use crate::control::{EntryStatus, PlaylistStatus, Status};

/// The commands that choose what is played.
#[derive(Debug, clap::Subcommand)]
pub(in crate::cli) enum PlaylistCommand {
    /// Loads a cue of the daemon's library.
    ///
    /// The cue is read and proved before the command ends.
    #[command(after_help = "\
Examples:
  kinocue load bench-ride
  kinocue cues

Exit codes: 0 loaded, 1 it breaks limits, 65 it cannot be read or asks for what the hall does not have (every fault is listed),
66 no such cue, 75 the hall's state does not allow it")]
    Load(LoadArgs),
    /// Loads, unloads or shows a playlist.
    #[command(after_help = "\
Examples:
  kinocue playlist
  kinocue playlist --none
  kinocue playlist today")]
    Playlist(PlaylistArgs),
    /// Selects the playlist entry to play next.
    ///
    /// Entries are numbered from 1, as `kinocue playlist` shows them.
    #[command(after_help = "Example:\n  kinocue select 2")]
    Select(SelectArgs),
}

/// A cue.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct LoadArgs {
    /// The id of the cue.
    #[arg(value_name = "CUE")]
    cue: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// A playlist.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct PlaylistArgs {
    /// The id of the playlist [default: show the loaded one].
    #[arg(value_name = "ID")]
    id: Option<String>,
    /// Unload the playlist.
    #[arg(long, conflicts_with = "id")]
    none: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// An entry.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct SelectArgs {
    /// Number of the entry, from 1.
    #[arg(value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    entry: u32,
    #[command(flatten)]
    server: ServerArgs,
}

pub(super) fn run(command: &PlaylistCommand) -> Result<Exit, Failure> {
    match command {
        PlaylistCommand::Load(LoadArgs { cue, server }) => {
            server.act("/api/v1/show/load", &json!({ "cue": cue }))
        }
        PlaylistCommand::Playlist(PlaylistArgs { id: None, none: false, server }) => show(server),
        PlaylistCommand::Playlist(PlaylistArgs { id, server, .. }) => {
            let status = server.put("/api/v1/playlist", &json!({ "id": id }))?;
            if let Some(playlist) = status.playlist.as_ref().filter(|_| !server.json) {
                print::out(&entries(playlist, &status))?;
            }
            Ok(server.tell(&status))
        }
        PlaylistCommand::Select(SelectArgs { entry, server }) => {
            server.act("/api/v1/playlist/select", &json!({ "entry": entry - 1 }))
        }
    }
}

fn show(server: &ServerArgs) -> Result<Exit, Failure> {
    let reply = server.get("/api/v1/status")?;
    let status = super::reply::status(&reply)?;
    if server.json {
        let whole: serde_json::Value = serde_json::from_str(&reply.text).unwrap_or_default();
        print::json(&whole["playlist"])?;
    } else if let Some(playlist) = &status.playlist {
        print::out(&entries(playlist, &status))?;
    } else {
        let ids = names(KnownKind::Playlists, server)?;
        let there_are = if ids.is_empty() { "none".to_owned() } else { ids.join(", ") };
        print::tell(&format!(
            "kinocue: no playlist is loaded; there are: {there_are}; next: kinocue playlist ID"
        ));
    }
    Ok(Exit::Done)
}

/// The entries, the one that is loaded marked.
fn entries(playlist: &PlaylistStatus, status: &Status) -> String {
    let row = |(place, entry): (usize, &EntryStatus)| {
        let mark = if place == playlist.current { ">" } else { "" };
        let or = |text: Option<String>, otherwise: &str| text.unwrap_or_else(|| otherwise.to_owned());
        [
            format!("{mark}{}", place + 1),
            entry.cue.clone(),
            or(entry.title.clone(), ""),
            time(entry.length_s),
            or(entry.level.map(percent), "-"),
            or(entry.trim_ms.map(|ms| format!("{ms:+} ms")), "-"),
            entry.then.to_string(),
            or(entry.at.clone(), "-"),
        ]
    };
    let header = ["", "cue", "title", "length", "level", "trim", "then", "starts at"];
    let PlaylistStatus { id, title, entries, .. } = playlist;
    let next =
        next_start(status).map_or_else(String::new, |at| format!("; the next starts by itself at {at}"));
    let notes = entries
        .iter()
        .zip(1..)
        .filter_map(|(entry, place)| Some(format!("\n{place}: {}", entry.note.as_ref()?)));
    let notes: String = notes.collect();
    format!("{id}: {title}{next}\n\n{}{notes}", table(header, entries.iter().enumerate().map(row)))
}
