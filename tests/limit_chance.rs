//! Cues that use all of their limits, by chance: they pass `check`, end in motion or at rest, near the ends of the stroke or
//! not, and are stopped anywhere, led to their end, held up by stalls or trimmed. What is sent keeps the limits, in virtual time.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use kinocue::cue::{self, Source};
use kinocue::harness::engine::Ending;
use kinocue::harness::motion::SeatType;
use kinocue::harness::proof::{Digest, Proof, Terms, prove};
use kinocue::harness::time::Rate;
use kinocue::harness::timeline::Timeline;
use kinocue::harness::{Event, Played, Virtual, Worst};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Two waves that swing up to an end of the stroke, cut off anywhere.
#[derive(Debug, Clone)]
struct Ride {
    seconds: f64,
    /// Frequency, Hz, phase in turns, and weight.
    waves: [(f64, f64, f64); 2],
    /// Where in what the stroke leaves the swing lies: 0 at the lower end, 1 at the upper one.
    place: f64,
    /// How far from the stroke's end it turns, fraction of the stroke.
    clear: f64,
    row_ms: u32,
}

impl Ride {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some hundreds")]
    fn rows(&self) -> Vec<(u32, f64)> {
        let rows = (self.seconds * 1000.0 / f64::from(self.row_ms)) as u32;
        let wave = |t: f64| -> f64 {
            let at =
                |(hz, phase, part): &(f64, f64, f64)| part * ((t * hz + phase) * std::f64::consts::TAU).sin();
            self.waves.iter().map(at).sum()
        };
        (0..=rows.max(8)).map(|row| (row * self.row_ms, wave(f64::from(row * self.row_ms) * 1e-3))).collect()
    }

    /// The cue with so much of its amplitude.
    fn cue(&self, amplitude: f64) -> String {
        let rows = self.rows();
        let (low, high) =
            rows.iter().fold((f64::MAX, f64::MIN), |(low, high), row| (low.min(row.1), high.max(row.1)));
        let free = 1.0 - amplitude * (high - low) - 2.0 * self.clear;
        let mut text = "time_ms,a1\n".to_owned();
        for (ms, value) in rows {
            let at = self.clear + free * self.place + amplitude * (value - low);
            writeln!(text, "{ms},{at:.9}").expect("a String takes what is written to it");
        }
        text
    }

    /// The cue with as much amplitude as the proof lets it keep at that rate; none where a curve out of rest dips too far.
    fn at_the_limit(&self, rate: f64) -> Option<String> {
        let (mut keeps, mut breaks) = (0.0, 0.9);
        for _ in 0..14 {
            let middle = f64::midpoint(keeps, breaks);
            if self.passes(middle, rate) { keeps = middle } else { breaks = middle }
        }
        (keeps > 0.01).then(|| self.cue(keeps))
    }

    fn passes(&self, amplitude: f64, rate: f64) -> bool {
        let rows = self.rows();
        let (low, high) =
            rows.iter().fold((f64::MAX, f64::MIN), |(low, high), row| (low.min(row.1), high.max(row.1)));
        amplitude * (high - low) + 2.0 * self.clear <= 1.0 && {
            let timeline = timeline(&self.cue(amplitude));
            timeline.fits_stroke(0..1, Some(&SeatType::bench3(1))).faults.is_none()
                && proof(&timeline, rate).passed()
        }
    }
}

fn timeline(text: &str) -> Timeline {
    Timeline::new(
        cue::read(Path::new("show.csv"), text.as_bytes(), &Source::Native).expect("the cue is sound"),
    )
}

fn proof(timeline: &Timeline, rate: f64) -> Proof {
    let seat = Arc::new(SeatType::bench3(1));
    prove(timeline, Terms::of_seat(seat, 1, Digest::of(timeline.cue()), Rate::from_hz(rate), 1.0))
}

fn ride() -> impl Strategy<Value = Ride> {
    let wave = (0.2..3.0_f64, 0.0..1.0_f64, 0.1..1.0_f64);
    let place = prop_oneof![Just(0.0), Just(1.0), 0.0..1.0_f64];
    let clear = prop_oneof![Just(0.0), Just(0.001), 0.0..0.05_f64];
    let row_ms = prop_oneof![Just(10_u32), Just(20), Just(25)];
    (2.5..5.0_f64, [wave.clone(), wave], place, clear, row_ms)
        .prop_map(|(seconds, waves, place, clear, row_ms)| Ride { seconds, waves, place, clear, row_ms })
}

fn rate() -> impl Strategy<Value = f64> {
    prop_oneof![Just(50.0), Just(60.0), Just(100.0), Just(200.0), Just(1000.0)]
}

fn is_within(worst: Worst) -> bool {
    let Worst { velocity, acceleration, jerk, step } = worst;
    velocity <= 1.01 && acceleration <= 1.01 && jerk <= 1.01 && step <= 1.01
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousands")]
fn wake_up(seconds: f64, rate: f64) -> u64 {
    (seconds * rate) as u64
}

/// What all frames make the seat do, from rest in park.
fn worst(played: &Played) -> Worst {
    played.worst_from_rest_at(0.0, 0, played.frames.len())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, rng_seed: RngSeed::Fixed(12), ..ProptestConfig::default() })]

    #[test]
    fn a_cue_that_uses_all_of_its_limits_is_played_to_its_end_in_whatever_motion_it_ends(
        ride in ride(), rate in rate(), plays in 1..3_u32,
    ) {
        let Some(cue) = ride.at_the_limit(rate) else { return Ok(()) };
        let mut show = Virtual::new(cue).at_rate(rate);
        show.plays = plays;
        let played = show.play();
        prop_assert!(is_within(worst(&played)), "{:?} {:?}", worst(&played), played.clamps[0]);
        prop_assert_eq!(played.clamps[0].beyond, 0);
        prop_assert_eq!(played.clamps[0].worst, None, "the limiter has nothing to do");
        prop_assert!(played.ended.ending == Ending::Completed);
    }

    #[test]
    fn a_stop_anywhere_in_it_keeps_the_limits_and_stays_inside_the_stroke(
        ride in ride(), rate in rate(), share in 0.0..1.0_f64,
    ) {
        let Some(cue) = ride.at_the_limit(rate) else { return Ok(()) };
        // After the join onto it, which takes a second and a half.
        let stop = 1.5 + share * (ride.seconds - 1.5);
        let show = Virtual::new(cue).at_rate(rate).with(wake_up(stop, rate), Event::Stop);
        let played = show.with(wake_up(stop + 2.0, rate), Event::Leave).play();
        prop_assert!(is_within(worst(&played)), "{:?} {:?}", worst(&played), played.clamps[0]);
        prop_assert_eq!(played.clamps[0].beyond, 0, "{:?}", played.clamps[0]);
        let mm = played.positions_mm(0, 0);
        prop_assert!(mm.iter().all(|mm| (0.0..=150.0).contains(mm)));
    }

    #[test]
    fn stalls_and_a_trim_in_it_are_taken_back_only_as_far_as_it_leaves_room(
        ride in ride(), rate in rate(), share in 0.0..1.0_f64, stall_ms in 10..45_u64, trim in -500..500_i32,
    ) {
        let Some(cue) = ride.at_the_limit(rate) else { return Ok(()) };
        let show = Virtual::new(cue).at_rate(rate)
            .with(wake_up(1.5 + share, rate), Event::Late(Duration::from_millis(stall_ms)))
            .with(wake_up(1.6 + share, rate), Event::Trim(trim));
        let played = show.play();
        prop_assert!(is_within(worst(&played)), "{:?} {:?}", worst(&played), played.clamps[0]);
        prop_assert_eq!(played.clamps[0].worst, None, "the limiter has nothing to do");
        prop_assert!(played.ended.ending == Ending::Completed);
    }
}
