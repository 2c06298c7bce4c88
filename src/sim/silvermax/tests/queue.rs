//! The timed queue: what it executes, and what it does when it runs dry.

use super::*;
use crate::drive::{DriveCourse, DriveUnits, Segment};

impl Host {
    /// Ready for segments, as a play has it.
    fn ready(unit: u8) -> Self {
        let mut host = Self::of(unit);
        host.tell(unit, Request::EnableMultiTasking);
        host.tell(unit, Request::WriteRegister { register: register::DRY_BRAKE, value: BRAKE.cast_signed() });
        host.tell(unit, Request::ClearQueue);
        host.tell(unit, Request::WriteRegister { register: register::QUEUE_SOURCE, value: 0 });
        host.tell(unit, Request::StartQueue);
        host
    }

    /// Sends a segment until there is room for it.
    fn feed(&mut self, segment: Segment) {
        let request = sent(segment);
        for _ in 0..1_000 {
            match self.ask(16, request) {
                Some(Reply::Ack { .. }) => return,
                Some(Reply::Nak { reason: NakReason::QueueFull, .. }) => self.wait(1),
                other => panic!("{other:?}"),
            }
        }
        panic!("never room");
    }
}

fn sent(segment: Segment) -> Request {
    Request::ImmediateSegment {
        ticks: segment.ticks,
        position: segment.position,
        acceleration: segment.acceleration,
        velocity: segment.velocity.unsigned_abs(),
    }
}

/// A swing up and down again of 50 segments, and its last place.
fn swing() -> Vec<Segment> {
    let mut segments = Vec::new();
    let mut last = 0.0_f64;
    for step in 1..50 {
        let turn = f64::from(step) / 50.0 * std::f64::consts::TAU;
        let velocity = 4e8 * turn.sin();
        let change = ((velocity - last).abs() / 333.0).round();
        segments.push(Segment::moving(333, (change as i32).unsigned_abs(), velocity.round() as i32));
        last = velocity;
    }
    segments
}

#[test]
fn a_course_of_segments_ends_where_the_model_says_to_a_count() {
    let mut host = Host::ready(16);
    let units = DriveUnits::of(4_000.0).unwrap();
    let mut model = DriveCourse::at_rest(units, 0);
    for segment in swing() {
        host.feed(segment);
        model = model.after(segment);
    }
    let place = model.position().round() as i32;
    let to_rest = Segment::to_rest(333, place, 500_000, model.velocity().abs() as i32);
    host.feed(to_rest);
    host.feed(Segment::to_rest(0, place, BRAKE, 1_000_000));
    host.at_rest();
    assert!((host.unit().position() - place).abs() <= 1, "{} {place}", host.unit().position());
    assert_eq!((host.unit().tally().dry, host.unit().tally().segments), (0, 51));
    let executed = host.unit().executed();
    assert!(executed.velocity < 52_000.0, "{}", executed.velocity); // 4e8 / 8053
    assert!(executed.highest - executed.lowest > 8_000.0 && executed.jumps == 0);
}

#[test]
fn within_a_course_it_is_where_the_model_says_to_a_count() {
    let mut host = Host::ready(16);
    let units = DriveUnits::of(4_000.0).unwrap();
    let segments = swing();
    let mut before = DriveCourse::at_rest(units, 0);
    let mut next = 0;
    let mut seen = 0;
    for round in 0..400 {
        if next < segments.len() && host.unit().queued() < 3 {
            host.feed(segments[next]);
            next += 1;
        }
        let running = usize::try_from(host.unit().tally().segments).unwrap();
        if host.unit().is_moving() && running > 0 && running <= 48 {
            before =
                segments[..running - 1].iter().fold(DriveCourse::at_rest(units, 0), |at, s| at.after(*s));
            let left = host.unit().ticks_left();
            let model = before.within(segments[running - 1], segments[running - 1].ticks - left);
            let found = host.unit().position();
            assert!((f64::from(found) - model.position()).abs() <= 1.0, "{round}: {found} {model:?}");
            seen += 1;
        }
        host.wait(3);
    }
    assert!(seen > 100, "{seen} {before:?}");
}

#[test]
fn four_segments_wait_beside_the_one_that_runs_and_the_next_is_refused_and_taken_later() {
    let mut host = Host::ready(16);
    let slow = sent(Segment::resting(10_000, 0));
    for _ in 0..5 {
        host.tell(16, slow);
    }
    assert_eq!(host.nak(16, slow), NakReason::QueueFull);
    assert_eq!((host.unit().tally().full, host.unit().tally().refused), (1, 0));
    host.wait(1_200);
    host.tell(16, slow);
    let left = host.read(16, register::TICKS_LEFT);
    assert!((9_000..10_000).contains(&left), "{left}");
}

#[test]
fn a_queue_that_runs_dry_brakes_with_register_19_and_says_so() {
    let mut host = Host::ready(16);
    host.tell(16, Request::ClearPoll { mask: 0xffff });
    host.word(16, Request::Poll);
    host.tell(16, Request::ClearPoll { mask: 0xffff });
    // To 120 mm/s in 100 ms.
    host.tell(16, sent(Segment::moving(833, 928_000, 773_094_113)));
    host.at_rest();
    assert_eq!(host.unit().tally().dry, 1);
    assert_ne!(host.word(16, Request::Poll) & Poll::PROGRAM_ERROR, 0);
    let executed = host.unit().executed();
    // 96,000 counts/s within 3,000 mm/s² are 40 ms: 1,920 counts after 4,800.
    assert!((6_650..6_800).contains(&host.unit().position()), "{}", host.unit().position());
    assert!(executed.acceleration <= 3_001.0 * f64::from(MM), "{}", executed.acceleration);
}

#[test]
fn a_crystal_that_is_off_runs_through_segments_as_much_sooner() {
    for (ppm, least, most) in [(0, -1, 1), (200, 10, 14), (-200, -14, -10)] {
        let mut host = Host::with(&[UnitSetup { ppm, ..UnitSetup::new(16) }]);
        host.tell(16, Request::EnableMultiTasking);
        host.tell(16, Request::StartQueue);
        host.tell(16, sent(Segment::resting(100_000, 0)));
        let before = host.unit().ticks_left();
        let (from, span) = (host.now, Duration::from_millis(7_200));
        host.wait(7_200);
        assert_eq!(host.now.since(from), span);
        let gone = i64::from(before) - i64::from(host.unit().ticks_left());
        assert!((least..=most).contains(&(gone - 60_000)), "{ppm}: {gone}");
    }
}
