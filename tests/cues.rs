//! The shipped cues: as generated, at rest at their ends, and well within the limits of the bench seat.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use kinocue::cue::{self, Source};
use kinocue::harness::motion::{SeatAxis, SeatType};
use kinocue::harness::proof::figures;
use kinocue::harness::time::{Rate, ShowTime};
use kinocue::harness::timeline::{EffectSet, Hint, Timeline};

#[path = "../examples/make_cues/files.rs"]
mod files;
#[path = "../examples/make_cues/rides.rs"]
mod rides;
#[path = "../examples/make_cues/shapes.rs"]
mod shapes;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cues")
}

fn shipped() -> Vec<Timeline> {
    let load = |ride: &shapes::Ride| cue::load(&folder().join(ride.file), &Source::Native).expect(ride.file);
    rides::ALL.iter().map(load).map(Timeline::new).collect()
}

fn name(timeline: &Timeline) -> String {
    timeline.cue().path().file_name().expect("a file").display().to_string()
}

#[test]
fn the_files_are_what_the_generator_makes() {
    for (name, bytes) in files::all() {
        assert!(fs::read(folder().join(name)).unwrap() == bytes, "{name}: run cargo run --example make_cues");
        assert!(bytes.len() < 300_000, "{name}: {} bytes", bytes.len());
    }
}

#[test]
fn every_cue_keeps_to_nine_tenths_of_the_bench_seat_at_100_and_1000_hz() {
    for timeline in shipped() {
        let seat = Arc::new(SeatType::bench3(timeline.axes()));
        let seats: Vec<_> = (0..timeline.axes()).map(|axis| SeatAxis::new(&seat, axis)).collect();
        assert_eq!(timeline.fits_stroke(0..timeline.axes(), Some(&seat)).faults, None);
        for rate in [100.0, 1000.0] {
            for (axis, figures) in figures(&timeline, Rate::from_hz(rate), &seats).iter().enumerate() {
                let geometry = figures.on.geometry();
                for (what, value, limit) in [
                    ("velocity", figures.velocity.value, geometry.max_velocity),
                    ("acceleration", figures.acceleration.value, geometry.max_acceleration),
                    ("jerk", figures.jerk.value, geometry.max_jerk),
                ] {
                    let part = value / limit;
                    assert!(
                        part < 0.9,
                        "{}: a{}: {what} is {part:.3} of its limit at {rate} Hz",
                        name(&timeline),
                        axis + 1
                    );
                }
                assert!(
                    figures.highest.value > 0.5 * geometry.stroke(),
                    "{}: a{} hardly moves",
                    name(&timeline),
                    axis + 1
                );
            }
        }
    }
}

#[test]
fn every_cue_begins_and_ends_at_rest_in_park_with_effects_off() {
    for timeline in shipped() {
        let mut hint = Hint::default();
        let end = timeline.duration().as_nanos();
        for ms in [0, 100, 200, 300] {
            let from_end = ShowTime::from_nanos(end - ms * 1_000_000);
            for at in [ShowTime::from_millis(ms), from_end] {
                let pose = timeline.sample(at, &mut hint);
                assert!(
                    pose.iter().all(|position| position.abs() < 1e-5),
                    "{} at {at}: {pose:?}",
                    name(&timeline)
                );
                assert_eq!(
                    timeline.effects(at, &mut hint),
                    EffectSet::Named(0),
                    "{} at {at}",
                    name(&timeline)
                );
            }
        }
    }
}

#[test]
fn the_cues_are_of_the_sizes_that_the_readme_says() {
    let sizes: Vec<_> =
        shipped().iter().map(|t| (name(t), t.axes(), t.duration(), t.has_vibration())).collect();
    let seconds = |s: i64| ShowTime::from_millis(1000 * s);
    assert_eq!(
        sizes,
        [
            ("seat-demo.csv".to_owned(), 3, seconds(11), true),
            ("bench-ride.csv".to_owned(), 3, seconds(18), true),
            ("coaster.csv".to_owned(), 6, seconds(50), true),
            ("voyage.csv".to_owned(), 12, seconds(56), false),
            ("storm.mcap".to_owned(), 6, seconds(44), true),
        ]
    );
    let readme = fs::read_to_string(folder().join("README.md")).unwrap();
    assert!(sizes.iter().all(|(name, ..)| readme.contains(name)), "cues/README.md names every cue");
}

#[test]
fn the_example_of_the_readme_is_a_cue_that_passes() {
    let readme = fs::read_to_string(folder().join("README.md")).unwrap();
    let (_, from_example) = readme.split_once("```csv\n").expect("an example");
    let (example, _) = from_example.split_once("```").expect("its end");
    let cue = cue::read(Path::new("README.md"), example.as_bytes(), &Source::Native).unwrap();
    assert_eq!((cue.axes(), cue.rows(), cue.title()), (2, 6, Some("A nod")));
    let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
    fs::write(file.path(), example).unwrap();
    let hall = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hall.toml");
    let mut check = std::process::Command::new(env!("CARGO_BIN_EXE_kinocue"));
    let run = check.arg("check").arg(file.path()).arg("--config").arg(hall).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}
