//! A second round of attacks: what a seat is told at the very tick of a change, and what it is left with.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use kinocue::harness::engine::Mix;
use kinocue::harness::state::{LedBefore, PlayMode, State, Transition};

use super::cues::{KINDS, Kind, OTHERS, TOGETHER};
use super::dice::Dice;
use super::ether::{Ether, Weather};
use super::hall::{Hall, Thread, breaches, open, seats};
use super::judge::PULSES_PER_MM;
use super::named::ether;
use super::seat::{MS, Settings};

/// Something that somebody does.
type Ask = fn(&mut Hall<'_, '_>);

const WET: usize = 3;
const WET_AT_REST: usize = 4;

fn lead<T>(kind: Kind, ether: &Ether, lead: impl FnOnce(&mut Hall<'_, '_>) -> T) -> T {
    open(ether, kind, LedBefore::Ended, &BTreeMap::new(), lead).0
}

fn frames(hall: &Hall<'_, '_>, seat: usize) -> u64 {
    hall.ether.world().lines[seat].frames
}

fn wet(hall: &Hall<'_, '_>, seat: usize) -> (u16, bool) {
    let world = hall.ether.world();
    (world.lines[seat].seat.outputs, world.lines[seat].seat.shakes)
}

fn told(ether: &Ether) -> Vec<String> {
    breaches(ether).iter().take(3).map(ToString::to_string).collect()
}

#[test]
fn a_tick_that_comes_late_while_a_seat_is_told_that_it_is_out_does_not_panic() {
    let mut bad = Vec::new();
    for (kind, step, stall) in [(KINDS[6], 20, 130), (KINDS[2], 20, 110), (OTHERS[0], 50, 190)] {
        // Its three hold frames at park, and the tick after them.
        for offset in (1_300..1_500).step_by(step) {
            let ether = ether(kind, |_| {});
            let done = catch_unwind(AssertUnwindSafe(|| {
                lead(kind, &ether, |hall| {
                    hall.ride(WET);
                    hall.pass(200);
                    let mix = hall.runtime.desk.mix(0);
                    hall.set(0, Mix { on: false, ..mix });
                    hall.pass(offset);
                    hall.still(Thread::Tick, stall);
                    hall.pass(1_500);
                    hall.set(0, mix);
                    hall.pass(1_500);
                });
            }));
            if done.is_err() {
                bad.push(format!("{:?} at {} Hz, stalled {offset} ms after: panic", kind.axes, kind.hz));
            } else if !breaches(&ether).is_empty() {
                bad.push(format!(
                    "{:?} at {} Hz, stalled {offset} ms after: {:?}",
                    kind.axes,
                    kind.hz,
                    told(&ether)
                ));
            }
        }
    }
    assert!(bad.is_empty(), "{}: {bad:#?}", bad.len());
}

/// What is on 4 s after a request whose frames are lost for so long.
fn left_on(
    kind: Kind,
    cue: usize,
    ask: impl Fn(&mut Hall<'_, '_>),
    lost_ms: u64,
    lead_ms: u64,
) -> (u16, bool) {
    let ether = ether(kind, |_| {});
    lead(kind, &ether, |hall| {
        hall.ride(cue);
        hall.pass(300);
        assert_eq!(wet(hall, 0), (1, true));
        if lead_ms > 0 {
            hall.ether.turns(0, Weather::Lost, lost_ms);
            hall.pass(lead_ms);
            ask(hall);
        } else {
            ask(hall);
            hall.ether.turns(0, Weather::Lost, lost_ms);
        }
        hall.pass(4_000);
        wet(hall, 0)
    })
}

/// Whether more is left on than README admits: no register ends the vibration of a seat that was cut off for long.
fn is_too_much((outputs, vibrates): (u16, bool), lost_ms: u64) -> bool {
    outputs != 0 || (vibrates && lost_ms <= 100)
}

#[test]
fn nothing_is_left_on_at_a_seat_that_gets_no_more_frames_but_vibration_after_a_long_loss() {
    let mut bad = Vec::new();
    for kind in [OTHERS[7], KINDS[0], KINDS[2]] {
        for cue in [WET, WET_AT_REST] {
            for lost_ms in [5, 40, 100, 500] {
                for lead_ms in [0, 1] {
                    for (what, ask) in
                        [("pause", Transition::Pause), ("stop", Transition::Stop), ("park", Transition::Park)]
                    {
                        let left = left_on(kind, cue, |hall| hall.ask(ask), lost_ms, lead_ms);
                        if is_too_much(left, lost_ms) {
                            bad.push(format!(
                                "{:?} {} Hz cue {cue}: {what}, {lost_ms} ms lost: {left:?}",
                                kind.axes, kind.hz
                            ));
                        }
                    }
                    let out = |hall: &mut Hall<'_, '_>| {
                        let mix = hall.runtime.desk.mix(0);
                        hall.set(0, Mix { on: false, ..mix });
                    };
                    let left = left_on(kind, cue, out, lost_ms, lead_ms);
                    if is_too_much(left, lost_ms) {
                        bad.push(format!(
                            "{:?} {} Hz cue {cue}: out, {lost_ms} ms lost: {left:?}",
                            kind.axes, kind.hz
                        ));
                    }
                }
            }
        }
    }
    assert!(bad.is_empty(), "{}: {bad:#?}", bad.len());
}

#[test]
fn no_effect_is_left_on_at_a_seat_that_stays_out_since_it_went_astray_or_was_cut_off_three_times() {
    let mut bad = Vec::new();
    for kind in [KINDS[0], KINDS[2], OTHERS[7]] {
        for deaf in [true, false] {
            let ether = ether(kind, |_| {});
            lead(kind, &ether, |hall| {
                hall.ride(WET);
                for _ in 0..4 {
                    if deaf {
                        let now = hall.ether.ns();
                        hall.ether.world().lines[0].seat.seize(Some((0, 60.0)), now, 600 * MS);
                    } else {
                        hall.ether.turns(0, Weather::Cut, 600);
                    }
                    hall.pass(3_500);
                    let table = hall.runtime.live.table();
                    println!("{} Hz, deaf {deaf}: {:?}, {:?}", kind.hz, table[0].standing, table[0].why);
                }
                let before = frames(hall, 0);
                hall.pass(1_000);
                let sent = frames(hall, 0) - before;
                if sent == 0 && wet(hall, 0).0 != 0 {
                    bad.push(format!("{} Hz, deaf {deaf}: {:?}, {:?}", kind.hz, wet(hall, 0), hall.state));
                }
            });
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

/// What somebody asks for while the machine is asleep, or nothing.
const ASLEEP_ASKS: [Option<Transition>; 4] =
    [None, Some(Transition::Stop), Some(Transition::Pause), Some(Transition::Park)];

#[test]
fn nothing_is_left_on_at_seats_whose_hall_was_asleep_and_who_asked_for_park_meanwhile_finds_them_there() {
    let mut bad = Vec::new();
    for kind in [KINDS[0], KINDS[2], OTHERS[0], TOGETHER[0], TOGETHER[1]] {
        for asleep_ms in [300, 600, 1_900, 2_300, 9_000] {
            for ask in ASLEEP_ASKS {
                let ether = ether(kind, |_| {});
                let (left, state, mm) = lead(kind, &ether, |hall| {
                    hall.ride(WET);
                    hall.pass(700);
                    assert_eq!(wet(hall, 0).0, 1);
                    hall.still(Thread::All, asleep_ms);
                    hall.pass(asleep_ms / 2);
                    ask.into_iter().for_each(|ask| hall.ask(ask));
                    hall.pass(asleep_ms - asleep_ms / 2 + 8_000);
                    let place = hall.ether.world().lines[0].seat.place(hall.ether.ns())[0];
                    (wet(hall, 0).0, hall.state, place / PULSES_PER_MM)
                });
                // A short one is over by itself.
                let goes_on = matches!(state, State::Playing(_));
                let is_left = left != 0 && !goes_on;
                let is_up = state == State::Parked && mm > 0.5;
                if is_left || is_up || !breaches(&ether).is_empty() {
                    let what = format!("{state:?} at {mm:.1} mm, outputs {left}, {:?}", told(&ether));
                    bad.push(format!("{:?} {} Hz, {asleep_ms} ms, {ask:?}: {what}", kind.axes, kind.hz));
                }
            }
        }
    }
    assert!(bad.is_empty(), "{}: {bad:#?}", bad.len());
}

/// How long after a seat was taken by its keys the last frame went to it, ms.
fn cut_after(kind: Kind, set: impl Fn(&mut Settings), jogged: Option<(usize, f64)>, at: u64) -> u64 {
    let ether = ether(kind, set);
    lead(kind, &ether, |hall| {
        hall.ride(0);
        hall.pass(at);
        let begun = hall.ether.ns();
        hall.ether.world().lines[0].seat.seize(jogged, begun, 3_000 * MS);
        let (mut last, mut count) = (begun, frames(hall, 0));
        while hall.ether.ns() < begun + 2_000 * MS {
            hall.pass(5);
            if frames(hall, 0) != count {
                (last, count) = (hall.ether.ns(), frames(hall, 0));
            }
        }
        (last - begun) / MS
    })
}

fn slowest_cut(kind: Kind) -> u64 {
    let jogs = [None, Some((0, 60.0)), Some((0, -60.0))];
    let all = jogs.iter().flat_map(|jogged| [100, 433, 766].map(|at| cut_after(kind, |_| {}, *jogged, at)));
    all.max().expect("there are nine")
}

#[test]
fn a_seat_that_does_not_execute_is_cut_off_within_what_is_said() {
    for kind in [KINDS[0], KINDS[1], KINDS[3], KINDS[4], KINDS[5], OTHERS[3], OTHERS[4], OTHERS[8]] {
        let slowest = slowest_cut(kind);
        assert!(slowest <= 350, "{:?} {} Hz: {slowest} ms", kind.axes, kind.hz);
    }
}

#[test]
fn nor_does_it_take_longer_than_is_said_at_few_frames_a_second() {
    for kind in [OTHERS[0], OTHERS[1], OTHERS[6]] {
        let slowest = slowest_cut(kind);
        let said = if kind.hz < 20.0 { 800 } else { 400 };
        assert!(slowest <= said, "{:?} {} Hz: {slowest} ms", kind.axes, kind.hz);
    }
}

/// Whether seats were taken out for a while in a show of which nothing is wrong but that.
fn cries(kind: Kind, set: impl Fn(&mut Settings), each: impl Fn(&mut Hall<'_, '_>)) -> u32 {
    let ether = ether(kind, set);
    lead(kind, &ether, |hall| {
        hall.ride(0);
        let mut quiet = 0;
        for _ in 0..14 {
            each(hall);
            let before: Vec<u64> = (0..kind.axes.len()).map(|seat| frames(hall, seat)).collect();
            hall.pass(250);
            if matches!(hall.state, State::Playing(_)) {
                quiet += (0..kind.axes.len())
                    .filter(|seat| frames(hall, *seat) - before[*seat] < (kind.hz / 4.0) as u64 / 3)
                    .count() as u32;
            }
        }
        quiet
    })
}

#[test]
fn no_seat_that_follows_is_cut_off() {
    for kind in [KINDS[0], KINDS[1], KINDS[3], KINDS[4], KINDS[7], OTHERS[0], OTHERS[5]] {
        for (weather, ms) in
            [(Weather::Late(45), 300), (Weather::Echo(40), 300), (Weather::Held, 40), (Weather::Mute, 30)]
        {
            let quiet = cries(
                kind,
                |seat| seat.hurry = false,
                |hall| {
                    (0..kind.axes.len()).for_each(|seat| hall.ether.turns(seat, weather, ms));
                },
            );
            assert_eq!(quiet, 0, "{:?} {} Hz: {weather:?}", kind.axes, kind.hz);
        }
    }
}

#[test]
fn no_seat_that_vibrates_and_follows_is_cut_off() {
    for kind in [KINDS[1], KINDS[4], KINDS[7], OTHERS[0], OTHERS[7]] {
        let ether = ether(kind, |_| {});
        lead(kind, &ether, |hall| {
            hall.ride(WET);
            let mut quiet = 0;
            for turn in 0..30_u32 {
                let before = frames(hall, 0);
                let mix = hall.runtime.desk.mix(0);
                hall.set(
                    0,
                    Mix {
                        motion: if turn % 5 == 0 { 0.3 } else { 1.0 },
                        vibration: f64::from(turn % 3) * 0.5,
                        ..mix
                    },
                );
                hall.pass(250);
                quiet += u32::from(frames(hall, 0) - before < (kind.hz / 4.0) as u64 / 3);
                if turn % 7 == 6 {
                    hall.ask(Transition::Pause);
                    hall.pass(700);
                    hall.ask(Transition::Resume);
                    assert!(
                        hall.comes_to(|state| state == State::Playing(PlayMode::Following), 8_000),
                        "{:?}",
                        hall.state
                    );
                }
            }
            assert_eq!(quiet, 0, "{:?} {} Hz", kind.axes, kind.hz);
        });
    }
}

/// Nothing that is asked at any tick of a seat's way out or in, or of a pause, moves a seat as none may, or panics.
#[test]
fn no_two_requests_one_after_the_other_move_a_seat_as_none_may() {
    let asks: [(&str, Ask); 10] = [
        ("pause", |hall| hall.ask(Transition::Pause)),
        ("resume", |hall| hall.ask(Transition::Resume)),
        ("stop", |hall| hall.ask(Transition::Stop)),
        ("park", |hall| hall.ask(Transition::Park)),
        ("seek", |hall| hall.seek(4_000)),
        ("trim", |hall| hall.trim(300)),
        ("out", |hall| hall.set(0, Mix { on: false, ..hall.runtime.desk.mix(0) })),
        ("in", |hall| hall.set(0, Mix { on: true, ..hall.runtime.desk.mix(0) })),
        ("late", |hall| hall.still(Thread::Tick, 140)),
        ("cut", |hall| hall.ether.turns(0, Weather::Cut, 160)),
    ];
    let mut bad = Vec::new();
    for kind in [KINDS[6]] {
        for (one, first) in &asks {
            for (other, second) in &asks {
                for gap in [20, 1_400] {
                    let ether = ether(kind, |_| {});
                    let done = catch_unwind(AssertUnwindSafe(|| {
                        lead(kind, &ether, |hall| {
                            hall.ride(WET);
                            hall.pass(200);
                            first(hall);
                            hall.pass(gap);
                            second(hall);
                            hall.pass(500);
                            hall.set(0, Mix { on: true, ..hall.runtime.desk.mix(0) });
                            hall.ask(Transition::Resume);
                            hall.pass(1_200);
                        });
                    }));
                    let found = breaches(&ether);
                    if done.is_err() || !found.is_empty() {
                        bad.push(format!(
                            "{:?} {} Hz: {one}, {gap} ms, {other}: panic {}, {:?}",
                            kind.axes,
                            kind.hz,
                            done.is_err(),
                            told(&ether)
                        ));
                    }
                }
            }
        }
    }
    assert!(bad.is_empty(), "{}: {bad:#?}", bad.len());
}

#[test]
fn a_seat_that_vibrates_on_after_frames_were_lost_is_led_to_rest_by_slow_ones_and_comes_back() {
    let mut bad = Vec::new();
    let mut stays = 0;
    for kind in [KINDS[0], KINDS[5], KINDS[2], OTHERS[7]] {
        for cue in [WET_AT_REST, 5, 6, 7] {
            for offset in [0, 31, 62, 93, 124, 155, 186, 217] {
                for park in [false, true] {
                    let ether = ether(kind, |_| {});
                    lead(kind, &ether, |hall| {
                        hall.ride(cue);
                        hall.pass(300 + offset);
                        hall.ask(Transition::Pause);
                        hall.ether.turns(0, Weather::Lost, 100);
                        hall.pass(1_500 + offset * 3);
                        hall.ask(if park { Transition::Park } else { Transition::Resume });
                        hall.pass(2_500);
                        let before = frames(hall, 0);
                        hall.pass(200);
                        let still = wet(hall, 0).1 && frames(hall, 0) == before;
                        stays += u32::from(still);
                        let found = breaches(&hall.ether);
                        if let Some(worst) = found.iter().max_by(|a, b| a.mm.total_cmp(&b.mm)) {
                            bad.push(format!(
                                "{:?} {} Hz, cue {cue}, {offset} ms, park {park}: {} worst {worst}",
                                kind.axes,
                                kind.hz,
                                found.len()
                            ));
                        }
                    });
                }
            }
        }
    }
    assert!(stays == 0 && bad.is_empty(), "{stays} stay out and vibrate; {}: {bad:#?}", bad.len());
}

#[test]
fn a_seat_that_was_cut_off_in_mid_show_while_it_vibrated_is_led_to_rest_where_it_is_and_rides_on() {
    for kind in [KINDS[0], OTHERS[7]] {
        for (cue, weather) in [(WET, Weather::Lost), (WET_AT_REST, Weather::Lost), (WET, Weather::Cut)] {
            for lost_ms in [260, 400, 700] {
                let ether = ether(kind, |_| {});
                lead(kind, &ether, |hall| {
                    hall.ride(cue);
                    hall.pass(300);
                    assert!(wet(hall, 0).1, "it vibrates");
                    hall.ether.turns(0, weather, lost_ms);
                    hall.pass(lost_ms);
                    let before = frames(hall, 0);
                    hall.pass(6_000);
                    let what = format!("{:?}, cue {cue}, {weather:?} for {lost_ms} ms", kind.axes);
                    assert!(frames(hall, 0) > before + 200, "{what}: it rides on");
                });
                assert!(breaches(&ether).is_empty(), "{:?}", told(&ether));
            }
        }
    }
}

/// Seats are taken out and put back by somebody who does all of it at the wrong time; in the end all are to park.
fn hands(kind: Kind, seed: u64) -> Result<(), String> {
    let mut dice = Dice::new(seed);
    let mut seats = seats(&kind);
    for seat in &mut seats {
        seat.hurry = !dice.one_in(3);
        seat.report_ms = dice.pick(&[0, 100]);
    }
    let ether = Ether::new(&seats, seed);
    let count = kind.axes.len() as u64;
    let mut diary = Vec::new();
    let ends = catch_unwind(AssertUnwindSafe(|| {
        lead(kind, &ether, |hall| {
            hall.planner_ns = dice.pick(&[1, 8, 40]) * MS;
            for seat in 0..count as usize {
                let on = !dice.one_in(4);
                hall.set(seat, Mix { on, ..hall.runtime.desk.mix(seat) });
            }
            hall.load(dice.range(0, 4) as usize);
            hall.comes_to(|state| state == State::Parked, 5_000);
            hall.diary = Some(std::mem::take(&mut diary));
            for _ in 0..40 {
                hall.pass(dice.pick(&[0, 1, 5, 10, 20, 40, 80, 150, 300, 700, 1_300]));
                let seat = dice.range(0, count) as usize;
                let now = hall.ether.ns();
                match dice.range(0, 20) {
                    0..=6 => hall.set(seat, Mix { on: dice.one_in(2), ..hall.runtime.desk.mix(seat) }),
                    7 => {
                        let mix = hall.runtime.desk.mix(seat);
                        hall.set(seat, Mix { on: !mix.on, ..mix });
                        hall.pass(dice.range(0, 30));
                        hall.set(seat, mix);
                    }
                    8 => hall.still(Thread::Tick, dice.pick(&[60, 110, 140, 200, 240, 260, 400])),
                    9 => hall.ether.turns(seat, Weather::Cut, dice.pick(&[30, 60, 120, 500, 1_500])),
                    10 => {
                        let done = hall.ether.jog(
                            seat,
                            dice.range(0, kind.axes[seat] as u64) as usize,
                            dice.range(0, 120) as f64 - 60.0,
                            now,
                        );
                        hall.note(|| format!("seat {} jogged {done}", seat + 1));
                    }
                    11 if dice.one_in(3) => hall.ether.world().lines[seat].seat.reboot(now, 1_000 * MS),
                    12 => hall.load(dice.range(0, 4) as usize),
                    13 => hall.seek(dice.range(0, 5_900) as i64),
                    14 => hall.set(
                        seat,
                        Mix { motion: dice.range(1, 11) as f64 / 10.0, ..hall.runtime.desk.mix(seat) },
                    ),
                    _ => {
                        let ask = match hall.state {
                            State::Parked => Transition::Arm,
                            State::Armed => Transition::Go,
                            State::Paused => dice.pick(&[
                                Transition::Resume,
                                Transition::Resume,
                                Transition::Park,
                                Transition::Stop,
                            ]),
                            State::Playing(_) => dice.pick(&[
                                Transition::Pause,
                                Transition::Pause,
                                Transition::Park,
                                Transition::Stop,
                            ]),
                            State::Parking => {
                                dice.pick(&[Transition::Pause, Transition::Stop, Transition::Park])
                            }
                            State::Stopped | State::Fault => Transition::Clear,
                            State::Recovering => Transition::Park,
                            State::Boot | State::Stopping | State::Homing => Transition::Park,
                        };
                        hall.ask(ask);
                    }
                }
            }
            // Whatever it was: all are well, are put back, and park.
            (0..count as usize)
                .for_each(|seat| hall.set(seat, Mix { on: true, ..hall.runtime.desk.mix(seat) }));
            hall.pass(3_000);
            for _ in 0..60 {
                if hall.state == State::Parked {
                    break;
                }
                match hall.state {
                    State::Stopped | State::Fault => hall.ask(Transition::Clear),
                    State::Armed => hall.ask(Transition::Disarm),
                    State::Playing(_) | State::Paused | State::Recovering => hall.ask(Transition::Park),
                    _ => {}
                }
                hall.pass(500);
            }
            hall.pass(1_500);
            let homed: Vec<bool> = hall.ether.world().lines.iter().map(|line| line.seat.homed).collect();
            let places: Vec<f64> = (0..count as usize)
                .map(|seat| hall.ether.world().lines[seat].seat.place(hall.ether.ns())[0] / 2_000.0)
                .collect();
            (hall.state, hall.state == State::Parked, homed, places, hall.diary.take().unwrap_or_default())
        })
    }));
    let found = breaches(&ether);
    let worst = found.iter().max_by(|a, b| a.mm.total_cmp(&b.mm)).map(ToString::to_string);
    let tail = |diary: &[String]| {
        diary
            .iter()
            .filter(|line| !line.contains("Park, PositionUnknown") && !line.ends_with("asks: Park"))
            .cloned()
            .collect::<Vec<_>>()
    };
    match ends {
        Err(_) => Err(format!("{:?} {} Hz seed {seed}: panic", kind.axes, kind.hz)),
        Ok((_, _, _, _, diary)) if !found.is_empty() => {
            Err(format!("{:?} {} Hz seed {seed}: {} {worst:?} {:#?}", kind.axes, kind.hz, found.len(), diary))
        }
        Ok((state, parked, homed, places, diary))
            if !parked && homed.iter().all(|homed| *homed) && kind.axes[0] <= 6 =>
        {
            Err(format!(
                "{:?} {} Hz seed {seed}: {state:?} at {places:?}: {:#?}",
                kind.axes,
                kind.hz,
                tail(&diary)
            ))
        }
        Ok(_) => Ok(()),
    }
}

#[test]
fn whoever_takes_seats_out_and_puts_them_back_at_the_wrong_time_moves_none_as_none_may() {
    let count = super::chance::setting("KINOCUE_HISTORIES").unwrap_or(60);
    let first = super::chance::setting("KINOCUE_SEED").unwrap_or(1);
    let kinds = [KINDS[6], KINDS[2], KINDS[0], OTHERS[8], OTHERS[0], KINDS[3], OTHERS[7]];
    let mut bad = Vec::new();
    for seed in first..first + count {
        if let Err(why) = hands(kinds[seed as usize % kinds.len()], seed) {
            println!("{}", why.chars().take(if count == 1 { 20_000 } else { 260 }).collect::<String>());
            bad.push(seed);
        }
    }
    assert!(bad.is_empty(), "{} of {count}: {bad:?}", bad.len());
}
