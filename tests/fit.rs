//! `fit` as a person runs it: what it writes passes `check`, and it says what it did.

use std::path::Path;

use assert_cmd::Command;
use proptest::prelude::*;
use serde_json::Value;

struct Run {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

fn kinocue(args: &[&str]) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).args(args).output().expect("kinocue runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Run { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// A file of this folder, as arguments have it.
fn path(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

fn write(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> String {
    std::fs::write(folder.join(name), text).expect("the folder is ours");
    path(folder, name)
}

/// A ride of two axes over 4 s, the first swinging by `swing` of its stroke at 1 Hz, the second by a quarter of that.
fn ride(swing: f64) -> String {
    let mut text = "time_ms,a1,a2,fx_air\n".to_owned();
    for row in 0..=200 {
        let t = f64::from(row) * 0.02;
        let sine = (t * std::f64::consts::TAU).sin();
        text +=
            &format!("{},{:.6},{:.6},{}\n", row * 20, 0.5 + swing * sine, 0.5 + swing / 4.0 * sine, row % 2);
    }
    text
}

fn fit(args: &[&str]) -> Value {
    let run = kinocue(&[&["fit"], args, &["--json"]].concat());
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{args:?}");
    serde_json::from_str(&run.stdout).expect("one JSON object")
}

fn assert_passes(args: &[&str]) {
    let run = kinocue(&[&["check"], args].concat());
    assert_eq!(run.code, Some(0), "{}", run.stderr);
}

#[test]
fn amplitude_is_lowered_just_as_far_as_needed_and_the_outcome_passes_check() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "ride.csv", ride(0.35)); // 330 mm/s
    assert_eq!(kinocue(&["check", &cue]).code, Some(1));
    for name in ["out.csv", "out.mcap"] {
        let out = path(folder.path(), name);
        let report = fit(&[&cue, "-o", &out]);
        let factor = report["factors"][0].as_f64().unwrap();
        assert!((factor / (240.0 / 329.9) - 1.0).abs() < 0.01, "{report}");
        assert_eq!(report["factors"][0], report["factors"][1], "all axes alike");
        assert!(report["after"][0]["velocity"]["margin"].as_f64().unwrap().abs() < 0.005, "{report}");
        assert!(report["change_mm"].as_f64().unwrap() > 10.0 && report["cut_off_hz"].is_null());
        assert_passes(&[&out]);
    }
    let out = path(folder.path(), "axes.csv");
    let report = fit(&[&cue, "-o", &out, "--per-axis"]);
    assert_eq!(report["factors"][1], 1.0, "{report}");
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(
        text.contains("fx_air") && text.lines().last().unwrap().starts_with("4000,"),
        "no time was changed"
    );
    assert_passes(&[&out]);
    assert_eq!(kinocue(&["check", &out, "--rate", "60"]).code, Some(0));
}

#[test]
fn a_cue_of_four_strokes_keeps_a_quarter_of_its_amplitude() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "# kinocue-csv: 1\n# units: mm\ntime_ms,a1\n".to_owned();
    for row in 0..=600_u32 {
        let up = 300.0 * (1.0 - (std::f64::consts::TAU * f64::from(row) / 600.0).cos());
        text += &format!("{},{up:.3}\n", 100 * row);
    }
    let cue = write(folder.path(), "far.csv", text);
    let out = path(folder.path(), "out.csv");
    let report = fit(&[&cue, "-o", &out]);
    let factor = report["factors"][0].as_f64().unwrap();
    assert!((factor - 0.25).abs() < 0.001, "{report}");
    assert_passes(&[&out]);
}

#[test]
fn a_cue_that_is_fitted_for_a_film_has_room_for_the_paces_that_one_may_ask_for_and_check_knows() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "ride.csv", ride(0.35));
    let own = path(folder.path(), "own.csv");
    fit(&[&cue, "-o", &own]);
    let refused = kinocue(&["check", &own, "--chase"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("kinocue fit CUE -o OUT --chase"));
    let film = path(folder.path(), "film.csv");
    fit(&[&own, "-o", &film, "--chase"]);
    assert_passes(&[&film, "--chase"]);

    let simulated = include_str!("../systemd/simulated.toml");
    let hall = write(folder.path(), "hall.toml", simulated);
    let synced = write(
        folder.path(),
        "synced.toml",
        format!(
            "{simulated}\n[sync]\nsources = [\"mpv\"]\nstart = \"00:00:00:00\"\n[sync.mpv]\nsocket = \"/s\"\n"
        ),
    );
    assert_passes(&[&own, "--config", &hall]);
    assert_eq!(kinocue(&["check", &own, "--config", &synced]).code, Some(1), "its shows follow a film");
    let there = path(folder.path(), "there.csv");
    fit(&[&own, "-o", &there, "--config", &synced]);
    assert_passes(&[&there, "--config", &synced]);
}

#[test]
fn a_cue_that_keeps_its_limits_is_written_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let out = path(folder.path(), "same.csv");
    let report = fit(&["cues/coaster.csv", "-o", &out, "--smooth"]);
    assert_eq!((&report["change_mm"], &report["cut_off_hz"]), (&0.0.into(), &Value::Null));
    let run = kinocue(&["fit", "cues/coaster.csv", "-o", &out, "--force"]);
    assert!(run.stderr.contains("already keeps all limits"), "{}", run.stderr);
}

#[test]
fn coarse_bytes_are_smoothed_without_a_shift_in_time() {
    let folder = tempfile::tempdir().unwrap();
    // A slow swing to 40 mm and back at 20 bytes a second: steps of more than half a millimetre.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 68")]
    let byte = |row: u32| (34.0 * (1.0 - (f64::from(row) * 0.031_415_926).cos())).round() as u8;
    let bytes: Vec<u8> = (0..=200).map(byte).collect();
    let raw = write(folder.path(), "ride.bin", bytes);
    let cue = path(folder.path(), "ride.csv");
    assert_eq!(
        kinocue(&["convert", &raw, &cue, "--from", "u8", "--axes", "1", "--rate", "20"]).code,
        Some(0)
    );
    let stepped =
        std::fs::read_to_string(&cue).unwrap().replace("interpolation: monotone", "interpolation: hold");
    let cue = write(folder.path(), "steps.csv", stepped);
    let out = path(folder.path(), "smooth.csv");
    assert_eq!(kinocue(&["check", &cue]).code, Some(1));
    let run = kinocue(&["fit", &cue, "-o", &out]);
    let left = run.code != Some(0)
        || run.stderr.contains("amplitude x 0.0")
        || run.stderr.contains("amplitude x 0.2");
    assert!(left, "no amplitude cures steps: {}", run.stderr);
    let report = fit(&[&cue, "-o", &out, "--smooth", "--force"]);
    assert!(report["cut_off_hz"].as_f64().unwrap() > 0.5, "{report}");
    assert!(report["factors"][0].as_f64().unwrap() > 0.9, "{report}");
    assert!(report["change_mm"].as_f64().unwrap() < 3.0, "{report}");
    assert!(report["change_at_s"].as_f64().is_some());
    assert_passes(&[&out]);
    assert_passes(&[&out, "--rate", "1000"]);
}

#[test]
fn the_corners_of_an_editors_rows_are_rounded() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "line,time_ms,x,y\n1,1000,0,0\n2,1000,60,40\n3,1000,0,0\n";
    let cue = write(folder.path(), "rows.csv", rows);
    let out = path(folder.path(), "out.csv");
    let from = ["--from", "rows", "--units", "mm"];
    assert_eq!(kinocue(&[&["check", &cue][..], &from].concat()).code, Some(1));
    let report = fit(&[&[cue.as_str(), "-o", &out, "--smooth"][..], &from].concat());
    assert!(report["change_mm"].as_f64().unwrap() < 5.0, "{report}");
    assert_passes(&[&out]);
}

#[test]
fn a_cue_that_runs_into_the_end_of_the_stroke_is_brought_to_rest_before_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "# units: mm\ntime_ms,a1\n".to_owned();
    // Gathers speed to 100 mm/s within half a second, and is at 0.1 mm in the end: no amplitude about 0 helps there.
    for row in 0..=100 {
        let t = f64::from(row) * 0.01;
        let way = if t < 0.5 { 100.0 * t * t } else { 25.0 + 100.0 * (t - 0.5) };
        text += &format!("{},{:.6}\n", row * 10, 75.1 - way);
    }
    let cue = write(folder.path(), "runs.csv", text);
    let run = kinocue(&["check", &cue]);
    assert!(run.code == Some(1) && run.stderr.contains("runs.csv:103:"), "{}", run.stderr);
    assert!(
        run.stderr.contains("a1: the cue ends at 00:01.000 in motion, -100.0 mm/s at 0.100 mm"),
        "{}",
        run.stderr
    );
    let out = path(folder.path(), "out.csv");
    let report = fit(&[&cue, "-o", &out]);
    assert!(report["eased_s"].as_f64().unwrap() <= 0.2, "{report}");
    assert!(report["factors"][0] == 1.0 && report["change_mm"].as_f64().unwrap() < 10.0, "{report}");
    assert_passes(&[&out]);
    assert_passes(&[&out, "--rate", "1000"]);
}

#[test]
fn vibration_beyond_what_a_seat_stands_is_lowered_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let text = "# units: mm\ntime_s,a1,v1_hz,v1_amp\n0,75,20,30\n1,75,40,0.1\n2,75,0,0\n";
    let cue = write(folder.path(), "shake.csv", text);
    let run = kinocue(&["check", &cue]);
    assert!(
        run.code == Some(1) && run.stderr.contains("v1_amp: vibration of 30.000 mm at 20.0 Hz"),
        "{}",
        run.stderr
    );
    let out = path(folder.path(), "out.csv");
    assert_eq!(fit(&[&cue, "-o", &out])["vibration_lowered"], 1, "the other is within them");
    let text = std::fs::read_to_string(&out).unwrap();
    // 1 g at 20 Hz is 0.621 mm.
    assert!(text.contains("0,75,20,0.62") && text.contains("75,40,0.1\n"), "{text}");
    assert_passes(&[&out]);
}

#[test]
fn vibration_past_the_stroke_is_lowered() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(
        folder.path(),
        "shake.csv",
        "time_s,a1,v1_hz,v1_amp\n0,0.01,2,0.02\n1,0.01,2,0.02\n2,0.01,0,0\n",
    );
    let out = path(folder.path(), "out.csv");
    let report = fit(&[&cue, "-o", &out]);
    assert_eq!((&report["vibration_lowered"], &report["factors"][0]), (&1.into(), &1.0.into()));
    assert!(std::fs::read_to_string(&out).unwrap().contains("0,0.01,2,0.01\n"));
    assert_passes(&[&out]);
}

#[test]
fn what_is_no_motion_is_not_made_to_fit() {
    let folder = tempfile::tempdir().unwrap();
    let hall = std::fs::read_to_string("tests/data/config/hall.toml").unwrap();
    let hall = write(folder.path(), "hall.toml", hall + "\n[effect_limits]\nair = { min_on_ms = 50 }\n");
    let cue = write(folder.path(), "ride.csv", ride(0.1));
    let out = path(folder.path(), "out.csv");
    let run = kinocue(&["fit", &cue, "-o", &out, "--config", &hall]);
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert!(run.stderr.contains("fx_air: on at") && run.stderr.contains("min_on_ms"), "{}", run.stderr);
    assert!(!Path::new(&out).exists());
}

#[test]
fn no_file_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "ride.csv", ride(0.35));
    let other = write(folder.path(), "other.csv", "mine");
    for args in [
        &["fit", &cue, "-o", &cue, "--force"][..],
        &["fit", &cue, "-o", &other],
        &["fit", &cue, "-o", "out.txt"],
        &["fit", &cue],
    ] {
        let run = kinocue(args);
        assert_eq!(run.code, Some(64), "{args:?}: {}", run.stderr);
    }
    assert_eq!(std::fs::read_to_string(&other).unwrap(), "mine");
    assert_eq!(std::fs::read_to_string(&cue).unwrap(), ride(0.35));
    assert_eq!(kinocue(&["fit", "nowhere.csv", "-o", &path(folder.path(), "x.csv")]).code, Some(66));
    let help = kinocue(&["fit", "--help"]).stdout;
    assert!(help.contains("Examples:") && help.contains("--smooth"), "{help}");
}

/// A hall of one controller whose effects are air alone.
fn hall(dialect: &str, axes: usize, vibration: &str) -> String {
    format!(
        "[show]\nbind = \"127.0.0.1:8410\"\n[effects]\nair = 1\n[seat.s]\naxes = {axes}\nstroke_mm = 150.0\nlead_mm = 5.0\n\
         pulses_per_rev = 10000\nmax_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n\
         vibration = \"{vibration}\"\n[[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"127.0.0.1:7408\"\n\
         dialect = \"{dialect}\"\n"
    )
}

/// A ride of so many axes, the first of which vibrates.
fn shaken(axes: usize, swing: f64, amplitude: f64, effect: &str) -> String {
    let names: Vec<_> = (1..=axes).map(|axis| format!("a{axis}")).collect();
    let mut text = format!("time_ms,{},v1_hz,v1_amp,fx_{effect}\n", names.join(","));
    for row in 0..=100 {
        let place = 0.5 + swing * (f64::from(row) * 0.04 * std::f64::consts::PI).sin();
        let places = vec![format!("{place:.6}"); axes].join(",");
        text += &format!("{},{places},20,{amplitude},0\n", row * 20);
    }
    text
}

#[test]
fn a_cue_with_vibration_is_fit_for_an_imax_only_where_its_seat_type_leaves_vibration_out() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "ride.csv", shaken(3, 0.1, 0.01, "air"));
    let out = path(folder.path(), "out.csv");
    let with = write(folder.path(), "with.toml", hall("mbox", 3, "100%"));
    let run = kinocue(&["fit", &cue, "-o", &out, "--config", &with]);
    assert_eq!(run.code, Some(65), "{}", run.stderr);
    assert!(run.stderr.contains("write vibration = \"0%\" in [seat.s]"), "{}", run.stderr);
    assert!(!Path::new(&out).exists());
    let without = write(folder.path(), "without.toml", hall("mbox", 3, "0%"));
    fit(&[&cue, "-o", &out, "--config", &without]);
    let run = kinocue(&["check", &out, "--config", &without]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(run.stdout.contains("vibration is left out on seat s"), "{}", run.stdout);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_file_is_called_fit_that_check_refuses_for_the_same_hall(
        dialect in prop::sample::select(&["smc", "mbox"][..]),
        vibration in prop::sample::select(&["100%", "40%", "0%"][..]),
        (seat_axes, cue_axes) in (1_usize..8, 1_usize..8),
        swing in 0.0..0.49_f64,
        amplitude in prop::sample::select(&[0.0, 0.01, 0.2, 0.6][..]),
        effect in prop::sample::select(&["air", "air", "air", "rain"][..]),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let cue = write(folder.path(), "ride.csv", shaken(cue_axes, swing, amplitude, effect));
        let hall = write(folder.path(), "hall.toml", hall(dialect, seat_axes, vibration));
        let out = path(folder.path(), "out.csv");
        let run = kinocue(&["fit", &cue, "-o", &out, "--config", &hall]);
        prop_assert_eq!(run.code == Some(0), Path::new(&out).exists());
        if run.code == Some(0) {
            let checked = kinocue(&["check", &out, "--config", &hall]);
            prop_assert_eq!(checked.code, Some(0), "{}", checked.stderr);
        }
    }
}
