use super::Desk;
use crate::engine::Mix;

#[test]
fn what_is_set_is_read_and_levels_stay_within_their_range() {
    let desk = Desk::new([Mix::FULL; 2].into_iter());
    assert_eq!((desk.lanes(), desk.mix(1)), (2, Mix::FULL));
    for (set, read) in [(0.5, 0.5), (7.0, 1.0), (-1.0, 0.0), (f64::NAN, 0.0)] {
        desk.set(1, Mix { motion: set, vibration: set, effects: 5, switches: 2, on: false });
        assert_eq!(desk.mix(1), Mix { motion: read, vibration: read, effects: 5, switches: 2, on: false });
    }
    assert_eq!(desk.mix(0), Mix::FULL, "the other seat is as it was");
}

#[test]
fn a_stop_is_taken_once() {
    let desk = Desk::new(std::iter::empty());
    desk.stop();
    assert_eq!([desk.take_stop(), desk.take_stop()], [true, false]);
}

#[test]
fn levels_that_are_set_by_themselves_leave_a_seat_out_that_is_left_out() {
    let desk = Desk::new([Mix::FULL; 2].into_iter());
    desk.leave_out(1);
    desk.set_levels(1, 0.5, 0.25);
    assert_eq!(desk.mix(1), Mix { motion: 0.5, vibration: 0.25, on: false, ..Mix::FULL });
    assert_eq!(desk.mix(0), Mix::FULL, "the other seat is as it was");
}
