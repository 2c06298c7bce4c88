//! Plays over a good line.

use super::bench::*;
use crate::drive::link::*;

#[test]
fn a_ride_over_three_units_is_executed_within_a_tenth_of_a_millimetre_whatever_their_crystals() {
    for ppm in [[0, 0, 0], [200, -200, 0], [-200, 200, 200]] {
        let mut play = Play::with_ppm(ppm);
        play.begin(ride);
        play.play(60.0, 0);
        let figures = play.figures();
        assert!(play.worst.iter().all(|worst| *worst <= 0.1), "{ppm:?}: {:?} {figures:?}", play.worst);
        assert!(figures.iter().all(|axis| axis.dry == 0), "{figures:?}");
        let dry = [0, 1, 2].map(|axis| play.unit(axis).tally().dry);
        assert_eq!(dry, [0; 3], "{:?}", play.told);
        play.assert_gentle();
    }
}

#[test]
fn frames_are_confirmed_once_all_axes_have_them_before_they_are_executed() {
    let mut play = Play::with_ppm([0; 3]);
    play.begin(ride);
    play.play(10.0, 0);
    let origin = play.origin;
    let mut last = None;
    for (at, event) in &play.told {
        if let StreamEvent::Confirmed { last: frame, .. } = event {
            assert!(last < Some(frame.0), "{last:?} {frame:?}");
            last = Some(frame.0);
            let executed = origin + TICK * frame.0;
            assert!(*at < executed, "{frame:?} {at:?} {executed:?}");
        }
    }
    assert!(last > Some(960), "{last:?}");
    let moves = play.told.iter().filter(|(_, event)| matches!(event, StreamEvent::Moves { .. })).count();
    assert_eq!(moves, 1);
}

#[test]
fn it_ends_at_rest_where_the_poses_ended_and_begins_again_from_there() {
    let mut play = Play::with_ppm([200, 0, -200]);
    play.begin(there);
    play.play(2.5, 0);
    play.judged = false;
    play.wait(1.0);
    play.assert_at([40.0, 50.0, 60.0]);
    assert!(play.stream.is_ready(0));
    play.judged = true;
    play.begin(back);
    play.play(2.5, 0);
    play.wait(1.0);
    play.assert_at([0.0; 3]);
    let rests = play.told.iter().filter(|(_, event)| matches!(event, StreamEvent::Rests { .. })).count();
    let braked = play.told.iter().filter(|(_, event)| matches!(event, StreamEvent::Braked { .. })).count();
    assert!(rests >= 4 && braked == 0, "{rests}: {:?}", play.told);
    assert!(play.worst.iter().all(|worst| *worst < 0.1), "{:?}", play.worst);
    assert_eq!([0, 1, 2].map(|axis| play.unit(axis).tally().dry), [0; 3]);
    play.assert_gentle();
}

#[test]
fn poses_that_end_in_motion_brake_it_within_the_limits() {
    let mut play = Play::with_ppm([0; 3]);
    play.begin(ride);
    play.play(8.0, 0);
    play.judged = false;
    play.wait(1.0);
    let braked =
        |event: &StreamEvent| matches!(event, StreamEvent::Braked { why: BrakeReason::PosesEnded, .. });
    assert!(play.told.iter().any(|(_, event)| braked(event)), "{:?}", play.told);
    assert!(play.stream.is_ready(0));
    play.assert_gentle();
}

#[test]
fn missed_ticks_cost_lead_that_is_regained() {
    let mut play = Play::with_ppm([0; 3]);
    play.begin(ride);
    play.play(8.0, 0);
    play.play(12.0, 2);
    let dry = [0, 1, 2].map(|axis| play.unit(axis).tally().dry);
    assert_eq!(dry, [0; 3]);
    // Two ticks later than at the beginning, as the poses are; and there to a tenth of a millimetre.
    play.worst = [0.0; 3];
    play.origin = play.origin + 2 * TICK;
    play.play(5.0, 0);
    assert!(play.worst.iter().all(|worst| *worst < 0.1), "{:?}", play.worst);
    play.assert_gentle();
}

#[test]
fn a_first_pose_elsewhere_moves_nothing() {
    let mut play = Play::with_ppm([0; 3]);
    play.judged = false;
    play.begin(|_, _| 70.0);
    play.play(1.0, 0);
    play.assert_at([0.0; 3]);
    let off: Vec<_> =
        play.told.iter().filter(|(_, event)| matches!(event, StreamEvent::Elsewhere { .. })).collect();
    assert_eq!(off.len(), 1, "{off:?}");
    assert!(play.stream.figures().poses_skipped > 90);
}

#[test]
fn a_pose_that_passes_where_a_seat_stands_is_not_the_first_of_a_motion() {
    let mut play = Play::with_ppm([0; 3]);
    play.begin(|at, _| there(at, 0));
    play.play(2.5, 0);
    play.judged = false;
    play.wait(1.0);
    assert!(play.stream.is_ready(0));
    // A tenth of them is where it stands, at 40 mm/s.
    play.begin(|at, _| 36.0 + 40.0 * at);
    play.play(1.0, 0);
    play.assert_at([40.0; 3]);
    assert!(play.has("Elsewhere"), "{:?}", play.rare());
}

#[test]
fn one_place_of_each_queue_stays_free_while_all_goes_well() {
    let mut play = Play::with_ppm([0; 3]);
    play.begin(ride);
    play.play(1.0, 0);
    let mut most = [0; 3];
    for _ in 0..700 {
        play.play(0.01, 0);
        most = [0, 1, 2].map(|axis| play.unit(axis).queued().max(most[axis]));
    }
    assert_eq!(most, [3; 3], "of four");
    let full = [0, 1, 2].map(|axis| (play.unit(axis).tally().full, play.figures()[axis].account.again));
    assert_eq!(full, [(0, 0); 3]);
}

/// Three axes at 57,600 baud; `KINOCUE_SHOWS` is how many shows, 60 for an hour.
#[test]
fn no_queue_runs_dry_in_shows_whose_thread_is_held_up_as_a_real_time_thread_is() {
    let mut play = Play::with_ppm([100, 0, -100]);
    play.shows(soaks(), |at, axis| ride_for_a_minute(60.0, at, axis));
    let dry = [0, 1, 2].map(|axis| (play.unit(axis).tally().dry, play.figures()[axis].dry));
    assert_eq!(dry, [(0, 0); 3]);
    play.assert_gentle();
}
