//! Brings a cue that ends in motion to rest at its end: in its last stretch it is run through ever more slowly, so that half of
//! that stretch is not reached any more. The length of the cue stays what it is.

use crate::cue::{Cue, Interpolation};
use crate::time::ShowTime;
use crate::timeline::{Hint, Timeline};

/// How long the last stretch may be, seconds: the shortest that does is taken.
const LENGTHS: [f64; 10] = [0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0];
/// Rows of that stretch are at most this far apart, nanoseconds.
const FINE: i64 = 5_000_000;

/// The cue with each of these endings, and the seconds that it takes; `None` if it jumps from row to row.
pub(super) fn eased(timeline: &Timeline) -> impl Iterator<Item = (f64, Cue)> {
    // Steps run through more slowly are as high as before.
    let jumps = timeline.cue().interpolation() == Interpolation::Hold;
    let half = timeline.duration().as_secs_f64() / 2.0;
    let lengths = LENGTHS.into_iter().filter(move |length| !jumps && *length <= half);
    lengths.map(|length| (length, ease(timeline, length)))
}

fn ease(timeline: &Timeline, seconds: f64) -> Cue {
    let cue = timeline.cue();
    let end = timeline.duration().as_nanos();
    let begin = end - ShowTime::from_secs_f64(seconds).as_nanos();
    let mut times: Vec<i64> = cue.times().iter().map(|time| time.as_nanos()).collect();
    times.extend((begin..end).step_by(usize::try_from(FINE).expect("it is above 0")));
    times.sort_unstable();
    times.dedup();
    let mut hint = Hint::default();
    let mut positions = Vec::with_capacity(times.len() * cue.axes());
    for &at in &times {
        let passed = ShowTime::from_nanos((at - begin).max(0)).as_secs_f64() / seconds;
        let slow = ShowTime::from_secs_f64(seconds * run_out(passed)).as_nanos();
        let at = if at <= begin { at } else { begin + slow };
        positions.extend_from_slice(&timeline.sample(ShowTime::from_nanos(at), &mut hint)[..cue.axes()]);
    }
    let times = times.into_iter().map(ShowTime::from_nanos).collect();
    cue.clone().with_rows(times, positions, cue.interpolation())
}

/// How far a pace gets that sinks from 1 to 0 while `u` goes from 0 to 1, as 1 - u^3 (10 - 15 u + 6 u^2) does: neither it nor
/// its change ever jumps.
fn run_out(u: f64) -> f64 {
    u - u * u * u * u * (2.5 - u * (3.0 - u))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_that_runs_out_comes_half_as_far() {
        assert_eq!((run_out(0.0), run_out(1.0)), (0.0, 0.5));
        let pace = |u: f64| (run_out(u + 1e-6) - run_out(u - 1e-6)) / 2e-6;
        assert!((pace(0.0) - 1.0).abs() < 1e-6 && pace(1.0).abs() < 1e-6 && (pace(0.5) - 0.5).abs() < 1e-6);
    }
}
