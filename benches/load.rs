//! How long a two-hour six-axis cue at 100 Hz takes to load and how much memory that needs, as ratios: the time against
//! reading the same file with `csv` and parsing every cell; the memory against the samples it holds and the file.
//!
//! `cargo bench --bench load`

mod common {
    pub(crate) mod spread;
}

use std::fs::{self, File};
use std::hint::black_box;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use kinocue::cue::{self, Source};
use kinocue::harness::timeline::Timeline;

use common::spread::{Spread, verdict};

const ROWS: u32 = 720_000;
const AXES: u32 = 6;
const ROUNDS: usize = 7;
/// The goals that the ratios are held against.
const TIME_GOAL: f64 = 2.0;
const MEMORY_GOAL: f64 = 1.0;
/// Tells the child process to load a file and print by how many kB its peak memory rose.
const CHILD: &str = "--peak-of";

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Outcome<()> {
    let args: Vec<_> = std::env::args().collect();
    if let [_, flag, path] = args.as_slice()
        && flag == CHILD
    {
        return print_rise(Path::new(path));
    }
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("two-hours.csv");
    write_cue(&path)?;
    compare_times(&path)?;
    compare_memory(&path)
}

/// Smooth motion with six decimals, as an editor exports it.
fn write_cue(path: &Path) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    writeln!(out, "# kinocue-csv: 1\ntime_ms,a1,a2,a3,a4,a5,a6")?;
    for row in 0..ROWS {
        write!(out, "{}", row * 10)?;
        for axis in 0..AXES {
            let phase = f64::from(row) * 0.01 * (0.7 + 0.3 * f64::from(axis));
            write!(out, ",{:.6}", 0.5 + 0.3 * phase.sin() + 0.1 * (2.7 * phase).cos())?;
        }
        writeln!(out)?;
    }
    out.flush()
}

fn compare_times(path: &Path) -> Outcome<()> {
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        theirs.push(timed(|| parse_cells(path))?);
        ours.push(timed(|| load(path))?);
    }
    let ratios = Spread::of(ours.iter().zip(&theirs).map(|(a, b)| a.as_secs_f64() / b.as_secs_f64()));
    println!("loading {ROWS} rows of {AXES} axes, {ROUNDS} rounds: median (least..greatest)");
    print_times("cue::load and Timeline::new", &ours);
    print_times("csv ByteRecords, cells as f64", &theirs);
    println!("{:<42} {ratios:.2}   goal {TIME_GOAL:.1}: {}", "ratio", verdict(ratios, TIME_GOAL));
    Ok(())
}

fn compare_memory(path: &Path) -> Outcome<()> {
    let child = Command::new(std::env::current_exe()?).arg(CHILD).arg(path).output()?;
    let rise_kb: f64 = String::from_utf8(child.stdout)?.trim().parse()?;
    let file = f64::from(u32::try_from(fs::metadata(path)?.len())?) / 1e6;
    let samples = f64::from(ROWS * 8 * (1 + AXES)) / 1e6;
    let (rise, most) = (rise_kb * 1024.0 / 1e6, 2.0 * samples + file);
    println!("\nmemory: rise of the peak {rise:.1} MB; samples {samples:.1} MB, file {file:.1} MB");
    let part = Spread::of([rise / most]);
    let judged = verdict(part, MEMORY_GOAL);
    println!("{:<42} {:>8.2}   goal {MEMORY_GOAL:.1}: {judged}", "rise / (2 x samples + file)", part.median);
    println!("{:<42} {:>8.2}", "rise / samples", rise / samples);
    Ok(())
}

fn load(path: &Path) -> Outcome<Timeline> {
    Ok(Timeline::new(cue::load(path, &Source::Native)?))
}

/// The yardstick: every record read, every cell parsed, nothing kept.
fn parse_cells(path: &Path) -> Outcome<f64> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path)?;
    let mut record = csv::ByteRecord::new();
    let mut sum = 0.0;
    while reader.read_byte_record(&mut record)? {
        for cell in &record {
            sum += str::from_utf8(cell)?.parse::<f64>()?;
        }
    }
    Ok(sum)
}

#[expect(clippy::disallowed_methods, reason = "a bench measures")]
fn timed<T>(work: impl FnOnce() -> Outcome<T>) -> Outcome<Duration> {
    let start = Instant::now();
    let made = black_box(work()?);
    let took = start.elapsed();
    drop(made);
    Ok(took)
}

fn print_rise(path: &Path) -> Outcome<()> {
    let before = peak_kb()?;
    let made = black_box(load(path)?);
    println!("{}", peak_kb()? - before);
    drop(made);
    Ok(())
}

/// The most memory that this process ever had resident.
fn peak_kb() -> Outcome<u64> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).ok_or("no VmHWM")?;
    Ok(line.trim().trim_end_matches(" kB").parse()?)
}

fn print_times(what: &str, times: &[Duration]) {
    println!("{what:<42} {:.0} ms", Spread::of(times.iter().map(|time| time.as_secs_f64() * 1e3)));
}
