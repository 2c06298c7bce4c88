//! Whole plays to virtual SilverMax units.

use super::*;

/// Plays the cue whole; how far an axis was beside it at the most, mm.
fn beside_a_ride(hall: &mut Hall<'_, '_>, show: StagedShow, cue: &Timeline) -> f64 {
    let lead = show.lanes[0].window.lead();
    hall.go(show);
    let (mut worst, mut rode) = (0.0_f64, false);
    let mut begun = None;
    hall.run(25.0, |hall| {
        // Frame 0 is reached a lead and a tick after it was sent.
        if hall.runtime.live.ticks() == 1 && begun.is_none() {
            begun = Some(NOW.get());
        }
        let Some(begun) = begun else { return };
        // The line is ahead of the ticks by up to an exchange.
        let show_ns = hall.line.lock().now().since(begun).as_nanos() as i64 - lead.as_nanos() as i64;
        let at = ShowTime::from_nanos(show_ns);
        if hall.state().may_send_motion() && show_ns > 0 && at < cue.duration() {
            let wanted = cue.sample(at, &mut crate::timeline::Hint::default());
            for (place, wanted) in hall.places_mm().iter().zip(wanted) {
                rode |= wanted > 0.5;
                worst = worst.max((place - 150.0 * wanted).abs());
            }
        }
    });
    assert!(rode && hall.state() == State::Parked, "{:?}", hall.state());
    worst
}

#[expect(clippy::print_stdout, reason = "the figures are for who asks to see them")]
#[test]
fn a_cue_is_executed_within_a_tenth_of_a_millimetre_at_a_serial_port_and_an_eighth_over_usb() {
    for (port, most_mm) in [("ttyS0", 0.1), ("ttyUSB0", 0.12)] {
        let text = HALL.replace("ttyUSB0", port);
        hall_of(
            &text,
            |line| Box::new(line),
            |hall, show, cue| {
                let worst = beside_a_ride(hall, show, cue);
                println!("SilverMax, 57,600 baud, 3 axes, {port}: at most {worst:.3} mm off the bench ride");
                assert!(worst < most_mm, "{port}: {worst} mm");
                assert_gentle(hall);
                for place in hall.places_mm() {
                    assert!(place.abs() < 0.02, "{port}: {place} mm off park");
                }
            },
        );
    }
}

#[test]
fn a_seat_that_is_pushed_a_little_at_rest_is_led_from_where_its_drives_hold_it() {
    for mm in [-0.95, 0.2, 0.6] {
        hall(|hall, show, cue| {
            hall.push(None, mm);
            let worst = beside_a_ride(hall, show, cue);
            // It is beside the cue by what it is pushed, no more, and begins without a jerk.
            assert!((worst - mm.abs()).abs() < 0.12, "{mm}: {worst} mm");
            for unit in hall.units(|unit| unit.executed().clone()) {
                assert!(unit.velocity < 241.0 * MM && unit.acceleration < 3_030.0 * MM, "{mm}: {unit:?}");
            }
            assert_eq!(hall.runtime.live.table()[0].standing, HealthState::Ok, "{mm}");
        });
    }
}

#[test]
fn a_seat_that_is_pushed_too_far_is_not_led_and_told_with_where_it_stands_until_it_is_let_go() {
    let text = HALL.replace("full = 20000 }\n", "full = 20000 }\nhold_error_mm = 3.0\n");
    hall_of(
        &text,
        |line| Box::new(line),
        |hall, show, _| {
            hall.push(Some(17), 2.0);
            hall.go(show);
            hall.run(5.0, |hall| hall.runtime.live.want(NOW.get()));
            let row = hall.runtime.live.table().swap_remove(0);
            let told = "its axis 2 stands at 2.0 mm, and its drive holds it at 0.0 mm: something pushes it";
            assert!(
                row.standing == HealthState::Lost && row.why.to_string().starts_with(told),
                "{}",
                row.why
            );
            assert!(row.why.next().is_some_and(|next| next.starts_with("free it")), "{row:?}");
            assert!(
                hall.units(|unit| unit.executed().velocity).iter().all(|speed| *speed == 0.0),
                "nobody led it"
            );
            hall.push(Some(17), 0.0);
            hall.run(15.0, |_| {});
            let row = hall.runtime.live.table().swap_remove(0);
            assert!(hall.is_led() && row.standing == HealthState::Ok, "{row:?}");
            assert_gentle(hall);
        },
    );
}

#[test]
fn a_stop_brakes_the_drives_at_once_and_no_pose_that_was_under_way_moves_them_on() {
    hall(|hall, show, _| {
        hall.go(show);
        hall.run(6.0, |_| {});
        assert!(hall.units(Unit::is_moving).contains(&true));
        hall.runtime.desk.stop();
        // 203 mm/s and 3000 mm/s²: at rest after 68 ms, and a tick and an exchange for each unit.
        hall.run(0.2, |_| {});
        let places = hall.places_mm();
        hall.run(2.0, |_| {});
        assert_eq!(hall.places_mm(), places);
        assert_eq!(hall.state(), State::Stopped);
        let reading = hall.reading().expect("it is read where it stands");
        assert!(reading.rests && (150.0 * reading.pose[0] - places[0]).abs() < 0.1, "{reading:?} {places:?}");
        assert_gentle(hall);
        hall.assert_withdrawn();
    });
}

/// The tick that takes it up, the exchange that is under way, and what an answer takes to begin.
#[expect(clippy::print_stdout, reason = "the figures are for who asks to see them")]
#[test]
fn a_stop_is_on_its_way_to_all_drives_within_a_tick_and_an_exchange() {
    let mut longest = Duration::ZERO;
    for phase in 0..8 {
        hall(|hall, show, _| {
            hall.go(show);
            hall.run(6.0, |_| {});
            hall.run(0.01 * f64::from(phase), |_| {});
            let (asked, sent) = (NOW.get(), hall.line.lock().sent.len());
            hall.runtime.desk.stop();
            hall.run(0.1, |_| {});
            let sent = hall.line.lock().sent.split_off(sent);
            let stop = sent.iter().find(|(_, octets)| octets.starts_with(b"@255 3 "));
            longest = longest.max(stop.expect("it is told to all").0.since(asked));
        });
    }
    let exchange = Duration::from_secs(52 * 11) / BAUD + Duration::from_millis(1);
    println!("{longest:?} of {:?}", Duration::from_millis(10) + exchange);
    assert!(longest <= Duration::from_millis(10) + exchange, "{longest:?}");
}

#[test]
fn a_seat_of_a_program_that_was_held_up_for_a_second_is_led_again_once_it_was_found() {
    for ms in [0, 3, 5, 8, 11] {
        hall(|hall, show, _| {
            hall.comes_back_after_a_second(show, Duration::from_millis(ms));
            assert_gentle(hall);
        });
    }
}

#[test]
fn a_line_that_is_cut_brings_the_seat_to_rest_within_the_lead_and_puts_its_lane_out() {
    hall(|hall, show, _| {
        let lead = show.lanes[0].window.lead();
        hall.go(show);
        hall.run(6.0, |_| {});
        hall.line.lock().is_gone = true;
        hall.run(lead.as_secs_f64() + 0.1, |_| {});
        let places = hall.places_mm();
        hall.run(1.0, |_| {});
        assert_eq!(hall.places_mm(), places);
        assert!(!hall.is_led(), "no pose goes to it");
        assert_gentle(hall);
    });
}

#[test]
fn a_port_that_comes_back_as_the_line_of_another_seat_moves_nobody_there() {
    let other = homed_line(&read(HALL), 9 << 16);
    hall(|hall, show, _| {
        let places = |bus: &SilverBus| bus.units().iter().map(Unit::place).collect();
        hall.moves_nobody_on_another_line(show, &other, places);
    });
}

/// Its units have the same numbers, and were homed with the same settings.
#[test]
fn a_seat_that_is_set_alike_at_the_end_of_a_line_that_was_exchanged_is_not_home() {
    let other = homed_line(&read_of_another(HALL), 7 << 16);
    hall_over(
        |line| Box::new(changed(line, &other)),
        |hall, _, _| hall.takes_no_other_seat(|bus| bus.units().iter().map(Unit::place).collect()),
    );
}
