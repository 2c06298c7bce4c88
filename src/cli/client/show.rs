//! What the show does: one word, one request.

use serde_json::json;

use super::server::ServerArgs;
use crate::cli::table::table;
use crate::cli::{Exit, Failure, ask, print};
use crate::control::{ControllerStatus, PreflightStatus, Severity, Status, Warning};
use crate::time::{ShowTime, parse_time};

/// Of so many controllers with the same finding only the number is told.
const FEW: usize = 9;

/// The commands that lead a show.
#[derive(Debug, clap::Subcommand)]
pub(in crate::cli) enum ShowCommand {
    /// Arms the hall: ready to go.
    ///
    /// A cue has to be loaded and proved, and preflight has to pass. Arming lapses after ten minutes.
    #[command(after_help = "\
Examples:
  kinocue load bench-ride && kinocue arm
  kinocue arm --seats-empty              if a controller does not know its position
  kinocue arm --fleet trio               the desk of the fleet may start it, once, with the other halls of trio
  kinocue arm --json

If a position is unknown, as after a controller reboots, the seats have to home first. They then move by themselves over
their whole stroke, so this needs --seats-empty.

Exit codes: 0 armed, or homing first, 69 no daemon, 75 not ready (the message says why), 77 not allowed")]
    Arm(ArmArgs),
    /// Disarms the hall: nothing can start until a person arms it again.
    #[command(after_help = "Example:\n  kinocue disarm")]
    Disarm(ServerArgs),
    /// Starts the loaded, armed show. The seats move.
    #[command(after_help = "\
Examples:
  kinocue go
  kinocue arm && kinocue go
  kinocue go --from 0:05       after a stop: the seats join the cue there; `kinocue status` shows where it stopped

A request that arrives more than two seconds late, or a second time, starts nothing.

Exit codes: 0 playing, 69 no daemon, 75 not armed or too late, 77 not allowed")]
    Go(GoArgs),
    /// Holds the seats where they are; the film waits.
    #[command(after_help = "Example:\n  kinocue pause")]
    Pause(ServerArgs),
    /// Resumes a paused show, or one that was taken over.
    #[command(after_help = "Example:\n  kinocue resume")]
    Resume(ServerArgs),
    /// Jumps to another position in the cue.
    ///
    /// The seats reach it by a move within their limits.
    #[command(after_help = "\
Examples:
  kinocue seek 0:12
  kinocue seek 7.5
  kinocue seek 00:00:12:12@24")]
    Seek(SeekArgs),
    /// Brings the seats to their park poses, and ends the show.
    #[command(after_help = "Example:\n  kinocue park")]
    Park(ServerArgs),
    /// Clears a latched stop or fault once its cause is gone.
    #[command(after_help = "\
Example:
  kinocue status && kinocue clear

All positions are read again before anything moves.")]
    Clear(ServerArgs),
    /// Reloads the daemon's configuration.
    ///
    /// Only while nothing is armed; a bad configuration changes nothing. It returns once the hall has opened with the new one.
    #[command(after_help = "Example:\n  kinocue check /etc/kinocue/kinocue.toml && kinocue reload")]
    Reload(ServerArgs),
}

/// Permission to home first, and the daemon's socket.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct ArmArgs {
    /// Confirm that nobody sits on the seats and nothing lies on or under them: they may home first.
    #[arg(long)]
    seats_empty: bool,
    /// Let the fleet start the show, once, together with the other halls of that group; lapses as arming does.
    #[arg(long, value_name = "GROUP", conflicts_with = "seats_empty")]
    fleet: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// From where on, and where the daemon is.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct GoArgs {
    /// Where in the cue to start: SS[.mmm], MM:SS, HH:MM:SS[.mmm] or HH:MM:SS:FF@24 [default: its beginning, or the last seek].
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    from: Option<ShowTime>,
    #[command(flatten)]
    server: ServerArgs,
}

/// The position, and where the daemon is.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct SeekArgs {
    /// Position in the cue: SS[.mmm], MM:SS, HH:MM:SS[.mmm] or HH:MM:SS:FF@24.
    #[arg(value_name = "TIME", value_parser = parse_time)]
    at: ShowTime,
    #[command(flatten)]
    server: ServerArgs,
}

pub(super) fn run(command: &ShowCommand) -> Result<Exit, Failure> {
    let (word, server) = match command {
        ShowCommand::Arm(ArmArgs { seats_empty, fleet, server }) => {
            let body = match fleet {
                Some(group) => json!({ "fleet": group }),
                None if *seats_empty => json!({ "seats_empty": true }),
                None => json!({}),
            };
            let status = server.post("/api/v1/show/arm", &body)?;
            // Whoever arms hears who is out, and what is as it was before the service started.
            let lasts = status.warnings.iter().filter(|one| ["seat-out", "kept"].contains(&one.id.as_str()));
            lasts.for_each(|one| print::tell(&format!("kinocue: {}", one.said())));
            return Ok(server.tell(&status));
        }
        ShowCommand::Disarm(server) => ("disarm", server),
        ShowCommand::Go(GoArgs { from: Some(from), server }) => {
            return server.act("/api/v1/show/go", &json!({ "from_s": from.as_secs_f64() }));
        }
        ShowCommand::Go(GoArgs { from: None, server }) => ("go", server),
        ShowCommand::Pause(server) => ("pause", server),
        ShowCommand::Resume(server) => ("resume", server),
        ShowCommand::Park(server) => ("park", server),
        ShowCommand::Clear(server) => ("clear", server),
        ShowCommand::Seek(SeekArgs { at, server }) => {
            return server.act("/api/v1/show/seek", &json!({ "position_s": at.as_secs_f64() }));
        }
        ShowCommand::Reload(server) => {
            let exit = server.act("/api/v1/reload", &json!({}))?;
            print::tell("kinocue: the hall has opened with this configuration");
            return Ok(exit);
        }
    };
    server.act(&format!("/api/v1/show/{word}"), &json!({}))
}

/// Has the daemon home all controllers, once a person says that the seats are empty.
pub(in crate::cli) fn home(server: &ServerArgs, seats_empty: bool) -> Result<Exit, Failure> {
    let question =
        "All seats of the hall will move over their whole stroke. Are they empty, and is nobody near them?";
    if !ask::agreed(question, seats_empty, "--seats-empty")? {
        print::tell("nothing was moved");
        return Ok(Exit::Done);
    }
    server.act("/api/v1/show/home", &json!({}))
}

/// Has the daemon check its controllers.
pub(in crate::cli) fn preflight(server: &ServerArgs) -> Result<Exit, Failure> {
    let status = server.post("/api/v1/preflight", &json!({}))?;
    let Some(found) = &status.preflight else {
        return Ok(server.tell(&status));
    };
    if !server.json && !found.findings.is_empty() {
        print::out(&findings(&status, &found.findings))?;
    }
    let PreflightStatus { passed, answered, .. } = found;
    let verdict = if *passed { "passed" } else { "failed" };
    print::tell(&format!(
        "kinocue: preflight {verdict}: {answered} of {} controllers answered; next: {}",
        status.controllers.iter().filter(|one| !one.is_out_for_good()).count(),
        status.next
    ));
    Ok(if *passed { Exit::Done } else { Exit::CheckFailed })
}

/// A row for each thing that was found, with those of whom it was: one with its place, several by their names. Of more than a few the
/// number is enough, unless it fails.
fn findings(status: &Status, all: &[Warning]) -> String {
    let mut rows: Vec<(&Warning, Vec<String>)> = Vec::new();
    for one in all {
        let who = one.controller.clone().unwrap_or_else(|| "-".to_owned());
        let same = |(first, _): &&mut (&Warning, Vec<String>)| {
            first.severity == one.severity && first.id == one.id && first.text == one.text
        };
        match rows.iter_mut().find(same) {
            Some((_, of)) => of.push(who),
            None => rows.push((one, vec![who])),
        }
    }
    let row = |(one, of): &(&Warning, Vec<String>)| {
        let Warning { severity, id, text, remedy, .. } = one;
        let of = match of.len() {
            1 => who(status, one),
            FEW.. if of.len() == status.controllers.len() => format!("all {}", of.len()),
            FEW.. if *severity != Severity::Error => format!("{} controllers", of.len()),
            _ => of.join(", "),
        };
        [severity.word(), &of, id, text, remedy].map(str::to_owned)
    };
    table(["severity", "controllers", "check", "found", "what to do"], rows.iter().map(row))
}

/// The controller that something was found of; where it fails with its row and address, for whoever goes there.
fn who(status: &Status, found: &Warning) -> String {
    let Some(name) = &found.controller else { return "-".to_owned() };
    match status.controllers.iter().find(|one| one.name == *name && found.severity == Severity::Error) {
        Some(ControllerStatus { row: Some(row), address, .. }) => format!("{name} (row {row}, {address})"),
        Some(ControllerStatus { address, .. }) => format!("{name} ({address})"),
        None => name.clone(),
    }
}
