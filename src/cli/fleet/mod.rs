//! `kinocue fleet`: many halls from one desk, over an engine of messages (NATS, JetStream) that others make. The engine's library runs in
//! these commands alone; a hall knows nothing of it.

use std::path::PathBuf;

use super::{Exit, Failure};

mod act;
mod clock;
mod demo;
mod desk;
mod drop;
mod engine;
mod hall;
mod have;
mod init;
mod lease;
mod link;
mod log;
mod made;
mod migrate;
mod object;
mod page;
mod part;
mod playlist;
mod pull;
mod push;
mod report;
mod settings;
mod start;
mod stops;
mod wishes;
mod wishing;

const EXAMPLES: &str = "\
Examples:
  kinocue fleet demo                                     three halls of simulated seats, to try it
  kinocue fleet init --site berlin --halls h1,h2,h3      makes keys and configurations in the folder fleet
  kinocue fleet link --config /etc/kinocue/fleet.toml    carries what a hall says and is asked, as its unit starts it
  kinocue fleet status
  kinocue fleet watch
  kinocue fleet desk                                     the page of all halls, with a STOP for each
  kinocue fleet stop
  kinocue fleet stop berlin.h2
  kinocue fleet level 60% 'berlin.*'
  kinocue fleet trim +40ms berlin.h1
  kinocue fleet preflight all                            whether their seats could play now
  kinocue fleet start --group trio --at +10s
  kinocue fleet report --day yesterday
  kinocue fleet push cues/storm.mcap --to 'berlin.*'     tomorrow's cue into all halls, and where not, and why
  kinocue fleet playlist today.toml --to all --from 04:00
  kinocue fleet drop storm --to all                      what the fleet brought goes again
  kinocue fleet pull berlin.h1 storm                     a hall's cue back to this desk
  kinocue fleet have

Exit codes: 0 done, 1 a hall refused, 64 usage, 69 the engine does not answer, 75 a hall did not answer, 78 bad settings";

/// Shows and leads many halls from one desk.
///
/// Each hall plays alone, whatever becomes of the network and of the engine. Halls may be stopped from a desk; all else they have to
/// allow. Nothing from a desk ever homes, arms or clears one, and it starts only what a person there has armed for that.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    #[command(subcommand)]
    command: FleetCommand,
}

#[derive(Debug, clap::Subcommand)]
enum FleetCommand {
    Demo(demo::Args),
    Init(init::Args),
    Link(link::Args),
    Status(desk::StatusArgs),
    Watch(desk::WatchArgs),
    Desk(page::Args),
    Stop(act::StopArgs),
    Pause(act::PauseArgs),
    Park(act::ParkArgs),
    Disarm(act::DisarmArgs),
    Level(act::LevelArgs),
    Trim(act::HallTrimArgs),
    Load(act::LoadArgs),
    Preflight(act::PreflightArgs),
    Start(start::Args),
    Report(report::Args),
    Push(push::Args),
    Playlist(playlist::Args),
    Drop(drop::Args),
    Pull(pull::Args),
    Have(have::Args),
}

// Who asks. No documentation: clap would show it as the help of commands.
#[derive(Debug, Clone, clap::Args)]
struct DeskArgs {
    /// The settings of the desk, as `kinocue fleet init` makes them.
    #[arg(long, value_name = "FILE", env = "KINOCUE_DESK", default_value = "/etc/kinocue/desk.toml")]
    desk: PathBuf,
}

pub(super) fn run(Args { command }: &Args) -> Result<Exit, Failure> {
    match command {
        FleetCommand::Demo(args) => demo::run(args),
        FleetCommand::Init(args) => init::run(args),
        FleetCommand::Link(args) => link::run(args),
        FleetCommand::Status(args) => desk::status(args),
        FleetCommand::Watch(args) => desk::watch(args),
        FleetCommand::Desk(args) => page::run(args),
        FleetCommand::Stop(args) => act::stop(args),
        FleetCommand::Pause(args) => act::pause(args),
        FleetCommand::Park(args) => act::park(args),
        FleetCommand::Disarm(args) => act::disarm(args),
        FleetCommand::Level(args) => act::level(args),
        FleetCommand::Trim(args) => act::trim(args),
        FleetCommand::Load(args) => act::load(args),
        FleetCommand::Preflight(args) => act::preflight(args),
        FleetCommand::Start(args) => start::run(args),
        FleetCommand::Report(args) => report::run(args),
        FleetCommand::Push(args) => push::run(args),
        FleetCommand::Playlist(args) => playlist::run(args),
        FleetCommand::Drop(args) => drop::run(args),
        FleetCommand::Pull(args) => pull::run(args),
        FleetCommand::Have(args) => have::run(args),
    }
}
