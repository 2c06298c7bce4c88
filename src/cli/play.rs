//! `kinocue play`: one cue in the foreground, keys and live lines on a terminal, the report at the end.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, anyhow};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::load::{self, SourceArgs, after_help, parse_rate};
use super::stream::StreamArgs;
use super::targets::tell_absent;
use super::{Exit, Failure, OrExit as _, exit, metres, print};
use crate::app::film::{FilmReader, SourceRules};
use crate::app::runtime::RuntimeError;
use crate::app::{Play, PlayError, Played, RollCall};
use crate::config::{Config, from_to_args, parse_level};
use crate::control::model::Ending;
use crate::drive::Manner;
use crate::engine::Show;
use crate::film::source::{ClockStart, FilmArgs, FilmSource};
use crate::health::ACKS_OFF;
use crate::record::Mode;
use crate::sys::{signal, terminal};
use crate::time::{Rate, ShowTime, parse_time};
use crate::timeline::Timeline;
use crate::wire::Timing;

mod health;
mod keyboard;
mod keys;
mod messages;
mod progress;

use messages::Messages;
use progress::Progress;

const EXAMPLES: [&str; 5] = [
    "kinocue play cues/bench-ride.csv --to 127.0.0.1:7408",
    "kinocue play cues/bench-ride.csv --to 127.0.0.1:7408,name=A1 --to 127.0.0.1:7409,name=A2 --rate 250",
    "kinocue play cues/voyage.csv --to 127.0.0.1:7408,axes=6 --to 127.0.0.1:7409,axes=6,offset=6",
    "kinocue play cues/bench-ride.csv --config examples/hall.toml --start 0:12 --json > report.json",
    "kinocue play cues/seat-demo.csv --to 127.0.0.1:7408 --record ride.mcap --record-mode full",
];

/// Plays one cue, and reports the fate of every frame.
///
/// Ctrl-C parks the seats and ends with the report. A second Ctrl-C, at least half a second later, ends at once and leaves the
/// seats where they are. On a terminal, keys control the play; ? lists them. None of this is an emergency stop: that one is
/// hard-wired.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("seats").required(true).args(["to", "config"])))]
#[command(after_help = after_help(&EXAMPLES))]
pub(super) struct Args {
    /// The cue: CSV or MCAP.
    cue: PathBuf,
    #[command(flatten)]
    source: SourceArgs,
    /// A controller: HOST:PORT, then optionally, after commas, name=A1, axes=6, offset=0, fan_out=slice or shared, dialect=smc or
    /// mbox; repeatable.
    #[arg(long, value_name = "ADDR")]
    to: Vec<String>,
    /// The configuration, with controllers, seats and show settings.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Ticks per second, 1 to 1000 [default: 100, or the configuration's].
    #[arg(long, value_name = "HZ", value_parser = parse_rate)]
    rate: Option<f64>,
    /// Whether Time in the frames is relative or absolute [default: relative, or the configuration's].
    #[arg(long, value_parser = ["relative", "absolute"])]
    time: Option<String>,
    /// Start at this position in the cue: SS[.mmm], MM:SS, HH:MM:SS[.mmm] or HH:MM:SS:FF@24.
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    start: Option<ShowTime>,
    /// Number of plays; 0 repeats until stopped.
    #[arg(long = "loop", value_name = "N", default_value_t = 1)]
    plays: u32,
    /// Level of motion and vibration about the seats' neutral pose: 60%, 0.6 or -6dB.
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    level: Option<f64>,
    /// An effect's output Y01 to Y12, for controllers that are not on this machine: NAME=N; repeatable.
    #[arg(long, value_name = "NAME=N", conflicts_with = "config")]
    effect: Vec<String>,
    #[command(flatten)]
    stream: StreamArgs,
    /// Play only if every controller answers; without, those that do not are left out, on a terminal once you agree.
    #[arg(long, conflicts_with = "no_acks")]
    require_acks: bool,
    /// Follow a film: the seats wait at park, join it, and rest while it is stopped. mpv:SOCKET, ltc:pipe:COMMAND, ltc:fifo:PATH,
    /// ltc:alsa:DEVICE, ltc:-, ltc:FILE.wav, sound:INPUT,index=FILE.kidx, mtc:DEVICE, artnet:FROM, osc:FROM, http:FROM or
    /// clock:TIME; repeatable, best first.
    #[arg(long, value_name = "SOURCE", conflicts_with_all = ["start", "plays"])]
    chase: Vec<FilmSource>,
    /// Follow a film that begins at this time of day, as --chase clock:TIME does: 2026-11-21T19:00 or 19:00.
    #[arg(long, value_name = "TIME", conflicts_with_all = ["start", "plays", "chase"])]
    at: Option<ClockStart>,
    /// Also follow coarse sources: positions by OSC or HTTP that may be tens of milliseconds off.
    #[arg(long, requires = "chase")]
    allow_coarse: bool,
    /// Frame rate of the film: 23.976, 24, 25, 29.97 or 30 [default: as received].
    #[arg(long, value_name = "N", requires = "chase")]
    film_fps: Option<String>,
    /// The film's timecode at which the cue begins, HH:MM:SS:FF [default: 00:00:00:00].
    #[arg(long, value_name = "TIMECODE", requires = "chase")]
    tc_start: Option<String>,
    /// Record the play to a new MCAP file: 20 times a second, the positions asked of each seat and sent to it.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// How much to record.
    #[arg(long, value_enum, value_name = "MODE", requires = "record", default_value_t)]
    record_mode: Mode,
    /// Print the report as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let timeline = Timeline::new(load::cue(&args.cue, &args.source.source())?);
    let config = configuration(args, timeline.cue().axes())?;
    let seats = load::seats(Some(&config), None, timeline.axes());
    let small = metres::of_hall(&config).into_iter().chain(metres::of_cue(&timeline, &seats));
    small.for_each(|text| print::tell(&format!("kinocue: {text}")));
    let show = Show {
        rate: Rate::from_hz(config.show.rate_hz),
        timing: config.show.timing,
        start: args.start.unwrap_or_default(),
        plays: args.plays,
    };
    if show.start >= timeline.duration() {
        let why =
            anyhow!("--start {} is not before the end of the cue at {}", show.start, timeline.duration());
        return Err(why).or_exit(Exit::Usage);
    }
    let manner = Manner { level: args.level.unwrap_or(1.0), silent: args.stream.no_acks };
    let film = film(args)?;
    let exit = play(config, timeline, show, manner, film.as_ref(), args)?;
    film.and_then(|film| film.table().read().unheard()).map_or(Ok(exit), unheard)
}

/// Begins to listen to the film that leads, if one does.
fn film(args: &Args) -> Result<Option<FilmReader>, Failure> {
    let clock = args.at.map(FilmSource::Clock);
    let of = |source: FilmSource| FilmArgs::new(source, args.film_fps.as_deref(), args.tc_start.as_deref());
    let sources = args.chase.iter().cloned().chain(clock).map(of);
    let sources: Vec<FilmArgs> = sources.collect::<Result<_, _>>().or_exit(Exit::Usage)?;
    if sources.is_empty() {
        return Ok(None);
    }
    let rules = SourceRules { allows_coarse: args.allow_coarse, ..SourceRules::default() };
    FilmReader::start(&sources, rules).map(Some).map_err(exit::of_film)
}

/// Plays what is proved to fit, and prints the report.
fn play(
    config: Config,
    timeline: Timeline,
    show: Show,
    manner: Manner,
    film: Option<&FilmReader>,
    args: &Args,
) -> Result<Exit, Failure> {
    let cue = timeline.cue().path().to_path_buf();
    let length = timeline.duration();
    let for_ever = show.plays == 0;
    for (controller, what) in config.without_effects().filter(|_| uses_effects(&timeline)) {
        print::tell(&format!("{}: effects stay off; {what}", controller.name));
    }
    config.absent.iter().for_each(|one| tell_absent(&one.controller));
    if manner.silent {
        print::tell(&format!("kinocue: {ACKS_OFF}"));
    }
    let names = config.controllers.iter().map(|one| one.name.clone()).collect();
    let play = match film {
        Some(film) => Play::chasing(config, timeline, show, manner, film.point()),
        None => Play::new(config, timeline, show, manner),
    };
    let mut play = play.map_err(|error| refused(error, &cue))?;
    play.crowding().into_iter().for_each(|words| print::tell(&format!("kinocue: {words}")));
    if let Some(file) = &args.record {
        play = play
            .recorded(file, args.record_mode)
            .with_context(|| file.display().to_string())
            .or_exit(Exit::Io)?;
    }
    let roll = Arc::new(RollCall::new(args.require_acks));
    play = play.called(&roll);
    let control = play.control();
    let ctrl_c = leave_on_signals(&control.leave).context("signals cannot be handled").or_system()?;
    let film = film.map(FilmReader::table);
    let said = Messages { control, ctrl_c, length, join: play.join(), film, roll, names };
    let progress = Progress::start(said, for_ever);
    let played = play.run(|handle| progress.lead(handle)).map_err(|error| refused(error, &cue));
    progress.finish();
    tell(&played?, args.json)
}

/// Sources that say nothing of a film are no input to a play that chases one.
fn unheard(sources: String) -> Result<Exit, Failure> {
    let why = "ended, and nothing of a film was heard in it; see with `kinocue sync watch` what it carries, and check a recording with \
               `kinocue sync check`";
    Err(anyhow!("{sources}: {why}")).or_exit(Exit::BadCue)
}

fn uses_effects(timeline: &Timeline) -> bool {
    !timeline.effect_names().is_empty()
}

fn configuration(args: &Args, axes: usize) -> Result<Config, Failure> {
    let mut config = match &args.config {
        Some(path) => load::streamed(path, args.stream.no_acks)?,
        None => from_to_args(&args.to, &args.effect, axes).or_exit(Exit::Usage)?,
    };
    if let Some(hz) = args.rate {
        config.show.rate_hz = hz;
    }
    args.stream.put_into(&mut config)?;
    match args.time.as_deref() {
        Some("absolute") => config.show.timing = Timing::Absolute,
        Some(_) => config.show.timing = Timing::Relative,
        None => {}
    }
    Ok(config)
}

/// What a play ends with that did not begin.
fn refused(error: PlayError, cue: &Path) -> Failure {
    let (code, names_cue) = (exit_of(&error), !matches!(error, PlayError::Plan(_)));
    let error = anyhow::Error::new(error);
    Failure { exit: code, error: if names_cue { error } else { error.context(cue.display().to_string()) } }
}

/// The exit code of that.
pub(super) fn exit_of(error: &PlayError) -> Exit {
    match error {
        PlayError::Runtime(RuntimeError::Net(error)) => exit::of_net(error),
        PlayError::Runtime(RuntimeError::Thread(error)) => exit::of_system(error),
        PlayError::Runtime(RuntimeError::PortTaken(_)) => Exit::TryAgain,
        PlayError::Runtime(RuntimeError::Link(_)) | PlayError::Silent(_) => Exit::Unavailable,
        PlayError::Limits { .. } => Exit::CheckFailed,
        PlayError::Foreign(_) => Exit::Refused,
        PlayError::Moving(_) | PlayError::OtherMaster(_) => Exit::OtherMaster,
        PlayError::Unsure(_) | PlayError::Unplaced(_) | PlayError::NotHome(_) | PlayError::UnknownTurn(_) => {
            Exit::TryAgain
        }
        _ => Exit::BadCue,
    }
}

/// What Ctrl-C does besides asking to leave.
#[derive(Debug, Clone, Default)]
pub(super) struct CtrlC {
    pressed: Arc<AtomicBool>,
    /// True if the next one ends the program at once.
    armed: Arc<AtomicBool>,
}

impl CtrlC {
    /// True if it was pressed.
    pub(super) fn is_pressed(&self) -> bool {
        self.pressed.load(Ordering::Relaxed)
    }

    /// The next one ends the program at once.
    pub(super) fn arm(&self) {
        self.armed.store(true, Ordering::Relaxed);
    }

    /// True if the next one ends the program at once.
    pub(super) fn is_armed(&self) -> bool {
        self.armed.load(Ordering::Relaxed)
    }
}

/// The first Ctrl-C, SIGTERM or SIGHUP sets `leave`. Once it is armed, another Ctrl-C ends the program at once; never
/// before that, because one press reaches the program twice where something beside the terminal passes it on to the
/// whole process group, and seats would be left in mid-air for it.
pub(super) fn leave_on_signals(leave: &Arc<AtomicBool>) -> std::io::Result<CtrlC> {
    let ctrl_c = CtrlC::default();
    let code = Exit::Interrupted as i32;
    terminal::restore_on(SIGINT, Arc::clone(&ctrl_c.armed))?;
    signal_hook::flag::register_conditional_shutdown(SIGINT, code, Arc::clone(&ctrl_c.armed))?;
    signal_hook::flag::register(SIGINT, Arc::clone(&ctrl_c.pressed))?;
    signal_hook::flag::register(SIGINT, Arc::clone(leave))?;
    signal_hook::flag::register(SIGTERM, Arc::clone(leave))?;
    if !signal::is_ignored(SIGHUP)? {
        // The terminal is gone; the seats must not be left in the air for that.
        signal_hook::flag::register(SIGHUP, Arc::clone(leave))?;
    }
    Ok(ctrl_c)
}

/// Prints the report, and says how the program ends; `demo` does the same.
pub(super) fn tell(played: &Played, json: bool) -> Result<Exit, Failure> {
    for line in played.refusals.iter().chain(&played.notes) {
        print::tell(&format!("kinocue: {line}"));
    }
    if json {
        print::json(&played.report)?;
    } else {
        print::tell(&format!("\n{}", played.report.text()));
    }
    judge(played)
}

/// Who was silent, and what to look at: a drive on a link has no parameters of a controller.
fn silence(played: &Played) -> anyhow::Error {
    let mut silent = played.report.controllers.iter().filter(|one| played.silent.contains(&one.name));
    let what = if silent.all(|one| one.address.starts_with("link:")) {
        "power and cable, and ask `kinocue preflight` how its drives stand"
    } else {
        "power, cable, PA15 and PA20 to PA24"
    };
    anyhow!("{} acked nothing, or was lost at the end; check {what}", played.silent.join(", "))
}

/// How the program ends after a play.
pub(super) fn judge(played: &Played) -> Result<Exit, Failure> {
    let refused: Vec<&str> = played
        .report
        .controllers
        .iter()
        .filter(|one| one.frames.refused > 0 || one.state.emergency_stop)
        .map(|one| one.name.as_str())
        .collect();
    if played.report.result == Ending::Fault {
        return Err(anyhow!("the play ended in a fault; the seats were stopped")).or_exit(Exit::Internal);
    }
    if !refused.is_empty() {
        return Err(anyhow!(
            "{} refused frames, or is in emergency stop (x = 3, 4 or 5)",
            refused.join(", ")
        ))
        .or_exit(Exit::Refused);
    }
    if !played.silent.is_empty() {
        return Err(silence(played)).or_exit(Exit::Unavailable);
    }
    if !played.off_park.is_empty() {
        let who = played.off_park.join(", ");
        let why = anyhow!(
            "{who} tells that it is not at park, where its last frames led; look at it before the next play"
        );
        return Err(why).or_exit(Exit::TryAgain);
    }
    if !played.lost_sight_of.is_empty() {
        let who = played.lost_sight_of.join(", ");
        let why = anyhow!(
            "{who} could not be led to park: nobody knows which frames reached it, or it was moved; look where it stands before \
             the next play"
        );
        return Err(why).or_exit(Exit::TryAgain);
    }
    Ok(Exit::Done)
}
