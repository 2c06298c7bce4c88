//! What befalls cables, addresses and routes.

use serde_json::Value;

use crate::forger::page;
use crate::hall::{Hall, MISSED, all, count, health, plays_on, warning};

/// A seat is out, and said to be; the hall plays, and says so if nobody is left.
fn is_missed(status: &Value, seat: usize) -> bool {
    status["state"] == "playing"
        && warning(status, "controller-lost", Some(seat)).is_some_and(|(text, remedy)| {
            text == MISSED && remedy.contains("power and its cable") && remedy.contains("rejoins by itself")
        })
}

/// Waits until the second seat is out while the first plays on, and lets that be for a while.
fn second_alone_is_missed(hall: &Hall) {
    hall.wait(|status| is_missed(status, 1) && plays_on(status, 0));
    let missed = hall.lives_on(20);
    let later = hall.lives_on(100);
    assert!(count(&later, 0, "acked") > count(&missed, 0, "acked") && health(&later, 1) == "lost", "{later}");
    assert_eq!(count(&later, 1, "sent"), count(&missed, 1, "sent"), "nothing goes to it any more: {later}");
}

/// Waits until both play again.
fn both_play(hall: &Hall) -> Value {
    hall.wait(|status| status["state"] == "playing" && all(status, "ok"))
}

#[test]
fn a_link_too_slow_for_the_frames_brings_the_seats_to_rest_and_cleared_they_come_down() {
    let Some(hall) = Hall::open() else { return };
    for (machine, port) in [(&hall.show, "show"), (&hall.far, "far")] {
        hall.rides();
        machine.run(&format!("tc qdisc add dev {port} root tbf rate 64kbit burst 1600 latency 400ms"));
        hall.wait(|status| (0..2).all(|seat| ["lost", "error"].contains(&health(status, seat))));
        let slow = hall.lives_on(150);
        assert_eq!(slow["state"], "playing");
        // Whoever is out is told of, however it goes on.
        hall.wait(|status| {
            (0..2).all(|seat| !plays_on(status, seat) && health(status, seat) != "rejoining")
                && warning(status, "no-seat", None).is_some()
        });
        machine.run(&format!("tc qdisc delete dev {port} root"));
        hall.wait(|status| (0..2).all(|seat| ["ok", "error"].contains(&health(status, seat))));
        hall.comes_down();
    }
    hall.ends(true);
}

#[test]
fn a_port_of_this_machine_that_is_down_for_half_a_second_makes_the_seats_rest_and_rejoin() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    hall.show.run("ip link set show down");
    let missed = hall.wait(|status| (0..2).all(|seat| is_missed(status, seat)));
    assert!(warning(&missed, "no-seat", None).is_some(), "{missed}");
    hall.lives_on(50);
    hall.show.run("ip link set show up");
    let back = both_play(&hall);
    assert!((0..2).all(|seat| count(&back, seat, "send_failed") > 0), "{back}");
    hall.comes_down();
    hall.ends(true);
}

#[test]
fn what_waited_for_a_cable_that_was_out_leads_no_seat_in_a_leap() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    hall.far.run("ip link set far down");
    hall.wait(|status| (0..2).all(|seat| is_missed(status, seat)));
    hall.lives_on(120);
    hall.far.run("ip link set far up");
    both_play(&hall);
    hall.comes_down();
    let waited = hall.ends(true).map(|rows| {
        let out = rows.windows(2).position(|pair| pair[1].at_s - pair[0].at_s > 0.5).expect("it was out");
        // Those that were sent before it was read anew come without a gap in their numbers.
        let old = rows[out..].windows(2).take_while(|pair| pair[1].frame == pair[0].frame.wrapping_add(1));
        old.count()
    });
    println!("frames that waited: {waited:?}");
}

#[test]
fn an_address_of_this_machine_that_goes_in_a_show_makes_the_seats_rest_and_the_console_still_answers() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    hall.show.run("ip address delete 10.77.0.1/24 dev show");
    hall.wait(|status| (0..2).all(|seat| is_missed(status, seat)));
    assert!(page(&hall.show).starts_with("HTTP/1.1 200"), "the console");
    hall.lives_on(50);
    hall.show.run("ip address add 10.77.0.1/24 dev show");
    both_play(&hall);
    hall.comes_down();
    hall.ends(true);
}

#[test]
fn a_machine_that_cannot_send_while_nothing_moves_says_that_its_seats_are_lost() {
    let Some(hall) = Hall::open() else { return };
    for (goes, comes) in [
        ("ip address delete 10.77.0.1/24 dev show", "ip address add 10.77.0.1/24 dev show"),
        ("ip link set show down", "ip link set show up"),
    ] {
        hall.wait(|status| all(status, "ok"));
        hall.show.run(goes);
        let lost = hall.wait(|status| all(status, "lost"));
        assert_eq!(lost["state"], "parked", "{goes}");
        let (text, _) = warning(&lost, "controller-lost", Some(1)).expect("it is told");
        assert!(text.contains("no ack and no report for too long"), "{text}");
        let refused = hall.run(&["preflight"]);
        let told = "check the cable and this machine's address";
        assert!(refused.code == Some(1) && refused.stdout.contains(told), "{goes}: {refused:?}");
        hall.show.run(comes);
    }
    hall.wait(|status| all(status, "ok"));
    hall.play("ride");
    hall.wait(|status| status["state"] == "parked" && all(status, "ok"));
    hall.ends(true);
}

#[test]
fn frames_that_this_machine_forbids_itself_are_a_finding_of_preflight_that_says_so() {
    let Some(hall) = Hall::open() else { return };
    hall.show.run("ip route add prohibit 10.77.0.3");
    let refused = hall.run(&["preflight"]);
    let told = "a firewall of this machine blocks it";
    assert!(refused.code == Some(1) && refused.stdout.contains(told), "{refused:?}");
    hall.show.run("ip route delete prohibit 10.77.0.3");
    hall.done(&["preflight"]);
    hall.ends(true);
}

#[test]
fn a_controller_that_answers_not_even_arp_costs_the_other_no_frame() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    hall.far.run("ip address delete 10.77.0.3/24 dev far");
    hall.show.run("ip neighbour flush all");
    second_alone_is_missed(&hall);
    let alone = hall.status();
    assert_eq!((count(&alone, 0, "send_failed"), count(&alone, 0, "lost")), (0, 0), "{alone}");
    hall.far.run("ip address add 10.77.0.3/24 dev far");
    both_play(&hall);
    hall.comes_down();
    hall.ends(true);
}

#[test]
fn a_controller_whose_port_closes_in_mid_show_and_opens_again_has_rebooted_and_is_homed_first() {
    let Some(mut hall) = Hall::open() else { return };
    hall.rides();
    hall.switch_off(1);
    second_alone_is_missed(&hall);
    let before = count(&hall.status(), 1, "sent");
    hall.switch_on(1);
    let out = hall.wait(|status| health(status, 1) == "excluded" && plays_on(status, 0));
    let (text, remedy) = warning(&out, "controller-excluded", Some(1)).expect("it is told");
    assert!(
        text.contains("it has rebooted") && remedy.contains("home it with nobody on the seat"),
        "{text}; {remedy}"
    );
    assert_eq!(count(&hall.lives_on(100), 1, "sent"), before, "no motion goes to it");
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.done(&["home", "--seats-empty"]);
    hall.wait(|status| status["state"] == "parked" && all(status, "ok"));
    hall.play("ride");
    hall.wait(|status| status["state"] == "parked" && all(status, "ok"));
    hall.ends(true);
}

#[test]
fn frames_that_this_machine_forbids_itself_make_the_seat_rest_and_the_other_play_on() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    hall.show.run("ip route add prohibit 10.77.0.3");
    second_alone_is_missed(&hall);
    assert!(count(&hall.status(), 1, "send_failed") > 0);
    hall.show.run("ip route delete prohibit 10.77.0.3");
    both_play(&hall);
    hall.comes_down();
    hall.ends(true);
}

#[test]
fn frames_to_a_wrong_hardware_address_are_silence_and_the_right_one_ends_it() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    hall.show.run("ip neighbour replace 10.77.0.3 lladdr 02:00:00:00:00:99 dev show nud permanent");
    second_alone_is_missed(&hall);
    assert_eq!(count(&hall.status(), 1, "send_failed"), 0, "nothing tells this machine");
    hall.show.run("ip neighbour delete 10.77.0.3 dev show");
    both_play(&hall);
    hall.comes_down();
    hall.ends(true);
}

#[test]
fn packets_that_become_too_small_in_mid_show_leave_the_seats_at_rest_and_are_named_by_preflight() {
    let Some(hall) = Hall::open_with(6, &[]) else { return };
    hall.rides();
    hall.show.run("ip link set show mtu 68");
    // Short answers still come: it rejoins, and falls out again, until that is enough.
    let out = hall.wait(|status| all(status, "error"));
    assert_eq!(out["state"], "playing");
    let (text, remedy) = warning(&out, "controller-error", Some(0)).expect("it is told");
    assert!(
        text.contains("three times within a minute") && !remedy.contains("at the controller"),
        "{text}; {remedy}"
    );
    assert!(warning(&out, "no-seat", None).is_some(), "{out}");
    hall.done(&["park"]);
    hall.comes_to("parked");
    let refused = hall.run(&["preflight"]);
    let told = "the interface takes packets of 68 bytes, but 108 are sent";
    assert!(refused.code == Some(1) && refused.stdout.contains(told), "{refused:?}");
    hall.show.run("ip link set show mtu 1500");
    hall.comes_down();
    hall.ends(true);
}
