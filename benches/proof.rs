//! How long the limits proof of a two-hour six-axis cue at 100 Hz takes, as a ratio to loading that cue in the same run:
//! of smooth motion, and of motion with noise on every row, where nothing can be ruled out at a glance. And how long the proof of what
//! SilverMax units execute of it takes, as a ratio to that one.
//!
//! `cargo bench --bench proof`, and with `-- --quick` for the smooth cue at 100 frames a second alone.

mod common {
    pub(crate) mod spread;
}

use std::fs::File;
use std::hint::black_box;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use kinocue::cue::{self, Source};
use kinocue::harness::motion::SeatType;
use kinocue::harness::proof::{Digest, DriveTerms, Terms, prove, prove_driven};
use kinocue::harness::time::Rate;
use kinocue::harness::timeline::Timeline;

use common::spread::{Spread, verdict};

const ROWS: u32 = 720_000;
const AXES: usize = 6;
const ROUNDS: usize = 7;
/// The goal that the ratio is held against, and the rate that it is for.
const GOAL: f64 = 1.0;
const GOAL_RATE: f64 = 100.0;
/// Segments a second of the drives.
const LINK_HZ: f64 = 30.0;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Outcome<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("two-hours.csv");
    println!("{ROWS} rows of {AXES} axes, {ROUNDS} rounds: median (least..greatest)");
    let quick = std::env::args().any(|arg| arg == "--quick");
    let (noises, rates) = if quick { (1, 1) } else { (2, 3) };
    for (what, noise) in [("smooth", 0.0), ("noisy", 2e-5)].into_iter().take(noises) {
        write_cue(&path, noise)?;
        for rate in [100.0, 1000.0, 60.0].into_iter().take(rates) {
            compare(&path, what, rate)?;
        }
    }
    Ok(())
}

/// Motion with six decimals, as an editor exports it.
fn write_cue(path: &Path, noise: f64) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    writeln!(out, "# kinocue-csv: 1\ntime_ms,a1,a2,a3,a4,a5,a6")?;
    let mut chance = 1_u32;
    for row in 0..ROWS {
        write!(out, "{}", row * 10)?;
        for axis in 0..6_u8 {
            let phase = f64::from(row) * 0.01 * (0.7 + 0.3 * f64::from(axis));
            chance = chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let shake = noise * (f64::from(chance >> 16) / 32_768.0 - 1.0);
            write!(out, ",{:.6}", 0.5 + 0.3 * phase.sin() + 0.1 * (2.7 * phase).cos() + shake)?;
        }
        writeln!(out)?;
    }
    out.flush()
}

fn compare(path: &Path, what: &str, rate: f64) -> Outcome<()> {
    let seat = Arc::new(SeatType::bench3(AXES));
    let (mut loads, mut proofs, mut driven) = (Vec::new(), Vec::new(), Vec::new());
    let counts = seat.as_ref().clone().with_each(|axis| axis.pulses_per_rev = 4_000.0);
    let link = DriveTerms::silvermax(Duration::from_secs_f64(LINK_HZ.recip()));
    for _ in 0..ROUNDS {
        let (timeline, load) = timed(|| Ok(Timeline::new(cue::load(path, &Source::Native)?)))?;
        let (_, proof) = timed(|| {
            let digest = Digest::of(timeline.cue());
            let terms = Terms::of_seat(Arc::clone(&seat), AXES, digest, Rate::from_hz(rate), 1.0);
            Ok(prove(&timeline, terms))
        })?;
        let (_, drives) = timed(|| {
            let digest = Digest::of(timeline.cue());
            let terms = Terms::of_seat(Arc::new(counts.clone()), AXES, digest, Rate::from_hz(rate), 1.0);
            Ok(prove_driven(&timeline, &terms, &link))
        })?;
        loads.push(load);
        proofs.push(proof);
        driven.push(drives);
    }
    let ratios = Spread::of(proofs.iter().zip(&loads).map(|(a, b)| a.as_secs_f64() / b.as_secs_f64()));
    println!("{what}, {rate} frames a second");
    print_times("  cue::load and Timeline::new", &loads);
    print_times("  digest and proof", &proofs);
    let verdict = match rate {
        GOAL_RATE => format!("goal {GOAL:.1}: {}", verdict(ratios, GOAL)),
        _ => String::new(),
    };
    println!("{:<42} {ratios:.2}   {verdict}", "  ratio");
    let ratios = Spread::of(driven.iter().zip(&proofs).map(|(a, b)| a.as_secs_f64() / b.as_secs_f64()));
    print_times("  digest and proof of drives", &driven);
    println!("{:<42} {ratios:.2}", "  ratio to the proof");
    Ok(())
}

#[expect(clippy::disallowed_methods, reason = "a bench measures")]
fn timed<T>(work: impl FnOnce() -> Outcome<T>) -> Outcome<(T, Duration)> {
    let start = Instant::now();
    let made = black_box(work()?);
    Ok((made, start.elapsed()))
}

fn print_times(what: &str, times: &[Duration]) {
    println!("{what:<42} {:.0} ms", Spread::of(times.iter().map(|time| time.as_secs_f64() * 1e3)));
}
