//! The last limiter, asked for anything: what it sends keeps the limits, and what keeps the limits it sends unchanged. Judged from
//! the definition of the measure, not by the limiter's own sums; `benches/limiter.rs` does the same for a million sequences.

use kinocue::harness::asked::{self, Sound, Trial, Wild, sound, wild, window};
use kinocue::harness::limiter::{Admitted, Limit, Limiter, Provenance};
use kinocue::harness::motion::{AxisGeometry, Limits, MAX_AXES, Measure, Pose, Spacing, Window};
use kinocue::harness::time::{Rate, ShowTime};

#[test]
fn whatever_is_asked_for_what_is_sent_keeps_the_limits() {
    // The last one has runs of equal Times after an odd one.
    for seed in (2_000_000..2_000_080).chain([80_233]) {
        let mut wild = Wild::new(seed);
        let trial = Trial::of_wild(&mut wild);
        assert!(!trial.is_broken(), "sequence {seed}, {}: {}", wild::SORTS[wild.sort], trial.share);
        assert!(trial.unchanged || trial.counts.clamps > 0, "sequence {seed}: a clamp is counted");
        assert_eq!(trial.counts.beyond, 0, "sequence {seed}");
    }
}

#[test]
fn what_keeps_nine_tenths_of_the_limits_passes_bit_for_bit() {
    let gentle = (1..).map(|seed| (seed, Sound::new(seed))).filter(|(_, sound)| sound.share <= 0.9);
    for (seed, sound) in gentle.take(30) {
        let trial = Trial::of_sound(&sound);
        assert!(trial.unchanged, "motion {seed}, {}: {:?}", sound::SORTS[sound.sort], trial.counts);
    }
}

#[test]
fn a_move_over_the_whole_stroke_at_the_very_limits_passes_from_200_hz_on() {
    let full = (1..).map(|seed| (seed, Sound::new(seed))).filter(|(_, sound)| {
        sound.sort == sound::SORTS.len() - 2 && sound.share > 0.99 && sound.rate.hz() >= 200.0
    });
    for (seed, sound) in full.take(4) {
        let trial = Trial::of_sound(&sound);
        assert!(trial.unchanged, "motion {seed}, {} Hz: {:?}", sound.rate.hz(), trial.counts);
    }
}

#[test]
fn what_was_proved_and_is_faded_back_onto_after_something_else_keeps_the_limits() {
    let mut returned = 0;
    for seed in 0..120 {
        let sound = Sound::new(seed);
        let trial = Trial::of_returns(&sound, seed);
        assert!(!trial.is_broken(), "motion {seed}, {}: {}", sound::SORTS[sound.sort], trial.share);
        assert_eq!(trial.counts.beyond, 0, "motion {seed}, {}", sound::SORTS[sound.sort]);
        returned += u32::from(trial.counts.clamps > 0);
    }
    assert!(returned > 40, "{returned} were left");
}

fn at(position: f64) -> Pose {
    let mut pose = [0.0; MAX_AXES];
    pose[0] = position;
    pose
}

fn bench() -> Window {
    window(Limits::of(&AxisGeometry::BENCH))
}

/// A limiter at 100 Hz that stands in the middle of the stroke.
fn standing() -> Limiter {
    asked::standing(&bench(), Rate::from_hz(100.0), at(0.5))
}

/// What it sends from frame `from` on when it is asked for these.
fn sent(limiter: &mut Limiter, from: u64, asked: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let send = |(index, asked): (u64, f64)| {
        let mut pose = at(asked);
        limiter.admit(&mut pose, index, Provenance::Anyhow);
        pose[0]
    };
    (from..).zip(asked).map(send).collect()
}

#[test]
fn after_a_step_it_comes_back_softly_and_then_lets_pass_again() {
    let mut limiter = standing();
    let way = sent(&mut limiter, 0, [0.7; 600]);
    assert_eq!(way[0], 0.5, "it stands");
    assert!(way.windows(2).all(|pair| pair[0] <= pair[1]), "it never turns back");
    assert_eq!(way[599], 0.7);
    assert_eq!(limiter.counts().clamps, 1);
    assert_eq!(limiter.admit(&mut at(0.7), 600, Provenance::Anyhow), Admitted::Passed);
    let worst = limiter.counts().worst.expect("there was one");
    assert_eq!((worst.axis, worst.asked, worst.allowed, worst.limit), (0, 0.7, 0.5, Limit::Jerk));
}

#[test]
fn what_is_no_number_stays_at_rest_for_as_long_as_it_lasts() {
    let mut limiter = standing();
    let way = sent(&mut limiter, 0, (0..200).map(|k| [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][k % 3]));
    assert!(way.iter().all(|&position| position == 0.5));
    let counts = limiter.counts();
    assert_eq!((counts.clamps, counts.worst.map(|worst| worst.limit)), (1, Some(Limit::Position)));
    assert!(counts.fault, "it lasted for more than a second");
}

#[test]
fn three_clamps_within_a_second_are_a_fault() {
    let mut limiter = standing();
    let mut verdicts = Vec::new();
    for index in 0..100 {
        let mut pose = at(if (index / 30) % 2 == 0 { 0.5 } else { 0.6 });
        verdicts.push(limiter.admit(&mut pose, index, Provenance::Anyhow));
    }
    let first = verdicts.iter().position(|verdict| *verdict == Admitted::Fault);
    assert_eq!(first, Some(90), "the third step");
    assert_eq!(limiter.counts().clamps, 3);
}

#[test]
fn after_a_rest_what_was_before_is_forgotten() {
    let mut limiter = standing();
    sent(&mut limiter, 0, (1..=60).map(|k| 0.5 + 1e-5 * f64::from(k * k)));
    let stands = limiter.sent()[0];
    limiter.rest();
    assert_eq!(sent(&mut limiter, 60, [stands; 100]), [stands; 100], "it stands where it was");
    limiter.restart(&asked::read(&bench(), at(0.25)));
    assert_eq!(sent(&mut limiter, 160, [0.25; 100]), [0.25; 100]);
}

#[test]
fn what_is_said_to_be_proved_and_runs_out_of_its_stroke_is_brought_to_rest_inside_within_the_limits() {
    // 140 mm/s within half a second out of rest, up to the end of the stroke, and there it is over.
    let speed = |t: f64| {
        let u = (t / 0.5).clamp(0.0, 1.0);
        140.0 / 150.0 * u * u * u * (10.0 + u * (6.0 * u - 15.0))
    };
    let mut limiter = standing();
    let mut measure = Measure::new(Spacing::at_rate(100.0));
    let mut asked = 0.5_f64;
    let limits = Limits::of(&AxisGeometry::BENCH);
    for index in 0..300_u32 {
        let t = f64::from(index) * 0.01;
        asked = (asked + 0.01 * speed(t)).min(1.0);
        let mut pose = at(asked);
        limiter.admit(&mut pose, u64::from(index), Provenance::Proved);
        let seen = measure.push(ShowTime::from_millis(i64::from(index) * 10), pose[0]);
        assert!(seen.acceleration.value.abs() <= 1.01 * limits.acceleration, "frame {index}: {seen:?}");
        assert!(seen.jerk.value.abs() <= 1.01 * limits.jerk, "frame {index}: {seen:?}");
    }
    assert!(limiter.counts().beyond == 0 && limiter.counts().clamps > 0, "{:?}", limiter.counts());
}
