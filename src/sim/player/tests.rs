use super::*;

const PACE: Pace = Pace { fast_forward: Some(2), limits: [500.0; MAX_AXES] };

fn ms(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

fn all(position: i32) -> MotorPositions {
    [Pulses(position); MAX_AXES]
}

fn leg(to: i32, duration_ms: u64) -> PlayedLeg {
    PlayedLeg { to: all(to), duration: Duration::from_millis(duration_ms), vibration: PerAxis::default() }
}

fn push(player: &mut Player, to: i32, duration_ms: u64, at_ms: u64) -> Result<(), Overflow> {
    player.push(leg(to, duration_ms), ms(at_ms), &PACE)
}

fn at(player: &mut Player, at_ms: u64) -> i32 {
    player.advance(ms(at_ms), &PACE);
    player.positions(ms(at_ms))[0].0
}

#[test]
fn a_move_is_a_straight_line_over_its_time() {
    let mut player = Player::new(200, ms(0));
    push(&mut player, 1_000, 100, 50).unwrap();
    let seen = [50, 75, 100, 149, 150, 500].map(|t| at(&mut player, t));
    assert_eq!(seen, [0, 250, 500, 990, 1_000, 1_000]);
    assert_eq!(player.executed, 1);
}

#[test]
fn a_waiting_move_begins_where_the_one_before_ends_and_after_a_gap_at_once() {
    let mut player = Player::new(200, ms(0));
    push(&mut player, 100, 10, 0).unwrap();
    push(&mut player, 200, 10, 8).unwrap();
    assert_eq!(at(&mut player, 15), 150);
    push(&mut player, 300, 10, 40).unwrap();
    assert_eq!([40, 45, 50].map(|t| at(&mut player, t)), [200, 250, 300]);
}

#[test]
fn with_more_than_two_waiting_moves_take_half_their_time() {
    let mut player = Player::new(200, ms(0));
    for to in [100, 200, 300, 400] {
        push(&mut player, to, 10, 0).unwrap();
    }
    // Three wait when the first ends: the second is fast; then two wait, and the others are not.
    assert_eq!([10, 15, 25, 35].map(|t| at(&mut player, t)), [100, 200, 300, 400]);
    assert_eq!(player.fast_forwarded, 1);
}

#[test]
fn fast_forward_can_be_off() {
    let pace = Pace { fast_forward: None, ..PACE };
    let mut player = Player::new(200, ms(0));
    for to in [100, 200, 300, 400] {
        player.push(leg(to, 10), ms(0), &pace).unwrap();
    }
    player.advance(ms(20), &pace);
    assert_eq!(player.positions(ms(20))[0].0, 200);
}

#[test]
fn no_axis_is_faster_than_its_limit() {
    let mut player = Player::new(200, ms(0));
    push(&mut player, 50_000, 10, 0).unwrap();
    assert_eq!(at(&mut player, 10), 5_000);
    assert_eq!(at(&mut player, 100), 50_000);
}

#[test]
fn the_201st_waiting_move_finds_no_room() {
    let mut player = Player::new(200, ms(0));
    for k in 0..=200 {
        push(&mut player, k, 10, 0).unwrap();
    }
    assert_eq!(push(&mut player, 0, 10, 0), Err(Overflow));
}

#[test]
fn a_hold_stays_where_it_came() {
    let mut player = Player::new(200, ms(0));
    push(&mut player, 1_000, 100, 0).unwrap();
    push(&mut player, 2_000, 100, 0).unwrap();
    player.hold(ms(50), &PACE);
    assert_eq!(at(&mut player, 1_000), 500);
    assert_eq!(player.target()[0].0, 500);
}

#[test]
fn a_pause_goes_on_with_the_rest_of_its_move_and_then_with_what_waits() {
    let mut player = Player::new(200, ms(0));
    push(&mut player, 1_000, 100, 0).unwrap();
    push(&mut player, 2_000, 100, 0).unwrap();
    player.pause(ms(50), &PACE);
    assert_eq!([60, 1_000].map(|t| at(&mut player, t)), [500, 500]);
    player.resume(ms(1_000), &PACE);
    assert_eq!([1_025, 1_050, 1_150].map(|t| at(&mut player, t)), [750, 1_000, 2_000]);
}

#[test]
fn a_pause_in_zero_waits_there_and_a_hold_forgets_what_waits() {
    let mut player = Player::new(200, ms(0));
    push(&mut player, 1_000, 100, 0).unwrap();
    push(&mut player, 2_000, 100, 0).unwrap();
    player.pause_in_zero(ms(50), &PACE);
    assert_eq!([51, 500].map(|t| at(&mut player, t)), [0, 0]);
    player.resume(ms(500), &PACE);
    assert_eq!(at(&mut player, 550), 1_000);
    player.pause(ms(560), &PACE);
    player.hold(ms(570), &PACE);
    player.resume(ms(600), &PACE);
    assert_eq!(at(&mut player, 900), 1_100);
}

#[test]
fn a_vibration_swings_about_the_move_and_ends_with_it() {
    let mut player = Player::new(200, ms(0));
    let shake = Vibration { period: 400, amplitude: 100 }; // 50 ms
    let vibration = PerAxis::new(&[Vibration::NONE, shake]);
    player.push(PlayedLeg { vibration, ..leg(0, 100) }, ms(0), &PACE).unwrap();
    let shaken = |player: &Player, t| player.shaken(ms(t)).map(|position| position.0);
    assert_eq!(shaken(&player, 0)[..3], [0, 0, 0]);
    assert_eq!((shaken(&player, 12)[1], shaken(&player, 37)[1]), (100, -100));
    push(&mut player, 0, 100, 100).unwrap();
    assert_eq!(shaken(&player, 112)[1], 0);
}

#[test]
fn the_record_says_when_each_move_began_how_long_it_took_and_from_where_to_where() {
    let mut player = Player::new(200, ms(0));
    push(&mut player, 100, 10, 0).unwrap();
    assert_eq!(at(&mut player, 20), 100);
    player.keep_record();
    push(&mut player, 200, 10, 30).unwrap();
    push(&mut player, 200, 10, 32).unwrap();
    push(&mut player, 300, 10, 34).unwrap();
    player.hold(ms(54), &PACE);
    push(&mut player, 40_240, 10, 60).unwrap(); // 80 ms at 500 pulses a millisecond
    assert_eq!(at(&mut player, 200), 40_240);
    let record: Vec<_> = player.take_record().collect();
    let line = |start, took, from, to| Executed {
        start: ms(start),
        duration: Duration::from_millis(took),
        from: all(from),
        to: all(to),
    };
    let lines = [(30, 10, 100, 200), (40, 10, 200, 200), (50, 4, 200, 240), (60, 80, 240, 40_240)];
    assert_eq!(record, lines.map(|(start, took, from, to)| line(start, took, from, to)));
    assert_eq!(player.take_record().count(), 0, "each is told once");
}
