//! What is answered by somebody else, wrongly, or with an error.

use kinocue::wire::ReplyCode;

use crate::forger::{FORGED, acks, done, told};
use crate::hall::{Hall, all, count, health, plays_on, warning};

#[test]
fn a_datagram_with_a_wrong_checksum_counts_as_nothing_at_either_end_and_with_the_right_one_as_what_it_says() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    let before = hall.status();
    done(acks(&hall.far, ReplyCode::EmergencyStop, "+0", "wrong", 50));
    let after = hall.lives_on(100);
    assert!(after["state"] == "playing" && (0..2).all(|seat| plays_on(&after, seat)), "{after}");
    assert!(warning(&after, "another-master", Some(1)).is_none(), "{after}");
    assert!(count(&after, 1, "acked") > count(&before, 1, "acked"), "{after}");

    hall.happens(1, "mute=1");
    done(acks(&hall.far, ReplyCode::EmergencyStop, "+0", "right", 1));
    hall.happens(1, "mute=0");
    let stopped = hall.comes_to("stopped");
    assert!(stopped["cause"].as_str().is_some_and(|cause| cause.contains("A2: emergency stop")), "{stopped}");
    hall.lives_on(50);
    let rest = hall.status();
    assert_eq!(count(&rest, 0, "sent"), count(&hall.lives_on(50), 0, "sent"), "nothing moves by itself");
    // The controller itself, asked, knows of no emergency stop.
    hall.wait(|status| status["next"].as_str().is_some_and(|next| next.starts_with("clear")));
    hall.done(&["clear"]);
    hall.wait(|status| status["next"] == "park, or home");
    hall.comes_down();

    done(told(&hall.show, "frame wrong"));
    done(told(&hall.show, "frame right"));
    hall.lives_on(50);
    let [_, rows] = hall.ends(true);
    let led: Vec<u32> = rows.iter().map(|row| row.frame).filter(|frame| *frame >= FORGED).collect();
    assert_eq!(led, [FORGED + 1], "of the two frames that were forged");
}

#[test]
fn acks_of_frames_that_were_never_sent_tell_of_another_machine_and_the_show_goes_on() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    done(acks(&hall.far, ReplyCode::Running, "+100000", "right", 40));
    let told = hall.wait(|status| warning(status, "another-master", Some(1)).is_some());
    assert!(told["state"] == "playing" && (0..2).all(|seat| plays_on(&told, seat)), "{told}");
    hall.comes_down();
    hall.ends(true);
}

#[test]
fn no_forged_ack_brings_back_a_seat_that_does_not_answer() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    hall.happens(1, "mute=1");
    hall.wait(|status| health(status, 1) == "lost" && plays_on(status, 0));
    let lost = hall.lives_on(20);
    // Of frames that were sent, and of those that would be next.
    let about = count(&lost, 1, "sent") - 8;
    let forger = acks(&hall.far, ReplyCode::Running, &format!("={about}"), "right", 15);
    let until = lost["ticks"].as_u64().expect("a count") + 400;
    let later = hall.wait(|status| {
        assert_eq!(health(status, 1), "lost", "{status}");
        status["ticks"].as_u64() >= Some(until)
    });
    done(forger);
    assert_eq!(count(&later, 1, "sent"), count(&lost, 1, "sent"), "{later}");
    hall.happens(1, "mute=0");
    hall.wait(|status| status["state"] == "playing" && all(status, "ok"));
    hall.comes_down();
    hall.ends(true);
}

#[test]
fn a_second_controller_with_the_address_of_the_first_is_out_in_mid_show_as_one_that_has_restarted() {
    let Some(hall) = Hall::open() else { return };
    let other = hall.show.beside();
    hall.far.run(&format!(
        "ip link add hub type bridge\nip link add port type veth peer name other\nip link set other netns {}\n\
         ip address flush dev far\nip link set far master hub\nip link set port master hub\nip link set port up\nip link set hub up\n\
         ip address add 10.77.0.2/24 dev hub\nip address add 10.77.0.3/24 dev hub",
        other.pid()
    ));
    hall.wait(|status| all(status, "ok"));
    hall.rides();
    other.run("ip link set other address 02:00:00:00:00:77\nip link set other up\nip address add 10.77.0.3/24 dev other");
    let second = hall.simulate(&other, 1, "other");
    // As if its answer to ARP had come last.
    hall.show.run("ip neighbour replace 10.77.0.3 lladdr 02:00:00:00:00:77 dev show nud permanent");
    let out = hall.wait(|status| health(status, 1) == "excluded" && plays_on(status, 0));
    let (text, remedy) = warning(&out, "controller-excluded", Some(1)).expect("it is told");
    assert!(
        text.contains("it has rebooted") && remedy.contains("home it with nobody on the seat"),
        "{text}; {remedy}"
    );
    let out = hall.lives_on(20);
    let later = hall.lives_on(100);
    assert!(later["state"] == "playing" && count(&later, 1, "sent") == count(&out, 1, "sent"), "{later}");
    hall.done(&["park"]);
    hall.comes_to("parked");
    second.end();
    println!("{} frames went to the second controller", hall.frames("other").len());
    hall.ends(false);
}

#[test]
fn a_controller_that_overflows_in_mid_show_is_out_in_words_and_the_other_plays_on() {
    let Some(hall) = Hall::open() else { return };
    for (error, words) in [(17, "play time is too long"), (20, "UDP memory overflow"), (21, "needs a reset")]
    {
        hall.rides();
        hall.happens(1, &format!("err={error}"));
        let out = hall.wait(|status| health(status, 1) == "error" && plays_on(status, 0));
        let (text, remedy) = warning(&out, "controller-error", Some(1)).expect("it is told");
        assert!(text.contains(&format!("Err{error}: ")) && text.contains(words), "{text}");
        assert!(remedy.contains("at the controller"), "{remedy}");
        // What was sent is told a while later where the machine is busy.
        let out = hall.lives_on(100);
        let later = hall.lives_on(50);
        assert!(later["state"] == "playing" && count(&later, 1, "sent") == count(&out, 1, "sent"), "{later}");
        hall.happens(1, "err=0");
        assert_eq!(health(&hall.lives_on(50), 1), "error", "a person clears it");
        hall.comes_down();
    }
    hall.ends(true);
}
