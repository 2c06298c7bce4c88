//! What comes twice, and what comes late.

use kinocue::harness::control::Command;

use crate::client::{Request, problem};
use crate::hall::Hall;

fn go() -> Request {
    Request::new("POST", "/api/v1/show/go")
}

#[test]
fn of_two_requests_with_one_key_the_second_does_nothing() {
    let hall = Hall::open();
    let keyed = |key: &str| go().header("Idempotency-Key", key);
    let first = keyed("a").send(&hall.socket());
    hall.socket().post("/api/v1/show/pause");
    let again = keyed("a").send(&hall.socket());
    assert_eq!(
        (again.status, &again.body),
        (200, &first.body),
        "the first reply, though the hall is elsewhere"
    );
    assert_eq!(again.header("content-type"), Some("application/json"));
    assert_eq!(hall.asks(), [Command::Go, Command::Pause]);
    keyed("b").send(&hall.socket());
    assert_eq!(hall.asks().len(), 3, "another key is another go");
    let other = Request::new("POST", "/api/v1/show/park").header("Idempotency-Key", "a");
    assert_eq!(other.send(&hall.socket()).problem(), problem(400, "value"));
    assert_eq!(keyed("a b").send(&hall.socket()).problem(), problem(400, "value"));
    assert_eq!(keyed(&"k".repeat(65)).send(&hall.socket()).problem(), problem(400, "value"));
}

#[test]
fn a_stop_is_done_each_time_whatever_key_comes_with_it() {
    let hall = Hall::open();
    go().header("Idempotency-Key", "b").send(&hall.socket());
    for key in ["a", "a", "b", "a b"] {
        let stop = Request::new("POST", "/api/v1/show/stop").header("Idempotency-Key", key);
        assert_eq!(stop.send(&hall.socket()).state(), "stopping", "{key}");
        assert!(hall.desk.take_stop(), "{key}: not the reply of before alone");
    }
}

#[test]
fn a_key_is_its_owners_and_a_refusal_is_repeated_too() {
    let hall = Hall::open();
    let resume = |token: &str| {
        let request = Request::new("POST", "/api/v1/show/resume").header("Idempotency-Key", "a").token(token);
        request.sent_ago(0).send(&hall.port()).problem()
    };
    for token in ["tablet-token", "tablet-token", "booth-token"] {
        assert_eq!(resume(token), problem(409, "state"));
    }
    assert_eq!(hall.asks().len(), 2);
}

#[test]
fn two_at_once_with_one_key_are_one() {
    let hall = Hall::open();
    let replies: Vec<_> = std::thread::scope(|scope| {
        let send = || go().header("Idempotency-Key", "a").send(&hall.socket()).body;
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(send)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(hall.asks(), [Command::Go]);
    assert!(replies.iter().all(|reply| *reply == replies[0]));
}

#[test]
fn a_go_that_is_old_or_from_the_future_does_nothing() {
    let hall = Hall::open();
    for ms in [2_500, 3_600_000, -2_500] {
        let reply = go().sent_ago(ms).send(&hall.socket());
        assert_eq!(reply.problem(), problem(409, "late"), "{ms}");
        assert!(reply.text().contains("the clocks differ"), "{}", reply.text());
    }
    assert_eq!(go().header("X-Kinocue-Sent", "soon").send(&hall.socket()).problem(), problem(400, "value"));
    assert!(hall.asks().is_empty());
    assert_eq!(go().sent_ago(1_000).send(&hall.socket()).state(), "joining");
}

#[test]
fn over_tcp_a_go_has_to_say_when_it_was_sent() {
    let hall = Hall::open();
    let go = go().token("tablet-token");
    for go in [go.clone(), go.clone().json(r#"{"from_s":1}"#)] {
        assert_eq!(go.send(&hall.port()).problem(), problem(400, "value"));
    }
    assert!(hall.asks().is_empty());
    assert_eq!(go.sent_ago(0).send(&hall.port()).state(), "joining");
}

#[test]
fn what_comes_late_and_moves_nothing_is_done_all_the_same() {
    let hall = Hall::open();
    for word in ["pause", "disarm", "stop"] {
        let request = Request::new("POST", &format!("/api/v1/show/{word}")).sent_ago(60_000);
        assert_eq!(request.send(&hall.socket()).status, 200, "{word}");
    }
    for word in ["home", "arm", "resume", "park", "clear"] {
        let request = Request::new("POST", &format!("/api/v1/show/{word}")).sent_ago(60_000);
        assert_eq!(request.send(&hall.socket()).problem(), problem(409, "late"), "{word}");
    }
}

#[test]
fn a_pause_that_a_busy_hall_does_not_take_is_refused_within_a_second_and_not_done_later() {
    let hall = Hall::open();
    hall.sleep();
    let reply = hall.socket().post("/api/v1/show/pause");
    assert_eq!(reply.problem(), problem(503, "timeout"));
    assert_eq!(reply.value()["why"], "not-taken");
    assert_eq!(hall.socket().post("/api/v1/show/stop").status, 200);
    assert!(hall.desk.take_stop());
    hall.wake();
    hall.socket().post("/api/v1/show/park");
    assert_eq!(hall.asks(), [Command::Stop, Command::Park]);
}
