//! Whole plays to virtual SIXpack 2 units.

use super::*;
use crate::drive::{motors_of, sixpack2};
use crate::sim::sixpack2::{MOTORS, ShaftSetup, SixpackBus, SixpackFault, SixpackSetup};

/// Microsteps of a millimetre.
pub(super) const MM: f64 = 640.0;

const HALL: &str = "[show]\nrate_hz = 100\n[link.stalls]\nport = \"/dev/ttyUSB0\"\n\
    [seat.s]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 3200\n\
    max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
    [seat.s.drive]\n\
    home = { way = \"switch\", toward = \"down\", travel_mm = 165, zero_mm = -2, speed_mm_s = 20 }\n\
    clock_divider = 3\ncurrent = { peak = 238 }\n\
    [[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"link:stalls\"\ndialect = \"sixpack2\"\n\
    unit = 1\nmotors = [0, 1, 2]\n";

type SixHall<'h, 'l> = Hall<'h, 'l, SixpackBus>;

/// The level at which the ride fits a link of this rate.
const LEVEL: f64 = 0.4;

/// Opens a hall whose seat was homed, with a cue on it.
fn hall(lead: impl FnOnce(&mut SixHall<'_, '_>, StagedShow, &Timeline)) {
    hall_over(|line| Box::new(line), lead);
}

/// The same, where its play has the line by a port of this kind.
pub(super) fn hall_over(
    over: impl FnOnce(SharedLine<SixpackBus>) -> Port,
    lead: impl FnOnce(&mut SixHall<'_, '_>, StagedShow, &Timeline),
) {
    let config = Arc::new(read(HALL));
    let line = homed_line(&config, 1_001);
    let port = over(line.clone());
    homed((config, LEVEL), line, port, lead);
}

/// A line with a unit of that serial number whose seat was homed.
fn homed_line(config: &Config, serial: u16) -> SharedLine<SixpackBus> {
    NOW.set(MonoTime::from_nanos(3_000_000_000));
    let shaft = ShaftSetup { switch: Some(-2.0 * MM), ..ShaftSetup::default() };
    let setup =
        SixpackSetup { unit: 1, serial, shafts: [shaft; MOTORS], is_two_wires: false, can_baud: None };
    let line = SharedLine::new(SixpackBus::waking([setup], NOW.get()), 10);
    line.lock().line.set_host_baud(Some(config.links[0].baud));
    let terms = StreamTerms::of(&config.links[0], config).expect("it plays").expect("there is a seat");
    let mut talk = sixpack2::Talk::new(line.clone(), TalkTerms::of(&config.links[0]));
    sixpack2::find(&mut talk, &[1]).expect("it is there");
    let seat = motors_of(&config.controllers[0], terms.period).expect("it has motors");
    let homing = sixpack2::Homing { goes_on: &|| true, told: &mut |_| {} };
    sixpack2::home(&mut talk, seat, homing).expect("it finds its zero");
    line.lock().line.bus_mut().forget();
    line
}

impl SixHall<'_, '_> {
    /// Where its axes really are.
    fn mm(&self) -> Vec<f64> {
        let port = self.line.lock();
        port.line.bus().units()[0].motors[..3].iter().map(|motor| motor.shaft.place() / MM).collect()
    }

    /// That no axis left its stroke, lost a step, or was made to jump by more than its acceleration makes in a slice.
    fn assert_gentle(&self) {
        for motor in &self.line.lock().line.bus().units()[0].motors[..3] {
            let executed = motor.shaft.executed();
            let (low, high) = (executed.lowest / MM, executed.highest / MM);
            assert!(low > -0.06 && high < 150.06, "{low} to {high} mm");
            assert!(executed.velocity / MM < 245.0, "{} mm/s", executed.velocity / MM);
            assert!(executed.jump / MM < 32.0, "{} mm/s at once", executed.jump / MM);
            assert_eq!((executed.lost, motor.own_searches), (0.0, 0));
        }
    }

    /// That nothing moves any more.
    fn assert_rests(&mut self) {
        let places = self.mm();
        self.run(2.0, |_| {});
        assert_eq!(self.mm(), places);
    }
}

#[expect(clippy::print_stdout, reason = "the figure is for who asks to see it")]
#[test]
fn a_cue_is_executed_within_a_fifth_of_a_millimetre_its_lead_after_the_ticks() {
    hall(|hall, show, cue| {
        let lead = show.lanes[0].window.lead();
        let slot = *show.lanes[0].window.slots().first().expect("it has axes");
        hall.go(show);
        let (mut worst, mut rode) = (0.0_f64, false);
        let mut begun = None;
        hall.run(25.0, |hall| {
            if hall.runtime.live.ticks() == 1 && begun.is_none() {
                begun = Some(NOW.get());
            }
            let Some(begun) = begun else { return };
            let show_ns = hall.line.lock().now().since(begun).as_nanos() as i64 - lead.as_nanos() as i64;
            if !hall.state().may_send_motion() || show_ns <= 0 || show_ns >= cue.duration().as_nanos() {
                return;
            }
            // Between two loops of its unit a motor is where it was at the first.
            let at = |ns: i64| {
                let sample =
                    cue.sample(ShowTime::from_nanos(ns.max(0)), &mut crate::timeline::Hint::default());
                sample.iter().map(|place| slot.at_level(LEVEL).place(*place)).collect()
            };
            let (now, before): (Vec<f64>, Vec<f64>) = (at(show_ns), at(show_ns - 2_000_000));
            for (place, (now, before)) in hall.mm().into_iter().zip(now.into_iter().zip(before)) {
                rode |= now > 0.2;
                worst = worst.max(150.0 * now.min(before) - place).max(place - 150.0 * now.max(before));
            }
        });
        assert_eq!(hall.state(), State::Parked);
        println!("SIXpack 2, 56,818 baud, 3 axes, level {LEVEL}: at most {worst:.3} mm off the bench ride");
        assert!(rode && worst < 0.2, "{worst} mm");
        hall.assert_gentle();
        assert!(hall.mm().iter().all(|place| place.abs() < 0.05), "{:?}", hall.mm());
        assert!(hall.is_led());
    });
}

#[test]
fn a_stop_brakes_the_motors_at_once_and_no_pose_that_was_under_way_moves_them_on() {
    hall(|hall, show, _| {
        hall.go(show);
        hall.run(6.0, |_| {});
        let before = hall.mm();
        hall.run(0.1, |_| {});
        assert_ne!(hall.mm(), before, "it moves");
        hall.runtime.desk.stop();
        // 203 mm/s and 3000 mm/s²: at rest after 68 ms, and two slices and the lag of its motors.
        hall.run(0.35, |_| {});
        hall.assert_rests();
        assert_eq!(hall.state(), State::Stopped);
        let (reading, places) = (hall.reading().expect("it is read where it stands"), hall.mm());
        assert!(reading.rests && (150.0 * reading.pose[0] - places[0]).abs() < 0.1, "{reading:?} {places:?}");
        hall.assert_gentle();
        hall.assert_withdrawn();
    });
}

#[test]
fn a_seat_of_a_program_that_was_held_up_for_a_second_is_led_again_once_it_was_found() {
    for ms in [0, 3, 5, 8, 11] {
        hall(|hall, show, _| {
            hall.comes_back_after_a_second(show, Duration::from_millis(ms));
            hall.assert_gentle();
        });
    }
}

#[test]
fn a_line_that_is_cut_leaves_each_motor_at_its_last_target_and_puts_its_lane_out() {
    hall(|hall, show, _| {
        hall.go(show);
        hall.run(6.0, |_| {});
        hall.line.lock().is_gone = true;
        hall.run(0.6, |_| {});
        hall.assert_rests();
        assert!(!hall.is_led(), "no pose goes to it");
        hall.assert_gentle();
    });
}

#[test]
fn a_unit_that_is_silent_for_a_while_comes_back_where_it_stands() {
    hall(|hall, show, _| {
        hall.go(show);
        hall.run(6.0, |_| {});
        hall.line.lock().line.faults.unplugged = true;
        hall.run(1.0, |_| {});
        assert!(!hall.is_led());
        hall.assert_rests();
        hall.line.lock().line.faults.unplugged = false;
        let places = hall.mm();
        hall.run(40.0, |_| {});
        assert!(hall.is_led() && hall.mm() != places, "{:?}", hall.mm());
        hall.assert_gentle();
    });
}

#[test]
fn a_unit_that_is_restarted_in_a_play_stands_and_is_not_led_again_until_it_is_homed() {
    hall(|hall, show, _| {
        hall.go(show);
        hall.run(6.0, |_| {});
        let now = hall.line.lock().now();
        hall.line.lock().line.bus_mut().suffer(None, SixpackFault::Reset, now);
        hall.run(0.1, |_| {});
        hall.assert_rests();
        assert!(!hall.is_led());
        // By looks, of an operator or of the program, nothing changes.
        for _ in 0..3 {
            hall.run(1.0, |hall| hall.runtime.live.want(NOW.get()));
            let reading = hall.reading();
            assert!(!hall.is_led() && reading.is_none_or(|reading| reading.at < now), "{now:?} {reading:?}");
        }
        hall.assert_rests();
    });
}

/// Its counters read as those of this seat do: both are set by the same settings.
#[test]
fn a_port_that_comes_back_as_the_line_of_another_seat_moves_nobody_there() {
    let other = homed_line(&read(HALL), 1_002);
    hall(|hall, show, _| {
        hall.moves_nobody_on_another_line(show, &other, places);
    });
}

/// Its unit has the same number, and was homed with the same settings.
#[test]
fn a_seat_that_is_set_alike_at_the_end_of_a_line_that_was_exchanged_is_not_home() {
    let other = homed_line(&read_of_another(HALL), 1_001);
    hall_over(|line| Box::new(changed(line, &other)), |hall, _, _| hall.takes_no_other_seat(places));
}

fn places(bus: &SixpackBus) -> Vec<f64> {
    bus.units()[0].motors[..3].iter().map(|motor| motor.shaft.place()).collect()
}
