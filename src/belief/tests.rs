use super::*;
use crate::motion::{SeatType, Slot};

const PERIOD: Duration = Duration::from_millis(10);

fn ms(ms: u64) -> MonoTime {
    MonoTime::from_nanos(1_000_000_000 + ms * 1_000_000)
}

fn at(place: f64) -> Pose {
    let mut pose = [0.0; MAX_AXES];
    pose[0] = place;
    pose
}

/// One axis of a bench seat, 240 mm/s over 150 mm, at 100 Hz.
fn window() -> Window {
    Window::new(vec![Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0)])
}

/// What the ack thread sees of a lane, and what the tick thread makes of it.
struct Bench {
    belief: Belief,
    evidence: Evidence,
    next: u32,
}

impl Bench {
    fn new() -> Self {
        Self { belief: Belief::new(&window(), PERIOD, true), evidence: Evidence::default(), next: 1 }
    }

    /// One that was read at rest there at 0 ms.
    fn found(place: f64) -> Self {
        let mut bench = Self::new();
        bench.read(place, 0, true);
        bench
    }

    fn read(&mut self, place: f64, when: u64, rests: bool) {
        let reading = Reading { rests, slots: 1, ..Reading::at_rest(at(place), ms(when)) };
        self.evidence.on_reading(&reading);
        self.look(when);
    }

    /// A look of a tick up to which the ack thread has told all.
    fn look(&mut self, when: u64) -> bool {
        self.belief.look(&self.evidence, ms(when), ms(when))
    }

    fn send(&mut self, place: f64, lasts_ms: u32, when: u64) {
        let frame = FrameNo(self.next);
        self.next += 1;
        self.belief.taken(&Taken { frame, asked: true, pose: &at(place), lasts_ms, at: ms(when) });
    }

    fn ack(&self, frame: u32) {
        self.evidence.on_ack(FrameNo(frame));
    }

    fn allows(&self, place: f64, lasts_ms: u32, when: u64) -> bool {
        self.belief.allows(&at(place), lasts_ms, ms(when))
    }
}

#[test]
fn of_a_seat_of_which_nothing_is_known_no_pose_is_made_and_only_what_is_slow_from_anywhere_may_leave() {
    let bench = Bench::new();
    assert_eq!((bench.belief.known(), bench.belief.pose(ms(0))), (Known::Nothing, None));
    assert!(!bench.allows(0.0, 600, 0), "the whole stroke takes 625 ms at 240 mm/s");
    assert!(bench.allows(0.0, 630, 0));
}

#[test]
fn a_reading_at_rest_is_known_as_long_as_it_is_fresh() {
    let bench = Bench::found(0.5);
    assert_eq!(bench.belief.pose(ms(100)).map(|known| known.pose()[0]), Some(0.5));
    assert!(bench.allows(0.515, 10, 100) && !bench.allows(0.52, 10, 100), "2.25 and 3 mm in 10 ms");
    assert!(bench.belief.pose(ms(1_600)).is_none() && !bench.allows(0.5, 10, 1_600));
}

#[test]
fn a_seat_that_is_read_while_it_moves_is_nowhere() {
    let mut bench = Bench::found(0.5);
    bench.read(0.5, 250, false);
    assert!(bench.belief.pose(ms(250)).is_some(), "a first answer after a motion finds it where it was left");
    bench.read(0.6, 500, false);
    assert!(matches!(bench.belief.known(), Known::Contradicted(_)));
    assert!(bench.belief.pose(ms(500)).is_none() && !bench.allows(0.6, 10, 500));
    bench.read(0.6, 750, true);
    assert_eq!(bench.belief.pose(ms(750)).map(|known| known.pose()[0]), Some(0.6));
}

#[test]
fn a_reading_from_before_the_last_frame_was_over_says_nothing() {
    let mut bench = Bench::found(0.0);
    bench.send(0.01, 10, 100);
    bench.ack(1);
    bench.read(0.0, 140, true);
    assert_eq!(bench.belief.pose(ms(150)).map(|known| known.pose()[0]), Some(0.01));
    bench.read(0.0, 161, true);
    assert_eq!(bench.belief.pose(ms(161)).map(|known| known.pose()[0]), Some(0.0), "somebody moved it");
}

/// Frames of 2 mm every 10 ms, of which only the first is acked: until that long after it.
fn unheard(until: u64) -> (Bench, u64) {
    let mut bench = Bench::found(0.0);
    let mut gap = 0;
    for tick in 0..=until / 10 {
        let begins = bench.look(10 * tick);
        bench.ack(1);
        if begins {
            gap = 10 * tick;
        }
        bench.send(f64::from(u32::try_from(tick).unwrap()) * 2.0 / 150.0, 10, 10 * tick);
    }
    (bench, gap)
}

#[test]
fn fifty_milliseconds_without_an_ack_are_a_gap_and_what_is_sent_then_is_slow_from_every_place_since() {
    let (bench, gap) = unheard(200);
    assert!((50..=70).contains(&gap), "{gap} ms after the first frame, the second is unheard for 40 to 50");
    assert!(bench.belief.is_in_a_gap());
    // Somewhere from 0 to 40 mm: to 40 mm that takes 167 ms at 240 mm/s.
    assert!(!bench.allows(40.0 / 150.0, 160, 210) && bench.allows(40.0 / 150.0, 170, 210));
    assert!(!bench.allows(0.0, 160, 210) && bench.allows(0.0, 170, 210));
    assert!(bench.allows(20.0 / 150.0, 90, 210), "half-way from both");
}

#[test]
fn acks_that_come_again_tell_where_frames_are_taken_and_a_reading_ends_the_gap() {
    let (mut bench, _) = unheard(200);
    bench.ack(21);
    bench.look(230);
    assert!(bench.belief.is_in_a_gap(), "acks alone do not");
    assert!(bench.allows(41.0 / 150.0, 10, 230), "it is where the last frame led");
    bench.read(40.0 / 150.0, 300, true);
    assert!(!bench.belief.is_in_a_gap());
    assert!(bench.belief.pose(ms(300)).is_some());
}

#[test]
fn that_the_ack_thread_is_slow_is_no_gap() {
    let mut bench = Bench::found(0.0);
    for tick in 0..30 {
        let told = ms(10 * tick.min(3));
        assert!(!bench.belief.look(&bench.evidence, told, ms(10 * tick)), "at {tick}");
        bench.send(0.0, 10, 10 * tick);
    }
}

#[test]
fn frames_that_the_kernel_does_not_take_for_fifty_milliseconds_are_a_gap_with_acks_or_without() {
    for asks in [true, false] {
        let mut belief = Belief::new(&window(), PERIOD, asks);
        let evidence = Evidence::default();
        let begins = |belief: &mut Belief, when| belief.look(&evidence, ms(when), ms(when));
        belief.refused(ms(0));
        assert!(!begins(&mut belief, 50));
        belief.refused(ms(50));
        assert!(begins(&mut belief, 60) && !begins(&mut belief, 70), "it begins once");
        assert_eq!(belief.tally().gaps, 1);
    }
}

#[test]
fn a_motion_begins_from_evidence_after_half_a_second_without_frames() {
    let mut bench = Bench::found(0.0);
    bench.send(0.01, 10, 100);
    bench.ack(1);
    bench.look(120);
    assert!(bench.allows(0.02, 10, 120));
    assert!(bench.allows(0.01, 10, 1_000), "the ack is fresh enough");
    assert!(!bench.allows(0.01, 10, 2_000));
}

#[test]
fn a_frame_that_waits_for_another_is_counted_as_late_and_one_that_waits_for_several_as_hurried() {
    let mut bench = Bench::found(0.0);
    bench.send(0.0, 100, 0);
    bench.send(0.0, 10, 10);
    assert_eq!((bench.belief.tally().late, bench.belief.tally().hurried), (1, 1));
    bench.send(0.0, 10, 90);
    assert_eq!((bench.belief.tally().late, bench.belief.tally().hurried), (2, 1));
    bench.send(0.0, 10, 200);
    assert_eq!(bench.belief.tally().late, 2);
}

#[test]
fn without_acks_what_the_kernel_took_is_where_a_seat_is_once_its_time_is_over() {
    let mut belief = Belief::new(&window(), PERIOD, false);
    let evidence = Evidence::default();
    let pose = at(0.0);
    belief.taken(&Taken { frame: FrameNo(1), asked: false, pose: &pose, lasts_ms: 3_000, at: ms(0) });
    belief.look(&evidence, ms(0), ms(2_000));
    assert!(belief.pose(ms(2_000)).is_none());
    belief.look(&evidence, ms(0), ms(3_000));
    assert_eq!(belief.pose(ms(3_000)).map(|known| *known.pose()), Some(pose));
}

#[test]
fn axes_that_no_reading_tells_are_known_by_confirmed_frames_alone() {
    let seat = SeatType::bench3(2);
    let window = Window::new((0..2).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect());
    let (mut belief, evidence) = (Belief::new(&window, PERIOD, true), Evidence::default());
    let half = Reading { slots: 1, ..Reading::at_rest(at(0.2), ms(0)) };
    evidence.on_reading(&half);
    belief.look(&evidence, ms(0), ms(0));
    assert!(belief.pose(ms(0)).is_none() && belief.is_measured_in_part());
    let pose = [0.1; MAX_AXES];
    belief.taken(&Taken { frame: FrameNo(1), asked: true, pose: &pose, lasts_ms: 700, at: ms(0) });
    evidence.on_ack(FrameNo(1));
    belief.look(&evidence, ms(500), ms(500));
    assert!(belief.pose(ms(500)).is_none(), "it is on its way");
    belief.look(&evidence, ms(700), ms(700));
    assert_eq!(belief.pose(ms(700)).map(|known| known.pose()[1]), Some(0.1));
    evidence.on_reading(&Reading { at: ms(1_000), ..half });
    belief.look(&evidence, ms(1_000), ms(1_000));
    assert_eq!(belief.pose(ms(1_000)).map(|known| known.pose()[..2].to_vec()), Some(vec![0.2, 0.1]));
}

#[test]
fn a_reading_is_taken_whole_or_not_at_all() {
    let evidence = Evidence::default();
    assert_eq!(evidence.reading(), None);
    let reading = Reading { slots: 5, rests: false, by: Source::Homing, ..Reading::at_rest(at(0.3), ms(7)) };
    evidence.on_reading(&reading);
    assert_eq!(evidence.reading(), Some((2, reading)));
    assert_eq!(evidence.acked(), None);
    [3, 5, 4].into_iter().for_each(|frame| evidence.on_ack(FrameNo(frame)));
    assert_eq!(evidence.acked(), Some(FrameNo(5)), "the newest");
}

#[test]
fn what_the_kernel_refused_and_what_was_lost_behind_it_are_one_gap() {
    let mut bench = Bench::found(0.0);
    bench.send(0.001, 10, 0);
    bench.ack(1);
    assert!(!bench.look(10));
    for tick in 1..=3 {
        bench.belief.refused(ms(10 * tick));
        assert!(!bench.look(10 * tick + 5));
    }
    bench.send(0.002, 10, 40);
    assert!(!bench.look(60), "its ack may still come");
    assert!(bench.look(61), "the kernel took none from 10 ms on, and no ack came since");
}
