use super::*;
use crate::film::point::FilmState;
use crate::film::tracker::{SourceKind, SourceTracker};
use crate::harness::shown::{Luck, TrueFilm, mono};

/// What a client makes of lines that come at 1 s.
fn told(client: &mut MpvClient, lines: &str) -> Vec<FilmWord> {
    let mut words = Vec::new();
    client.hear(lines.as_bytes(), mono(1.0), &mut |told| words.push(told.word));
    words
}

fn client() -> MpvClient {
    MpvClient::new(mono(0.0))
}

fn changed(name: &str, data: &str) -> String {
    format!("{{\"event\":\"property-change\",\"id\":3,\"name\":\"{name}\",\"data\":{data}}}\n")
}

#[test]
fn a_position_is_true_half_way_between_question_and_answer() {
    let mut client = client();
    let line = client.poll(mono(1.0)).expect("it is due");
    assert_eq!(line, "{\"command\":[\"get_property\",\"audio-pts\"],\"request_id\":1}\n");
    assert_eq!(client.poll(mono(1.05)), None, "one at a time");
    let mut heard = Vec::new();
    let reply = b"{\"data\":83.25,\"request_id\":1,\"error\":\"success\"}\n";
    client.hear(reply, mono(1.06), &mut |told| heard.push(told));
    let word = FilmWord::Position(ShowTime::from_millis(83_250));
    assert_eq!(heard, [Observation { at: mono(1.03), bound: Duration::from_millis(30), word }]);
    client.hear(reply, mono(1.07), &mut |told| heard.push(told));
    assert_eq!(heard.len(), 1, "nobody asked any more");
}

#[test]
fn a_player_that_does_not_answer_is_asked_again_and_its_old_answers_say_nothing() {
    let mut client = client();
    client.poll(mono(1.0)).expect("it is due");
    assert_eq!(client.poll(mono(1.2)), None);
    assert_eq!(client.next_at(), mono(1.25));
    assert!(client.poll(mono(1.25)).is_some_and(|line| line.contains("\"request_id\":2")));
    assert_eq!(told(&mut client, "{\"data\":1,\"request_id\":1,\"error\":\"success\"}\n"), []);
}

#[test]
fn without_sound_the_picture_counts_less_the_frame_that_it_is_early() {
    let mut client = client();
    let at_10_s = changed("time-pos", "10.0");
    assert_eq!(told(&mut client, &at_10_s), [], "the sound is better");
    client.poll(mono(0.9)).expect("it is due");
    assert_eq!(told(&mut client, "{\"request_id\":1,\"error\":\"property unavailable\"}\n"), []);
    assert_eq!(client.rate(), Some(FrameRate::F24));
    let shown = |ms| [FilmWord::Position(ShowTime::from_millis(ms))];
    told(&mut client, &changed("container-fps", "25"));
    assert_eq!(told(&mut client, &at_10_s), shown(9_960));
    assert_eq!(told(&mut client, &changed("time-pos", "null")), []);
}

/// What a client that asks makes of the answer, or of none, at an instant.
fn answered(client: &mut MpvClient, at_s: f64, media_s: Option<f64>) -> Vec<FilmWord> {
    let line = client.poll(mono(at_s)).expect("it is due");
    let asked: Value = serde_json::from_str(&line).expect("JSON");
    let error = if media_s.is_some() { "success" } else { "property unavailable" };
    let answer = json!({ "request_id": asked["request_id"], "data": media_s, "error": error });
    let mut words = Vec::new();
    client.hear(format!("{answer}\n").as_bytes(), mono(at_s), &mut |told| words.push(told.word));
    words
}

#[test]
fn after_a_seek_the_sound_is_waited_for_while_the_picture_runs_beside_it_and_a_film_that_stands_shows_its_picture()
 {
    let mut client = client();
    let at = |media_s| [FilmWord::Position(ShowTime::from_secs_f64(media_s))];
    assert_eq!(answered(&mut client, 0.9, Some(10.0)), at(10.0));
    told(&mut client, "{\"event\":\"seek\"}\n");
    let picture = changed("time-pos", "60.041666667");
    assert_eq!(told(&mut client, "{\"event\":\"playback-restart\"}\n"), [FilmWord::Landed]);
    for ms in (0..300_u32).step_by(10) {
        assert_eq!(answered(&mut client, 1.0 + f64::from(ms) * 1e-3, None), [], "{ms} ms after it landed");
        assert_eq!(told(&mut client, &picture), [], "{ms} ms after it landed");
    }
    assert_eq!(answered(&mut client, 1.3, Some(60.33)), at(60.33));
    told(&mut client, &changed("pause", "true"));
    told(&mut client, "{\"event\":\"seek\"}\n");
    assert_eq!(answered(&mut client, 2.0, None), []);
    assert_eq!(told(&mut client, &picture).len(), 1);
}

#[test]
fn what_was_asked_before_a_seek_is_no_answer_after_it_and_the_next_answers_come_soon() {
    let mut client = client();
    client.poll(mono(0.9)).expect("it is due");
    told(&mut client, "{\"event\":\"seek\"}\n{\"event\":\"playback-restart\"}\n");
    assert_eq!(told(&mut client, "{\"data\":83.25,\"request_id\":1,\"error\":\"success\"}\n"), []);
    assert_eq!(answered(&mut client, 1.0, Some(60.0)).len(), 1, "and it is asked again at once");
    let soon = (0..3).map(|_| {
        let due = client.next_at().since(mono(0.0)).as_secs_f64();
        answered(&mut client, due, Some(due)).len()
    });
    assert_eq!(soon.sum::<usize>(), 3);
    assert!(
        client.next_at() <= mono(1.02),
        "four answers, which seats wait for, take no longer than a tick or two"
    );
}

#[test]
fn pause_speed_seek_and_end_are_told_as_they_come() {
    let mut client = client();
    assert_eq!(told(&mut client, &changed("pause", "false")), [FilmWord::Play]);
    assert_eq!(told(&mut client, &changed("pause", "true")), [FilmWord::Stop]);
    assert_eq!(told(&mut client, &changed("core-idle", "true")), [], "it stands already");
    assert_eq!(
        told(&mut client, &(changed("core-idle", "false") + &changed("pause", "false"))),
        [FilmWord::Play]
    );
    assert_eq!(told(&mut client, &changed("speed", "1.001")), [FilmWord::Speed(1.001)]);
    assert_eq!(told(&mut client, &changed("core-idle", "true")), [FilmWord::Stop], "its buffer is dry");
    assert_eq!(told(&mut client, &changed("core-idle", "false")), [FilmWord::Play]);
    let seek = "{\"event\":\"seek\"}\n".to_owned() + &changed("core-idle", "true");
    assert_eq!(told(&mut client, &seek), [FilmWord::Seek]);
    assert_eq!(told(&mut client, "{\"event\":\"playback-restart\"}\n"), [FilmWord::Landed]);
    told(&mut client, &changed("core-idle", "false"));
    assert_eq!(told(&mut client, &changed("eof-reached", "true")), [FilmWord::End]);
    assert_eq!(told(&mut client, "{\"event\":\"end-file\",\"reason\":\"eof\"}\n"), [FilmWord::End]);
    assert_eq!(told(&mut client, "{\"event\":\"end-file\",\"reason\":\"quit\"}\n"), [FilmWord::Stop]);
    let next = "{\"event\":\"start-file\"}\n{\"event\":\"file-loaded\"}\n{\"event\":\"playback-restart\"}\n";
    assert_eq!(told(&mut client, next), [FilmWord::Seek, FilmWord::Landed, FilmWord::Play]);
    assert_eq!(told(&mut client, "{\"event\":\"shutdown\"}\n"), [FilmWord::Gone]);
    told(&mut client, &changed("path", "\"/films/one \\u00e9.mkv\""));
    assert_eq!(client.path(), Some("/films/one é.mkv"));
}

#[test]
fn lines_may_come_in_pieces_or_together_and_what_is_too_long_is_left_out() {
    let mut client = client();
    let line = changed("pause", "true");
    for byte in line.as_bytes() {
        let mut words = Vec::new();
        client.hear(&[*byte], mono(1.0), &mut |told| words.push(told.word));
        assert_eq!(words.is_empty(), *byte != b'\n');
    }
    let long = format!("{{\"event\":\"{}\"}}\n", "x".repeat(1_000_000));
    let both = long + &changed("pause", "false");
    assert_eq!(told(&mut client, &both), [FilmWord::Play]);
    let endless = "y".repeat(100_000);
    (0..20).for_each(|_| drop(told(&mut client, &endless)));
    assert!(client.line.capacity() <= 2 * LONGEST_LINE, "{}", client.line.capacity());
    assert_eq!(told(&mut client, &("\n".to_owned() + &changed("pause", "true"))), [FilmWord::Stop]);
    assert_eq!(client.garbage(), 2);
}

#[test]
fn the_greeting_observes_what_is_understood() {
    let greeting = MpvClient::greeting();
    assert_eq!(greeting.lines().count(), OBSERVED.len());
    assert!(greeting.starts_with("{\"command\":[\"observe_property\",0,\"pause\"]}\n"));
}

#[test]
fn no_line_makes_the_client_panic() {
    let mut luck = Luck::new(6);
    let pieces = [
        "{",
        "}",
        "[",
        "\"event\":",
        "\"data\":",
        "\"name\":",
        "\"request_id\":",
        "\"error\":\"success\"",
        "\"seek\"",
        "\"property-change\"",
        "\"pause\"",
        "\"time-pos\"",
        ",",
        "1e999",
        "-5",
        "null",
        "true",
        "\n",
        "\u{fffd}",
        "\\",
    ];
    let mut client = client();
    for n in 0..3_000 {
        let line: String = (0..luck.below(12)).map(|_| pieces[luck.below(pieces.len())]).collect();
        client.poll(mono(f64::from(n) * 0.02));
        client.hear(line.as_bytes(), mono(f64::from(n) * 0.02), &mut |_| ());
    }
    told(&mut client, &("\n".to_owned() + &"[".repeat(60_000) + "\n"));
}

/// Its clock moves by 21 ms, and is asked each 5 ms at first: three answers and more are the same.
#[test]
fn a_player_whose_clock_moves_by_the_periods_of_its_sound_runs_and_stands_only_where_it_does() {
    let film = TrueFilm::new(60.0, 1.0).rate_from(10.0, 0.0).rate_from(20.0, 1.0).rate_from(25.0, 0.0);
    let mut client = client();
    let mut tracker = SourceTracker::new(SourceKind::Mpv, 0.0015, mono(0.0));
    for n in 0..5_200_u32 {
        let t = f64::from(n) * 0.005;
        // It is started, paused and started again; that it stands in the end it does not say.
        let word = match n {
            0 | 4_000 => changed("pause", "false"),
            2_000 => changed("pause", "true"),
            _ => String::new(),
        };
        client.hear(word.as_bytes(), mono(t), &mut |told| tracker.hear(&told));
        if let Some(line) = client.poll(mono(t)) {
            let asked: Value = serde_json::from_str(&line).expect("JSON");
            let heard_s = (film.media_s(t) / 0.021).floor() * 0.021;
            let answer = json!({ "request_id": asked["request_id"], "data": heard_s, "error": "success" });
            let answer = format!("{answer}\n");
            client.hear(answer.as_bytes(), mono(t + 0.000_3), &mut |told| tracker.hear(&told));
        }
        let stands = tracker.state() == FilmState::Stopped;
        assert!(!stands || (2_000..4_000).contains(&n) || n >= 5_000, "at {t} s");
        assert!(stands || n < 5_050, "at {t} s: {:?}", tracker.state());
    }
}

/// A player that answers within a millisecond, and now and then much later.
#[test]
fn the_film_of_a_player_is_known_within_half_a_millisecond_and_its_pause_at_once() {
    let film = TrueFilm::new(60.0, 1.0003).rate_from(30.0, 0.0);
    let (mut client, mut luck) = (client(), Luck::new(14));
    let mut tracker = SourceTracker::new(SourceKind::Mpv, 0.0015, mono(0.0));
    let mut worst = 0.0_f64;
    let mut t = 0.0;
    while t < 29.9 {
        t += 0.005;
        let Some(line) = client.poll(mono(t)) else { continue };
        let id = line
            .split("\"request_id\":")
            .nth(1)
            .expect("it has one")
            .trim_end()
            .trim_end_matches('}')
            .to_owned();
        let trip = if luck.is(0.01) { luck.between(0.001, 0.017) } else { luck.between(0.0001, 0.0004) };
        let position = film.media_s(t + trip * luck.share());
        let reply = format!("{{\"data\":{position},\"request_id\":{id},\"error\":\"success\"}}\n");
        client.hear(reply.as_bytes(), mono(t + trip), &mut |told| tracker.hear(&told));
        if t > 3.0 {
            worst = worst.max((tracker.point(mono(t)).media.as_secs_f64() - film.media_s(t)).abs());
        }
    }
    assert!(tracker.state() == FilmState::Locked && worst < 0.000_5, "{worst} s");
    client.hear(changed("pause", "true").as_bytes(), mono(30.0), &mut |told| tracker.hear(&told));
    assert_eq!(tracker.state(), FilmState::Stopped);
}
