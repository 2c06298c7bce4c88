//! How the motors of the simulators move: never faster than the seat may, and to park no faster than 50 mm/s.

use std::fmt::Write as _;

use rustix::process::Signal;

use super::process::{Playing, Relay, Row, Sim, play};
use super::{Folder, STROKE, undisturbed};

/// The greatest speed of the bench seat, and of any seat on its way to park, pulses/s: 240 and 50 mm/s.
const LIMIT: f64 = 480_000.0;
const PARK_LIMIT: f64 = 100_000.0;
/// Positions are whole pulses, and the log's times whole microseconds.
const SLACK: f64 = 1.01;

/// Swings about the middle of the stroke for 3 s, at 200 mm/s where it is fastest, and stands still from then on.
fn swing(folder: &Folder) -> std::path::PathBuf {
    let mut text = "time_ms,a1,a2,a3\n".to_owned();
    for at_ms in (0..=3200).step_by(20) {
        let t = f64::from(at_ms.min(3000)) / 1000.0;
        let fade = ((3.0 - t) / 0.5).clamp(0.0, 1.0);
        let fade = fade * fade * (3.0 - 2.0 * fade);
        let swing = fade * 40.0 / 150.0 * (t * 0.8 * std::f64::consts::TAU).cos();
        writeln!(text, "{at_ms},{:.9},{:.9},0.5", 0.5 + swing, 0.5 - swing).expect("a String takes it");
    }
    folder.write("swing.csv", text)
}

/// The fastest that any axis was commanded, and that it moved from frame to frame, pulses/s.
pub(super) fn fastest(rows: &[Row]) -> (f64, f64) {
    let (mut commanded, mut executed) = (0.0_f64, 0.0_f64);
    for pair in rows.windows(2) {
        let [before, now] = pair else { continue };
        let span = now.at_s - before.at_s;
        for (from, to) in before.commanded.iter().zip(&now.commanded) {
            commanded = commanded.max(f64::from((to - from).abs()) * 1000.0 / f64::from(now.time_ms));
        }
        for (from, to) in before.executed.iter().zip(&now.executed) {
            executed = executed.max((f64::from((to - from).abs()) - 2.0) / span);
        }
    }
    (commanded, executed)
}

#[test]
fn no_axis_moves_faster_than_its_seat_may_and_none_parks_faster_than_50_mm_a_second() {
    let folder = Folder::new();
    let cue = swing(&folder);
    // Without fast forward, so that a simulator that was held up does not hurry by itself.
    let start_sim = || Sim::one(&["--pa", "06=0"]);
    let (whole, cut) = undisturbed(|| {
        let (whole, cut) = (start_sim(), start_sim());
        let relay = Relay::start(&cut.addresses[0]);
        let playing = Playing::start(&cue, &whole.to(), &["--json"]);
        let stopped = Playing::start(&cue, &[relay.to()], &["--json"]);
        relay.wait_for(|frame| frame.frame.0 >= 215); // at full swing, and its join is over
        stopped.signal(Signal::INT);
        let reports = [stopped.finish().report_of(0), playing.finish().report_of(0)];
        assert_eq!(
            reports.each_ref().map(|report| report["result"].as_str()),
            [Some("stopped"), Some("completed")]
        );
        ((whole.end(), cut.end()), reports.to_vec())
    });
    for seen in [&whole, &cut] {
        let (commanded, executed) = fastest(&seen.rows);
        assert!((LIMIT / 2.0..LIMIT * SLACK).contains(&commanded), "{commanded}");
        assert!((LIMIT / 2.0..LIMIT * SLACK).contains(&executed), "{executed}");
        assert!(seen.rest_in_park());
        let inside = 0..=super::pulses(1.0);
        assert!(seen.rows.iter().all(|row| row.commanded.iter().all(|pulses| inside.contains(pulses))));
    }
    let (commanded, executed) = fastest(&whole.rows[322..]);
    assert!((PARK_LIMIT * 0.9..PARK_LIMIT * SLACK).contains(&commanded), "{commanded}");
    assert!(executed < PARK_LIMIT * SLACK, "{executed}");
}

#[test]
fn a_start_in_the_middle_joins_the_cue_within_the_seats_limits() {
    let (folder, sim) = (Folder::new(), Sim::one(&["--pa", "06=0"]));
    let report = play(&swing(&folder), &sim.to(), &["--json", "--start", "00:01.2"]).report_of(0);
    let one = &report["controllers"][0];
    assert_eq!((&one["acked"], &one["park_frames"]), (&one["sent"], &0.into()));
    let seen = sim.end();
    let (commanded, executed) = fastest(&seen.rows);
    assert!(commanded < LIMIT * SLACK && executed < LIMIT * SLACK, "{commanded}, {executed}");
    assert_eq!(seen.rows[0].executed, [0, 0, 0]);
    assert!(seen.rows[0].commanded.iter().all(|pulses| f64::from(*pulses) < STROKE * 0.001), "no jump");
    // 2 s of cue from there on, and the way to park.
    assert!((300..420).contains(&seen.motion()), "{}", seen.motion());
    assert!(seen.rest_in_park());
}
