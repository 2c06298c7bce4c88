use super::*;
use crate::wire::ReplyCode::{Command, EmergencyStop, Fault, Running};

const fn ms(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

/// A tracker of one controller to which frames 1 to `count` were sent, one each millisecond from 1 ms on, all asking.
fn sent(count: u32) -> Tracker {
    let mut tracker = Tracker::new(1, 1);
    for frame in 1..=count {
        tracker.on_sent(0, FrameNo(frame), true, ms(u64::from(frame)));
    }
    tracker
}

#[track_caller]
fn assert_balanced(tracker: &Tracker) {
    let counts = tracker.counts(0);
    assert_eq!(counts.asked, counts.acked + counts.refused() + counts.lost + counts.withdrawn, "{counts:?}");
}

#[test]
fn each_frame_ends_acked_refused_or_lost() {
    let mut tracker = sent(5);
    assert_eq!(tracker.on_reply(0, FrameNo(1), Running, ms(2)), Fate::Answered(Running));
    for (frame, code) in [(2, Fault), (3, EmergencyStop), (4, Command)] {
        assert_eq!(tracker.on_reply(0, FrameNo(frame), code, ms(9)), Fate::Answered(code));
    }
    assert_eq!(tracker.counts(0).in_flight(), 1);
    tracker.expire(ms(1_006));
    let counts = tracker.counts(0);
    assert_eq!((counts.sent, counts.asked, counts.acked, counts.lost), (5, 5, 1, 1));
    assert_eq!((counts.fault, counts.emergency_stop, counts.command, counts.refused()), (1, 1, 1, 3));
    assert_balanced(&tracker);
}

#[test]
fn numbers_that_no_frame_has_count_as_nothing_however_many_they_are() {
    for next in [5, 900, 6_000, 3_000_000_000] {
        let mut tracker = Tracker::starting_at(&[FrameNo(next - 4)], 1);
        let first = next - 4;
        tracker.on_sent(0, FrameNo(first), true, ms(1));
        tracker.on_reply(0, FrameNo(first), Running, ms(2));
        tracker.on_sent(0, FrameNo(first + 1), true, ms(3));
        let far = FrameNo(next.wrapping_add(next / 3));
        tracker.on_skipped(0, far);
        assert_eq!(tracker.on_reply(0, FrameNo(far.0.wrapping_sub(1)), Running, ms(4)), Fate::Stray);
        tracker.on_sent(0, far, true, ms(5));
        assert_eq!(tracker.on_reply(0, far, Running, ms(6)), Fate::Answered(Running));
        tracker.expire(ms(5_000));
        let counts = tracker.counts(0);
        assert_eq!((counts.sent, counts.asked, counts.acked, counts.lost), (3, 3, 2, 1), "{next}");
        assert_balanced(&tracker);
    }
}

#[test]
fn frames_that_are_withdrawn_are_not_lost_whatever_else_is_told_of_them() {
    let mut tracker = sent(6);
    tracker.on_reply(0, FrameNo(3), Running, ms(9));
    tracker.withdraw(0, FrameNo(2), FrameNo(8));
    tracker.withdraw(0, FrameNo(4), FrameNo(4));
    assert_eq!(tracker.on_reply(0, FrameNo(5), Running, ms(10)), Fate::Stale);
    tracker.expire(ms(5_000));
    let counts = tracker.counts(0);
    assert_eq!((counts.acked, counts.withdrawn, counts.lost, counts.in_flight()), (1, 4, 1, 0));
    assert_balanced(&tracker);
}

#[test]
fn acks_of_seats_on_links_have_a_latency_of_their_own() {
    let mut tracker = Tracker::new(3, 1);
    tracker.set_on_links(1);
    for controller in 0..3 {
        tracker.on_sent(controller, FrameNo(1), true, ms(1));
        tracker.on_reply(controller, FrameNo(1), Running, ms(1 + 100 * controller as u64));
    }
    let [on_network, on_links] = tracker.latencies();
    assert_eq!((on_network.len(), on_links.len()), (2, 1));
    assert!(on_network.max() < 101_000_000 && on_links.min() > 199_000_000);
}

#[test]
fn only_acks_have_a_latency() {
    let mut tracker = sent(3);
    tracker.on_reply(0, FrameNo(1), Running, ms(8));
    tracker.on_reply(0, FrameNo(2), Fault, ms(900));
    tracker.on_reply(0, FrameNo(1), Running, ms(900));
    let latency = tracker.latency(0);
    assert_eq!(latency.len(), 1);
    assert!(latency.max().abs_diff(7_000_000) < 7_000, "{}", latency.max());
}

#[test]
fn a_second_reply_to_an_answered_frame_is_a_duplicate() {
    let mut tracker = sent(2);
    tracker.on_reply(0, FrameNo(1), Running, ms(3));
    tracker.on_reply(0, FrameNo(2), Fault, ms(3));
    for frame in [1, 2] {
        assert_eq!(tracker.on_reply(0, FrameNo(frame), Running, ms(5_000)), Fate::Duplicate);
    }
    assert_eq!(tracker.counts(0).acked, 1);
}

#[test]
fn a_reply_to_a_lost_frame_is_stale() {
    let mut tracker = sent(1);
    tracker.expire(ms(1_002));
    assert_eq!(tracker.on_reply(0, FrameNo(1), Running, ms(900)), Fate::Stale);
    assert_eq!((tracker.counts(0).lost, tracker.counts(0).stale), (1, 1));
    assert_balanced(&tracker);
}

#[test]
fn a_reply_after_a_second_loses_its_frame_even_before_it_expires() {
    let mut tracker = sent(2);
    assert_eq!(tracker.on_reply(0, FrameNo(1), Running, ms(1_002)), Fate::Stale);
    assert_eq!(tracker.on_reply(0, FrameNo(1), Running, ms(1_003)), Fate::Stale);
    assert_eq!(tracker.on_reply(0, FrameNo(2), Running, ms(1_002)), Fate::Answered(Running), "just in time");
    tracker.finish();
    assert_eq!((tracker.counts(0).lost, tracker.counts(0).stale), (1, 2));
    assert_balanced(&tracker);
}

#[test]
fn a_frame_expires_only_when_more_than_a_second_has_passed() {
    let mut tracker = sent(2);
    tracker.expire(ms(1_001));
    assert_eq!(tracker.counts(0).lost, 0);
    tracker.expire(ms(1_002));
    assert_eq!(tracker.counts(0).lost, 1);
}

#[test]
fn a_reply_to_what_was_never_sent_or_not_asked_is_stray() {
    let mut tracker = sent(2);
    tracker.on_sent(0, FrameNo(3), false, ms(3));
    tracker.on_sent(0, FrameNo(4), true, ms(4));
    tracker.on_send_failed(0, FrameNo(4));
    for frame in [0, 3, 4, 5, u32::MAX, 1 << 31] {
        assert_eq!(tracker.on_reply(0, FrameNo(frame), Running, ms(5)), Fate::Stray, "{frame}");
    }
    tracker.on_stray(0);
    assert_eq!(tracker.counts(0).stray, 7);
}

#[test]
fn a_frame_that_the_kernel_did_not_take_was_neither_sent_nor_asked() {
    let mut tracker = sent(2);
    tracker.on_send_failed(0, FrameNo(1));
    tracker.expire(ms(5_000));
    tracker.on_send_failed(0, FrameNo(2));
    tracker.on_send_failed(0, FrameNo(2));
    tracker.on_sent(0, FrameNo(3), false, ms(3));
    tracker.on_send_failed(0, FrameNo(3));
    assert_eq!(tracker.counts(0), Counts { send_failed: 3, ..Counts::default() });
}

#[test]
fn an_answer_proves_that_a_frame_was_sent() {
    let mut tracker = sent(1);
    tracker.on_reply(0, FrameNo(1), Running, ms(2));
    tracker.on_send_failed(0, FrameNo(1));
    assert_eq!((tracker.counts(0).acked, tracker.counts(0).send_failed), (1, 0));
}

#[test]
fn fates_are_remembered_for_as_many_frames_as_promised() {
    let mut tracker = sent(KEPT + 1);
    assert_eq!(tracker.on_reply(0, FrameNo(1), Running, ms(2)), Fate::Stale);
    assert_eq!(tracker.on_reply(0, FrameNo(2), Running, ms(3)), Fate::Answered(Running));
    assert_eq!(tracker.counts(0).lost, 1, "frame 1 gave up its place in flight");
    tracker.finish();
    assert_eq!((tracker.counts(0).lost, tracker.counts(0).in_flight()), (u64::from(KEPT), 0));
}

#[test]
fn frames_without_a_record_count_as_sent_and_asked_at_an_unknown_time() {
    let mut tracker = sent(1);
    tracker.on_sent(0, FrameNo(5), true, ms(50));
    assert_eq!((tracker.counts(0).sent, tracker.counts(0).asked), (5, 5));
    assert_eq!(tracker.on_reply(0, FrameNo(3), Running, ms(60)), Fate::Answered(Running));
    assert_eq!(tracker.on_reply(0, FrameNo(4), Running, ms(1_051)), Fate::Stale, "sent at 50 ms or before");
    assert!(tracker.latency(0).is_empty());
    tracker.expire(ms(1_051));
    assert_eq!((tracker.counts(0).acked, tracker.counts(0).lost), (1, 4));
}

#[test]
fn frames_without_a_record_did_not_ask_where_none_ever_does() {
    let mut tracker = Tracker::new(1, 0);
    tracker.on_sent(0, FrameNo(1), false, ms(1));
    tracker.on_sent(0, FrameNo(9_000), false, ms(9));
    tracker.on_send_failed(0, FrameNo(9_002));
    assert_eq!(tracker.counts(0), Counts { sent: 9_001, send_failed: 1, ..Counts::default() });
    assert!(!tracker.lost_at_end(0));
}

#[test]
fn frames_without_a_record_at_the_very_end_are_accounted_as_well() {
    let mut tracker = sent(3);
    tracker.on_last(0, FrameNo(3), ms(9));
    assert_eq!(tracker.counts(0).sent, 3);
    tracker.on_last(0, FrameNo(7), ms(9));
    assert_eq!(tracker.on_reply(0, FrameNo(6), Running, ms(10)), Fate::Answered(Running));
    tracker.finish();
    assert_eq!((tracker.counts(0).asked, tracker.counts(0).lost), (7, 6));
}

#[test]
fn a_gap_of_any_length_is_accounted_at_once() {
    let mut tracker = sent(10);
    tracker.on_sent(0, FrameNo(2_000_000_000), true, ms(99));
    let counts = tracker.counts(0);
    assert_eq!((counts.asked, counts.in_flight()), (2_000_000_000, u64::from(KEPT)));
    assert_eq!(tracker.on_reply(0, FrameNo(5), Running, ms(99)), Fate::Stale);
    assert_eq!(tracker.on_reply(0, FrameNo(1_999_999_999), Running, ms(99)), Fate::Answered(Running));
    tracker.finish();
    assert_balanced(&tracker);
}

#[test]
fn frame_numbers_count_round() {
    let mut tracker = Tracker::starting_at(&[FrameNo(u32::MAX)], 1);
    for (frame, at) in [(u32::MAX, 1), (0, 2), (1, 3)] {
        tracker.on_sent(0, FrameNo(frame), true, ms(at));
    }
    assert_eq!(tracker.on_reply(0, FrameNo(1), Running, ms(4)), Fate::Answered(Running));
    assert_eq!(tracker.on_reply(0, FrameNo(u32::MAX), Running, ms(5)), Fate::Answered(Running));
    assert_eq!(tracker.on_reply(0, FrameNo(u32::MAX - 1), Running, ms(5)), Fate::Stray);
    assert_eq!(tracker.last_ack(0), Some((FrameNo(1), ms(4))), "the newest frame, not the latest reply");
}

#[test]
fn a_frame_recorded_twice_counts_once() {
    let mut tracker = sent(2);
    tracker.on_sent(0, FrameNo(1), true, ms(9));
    assert_eq!(tracker.counts(0).sent, 2);
}

#[test]
fn controllers_do_not_share_their_books() {
    let mut tracker = Tracker::new(2, 1);
    tracker.on_sent(1, FrameNo(1), true, ms(1));
    tracker.on_port_closed(0, 3);
    assert_eq!(tracker.on_reply(0, FrameNo(1), Running, ms(2)), Fate::Stray);
    assert_eq!(tracker.counts(0), Counts { stray: 1, port_closed: 3, ..Counts::default() });
    assert_eq!(tracker.counts(1), Counts { sent: 1, asked: 1, ..Counts::default() });
}

#[test]
fn a_controller_is_lost_at_the_end_if_it_acked_nothing_of_the_last_second() {
    let mut tracker = sent(3_000);
    tracker.on_reply(0, FrameNo(1_999), Running, ms(2_000));
    tracker.on_reply(0, FrameNo(2_500), Fault, ms(2_501));
    tracker.finish();
    assert!(tracker.lost_at_end(0));

    let mut tracker = sent(3_000);
    tracker.on_reply(0, FrameNo(2_000), Running, ms(2_001));
    tracker.finish();
    assert!(!tracker.lost_at_end(0));
}

#[test]
fn at_a_low_rate_the_last_ten_frames_tell_whether_a_controller_is_lost() {
    let slow = |acked: u32| {
        let mut tracker = Tracker::new(1, 1);
        for frame in 1..=20 {
            tracker.on_sent(0, FrameNo(frame), true, ms(500 * u64::from(frame)));
        }
        tracker.on_reply(0, FrameNo(acked), Running, ms(500 * u64::from(acked) + 1));
        tracker.finish();
        tracker.lost_at_end(0)
    };
    assert!(slow(10));
    assert!(!slow(11));
}

#[test]
fn a_controller_out_of_reach_is_lost_and_one_never_asked_is_not() {
    let mut tracker = sent(2_000);
    for frame in 1..=2_000 {
        tracker.on_reply(0, FrameNo(frame), Running, ms(u64::from(frame) + 1));
    }
    assert!(!tracker.lost_at_end(0));
    for frame in 2_001..=4_000 {
        tracker.on_sent(0, FrameNo(frame), true, ms(u64::from(frame)));
        tracker.on_send_failed(0, FrameNo(frame));
    }
    assert!(tracker.lost_at_end(0));
    assert!(!Tracker::new(1, 1).lost_at_end(0), "nothing was sent");
}

/// A tracker of one controller to which frames 1 to `count` were sent, one each millisecond, each `ack_every`-th asking.
fn sent_asking(ack_every: u32, count: u32) -> Tracker {
    let mut tracker = Tracker::new(1, ack_every);
    for frame in 1..=count {
        tracker.on_sent(0, FrameNo(frame), FrameNo(frame).asks(ack_every), ms(u64::from(frame)));
    }
    tracker
}

#[test]
fn only_the_frames_that_ask_have_to_be_answered() {
    let mut tracker = sent_asking(10, 95);
    assert_eq!(tracker.on_reply(0, FrameNo(11), Running, ms(96)), Fate::Answered(Running));
    assert_eq!(tracker.on_reply(0, FrameNo(21), Fault, ms(96)), Fate::Answered(Fault));
    assert_eq!(tracker.on_reply(0, FrameNo(12), Running, ms(96)), Fate::Stray);
    tracker.finish();
    let counts = tracker.counts(0);
    assert_eq!((counts.sent, counts.asked, counts.acked, counts.fault, counts.lost), (95, 10, 1, 1, 8));
    assert_balanced(&tracker);
}

#[test]
fn of_frames_without_a_record_those_asked_whose_numbers_ask() {
    let mut tracker = sent_asking(10, 1);
    tracker.on_sent(0, FrameNo(35), false, ms(35));
    assert_eq!((tracker.counts(0).sent, tracker.counts(0).asked), (35, 4));
    assert_eq!(tracker.on_reply(0, FrameNo(31), Running, ms(36)), Fate::Answered(Running));
    assert_eq!(tracker.on_reply(0, FrameNo(32), Running, ms(36)), Fate::Stray);
    tracker.on_last(0, FrameNo(1_000_001), ms(99));
    assert_eq!((tracker.counts(0).sent, tracker.counts(0).asked), (1_000_001, 100_001));
    tracker.finish();
    assert_balanced(&tracker);
}

#[test]
fn where_few_frames_ask_the_last_ten_that_did_tell_whether_a_controller_is_lost() {
    // Far more frames than are remembered lie between the first of the last ten and the end.
    let lost = |acked: u32| {
        let mut tracker = Tracker::new(1, 1_000);
        for frame in 1..=20_000 {
            tracker.on_sent(0, FrameNo(frame), FrameNo(frame).asks(1_000), ms(u64::from(frame)));
            if frame == acked {
                tracker.on_reply(0, FrameNo(frame), Running, ms(u64::from(frame) + 1));
            }
        }
        tracker.finish();
        tracker.lost_at_end(0)
    };
    assert!(lost(9_001) && lost(0));
    assert!(!lost(10_001));
}

#[test]
fn nothing_is_known_of_the_number_before_the_first_frame() {
    let mut tracker = Tracker::new(1, 1);
    tracker.on_sent(0, FrameNo(1), true, ms(1));
    assert_eq!((tracker.sent_at(0, FrameNo(1)), tracker.sent_at(0, FrameNo(0))), (Some(ms(1)), None));
}
