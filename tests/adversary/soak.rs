//! A day in one go: show after show in one hall that never closes, with losses, seeks, levels and pauses; and nothing grows.

use std::collections::BTreeMap;

use kinocue::harness::engine::Mix;
use kinocue::harness::state::{LedBefore, State, Transition};

use super::chance::setting;
use super::counting::Calls;
use super::cues::KINDS;
use super::dice::Dice;
use super::ether::{Ether, Weather};
use super::hall::{Hall, breaches, open, seats};
use super::seat::MS;

const MINUTE: u64 = 60_000 * MS;
/// From then on memory is to stay as it is.
const SETTLED: u64 = 10 * MINUTE;
/// What the network and the mailboxes may hold more at one moment than at another, bytes.
const ON_ITS_WAY: i64 = 64 * 1024;

/// What a day came to.
#[derive(Debug, Default)]
struct Day {
    shows: u64,
    /// Shows that somebody had to end: a stop, a fault, a seat that stayed out.
    helped: u64,
    /// Bytes held at most: until it had settled, and later.
    early: i64,
    late: i64,
}

/// One who runs shows, sensibly.
struct Operator<'a, 'h, 'l> {
    hall: &'a mut Hall<'h, 'l>,
    dice: Dice,
    day: Day,
}

impl Operator<'_, '_, '_> {
    fn run(mut self, minutes: u64) -> Day {
        let (began, before) = (self.hall.ether.ns(), Calls::so_far().held);
        while self.hall.ether.ns() < began + minutes * MINUTE {
            self.show();
            let held = Calls::so_far().held - before;
            let most =
                if self.hall.ether.ns() < began + SETTLED { &mut self.day.early } else { &mut self.day.late };
            *most = held.max(*most);
        }
        self.day
    }

    fn show(&mut self) {
        self.come_to_parked();
        self.hall.load(self.dice.range(0, 5) as usize);
        self.hall.pass(200);
        self.hall.ask(Transition::Arm);
        self.hall.comes_to(|state| state == State::Armed, 1_000);
        self.hall.ask(Transition::Go);
        self.hall.comes_to(|state| matches!(state, State::Playing(_)), 1_000);
        self.day.shows += u64::from(matches!(self.hall.state, State::Playing(_)));
        let over = self.hall.ether.ns() + self.dice.range(4_000, 16_000) * MS;
        while matches!(self.hall.state, State::Playing(_) | State::Paused) && self.hall.ether.ns() < over {
            self.hall.pass(self.dice.range(100, 3_000));
            self.meddle();
        }
        self.come_to_parked();
        self.hall.pass(self.dice.range(100, 10_000));
    }

    fn meddle(&mut self) {
        let (hall, dice) = (&mut *self.hall, &mut self.dice);
        let seat = dice.range(0, hall.kind.axes.len() as u64) as usize;
        match dice.range(0, 12) {
            0 => hall.seek(dice.range(0, 5_900) as i64),
            1 => {
                hall.set(seat, Mix { motion: dice.range(2, 11) as f64 / 10.0, ..hall.runtime.desk.mix(seat) })
            }
            2 => hall.trim(dice.range(0, 400) as i32 - 200),
            3 => hall.ask(if hall.state == State::Paused { Transition::Resume } else { Transition::Pause }),
            4 => {
                let kinds = [Weather::Lost, Weather::Cut, Weather::Mute, Weather::Held, Weather::Shuffled];
                hall.ether.turns(seat, dice.pick(&kinds), dice.pick(&[20, 45, 80, 300]));
            }
            5 if dice.one_in(10) => hall.ask(Transition::Stop),
            _ => {}
        }
    }

    /// Whatever the hall is in, and whoever is out, people bring it to park.
    fn come_to_parked(&mut self) {
        self.hall.diary = Some(Vec::new());
        for tried in 0..20 {
            let request = match self.hall.state {
                State::Parked if self.all_may_move() => return,
                State::Parked => Transition::Home,
                State::Stopped | State::Fault => Transition::Clear,
                State::Armed => Transition::Disarm,
                // Where a seat is not home, or has to be looked after, parking is refused.
                State::Recovering if tried % 2 == 1 => Transition::Home,
                _ => Transition::Park,
            };
            self.day.helped += u64::from(matches!(request, Transition::Clear | Transition::Home));
            self.hall.ask(request);
            self.hall.pass(500);
            self.hall
                .comes_to(|state| matches!(state, State::Parked | State::Stopped | State::Fault), 20_000);
        }
        panic!("it does not come to park: {:?}, {:#?}", self.hall.state, self.hall.diary);
    }

    fn all_may_move(&self) -> bool {
        self.hall.runtime.live.table().iter().all(|row| row.standing.may_move())
    }
}

/// `KINOCUE_SOAK_MINUTES=N` lasts so long instead, in virtual time.
#[test]
fn a_day_of_shows_holds_no_more_memory_than_its_first_ten_minutes_and_accounts_for_every_frame() {
    let minutes = setting("KINOCUE_SOAK_MINUTES").unwrap_or(60);
    let kind = KINDS[2];
    let ether = Ether::new(&seats(&kind), 18);
    let ((day, counts), _) = open(&ether, kind, LedBefore::Ended, &BTreeMap::new(), |hall| {
        let day = Operator { hall, dice: Dice::new(18), day: Day::default() }.run(minutes);
        hall.pass(2_000);
        (day, hall.runtime.live.table().iter().map(|row| row.counts).collect::<Vec<_>>())
    });
    let frames: Vec<u64> = ether.world().lines.iter().map(|line| line.frames).collect();
    println!("{minutes} min: {day:?}, frames {frames:?}, {counts:?}");
    assert_eq!(breaches(&ether), []);
    assert!(day.shows >= minutes, "{day:?}");
    assert!(day.late <= day.early + ON_ITS_WAY, "{day:?}");
    for (counts, frames) in counts.iter().zip(frames) {
        assert_eq!(counts.asked, counts.acked + counts.refused() + counts.lost, "{counts:?}");
        assert_eq!(counts.sent, frames, "{counts:?}");
    }
}
