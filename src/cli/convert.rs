//! `kinocue convert`.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{self, BufWriter, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _, PermissionsExt as _, fchown};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use indicatif::{ProgressBar, ProgressStyle};

use super::load::cue_exit;
use super::record::{open, seat_in, tell_flaws, unread};
use super::{Exit, Failure, OrExit as _, exit, print};
use crate::cue::{self, CsvError, Cue, CueFaults, DeclaredUnit, Problem, Source, limits};
use crate::record::{Contents, FilmTracks, Places, RecordedAxis, tracks};

/// As many links are followed as the system follows.
const MAX_LINKS: usize = 40;

/// Converts cues between formats; makes a cue of a recording.
///
/// Exits with 1 if a recording is cut short or damaged: OUTPUT then has only what precedes that.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("\
Examples:
  kinocue convert cues/coaster.csv coaster.mcap
  kinocue convert examples/rows.csv swell.csv --from rows --units mm --title Swell
  kinocue convert --from csv saved.csv storm.csv                      a spreadsheet of yours, with semicolons and 0,5
  kinocue convert ride.bin ride.csv --from u8 --axes 3 --rate 20      raw bytes of yours
  kinocue convert --recover cues/storm.mcap saved.mcap
  kinocue convert ride.mcap sent.csv --seat c1 --take sent            a recording of yours

A cue may have {}.", limits::IN_WORDS))]
pub(super) struct Args {
    /// The cue to read, CSV or MCAP; a file in the format given with --from; or a recording.
    input: PathBuf,
    /// The file to write; its name ends in .csv or .mcap.
    output: PathBuf,
    /// Foreign format to read: csv is a cue as a spreadsheet of any language saves it; rows is line,time_ms,x,y,z,u,v,w, where time_ms is the duration of the row; u8 is raw
    /// bytes, one per axis, 0 to 255 over the stroke.
    #[arg(long, value_enum, value_name = "FORMAT")]
    from: Option<ConvertFormat>,
    /// Unit of the positions in rows: mm, percent, fraction or pulse.
    #[arg(long, value_name = "UNIT", requires = "from", required_if_eq("from", "rows"))]
    units: Option<DeclaredUnit>,
    /// Number of axes in u8, 1 to 12.
    #[arg(long, value_name = "N", requires = "from", required_if_eq("from", "u8"))]
    axes: Option<usize>,
    /// Rows per second in u8.
    #[arg(long, value_name = "HZ", requires = "from", required_if_eq("from", "u8"))]
    rate: Option<f64>,
    /// Recover the complete messages of a truncated or damaged MCAP cue.
    #[arg(long, conflicts_with = "from")]
    recover: bool,
    /// The seat of a recording.
    #[arg(long, value_name = "NAME", requires = "take", conflicts_with_all = ["from", "recover"])]
    seat: Option<String>,
    /// What to take from a recording: the positions sent to the seat, or those measured.
    #[arg(long, value_enum, value_name = "WHAT", requires = "seat")]
    take: Option<Take>,
    /// Give the cue this title.
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// Overwrite OUTPUT if it exists.
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum ConvertFormat {
    Csv,
    Rows,
    U8,
}

/// What of a recording becomes a cue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Take {
    Sent,
    Measured,
}

/// What is written, by the name of the output.
#[derive(Debug, Clone, Copy)]
pub(super) enum ConvertTarget {
    Csv,
    Mcap,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let target = target(&args.output).or_exit(Exit::Usage)?;
    let is_csv = matches!(args.from, Some(ConvertFormat::Csv));
    if is_csv && (args.units.is_some() || args.axes.is_some() || args.rate.is_some()) {
        let why = anyhow!(
            "--from csv takes no --units, --axes or --rate: the file says what it is in \"# units: ...\""
        );
        return Err(why).or_exit(Exit::Usage);
    }
    exit::refuse_to_replace(&args.output, args.force)?;
    if args.take.is_some() || args.recover {
        exit::refuse_same(&args.input, &args.output)?;
    }
    let mut flaws = Vec::new();
    let read = match (&args.seat, args.take) {
        (Some(seat), Some(take)) => {
            let (contents, cue) = of_recording(&args.input, seat, take)?;
            flaws = contents.flaws();
            cue.map(|cue| (cue, None))
        }
        _ => read(args),
    };
    let mut cue = match read {
        Ok((cue, lost)) => {
            tell_lost(&cue, lost.as_ref());
            cue
        }
        Err(faults) => {
            print::tell(&format!("{faults}"));
            return Ok(cue_exit(&faults));
        }
    };
    if let Some(title) = &args.title {
        cue.set_title(title.clone());
    }
    write(&cue, &[], &args.output, target)?;
    let (rows, axes, length) = (cue.rows(), cue.axes(), cue.duration());
    let axes_in_words = if axes == 1 { "1 axis".to_owned() } else { format!("{axes} axes") };
    print::tell(&format!("{}: {rows} rows, {axes_in_words}, {length}", args.output.display()));
    Ok(tell_flaws(&args.input, &flaws))
}

/// What the name of an output says that it is to be.
pub(super) fn target(output: &Path) -> anyhow::Result<ConvertTarget> {
    let named = |extension| output.extension().is_some_and(|it| it.eq_ignore_ascii_case(extension));
    if named("csv") {
        Ok(ConvertTarget::Csv)
    } else if named("mcap") {
        Ok(ConvertTarget::Mcap)
    } else {
        Err(anyhow!("{}: the name of the output has to end in .csv or .mcap", output.display()))
    }
}

/// The cue, and why the rest of it is lost where it had to be recovered.
fn read(args: &Args) -> Result<(Cue, Option<Problem>), CueFaults> {
    let source = match args.from {
        None => Source::Native,
        Some(ConvertFormat::Csv) => Source::Spreadsheet,
        Some(ConvertFormat::Rows) => Source::Rows { unit: args.units.unwrap_or_default() },
        Some(ConvertFormat::U8) => {
            Source::U8 { axes: args.axes.unwrap_or_default(), rate_hz: args.rate.unwrap_or_default() }
        }
    };
    let file = cue::open(&args.input)?;
    let length = file.metadata().map_or(0, |metadata| metadata.len());
    let bar = ProgressBar::new(length).with_style(style("reading {bar:40} {bytes} of {total_bytes}"));
    let input = bar.wrap_read(file);
    let cue = if args.recover {
        cue::recover(&args.input, input)
    } else {
        cue::read(&args.input, input, &source).map(|cue| (cue, None))
    };
    bar.finish_and_clear();
    cue
}

/// A seat of a recording as a cue from its first instant on, checked like any other; and what the recording says of itself.
fn of_recording(path: &Path, name: &str, take: Take) -> Result<(Contents, Result<Cue, CueFaults>), Failure> {
    let from = if take == Take::Sent { Places::Sent } else { Places::Measured };
    let FilmTracks { contents, mut seats, .. } =
        tracks(open(path)?, from).map_err(|error| unread(error, path))?;
    let lane = seat_in(&contents, name)?;
    let track = seats.remove(name).unwrap_or_default();
    let (Some((first, places)), axes) = (track.first(), contents.seats[lane].axes()) else {
        let error = anyhow!("{}: nothing of {name} was recorded while the film ran", path.display());
        return Err(error).or_exit(Exit::BadCue);
    };
    let units: Vec<&str> = axes.iter().map(|axis| axis.unit.name()).collect();
    let names = (1..=places.len()).map(|axis| format!(",a{axis}")).collect::<String>();
    let mut text = format!("# units: {}\n# interpolation: linear\ntime_s{names}\n", units.join(","));
    for (at, places) in &track {
        // A pulse that lies outside of the stroke by rounding is at its end.
        let place = |(place, axis): (&f32, &RecordedAxis)| {
            format!(",{:.4}", f64::from(*place).clamp(axis.low, axis.low + axis.stroke))
        };
        text += &format!("{:.6}{}\n", at - first, places.iter().zip(axes).map(place).collect::<String>());
    }
    // As text it is, whatever the recording is called.
    let named = PathBuf::from(format!("{} of {}", name, path.display())).with_extension("csv");
    Ok((contents, cue::read(&named, text.as_bytes(), &Source::Native)))
}

fn tell_lost(cue: &Cue, lost: Option<&Problem>) {
    if let Some(lost) = lost {
        let what = match lost {
            Problem::Damaged(what) => format!("damaged: {what}"),
            _ => "cut short".to_owned(),
        };
        let (rows, last) = (cue.rows(), cue.duration());
        print::tell(&format!(
            "{} is {what}; {rows} rows up to {last} are saved, the rest is lost",
            cue.path().display()
        ));
    }
}

/// Writes beside the output and renames, so that there is the old file or the whole new one at any time. Comments are lines for the
/// head of a CSV, each with its `#`.
pub(super) fn write(
    cue: &Cue,
    comments: &[String],
    output: &Path,
    target: ConvertTarget,
) -> Result<(), Failure> {
    let part = ConvertPart::create(output).or_exit(Exit::Io)?;
    let bar = ProgressBar::no_length().with_style(style("writing {bytes}"));
    let mut out = BufWriter::new(bar.wrap_write(&part.file));
    match target {
        ConvertTarget::Csv => {
            if !cue.markers().is_empty() {
                print::tell(&format!("CSV cannot hold markers; {} are left out", cue.markers().len()));
            }
            cue::write_csv_with(cue, comments, &mut out).map_err(|error| match error {
                CsvError::Io(error) => failure(error, Exit::Io, output),
                refused => failure(refused, Exit::BadCue, cue.path()),
            })?;
        }
        ConvertTarget::Mcap => {
            cue::write_mcap(cue, &mut out).map_err(|error| failure(error, Exit::Io, output))?
        }
    }
    out.flush().map_err(|error| failure(error, Exit::Io, output))?;
    drop(out);
    bar.finish_and_clear();
    part.rename().map_err(|error| failure(error, Exit::Io, output))
}

fn failure(error: impl Into<anyhow::Error>, exit: Exit, path: &Path) -> Failure {
    Failure { exit, error: error.into().context(path.display().to_string()) }
}

/// Writes a whole file in the same way.
pub(super) fn write_whole(output: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let part = ConvertPart::create(output).or_exit(Exit::Io)?;
    (&part.file).write_all(bytes).map_err(|error| failure(error, Exit::Io, output))?;
    part.rename().map_err(|error| failure(error, Exit::Io, output))
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// The file that a name leads to through links; there may be none yet.
fn behind_links(output: &Path) -> PathBuf {
    let mut path = output.to_owned();
    for _ in 0..MAX_LINKS {
        let Ok(next) = fs::read_link(&path) else { break };
        path.pop();
        path.push(next);
    }
    path
}

/// Gives a file the owner, group and mode of the one that it replaces, as far as the system lets us; where the group cannot be kept, another
/// one may do no more than anybody.
fn keep_rights(file: &File, was: &Metadata) -> io::Result<()> {
    let has_group = fchown(file, None, Some(was.gid())).is_ok();
    // Only root gives files away, and whoever may write here may own them.
    let _ = fchown(file, Some(was.uid()), None);
    let mode = was.mode() & 0o777;
    let mode = if has_group { mode } else { mode & (0o707 | (mode & 0o007) << 3) };
    file.set_permissions(Permissions::from_mode(mode))
}

/// A file on its way to its name; gone again unless it gets there.
struct ConvertPart {
    file: File,
    path: PathBuf,
    output: PathBuf,
    /// Of the file that is there.
    replaced: Option<Metadata>,
}

impl ConvertPart {
    fn create(output: &Path) -> anyhow::Result<Self> {
        let mut name = std::ffi::OsString::from(".");
        name.push(output.file_name().unwrap_or_default());
        name.push(format!(".{}.part", std::process::id()));
        let output = behind_links(output);
        let replaced = fs::metadata(&output).ok();
        if replaced.as_ref().is_some_and(|there| !there.is_file()) {
            bail!("{} is no file; give another name", output.display());
        }
        let path = output.with_file_name(name);
        let mode = replaced.as_ref().map_or(0o666, Metadata::mode) & 0o777;
        let file = OpenOptions::new().write(true).create_new(true).mode(mode).open(&path);
        let file = file.with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Self { file, path, output, replaced })
    }

    fn rename(self) -> io::Result<()> {
        self.replaced.iter().try_for_each(|was| keep_rights(&self.file, was))?;
        self.file.sync_all()?;
        fs::rename(&self.path, &self.output)
    }
}

impl Drop for ConvertPart {
    fn drop(&mut self) {
        // After the rename there is nothing left under this name, which is no error here.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use clap::{Args as _, FromArgMatches as _};

    use super::*;
    use crate::record::recorded_measured;

    /// `kinocue convert` with these arguments, in a folder with a recording of a seat that was sent up and down, and was measured where
    /// `measured` says.
    fn converted(measured: impl Fn(f64) -> Option<f64>) -> (tempfile::TempDir, Result<Exit, Failure>) {
        let folder = tempfile::tempdir().expect("a folder");
        let [from, to] = ["ride.mcap", "again.csv"].map(|name| folder.path().join(name));
        let ticks = (0..300).map(|tick| 0.5 + 0.2 * (f64::from(tick) * 0.04).sin());
        fs::write(&from, recorded_measured(ticks.map(|sent| (sent, measured(sent))))).expect("there is room");
        let words = ["convert".as_ref(), from.as_os_str(), to.as_os_str()];
        let words = words.into_iter().chain(["--seat", "A1", "--take", "measured"].map(AsRef::as_ref));
        let matches = Args::augment_args(clap::Command::new("convert")).get_matches_from(words);
        let run = run(&Args::from_arg_matches(&matches).expect("they are right"));
        (folder, run)
    }

    #[test]
    fn where_a_seat_was_measured_to_be_becomes_a_cue_that_is_read_like_any_other() {
        let (folder, run) = converted(|sent| Some(sent * 0.9));
        assert_eq!(run.expect("it is a cue"), Exit::Done);
        let path = folder.path().join("again.csv");
        let read = cue::read(&path, File::open(&path).expect("it is there"), &Source::Native).expect("a cue");
        assert_eq!(read.axes(), 3);
        assert!((2.8..3.0).contains(&read.duration().as_secs_f64()), "{}", read.duration());
        let text = fs::read_to_string(&path).expect("it is there");
        let places: Vec<f64> = text.lines().filter_map(|line| line.split(',').nth(1)?.parse().ok()).collect();
        let most = places.iter().copied().fold(f64::MIN, f64::max);
        // 0.9 of 0.7 of a stroke of 150 mm, to the pulse.
        assert!(places.len() > 40 && (most - 94.5).abs() < 0.1, "{most} in {} rows", places.len());
    }

    #[test]
    fn a_seat_that_nobody_measured_makes_no_cue() {
        let (folder, run) = converted(|_| None);
        assert!(run.is_err_and(|failure| failure.error.to_string().contains("nothing of A1 was recorded")));
        assert!(!folder.path().join("again.csv").exists());
    }
}
