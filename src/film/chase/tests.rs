use super::*;
use crate::film::follower::tests::tries;
use crate::harness::shown::{Luck, mono};

const FRAME: Duration = Duration::from_millis(10);

fn rules() -> ChaseRules {
    ChaseRules::until(ShowTime::from_millis(600_000))
}

/// A chase at 100 Hz of a film that is locked, and 10 s behind the clock.
struct Stand {
    chase: Chase,
    index: u64,
    leave: FilmLeave,
    state: FilmState,
    ahead_s: f64,
    trim_ms: i32,
    /// Ticks that are missed before the next.
    missed: u64,
}

impl Stand {
    fn new(rules: ChaseRules) -> Self {
        let chase = Chase::new(rules, mono(0.0));
        let (leave, state) = (FilmLeave::Lead, FilmState::Locked);
        Self { chase, index: 0, leave, state, ahead_s: 10.0, trim_ms: 0, missed: 0 }
    }

    /// One whose seats follow.
    fn following(rules: ChaseRules) -> Self {
        let mut stand = Self::new(rules);
        let verdict = stand.run(0.6);
        assert!(matches!(verdict, ChaseVerdict::Follow { join: 1, .. }), "{verdict:?}");
        stand
    }

    fn now_s(&self) -> f64 {
        self.index as f64 * 0.01
    }

    fn tick(&mut self) -> ChaseVerdict {
        let missed = std::mem::take(&mut self.missed);
        self.index += 1 + missed;
        let at = mono(self.now_s());
        let tick = Tick { index: self.index, deadline: at, late: Duration::ZERO, missed };
        let media = ShowTime::from_secs_f64(self.ahead_s + self.now_s());
        let point = FilmPoint { at, media, rate: 1.0, epoch: 0, state: self.state };
        let (trim_ms, leave) = (self.trim_ms, self.leave);
        self.chase.tick(&ChaseInput { tick: &tick, frame: FRAME, point: Some(point), trim_ms, leave })
    }

    /// The verdict after so many seconds.
    fn run(&mut self, seconds: f64) -> ChaseVerdict {
        (0..(seconds * 100.0).round() as u32).map(|_| self.tick()).last().expect("there is a tick")
    }
}

#[test]
fn seats_join_a_film_that_could_be_followed_for_half_a_second_and_only_if_the_hall_lets_them() {
    let mut stand = Stand::new(rules());
    stand.leave = FilmLeave::Nothing;
    assert_eq!(stand.run(10.0), ChaseVerdict::Wait);
    stand.leave = FilmLeave::Lead;
    assert_eq!(stand.run(0.5), ChaseVerdict::Wait);
    let ChaseVerdict::Follow { join: 1, playhead, pace } = stand.run(0.02) else { panic!("it joins") };
    let film = stand.ahead_s + stand.now_s() + 0.01;
    assert!((playhead.as_secs_f64() - film).abs() < 1e-6 && pace == 1.0, "{playhead} at {pace}");
    stand.leave = FilmLeave::Nothing;
    assert_eq!(stand.tick(), ChaseVerdict::Wait);
}

#[test]
fn a_film_outside_the_cue_moves_nobody() {
    for ahead_s in [-3_600.0, -12.0, 601.0] {
        let mut stand = Stand::new(rules());
        stand.ahead_s = ahead_s;
        assert_eq!(stand.run(1.5), ChaseVerdict::Wait, "{ahead_s}");
    }
}

#[test]
fn seats_hold_for_a_film_that_jumps_out_of_the_cue_and_never_join_its_end() {
    for ahead_s in [-3_600.0, 700.0] {
        let mut stand = Stand::following(rules());
        stand.ahead_s = ahead_s;
        assert_eq!(stand.tick(), ChaseVerdict::Hold(HoldCause::Apart));
        for _ in 0..190 {
            assert_eq!(stand.tick(), ChaseVerdict::Hold(HoldCause::Film(FilmState::Locked)), "{ahead_s}");
        }
        assert_eq!(stand.run(1.0), ChaseVerdict::Park(ParkCause::CueLeft));
    }
}

#[test]
fn whatever_ends_the_lead_of_the_film_is_obeyed_in_the_tick_that_reads_it() {
    for state in FilmState::ALL.into_iter().filter(|state| !state.may_lead()) {
        let mut stand = Stand::following(rules());
        stand.state = state;
        let verdict = stand.tick();
        if state == FilmState::Ended {
            assert_eq!(verdict, ChaseVerdict::Park(ParkCause::FilmCutShort));
        } else {
            assert_eq!(verdict, ChaseVerdict::Hold(HoldCause::Film(state)));
            assert_eq!(stand.run(10.0), ChaseVerdict::Hold(HoldCause::Film(state)));
            stand.state = FilmState::Locked;
            assert!(matches!(stand.tick(), ChaseVerdict::Follow { join: 2, .. }));
        }
    }
}

#[test]
fn seats_that_hold_for_five_minutes_park_and_join_no_more_by_themselves() {
    let mut stand = Stand::following(rules());
    stand.state = FilmState::Lost;
    assert_eq!(stand.run(299.0), ChaseVerdict::Hold(HoldCause::Film(FilmState::Lost)));
    assert_eq!(stand.run(2.0), ChaseVerdict::Park(ParkCause::HeldTooLong));
    stand.state = FilmState::Locked;
    assert_eq!(stand.run(10.0), ChaseVerdict::Park(ParkCause::HeldTooLong));
}

/// Seats that follow a film for so many seconds of a cue of so many, from one place in it on, and then from another; why they park
/// at its end.
fn parked_after(cue_s: f64, legs: [(f64, f64); 2]) -> ChaseVerdict {
    let mut stand = Stand::new(ChaseRules::until(ShowTime::from_secs_f64(cue_s)));
    for (from_s, seconds) in legs {
        stand.ahead_s = from_s - stand.now_s();
        stand.run(seconds);
    }
    stand.state = FilmState::Ended;
    stand.tick()
}

#[test]
fn a_film_that_is_over_has_led_its_cue_only_where_seats_followed_it_through_nine_tenths_of_it() {
    for (legs, cause) in [
        ([(0.0, 60.0), (60.0, 39.0)], ParkCause::FilmEnded),
        ([(0.0, 50.0), (55.0, 44.0)], ParkCause::FilmEnded),
        ([(5.0, 50.0), (55.0, 40.0)], ParkCause::FilmEnded),
        ([(0.0, 50.0), (50.0, 30.0)], ParkCause::FilmCutShort),
        ([(40.0, 10.0), (50.0, 49.0)], ParkCause::FilmCutShort),
        ([(0.0, 60.0), (0.0, 60.0)], ParkCause::FilmCutShort),
        ([(-9.0, 5.0), (-4.0, 3.0)], ParkCause::FilmCutShort),
    ] {
        assert_eq!(parked_after(100.0, legs), ChaseVerdict::Park(cause), "{legs:?}");
    }
}

#[test]
fn a_short_film_has_led_its_cue_if_seats_joined_within_the_seconds_that_a_join_takes_and_in_its_first_half() {
    for (cue_s, joins_s, cause) in [
        (8.0, 2.3, ParkCause::FilmEnded),
        (8.0, 3.2, ParkCause::FilmCutShort),
        (20.0, 2.9, ParkCause::FilmEnded),
        (4.0, 1.9, ParkCause::FilmEnded),
        (4.0, 2.1, ParkCause::FilmCutShort),
    ] {
        // They join half a second after the film is known.
        let from_s = joins_s - 0.5;
        let legs = [(from_s, cue_s / 2.0), (from_s + cue_s / 2.0, cue_s / 2.0 - from_s)];
        assert_eq!(parked_after(cue_s, legs), ChaseVerdict::Park(cause), "{joins_s} of {cue_s}");
    }
}

#[test]
fn up_to_a_frame_is_slewed_and_more_is_joined() {
    let mut stand = Stand::following(rules());
    stand.ahead_s += 0.041;
    assert!((0..600).all(|_| matches!(stand.tick(), ChaseVerdict::Follow { join: 1, .. })));
    stand.ahead_s += 0.043;
    assert_eq!(stand.tick(), ChaseVerdict::Hold(HoldCause::Apart));
    assert!(matches!(stand.tick(), ChaseVerdict::Follow { join: 2, pace: 1.0, .. }));
}

#[test]
fn seats_that_fell_behind_the_film_by_missed_ticks_blame_no_film() {
    let mut stand = Stand::following(rules());
    stand.missed = 5;
    assert_eq!(stand.tick(), ChaseVerdict::Hold(HoldCause::Behind));
    assert!(matches!(stand.tick(), ChaseVerdict::Follow { join: 2, .. }));
}

#[test]
fn seats_hold_briefly_for_a_film_that_is_being_found_and_rest_for_one_that_may_stay_away() {
    for state in FilmState::ALL.into_iter().filter(|state| !state.may_lead() && *state != FilmState::Ended) {
        let mut stand = Stand::following(rules());
        assert!(!stand.chase.is_held_briefly(), "they follow");
        stand.state = state;
        stand.tick();
        let is_brief = matches!(state, FilmState::Jumped | FilmState::Acquiring);
        assert_eq!(stand.chase.is_held_briefly(), is_brief, "{state:?}");
    }
}

#[test]
fn a_trim_of_any_size_is_never_a_reason_to_hold() {
    let mut stand = Stand::following(rules());
    stand.trim_ms = -500;
    assert!((0..7_000).all(|_| matches!(stand.tick(), ChaseVerdict::Follow { join: 1, .. })));
    let ChaseVerdict::Follow { playhead, .. } = stand.tick() else { panic!("it follows") };
    let film = stand.ahead_s + stand.now_s() + 0.01;
    assert!((playhead.as_secs_f64() - film - 0.5).abs() < 0.001, "{playhead} at {film}");
}

#[test]
fn after_five_joins_in_a_minute_the_next_waits_for_a_person() {
    let mut stand = Stand::following(rules());
    let mut joins = 1;
    let last = (0..20).map(|_| {
        stand.ahead_s += 5.0;
        stand.run(1.0)
    });
    for verdict in last {
        if let ChaseVerdict::Follow { join, .. } = verdict {
            joins = join;
        }
    }
    assert_eq!(joins, 5);
    assert_eq!(stand.run(120.0), ChaseVerdict::Hold(HoldCause::Unstable), "time alone makes it no better");
    stand.chase.let_join(mono(stand.now_s()));
    assert!(matches!(stand.tick(), ChaseVerdict::Follow { join: 6, .. }));
}

#[test]
fn seats_that_were_paused_up_come_down_by_the_rules_of_seats_that_hold() {
    let paused = || {
        let mut stand = Stand::following(rules());
        stand.leave = FilmLeave::Paused;
        assert!(matches!(stand.run(200.0), ChaseVerdict::Hold(_)));
        stand
    };
    for (ended_first, state) in [true, false]
        .into_iter()
        .flat_map(|first| [FilmState::Ended, FilmState::Stopped].map(|state| (first, state)))
    {
        let mut stand = paused();
        if ended_first {
            stand.state = state;
            stand.run(1.0);
        }
        stand.leave = FilmLeave::Lead;
        stand.state = state;
        let cause = if state == FilmState::Ended { ParkCause::FilmCutShort } else { ParkCause::HeldTooLong };
        if state == FilmState::Stopped {
            assert_eq!(
                stand.run(299.0),
                ChaseVerdict::Hold(HoldCause::Film(state)),
                "a pause does not count"
            );
        }
        assert_eq!(stand.run(3.0), ChaseVerdict::Park(cause));
        stand.state = FilmState::Locked;
        assert_eq!(stand.run(10.0), ChaseVerdict::Park(cause), "no other film moves them");
    }
    let mut stand = paused();
    stand.ahead_s = 700.0;
    stand.leave = FilmLeave::Lead;
    stand.run(2.1);
    assert_eq!(stand.tick(), ChaseVerdict::Park(ParkCause::CueLeft));
    let mut stand = paused();
    stand.leave = FilmLeave::Lead;
    assert!(matches!(stand.tick(), ChaseVerdict::Follow { join: 2, .. }));
    let mut waiting = Stand::new(rules());
    waiting.leave = FilmLeave::Paused;
    assert_eq!(waiting.run(1.0), ChaseVerdict::Wait, "they are parked");
}

#[test]
fn a_source_that_was_unstable_stays_so_while_the_film_stands_or_its_player_is_gone() {
    for state in [FilmState::Stopped, FilmState::Lost] {
        let mut stand = Stand::following(rules());
        for _ in 0..20 {
            stand.ahead_s += 5.0;
            stand.run(1.0);
        }
        stand.state = state;
        assert_eq!(stand.run(65.0), ChaseVerdict::Hold(HoldCause::Film(state)));
        stand.state = FilmState::Locked;
        assert_eq!(stand.run(120.0), ChaseVerdict::Hold(HoldCause::Unstable));
        stand.chase.let_join(mono(stand.now_s()));
        assert!(matches!(stand.tick(), ChaseVerdict::Follow { join: 6, .. }));
        stand.ahead_s += 5.0;
        stand.tick();
        assert!(matches!(stand.tick(), ChaseVerdict::Follow { join: 7, .. }), "a person has said so");
    }
}

#[test]
fn whoever_lets_seats_join_means_the_film_of_now() {
    let mut stand = Stand::following(ChaseRules { rejoin: Rejoin::Ask, ..rules() });
    stand.state = FilmState::Stopped;
    stand.run(1.0);
    stand.chase.let_join(mono(stand.now_s()));
    stand.run(11.0);
    stand.state = FilmState::Locked;
    assert_eq!(stand.run(5.0), ChaseVerdict::Hold(HoldCause::Asks));
}

#[test]
fn seats_that_are_to_ask_join_only_when_a_person_lets_them() {
    let mut stand = Stand::following(ChaseRules { rejoin: Rejoin::Ask, ..rules() });
    stand.state = FilmState::Stopped;
    stand.run(1.0);
    stand.state = FilmState::Locked;
    assert_eq!(stand.run(5.0), ChaseVerdict::Hold(HoldCause::Asks));
    stand.chase.let_join(mono(stand.now_s()));
    assert!(matches!(stand.tick(), ChaseVerdict::Follow { join: 2, .. }));
    stand.ahead_s += 1.0;
    stand.tick();
    assert_eq!(stand.run(5.0), ChaseVerdict::Hold(HoldCause::Asks), "once is once");
}

#[test]
fn no_sign_leads_from_parking_to_motion_but_the_hall() {
    let signs = [
        ChaseSign::Barred,
        ChaseSign::Paused,
        ChaseSign::Over(ParkCause::FilmEnded),
        ChaseSign::Unready(HoldCause::Apart),
        ChaseSign::Brief,
        ChaseSign::Ready,
    ];
    for sign in signs {
        let to = ChaseState::Leaving.next(sign);
        assert_eq!(to == ChaseState::Leaving, sign != ChaseSign::Barred, "{sign:?}");
        assert_eq!(ChaseState::Waiting.next(sign) == ChaseState::Following, sign == ChaseSign::Ready);
        assert_eq!(ChaseState::Following.next(ChaseSign::Barred), ChaseState::Waiting);
    }
}

#[test]
fn whatever_the_points_say_seats_follow_only_what_may_lead_and_never_in_a_jump() {
    for seed in 0..tries(200) {
        let mut luck = Luck::new(seed.into());
        let mut stand = Stand::following(rules());
        let mut before = stand.tick();
        for _ in 0..500 {
            if luck.is(0.05) {
                stand.state = FilmState::ALL[luck.below(12)];
                stand.ahead_s +=
                    [0.0, luck.between(-0.1, 0.1), luck.between(-1e6, 1e6), 1e300][luck.below(4)];
                stand.ahead_s = if stand.ahead_s.abs() > 1e9 { 10.0 } else { stand.ahead_s };
                stand.trim_ms = [0, 500, -500][luck.below(3)];
                let leaves = [FilmLeave::Nothing, FilmLeave::Paused];
                stand.leave = if luck.is(0.1) { leaves[luck.below(2)] } else { FilmLeave::Lead };
            }
            let verdict = stand.tick();
            if let ChaseVerdict::Follow { join, playhead, pace } = verdict {
                assert!(
                    stand.leave == FilmLeave::Lead && stand.state.may_lead(),
                    "{verdict:?} by {:?}",
                    stand.state
                );
                if let ChaseVerdict::Follow { join: joined, playhead: last, .. } = before
                    && joined == join
                {
                    let moved = (playhead.as_nanos() - last.as_nanos()) as f64;
                    assert!((moved / 1e7 - pace).abs() < 1e-6, "{verdict:?} after {before:?}");
                }
            }
            before = verdict;
        }
    }
}
