mod loss;

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
    evidence: EvidenceTable,
    next: u32,
}

impl Bench {
    fn new() -> Self {
        Self::of(&window())
    }

    fn of(window: &Window) -> Self {
        Self { belief: Belief::new(window, PERIOD, 1), evidence: EvidenceTable::of(1), next: 1 }
    }

    /// One that was read at rest there at 0 ms.
    fn found(place: f64) -> Self {
        let mut bench = Self::new();
        bench.read(place, 0, true);
        bench
    }

    fn read(&mut self, place: f64, when: u64, rests: bool) {
        let reading = Reading { rests, slots: 1, ..Reading::at_rest(at(place), ms(when)) };
        self.evidence.lane(0).unwrap().on_reading(&reading);
        self.look(when);
    }

    /// A look of a tick up to which the ack thread has told all.
    fn look(&mut self, when: u64) -> Found {
        self.belief.look(self.evidence.lane(0).unwrap(), ms(when), ms(when))
    }

    fn send(&mut self, place: f64, lasts_ms: u32, when: u64) {
        self.send_out_of_order(place, lasts_ms, lasts_ms, when);
    }

    /// One that takes longer if a later one overtakes it.
    fn send_out_of_order(&mut self, place: f64, lasts_ms: u32, at_most_ms: u32, when: u64) {
        let frame = FrameNo(self.next);
        self.next += 1;
        self.belief.taken(&Taken {
            frame,
            asked: true,
            pose: &at(place),
            lasts_ms,
            at_most_ms,
            shakes: 0.0,
            at: ms(when),
        });
    }

    fn ack(&self, frame: u32) {
        self.evidence.lane(0).unwrap().on_ack(FrameNo(frame));
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
        if begins == Found::Gap {
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
fn a_frame_is_missed_after_fifty_milliseconds_however_many_of_its_neighbours_were_acked() {
    let mut bench = Bench::found(0.0);
    bench.belief = Belief { period: Duration::from_millis(1), ..bench.belief };
    bench.belief.spans = Spans::over(GAP);
    bench.read(0.0, 0, true);
    let gap = (0_u32..400).find(|when| {
        // Frame n leaves at n - 1 ms and is acked 49 ms later, until frame 203, which is not.
        bench.ack(when.saturating_sub(48).min(202));
        let found = bench.look((*when).into());
        bench.send(0.0, 1, (*when).into());
        found == Found::Gap
    });
    assert_eq!(gap, Some(202 + 51));
}

#[test]
fn a_frame_is_missed_within_a_span_though_numbers_before_it_were_left_out() {
    let mut bench = Bench::found(0.0);
    bench.belief = Belief { period: Duration::from_millis(1), ..bench.belief };
    bench.belief.spans = Spans::over(GAP);
    bench.read(0.0, 0, true);
    // The lane goes on with the number of others at 203 ms. Acks come after 5 ms, and for what leaves from 206 ms on none.
    let number = |when: u32| when + if when < 203 { 1 } else { 1_001 };
    let gap = (0_u32..400).find(|when| {
        bench.ack(number(when.saturating_sub(5).min(205)));
        let found = bench.look((*when).into());
        bench.next = number(*when);
        bench.send(0.0, 1, (*when).into());
        found == Found::Gap
    });
    assert!(gap.is_some_and(|gap| (206 + 51..=206 + 61).contains(&gap)), "{gap:?}");
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
fn that_the_ack_thread_is_slow_is_no_gap_for_a_tenth_of_a_second() {
    let mut bench = Bench::found(0.0);
    for tick in 0..20 {
        let told = ms(10 * tick.min(3));
        let begins = bench.belief.look(bench.evidence.lane(0).unwrap(), told, ms(10 * tick));
        assert_eq!(begins == Found::Gap, tick == 11, "at {tick}");
        bench.send(0.0, 10, 10 * tick);
    }
}

#[test]
fn frames_that_the_kernel_does_not_take_for_fifty_milliseconds_are_a_gap_with_acks_or_without() {
    for ack_every in [1, 0] {
        let mut belief = Belief::new(&window(), PERIOD, ack_every);
        let table = EvidenceTable::of(1);
        let evidence = table.lane(0).unwrap();
        let begins = |belief: &mut Belief, when| belief.look(evidence, ms(when), ms(when)) == Found::Gap;
        belief.refused(ms(0), true);
        assert!(!begins(&mut belief, 50));
        belief.refused(ms(50), true);
        assert!(begins(&mut belief, 60) && !begins(&mut belief, 70), "it begins once");
        assert_eq!(belief.tally().gaps, 1);
    }
}

#[test]
fn an_ack_is_missed_in_time_though_the_frame_that_was_to_ask_was_refused() {
    // Of numbers 1 to 40 those of 1, 6, 11 … ask; 1 is acked, and nothing after it.
    let missed = |refused: &[u32]| {
        let mut bench = Bench { belief: Belief::new(&window(), PERIOD, 5), ..Bench::found(0.0) };
        bench.read(0.0, 0, true);
        (1..40).find(|number| {
            let (frame, when) = (FrameNo(*number), 10 * u64::from(*number));
            let begins = bench.look(when) == Found::Gap;
            if refused.contains(number) {
                bench.belief.refused(ms(when), frame.asks(5));
            } else {
                let (pose, asked) = (at(0.0), frame.asks(5));
                let (lasts_ms, at) = (10, ms(when));
                let taken = Taken { frame, asked, pose: &pose, lasts_ms, at_most_ms: 10, shakes: 0.0, at };
                bench.belief.taken(&taken);
            }
            if *number == 1 {
                bench.ack(1);
            }
            begins
        })
    };
    assert_eq!(missed(&[]), Some(12), "the sixth left at 60 ms");
    assert_eq!(missed(&[6]), Some(12));
    assert_eq!(missed(&[5, 6, 7]), Some(11), "the fifth was to leave at 50 ms");
    assert_eq!(missed(&[2, 3, 4]), Some(12), "none of these was to ask");
    assert_eq!(missed(&[2, 3, 4, 5, 6]), Some(8), "nor was any frame open when the first was refused");
}

#[test]
fn a_refusal_that_was_a_gap_is_none_any_more_once_the_seat_was_read_at_rest() {
    let mut bench = Bench::found(0.0);
    bench.send(0.001, 10, 0);
    bench.ack(1);
    assert_eq!(bench.look(10), Found::Nothing);
    bench.belief.refused(ms(10), true);
    assert_eq!(bench.look(70), Found::Gap);
    bench.read(0.001, 300, true);
    assert_eq!((bench.look(310), bench.belief.is_in_a_gap()), (Found::Nothing, false));
    assert_eq!(bench.belief.tally().gaps, 1);
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
fn a_motion_that_was_asked_for_may_begin_a_tenth_of_a_second_and_a_period_after_a_reading_since_then_and_no_later()
 {
    let mut bench = Bench::found(0.5);
    bench.read(0.5, 300, true);
    let may_begin = |since, now| bench.belief.may_begin(ms(since), ms(now));
    assert!(may_begin(300, 410) && !may_begin(300, 411) && !may_begin(301, 310));
    assert!(bench.belief.pose(ms(411)).is_some() && bench.belief.start(ms(411)).is_none());
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
    let mut belief = Belief::new(&window(), PERIOD, 0);
    let table = EvidenceTable::of(1);
    let evidence = table.lane(0).unwrap();
    let pose = at(0.0);
    belief.taken(&Taken {
        frame: FrameNo(1),
        asked: false,
        pose: &pose,
        lasts_ms: 3_000,
        at_most_ms: 3_000,
        shakes: 0.0,
        at: ms(0),
    });
    belief.look(evidence, ms(0), ms(2_000));
    assert!(belief.pose(ms(2_000)).is_none());
    belief.look(evidence, ms(0), ms(3_000));
    assert_eq!(belief.pose(ms(3_000)).map(|known| *known.pose()), Some(pose));
}

#[test]
fn axes_that_no_reading_tells_are_known_by_confirmed_frames_alone() {
    let seat = SeatType::bench3(2);
    let window = Window::new((0..2).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect());
    let (mut belief, table) = (Belief::new(&window, PERIOD, 1), EvidenceTable::of(1));
    let evidence = table.lane(0).unwrap();
    let half = Reading { slots: 1, ..Reading::at_rest(at(0.2), ms(0)) };
    evidence.on_reading(&half);
    belief.look(evidence, ms(0), ms(0));
    assert!(belief.pose(ms(0)).is_none() && belief.is_measured_in_part());
    let pose = [0.1; MAX_AXES];
    belief.taken(&Taken {
        frame: FrameNo(1),
        asked: true,
        pose: &pose,
        lasts_ms: 700,
        at_most_ms: 700,
        shakes: 0.0,
        at: ms(0),
    });
    evidence.on_ack(FrameNo(1));
    belief.look(evidence, ms(500), ms(500));
    assert!(belief.pose(ms(500)).is_none(), "it is on its way");
    belief.look(evidence, ms(700), ms(700));
    assert_eq!(belief.pose(ms(700)).map(|known| known.pose()[1]), Some(0.1));
    evidence.on_reading(&Reading { pose: at(0.1), at: ms(1_000), ..half });
    belief.look(evidence, ms(1_000), ms(1_000));
    assert_eq!(belief.pose(ms(1_000)).map(|known| known.pose()[..2].to_vec()), Some(vec![0.1, 0.1]));
    evidence.on_reading(&Reading { at: ms(1_200), ..half });
    belief.look(evidence, ms(1_200), ms(1_200));
    assert!(belief.pose(ms(1_200)).is_none(), "whoever moved the first may have moved the second");
}

#[test]
fn a_reading_is_taken_whole_or_not_at_all() {
    let table = EvidenceTable::of(1);
    let evidence = table.lane(0).unwrap();
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
    assert_eq!(bench.look(10), Found::Nothing);
    for tick in 1..=3 {
        bench.belief.refused(ms(10 * tick), true);
        assert_eq!(bench.look(10 * tick + 5), Found::Nothing);
    }
    bench.send(0.002, 10, 40);
    assert_eq!(bench.look(60), Found::Nothing, "its ack may still come");
    assert_eq!(bench.look(61), Found::Gap, "the kernel took none from 10 ms on, and no ack came since");
}

/// Frames at 60 mm/s from 30 mm on, each of them acked, until 500 ms.
fn ridden() -> Bench {
    let mut bench = Bench::found(0.2);
    for tick in 0..50 {
        bench.send(0.2 + f64::from(tick) * 0.004, 10, 10 * u64::from(tick));
        bench.ack(tick + 1);
        assert_eq!(bench.look(10 * u64::from(tick)), Found::Nothing);
    }
    bench
}

/// What one answer makes known that finds the axis there, asked for at `made`.
fn passes(bench: &mut Bench, place: f64, made: u64, when: u64) -> Found {
    let reading =
        Reading { rests: false, slots: 1, by: Source::Passing, ..Reading::at_rest(at(place), ms(made)) };
    bench.evidence.lane(0).unwrap().on_reading(&reading);
    bench.look(when)
}

#[test]
fn a_seat_that_follows_a_tenth_of_a_second_late_follows_and_one_that_acks_and_does_not_move_is_found_out() {
    // It is sent to 59.4 mm, and was to 51 mm 140 ms ago.
    for place in [0.396, 0.34, 0.335] {
        assert_eq!(passes(&mut ridden(), place, 498, 500), Found::Nothing, "{place}");
    }
    for place in [0.2, 0.29, 0.41] {
        let mut bench = ridden();
        assert_eq!(passes(&mut bench, place, 498, 500), Found::Astray, "{place}");
        assert_eq!((bench.belief.pose(ms(500)), bench.belief.known()), (None, Known::Contradicted(ms(500))));
        assert!(!bench.allows(0.396, 10, 510), "no frame may lead it from anywhere");
    }
}

#[test]
fn a_seat_that_fell_behind_is_at_rest_only_once_all_that_it_was_sent_is_over_however_it_arrived() {
    for (at_most_ms, over) in [(10, 700), (100, 5_100)] {
        let mut bench = Bench::found(0.2);
        for tick in 0..50 {
            bench.send_out_of_order(0.2 + f64::from(tick) * 0.004, 10, at_most_ms, 10 * u64::from(tick));
            bench.ack(tick + 1);
            bench.look(10 * u64::from(tick));
        }
        assert_eq!(passes(&mut bench, 0.25, 490, 500), Found::Astray);
        bench.read(0.25, over - 160, true);
        assert_eq!(
            bench.belief.known(),
            Known::Contradicted(ms(500)),
            "it waits between two frames of its queue"
        );
        bench.read(0.3, over, true);
        assert_eq!(bench.belief.known(), Known::Measured(ms(over), Source::Registers));
    }
}

#[test]
fn of_a_seat_that_is_seen_to_follow_only_what_it_was_sent_since_then_may_be_in_its_queue() {
    let mut bench = Bench::found(0.2);
    for tick in 0..50 {
        let (place, when) = (0.2 + f64::from(tick) * 0.004, 10 * u64::from(tick));
        bench.send_out_of_order(place, 10, 100, when);
        bench.ack(tick + 1);
        assert_eq!(passes(&mut bench, place, when, when), Found::Nothing);
    }
    assert_eq!(passes(&mut bench, 0.1, 500, 510), Found::Astray);
    bench.read(0.3, 900, true);
    assert_eq!(bench.belief.known(), Known::Measured(ms(900), Source::Registers));
}

#[test]
fn an_answer_that_came_late_is_held_against_all_since_it_was_asked_for_and_one_much_too_late_against_nothing()
{
    assert_eq!(passes(&mut ridden(), 0.28, 350, 500), Found::Nothing, "it was there 300 ms ago");
    assert_eq!(passes(&mut ridden(), 0.9, 350, 500), Found::Astray);
    assert_eq!(passes(&mut ridden(), 0.9, 90, 500), Found::Nothing);
}

#[test]
fn a_seat_that_vibrates_is_as_far_off_as_it_was_told_to_vibrate() {
    let mut bench = ridden();
    let taken = Taken {
        frame: FrameNo(51),
        asked: true,
        pose: &at(0.4),
        lasts_ms: 10,
        at_most_ms: 10,
        shakes: 0.03,
        at: ms(500),
    };
    bench.belief.taken(&taken);
    assert_eq!(passes(&mut bench, 0.43, 505, 510), Found::Nothing);
    assert_eq!(passes(&mut bench, 0.45, 505, 510), Found::Astray);
}

#[test]
fn what_one_answer_tells_in_passing_confirms_nothing_of_a_seat_at_rest() {
    let mut bench = Bench::found(0.2);
    assert_eq!(passes(&mut bench, 0.2, 900, 900), Found::Nothing);
    assert_eq!(bench.belief.known(), Known::Measured(ms(0), Source::Registers));
}

#[test]
fn a_seat_that_vibrates_on_may_be_anywhere_in_its_swing_and_no_motion_begins_before_a_frame_has_ended_that() {
    let mut bench = Bench::found(0.2);
    let send = |bench: &mut Bench, frame: u32, shakes: f64, lasts_ms: u32, when: u64| {
        let pose = at(0.2);
        bench.belief.taken(&Taken {
            frame: FrameNo(frame),
            asked: true,
            pose: &pose,
            lasts_ms,
            at_most_ms: lasts_ms,
            shakes,
            at: ms(when),
        });
    };
    (0..10).for_each(|tick| send(&mut bench, tick + 1, 0.02, 10, 10 * u64::from(tick)));
    assert_eq!(bench.look(100), Found::Gap);
    assert!((bench.belief.shakes() - 0.02).abs() < 1e-12);
    let sways = Reading { rests: false, moves: true, sways: 0.041, ..Reading::at_rest(at(0.21), ms(900)) };
    bench.evidence.lane(0).unwrap().on_reading(&sways);
    bench.look(1_000);
    assert_eq!(
        (bench.belief.pose(ms(1_000)), bench.belief.vibrates_about(ms(1_000))),
        (None, Some(&at(0.21)))
    );
    // The greatest speed is 1.6 strokes a second: 0.041 takes it 25.6 ms.
    assert!(!bench.allows(0.21, 25, 1_000) && bench.allows(0.21, 26, 1_000));
    send(&mut bench, 11, 0.0, 100, 1_000);
    bench.ack(11);
    bench.look(1_020);
    assert!(bench.belief.shakes() == 0.0, "it was told to stop");
    assert_eq!(passes(&mut bench, 0.25, 1_010, 1_030), Found::Nothing, "until then it swung");
    bench.look(1_100);
    assert_eq!(
        (bench.belief.vibrates_about(ms(1_100)), bench.belief.known()),
        (None, Known::Confirmed(ms(1_100)))
    );
}

#[test]
fn frames_that_may_be_confirmed_late_and_many_at_once_are_missed_only_when_they_are_overdue() {
    let (lead, later) = (200, 400);
    let window = window().led_ahead(Duration::from_millis(lead)).acked_later(Duration::from_millis(later));
    let mut bench = Bench::of(&window);
    bench.read(0.5, 0, true);
    let mut frames = 0;
    let mut ride = |bench: &mut Bench, tick: u64, acks: bool| {
        let now = 10 * tick;
        bench.send(0.5, 10, now);
        frames += 1;
        // Every 400 ms all that was executed by then: the first of them waited for 600 ms.
        if acks && now.is_multiple_of(later) && now > lead {
            bench.ack(u32::try_from((now - lead) / 10).unwrap());
        }
        bench.look(now)
    };
    assert!((1..=300).all(|tick| ride(&mut bench, tick, true) == Found::Nothing));
    let gap = (301..=500).find(|tick| ride(&mut bench, *tick, false) == Found::Gap).expect("it is noticed");
    // The oldest that was not acked was sent at 2610 ms at the latest.
    assert!((3_200..=3_360).contains(&(10 * gap)), "{gap}");
}

#[test]
fn no_frame_may_leave_for_a_controller_that_reads_frames_otherwise_until_its_answers_can_be_read() {
    let mut bench = Bench::found(0.0);
    assert!(bench.belief.allows(&at(0.0), 3_000, ms(10)));
    bench.evidence.lane(0).unwrap().on_layout(true);
    // An ack and a reading change nothing of that.
    bench.evidence.lane(0).unwrap().on_ack(FrameNo(1));
    bench.read(0.0, 20, true);
    assert_eq!(bench.evidence.lane(0).unwrap().acked(), Some(FrameNo(1)));
    assert!(!bench.belief.allows(&at(0.0), 60_000, ms(30)), "not even one that moves nothing");
    bench.evidence.lane(0).unwrap().on_layout(false);
    bench.look(40);
    assert!(bench.belief.allows(&at(0.0), 3_000, ms(40)));
    assert_eq!(bench.evidence.lane(0).unwrap().acked(), Some(FrameNo(1)));
}
