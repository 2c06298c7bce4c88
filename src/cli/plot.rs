//! `kinocue plot`.

use std::io;
use std::path::{Path, PathBuf};

use anyhow::anyhow;

use super::load::{self, Judge, SeatArgs};
use super::{Exit, Failure, OrExit as _, convert, exit, figures, plot_recording, print};
use crate::cue::Source;
use crate::motion::SeatAxis;
use crate::plot::{self, Columns, Picture, Subject, Theme};
use crate::proof::Digest;
use crate::sys::terminal;
use crate::time::{Rate, ShowTime, parse_time};
use crate::timeline::Timeline;

/// How far to each side of `--at` is shown.
const AROUND: ShowTime = ShowTime::from_millis(5_000);
/// Characters of a line where nobody says how wide it is.
const WIDTH: u16 = 100;
/// Columns of a file, shared out among the axes: what keeps it under 500 kB.
const FILE_COLUMNS: usize = 7_200;
/// The same of a recording, which has more lines.
pub(super) const RECORDING_COLUMNS: usize = 900;
/// The greatest width of a terminal that is used, characters.
const WIDEST: u16 = 240;

/// Draws a cue or a recording.
///
/// Of a cue where it goes and what that asks of a seat; of a recording what a seat was asked and sent, and what went wrong. Draws in braille on a terminal; with -o writes a self-contained HTML page or SVG. Speed, acceleration and jerk are those of
/// `kinocue info` and `kinocue check`, as fractions of their limits. For a recording, --seat is the name of a seat; without it, one
/// that a mark names is drawn, else one that fell out, else the one that the limiter held back farthest.
#[derive(Debug, clap::Args)]
#[command(after_help = load::after_help(&[
    "kinocue plot cues/coaster.csv",
    "kinocue plot cues/storm.mcap -o storm.html",
    "kinocue plot cues/coaster.csv --at 00:32.5 --theme print -o jerk.svg",
    "kinocue plot cues/bench-ride.csv --config examples/hall.toml --from 0:10 --to 0:15",
    "kinocue plot last                                            the newest recording in this folder",
    "kinocue plot ride.mcap before.mcap --seat c1 -o both.html    two recordings of yours",
]))]
pub(super) struct Args {
    /// The cue, CSV or MCAP; or a recording; or the word last: the newest recording in this folder.
    cue: PathBuf,

    /// Another recording, whose sent positions are drawn over the first.
    other: Option<PathBuf>,

    #[command(flatten)]
    seat: SeatArgs,

    /// Begin here: SS, MM:SS or HH:MM:SS.
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    from: Option<ShowTime>,

    /// End here: SS, MM:SS or HH:MM:SS.
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    to: Option<ShowTime>,

    /// Show five seconds to either side of this time.
    #[arg(long, value_name = "TIME", value_parser = parse_time, conflicts_with_all = ["from", "to"])]
    at: Option<ShowTime>,

    /// The file to write; its name ends in .html or .svg.
    #[arg(short, long, value_name = "OUT", conflicts_with = "json")]
    output: Option<PathBuf>,

    /// What the file will be viewed on.
    #[arg(long, value_enum, default_value_t, requires = "output")]
    theme: Theme,

    /// Overwrite OUT if it exists.
    #[arg(long, requires = "output")]
    force: bool,

    /// Print the picture as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What a picture is written as.
#[derive(Debug, Clone, Copy)]
enum PlotFormat {
    Page,
    Svg,
}

/// The console of a kernel has no braille, and draws a box for each.
fn on_terminal(drawn: String) -> String {
    let is_console = std::env::var_os("TERM").is_some_and(|term| term == "linux");
    if is_console { plot::in_blocks(&drawn) } else { drawn }
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let file = args.output.as_deref().map(|path| Ok::<_, Failure>((path, format(path)?))).transpose()?;
    if let Some((path, _)) = file {
        exit::refuse_to_replace(path, args.force)?;
    }
    if let Some(recording) = plot_recording::meant(&args.cue)? {
        if args.seat.is_of_hall() {
            let error = anyhow!(
                "--config, --rate and --chase are for cues; a recording has seats and a rate of its own"
            );
            return Err(error).or_exit(Exit::Usage);
        }
        let (from, until) = args.stretch();
        let recorded = plot_recording::OpenRecording::open(&recording)?;
        let other = args.other.as_deref().map(plot_recording::OpenRecording::open).transpose()?;
        let asked = plot_recording::Asked {
            file: &recorded,
            other: other.as_ref(),
            seat: args.seat.seat.as_deref(),
            from,
            until,
            columns: if file.is_some() {
                RECORDING_COLUMNS
            } else {
                2 * plot::cells(usize::from(width())) - 1
            },
            is_detailed: file.is_some() || args.json,
        };
        let (picture, ..) = plot_recording::picture(&asked)?;
        tell(&picture, file, args)?;
        return Ok(Exit::Done);
    }
    if let Some(other) = &args.other {
        let error = anyhow!("{}: only two recordings can be drawn over each other", other.display());
        return Err(error).or_exit(Exit::Usage);
    }
    let hall = args.seat.config.as_deref().map(load::config).transpose()?;
    let judge = args.seat.judge(hall)?;
    let timeline = Timeline::new(load::cue(&args.cue, &Source::Native)?);
    let seats = judge.seats(timeline.axes());
    let (from, until) = args.window(timeline.duration())?;
    let most = match file {
        Some(_) => (FILE_COLUMNS / timeline.axes()).clamp(600, 1_200),
        None => 2 * plot::cells(usize::from(width())) - 1,
    };
    let facts = facts(&timeline, &seats, judge.rate_hz);
    let subject = Subject { timeline: &timeline, seats: &seats, rate: Rate::from_hz(judge.rate_hz), facts };
    let mut picture = plot::of_cue(subject, Columns::over(from, until, most));
    let faults = judge.stroke(&timeline).faults;
    picture.facts.extend(faults.iter().map(|fault| fault.to_string().trim().to_owned()));
    tell(&picture, file, args)?;
    // Drawn all the same; but no seat can play what leaves its stroke.
    Ok(faults.first().map_or(Exit::Done, load::cue_exit))
}

/// Draws a cue on the terminal, as it is on its seats.
pub(super) fn draw(timeline: &Timeline, judge: &Judge) -> Result<(), Failure> {
    let seats = judge.seats(timeline.axes());
    let facts = facts(timeline, &seats, judge.rate_hz);
    let columns =
        Columns::over(ShowTime::ZERO, timeline.duration(), 2 * plot::cells(usize::from(width())) - 1);
    let subject = Subject { timeline, seats: &seats, rate: Rate::from_hz(judge.rate_hz), facts };
    print::out(&on_terminal(plot::braille(&plot::of_cue(subject, columns))))
}

impl Args {
    /// The ends of what is asked for.
    fn stretch(&self) -> (Option<ShowTime>, Option<ShowTime>) {
        match self.at {
            Some(at) => {
                (Some(at.since(AROUND)), Some(ShowTime::from_nanos(at.as_nanos() + AROUND.as_nanos())))
            }
            None => (self.from, self.to),
        }
    }

    /// What is shown of a cue that lasts so long.
    fn window(&self, end: ShowTime) -> Result<(ShowTime, ShowTime), Failure> {
        let (from, until) = self.stretch();
        let (from, until) = (from.unwrap_or(ShowTime::ZERO).max(ShowTime::ZERO), until.unwrap_or(end));
        let until = until.min(end);
        if from >= until {
            let error = anyhow!("nothing to show from {from} to {until}; the cue is {end} long");
            return Err(error).or_exit(Exit::Usage);
        }
        Ok((from, until))
    }
}

fn format(path: &Path) -> Result<PlotFormat, Failure> {
    match path.extension().and_then(|end| end.to_str()) {
        Some("html") => Ok(PlotFormat::Page),
        Some("svg") => Ok(PlotFormat::Svg),
        _ => Err(anyhow!("{}: the name has to end in .html or .svg", path.display())).or_exit(Exit::Usage),
    }
}

/// What the picture holds for.
fn facts(timeline: &Timeline, seats: &[SeatAxis], rate_hz: f64) -> Vec<String> {
    let cue = timeline.cue();
    vec![
        format!("{}, {}, {} rows", cue.path().display(), timeline.duration(), cue.rows()),
        format!("seat {} at {rate_hz} frames a second, level 100 %", figures::seat_names(seats)),
        format!("digest {}, kinocue {}", Digest::of(cue), env!("CARGO_PKG_VERSION")),
    ]
}

fn tell(picture: &Picture, file: Option<(&Path, PlotFormat)>, args: &Args) -> Result<(), Failure> {
    match file {
        Some((path, format)) => {
            let text = match format {
                PlotFormat::Page => plot::page(picture, args.theme),
                PlotFormat::Svg => plot::svg(picture, args.theme),
            };
            convert::write_whole(path, text.as_bytes())?;
            print::out(&format!("{}\n", picture.sentence))
        }
        None if args.json => print::json(picture),
        None => print::out(&on_terminal(plot::braille(picture))),
    }
}

/// How wide the terminal is, characters.
fn width() -> u16 {
    terminal::width(io::stdout()).unwrap_or(WIDTH).min(WIDEST)
}
