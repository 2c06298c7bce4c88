//! The library over HTTP: lists, curves, uploads.

use std::fs;
use std::io::{Read as _, Write as _};

use crate::client::{Reply, Request, problem};
use crate::hall::Hall;

const CUE: &str = "# title: Calm\ntime_ms,a1\n0,0\n1000,0.01\n2000,0.02\n3000,0.01\n4000,0\n";
/// From one end of the stroke to the other in a tenth of a second.
const WILD: &str = "time_ms,a1\n0,0\n100,1\n200,0\n300,1\n400,0\n";

fn upload(id: &str, text: &str) -> Request {
    Request::new("PUT", &format!("/api/v1/cues/{id}")).header("Content-Type", "text/csv").body(text)
}

fn files(hall: &Hall) -> Vec<String> {
    let files = fs::read_dir(hall.dir.path().join("cues")).unwrap();
    let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.ends_with(".csv") || name.starts_with(".upload")).collect()
}

#[test]
fn a_cue_is_taken_in_when_it_is_proved_and_then_listed_and_drawn() {
    let hall = Hall::open();
    let reply = upload("calm", CUE).send(&hall.socket());
    assert_eq!(reply.status, 200, "{}", reply.text());
    assert_eq!(reply.value()["title"], "Calm");
    let list = hall.socket().get("/api/v1/cues").value();
    assert_eq!((list.as_array().unwrap().len(), &list[0]), (1, &reply.value()));
    assert_eq!(hall.socket().get("/api/v1/cues/calm").value(), list[0]);
    let curve = hall.socket().get("/api/v1/cues/calm/curve?points=50").value();
    assert_eq!(curve["t_s"].as_array().unwrap().len(), 50);
    for bad in ["?points=0", "?points=99999", "?points=x", "?dots=5"] {
        let path = format!("/api/v1/cues/calm/curve{bad}");
        assert_eq!(hall.socket().get(&path).problem(), problem(400, "value"), "{bad}");
    }
}

#[test]
fn a_cue_that_does_not_pass_is_refused_with_its_faults_and_leaves_nothing() {
    let hall = Hall::open();
    let reply = upload("wild", WILD).send(&hall.socket());
    assert_eq!(reply.problem(), problem(422, "cue"), "its curve leaves the stroke");
    assert!(!reply.value()["faults"].as_array().unwrap().is_empty());
    let reply = upload("broken", "time_ms,a1\n0,0\n100,7\n200,8\n").send(&hall.socket());
    assert_eq!(reply.problem(), problem(422, "cue"));
    assert_eq!(reply.value()["faults"].as_array().unwrap().len(), 2, "{}", reply.text());
    let reply = upload("fast", "# interpolation: linear\ntime_ms,a1\n0,0.2\n100,0.6\n2000,0.2\n")
        .send(&hall.socket());
    assert_eq!(reply.problem(), problem(422, "check"), "it breaks limits alone");
    assert!(files(&hall).is_empty());
}

#[test]
fn an_upload_that_is_too_long_or_cut_short_leaves_nothing() {
    let hall = Hall::open();
    let long = format!("{CUE}{}", "# \n".repeat(50_000));
    assert_eq!(upload("calm", &long).send(&hall.socket()).problem(), problem(413, "size"));
    let mut connection = hall.socket().connect();
    let head = "PUT /api/v1/cues/calm HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
                Transfer-Encoding: chunked\r\n\r\n";
    connection.write_all(head.as_bytes()).unwrap();
    let _ = connection.write_all(format!("{:x}\r\n{long}\r\n0\r\n\r\n", long.len()).as_bytes());
    assert_eq!(Reply::read(&mut *connection).problem(), problem(413, "size"), "while it streams, too");
    let mut connection = hall.socket().connect();
    connection.write_all(head.as_bytes()).unwrap();
    connection.write_all(b"5\r\ntime_\r\nnonsense\r\n").unwrap();
    assert_eq!(Reply::read(&mut *connection).status, 400);
    assert!(files(&hall).is_empty());
}

#[test]
fn what_was_asked_by_someone_who_has_gone_away_is_not_worked_at_any_longer() {
    // Opened by both, the pipe says that the check has begun; it ends with the check, which else would write to it.
    let mut hall = Hall::with_checks_by("exec 3>\"${0%/*}/work\"; sleep 10 3>&-; echo done >&3");
    let pipe = hall.dir.path().join("work");
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
    let asks = [upload("calm", CUE), Request::new("GET", "/api/v1/cues/there/curve?points=10")];
    fs::write(hall.dir.path().join("cues/there.csv"), CUE).unwrap();
    for ask in asks {
        let mut connection = hall.socket().connect();
        connection.write_all(&ask.bytes(&hall.socket())).unwrap();
        let mut at_work = fs::File::open(&pipe).unwrap();
        drop(connection);
        assert_eq!(at_work.read(&mut [0]).unwrap(), 0, "it was not ended");
    }
    hall.close(); // a check has ended before its upload is taken away
    assert_eq!(files(&hall), ["there.csv"]);
}

#[test]
fn only_an_engineer_changes_the_library_and_no_form_does() {
    let hall = Hall::open();
    let by = |token: &str| upload("calm", CUE).token(token).send(&hall.port());
    assert_eq!(by("tablet-token").problem(), problem(403, "role"));
    assert_eq!(by("booth-token").status, 200);
    let form = Request::new("PUT", "/api/v1/cues/calm").header("Content-Type", "text/plain; x").body(CUE);
    assert_eq!(form.send(&hall.socket()).problem(), problem(415, "media"));
}

#[test]
fn names_are_ids_and_never_paths() {
    let hall = Hall::open();
    for id in ["..%2fhall", "%2e%2e", "Calm", "calm.csv", &"a".repeat(65)] {
        let path = format!("/api/v1/cues/{id}");
        assert_eq!(hall.socket().get(&path).problem(), problem(400, "value"), "{id}");
        assert_eq!(upload(id, CUE).send(&hall.socket()).problem(), problem(400, "value"), "{id}");
    }
    assert_eq!(hall.socket().get("/api/v1/cues/none").problem(), problem(404, "unknown"));
    assert_eq!(hall.socket().get("/api/v1/cues/none/curve").problem(), problem(404, "unknown"));
    assert!(files(&hall).is_empty());
}

#[test]
fn playlists_and_reports_are_read_where_they_lie() {
    let hall = Hall::open();
    assert_eq!(hall.socket().get("/api/v1/playlists").value(), serde_json::json!([]));
    let report = hall.socket().get("/api/v1/reports/2026-01-31");
    assert!(report.status == 200 || report.problem() == problem(500, "file"), "{}", report.text());
}

#[test]
fn reports_of_a_great_day_are_bounded_whole_and_made_in_turn() {
    let hall = Hall::open();
    let dir = hall.dir.path().join("journal");
    fs::create_dir_all(&dir).unwrap();
    let action = |n: usize| {
        let what = "x".repeat(6_000);
        let at = "2026-01-31T10:00:00.000+00:00";
        format!(
            "{{\"kind\":\"action\",\"at\":\"{at}\",\"who\":\"eve {n}\",\"what\":\"{what}\",\"result\":\"no\",\"state\":\"parked\"}}\n"
        )
    };
    let text: String = (0..300).map(action).collect();
    for file in 0..18 {
        fs::write(dir.join(format!("kinocue-2026-01-31-{file:03}.jsonl")), &text).unwrap();
    }
    // One that is not read to its end keeps the others waiting for a while at the most.
    let mut slow = hall.socket().connect();
    slow.write_all(&Request::new("GET", "/api/v1/reports/2026-01-31").bytes(&hall.socket())).unwrap();
    drop(slow);
    let report = hall.socket().get("/api/v1/reports/2026-01-31");
    assert_eq!(report.status, 200, "{}", report.text());
    assert_eq!(report.header("content-type"), Some("application/json"));
    assert!(report.body.len() < 5_000 * 600, "{} bytes", report.body.len());
    let report: serde_json::Value = serde_json::from_slice(&unchunked(&report.body)).unwrap();
    assert_eq!(report["actions"].as_array().unwrap().len(), 5_000);
    assert_eq!(report["notes"][0], "400 earlier commands are left out; `kinocue report` has them");
}

/// What is in the chunks of a body.
fn unchunked(mut body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    loop {
        let end = body.windows(2).position(|two| two == b"\r\n").unwrap();
        let length = usize::from_str_radix(std::str::from_utf8(&body[..end]).unwrap(), 16).unwrap();
        if length == 0 {
            return bytes;
        }
        bytes.extend_from_slice(&body[end + 2..end + 2 + length]);
        body = &body[end + 4 + length..];
    }
}
