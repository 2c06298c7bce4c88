//! Old answers and reports that the network delivers again, for as long as it likes and before the true ones; and what halls make
//! of a place that two sources contradict.

use kinocue::harness::state::{LedBefore, State, Transition};

use super::cues::{KINDS, Kind, MBOXES};
use super::dice::Dice;
use super::ether::{Ether, Line, Weather};
use super::hall::Hall;
use super::judge::PULSES_PER_MM;
use super::named::{assert_no_breach, ether, lead};
use super::seat::{MS, Seat};
use super::words::{report_places, told_places};

const THREE: Kind = KINDS[0];
const SIX: Kind = KINDS[1];
const EIGHT: Kind = KINDS[3];
const FAST: Kind = KINDS[7];
const MBOX: Kind = MBOXES[0];

/// Which old datagrams come again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Old {
    /// One answer to a read of positions.
    Answer,
    /// One of each read of positions that there was.
    Answers,
    /// One status report.
    Report,
}

impl Old {
    /// What an old datagram would have a seat be off by at the most, pulses; none where it is not of that sort.
    fn is_off(self, octets: &[u8], seat: &Seat, place: &[f64; 12]) -> Option<f64> {
        let told = match self {
            Self::Report => report_places(octets)?,
            Self::Answer | Self::Answers => told_places(octets, seat.settings.high_first)?,
        };
        let off = told.into_iter().filter(|(axis, _)| *axis < seat.settings.axes);
        off.map(|(axis, at)| (f64::from(at) - place[axis]).abs()).reduce(f64::max)
    }

    /// Those that are the farthest from where the seat is: one, or one for each read.
    fn farthest(self, line: &Line, now: u64) -> Vec<Vec<u8>> {
        let place = line.seat.told_place(now);
        let mut found: Vec<(f64, &Vec<u8>)> = Vec::new();
        for (_, octets) in &line.said {
            let Some(off) = self.is_off(octets, &line.seat, &place) else { continue };
            let is_alike = |other: &&Vec<u8>| self != Self::Answers || other[4..16] == octets[4..16];
            match found.iter_mut().find(|(_, other)| is_alike(other)) {
                Some(best) if best.0 < off => *best = (off, octets),
                Some(_) => {}
                None => found.push((off, octets)),
            }
        }
        found.into_iter().map(|(_, octets)| octets.clone()).collect()
    }
}

impl Ether {
    /// For so many milliseconds the network delivers old datagrams of a seat again, every `every` microseconds: those that are the farthest
    /// from where it is.
    pub(crate) fn repeats(&self, seat: usize, old: Old, every_us: u64, ms: u64) {
        let now = self.ns();
        let line = &mut self.world().lines[seat];
        for octets in old.farthest(line, now) {
            for at in (now..now + ms * MS).step_by(every_us as usize * 1_000) {
                line.deliver_again(octets.clone(), at, false);
            }
        }
    }
}

impl Ether {
    /// The network delivers a stretch of what a seat said again, or all of it in any order: `from` is how many of its datagrams are older, and
    /// the stretch is as long as it was.
    pub(crate) fn delivers_again(&self, seat: usize, from: u64, ms: u64, dice: Option<&mut Dice>) {
        let now = self.ns();
        let line = &mut self.world().lines[seat];
        let from = from as usize % line.said.len().max(1);
        let begun = line.said.get(from).map_or(0, |(at, _)| *at);
        let stretch = line.said.iter().skip(from).take_while(|(at, _)| *at < begun + ms * MS);
        let stretch: Vec<(u64, Vec<u8>)> = stretch.cloned().collect();
        let mut shift = dice;
        for (at, octets) in stretch {
            let later = shift.as_mut().map_or(at - begun, |dice| dice.range(0, ms * MS));
            line.deliver_again(octets, now + later, true);
        }
    }
}

/// What old datagrams come by chance.
pub(crate) fn by_chance(hall: &mut Hall<'_, '_>, seat: usize, dice: &mut Dice) {
    let ms = dice.pick(&[20, 150, 300, 800, 1_500]);
    if dice.one_in(3) {
        let (from, ms, in_order) = (dice.next(), ms.min(300), dice.one_in(2));
        hall.note(|| format!("seat {}: {ms} ms of answers from before, in order: {in_order}", seat + 1));
        return hall.ether.delivers_again(seat, from, ms, (!in_order).then_some(dice));
    }
    let old = dice.pick(&[Old::Answer, Old::Answer, Old::Answers, Old::Report]);
    let every_us = dice.pick(&[300, 3_000, 20_000, 90_000]);
    hall.note(|| format!("seat {}: {old:?} from before each {every_us} us for {ms} ms", seat + 1));
    hall.ether.repeats(seat, old, every_us, ms);
}

/// What is asked of a hall while old datagrams come again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    /// Nothing: a seat is out, and rejoins.
    Rejoin,
    Go,
    Resume,
    Park,
}

/// How the network misbehaves.
#[derive(Debug, Clone, Copy)]
struct Trouble {
    old: Old,
    every_us: u64,
    ms: u64,
    /// No true answer comes back meanwhile.
    is_mute: bool,
}

const ONE: Trouble = Trouble { old: Old::Answer, every_us: 200, ms: 800, is_mute: false };

impl Hall<'_, '_> {
    /// Where the first axis of the first seat stands, mm.
    fn height(&self) -> f64 {
        self.ether.world().lines[0].seat.place(self.ether.ns())[0] / PULSES_PER_MM
    }

    fn comes_to_height(&mut self, is: impl Fn(f64) -> bool) {
        for _ in 0..400 {
            if is(self.height()) {
                return;
            }
            self.pass(10);
        }
        panic!("it is at {} mm", self.height());
    }

    fn is_troubled(&mut self, trouble: Trouble) {
        let Trouble { old, every_us, ms, is_mute } = trouble;
        if is_mute {
            self.ether.turns(0, Weather::Mute, ms);
        }
        self.ether.repeats(0, old, every_us, ms);
    }

    /// From a ride into what is to be asked, with a place far from there behind it.
    fn leads_to(&mut self, asked: Asked) {
        self.ride(0);
        // Up, where it is read at rest.
        self.comes_to_height(|mm| mm > 108.0);
        self.ask(Transition::Pause);
        self.pass(1_500);
        self.ask(Transition::Resume);
        self.pass(300);
        self.comes_to_height(|mm| mm < 45.0);
        match asked {
            Asked::Rejoin => {
                self.ether.turns(0, Weather::Cut, 300);
                self.pass(300);
            }
            Asked::Go => {
                self.ask(Transition::Park);
                assert!(self.comes_to(|state| state == State::Parked, 10_000), "{:?}", self.state);
                self.pass(500);
                self.ask(Transition::Arm);
                assert!(self.comes_to(|state| state == State::Armed, 1_000), "{:?}", self.state);
            }
            Asked::Resume => {
                self.ask(Transition::Pause);
                self.pass(1_500);
            }
            Asked::Park => {
                self.ask(Transition::Stop);
                assert!(self.comes_to(|state| state == State::Stopped, 6_000), "{:?}", self.state);
                self.pass(500);
            }
        }
    }

    fn asks_after(&mut self, asked: Asked) {
        let ways: &[Transition] = match asked {
            Asked::Rejoin => &[],
            Asked::Go => &[Transition::Go],
            Asked::Resume => &[Transition::Resume],
            Asked::Park => &[Transition::Clear, Transition::Park],
        };
        for way in ways {
            self.ask(*way);
            self.pass(50);
        }
    }
}

/// Old datagrams come again while a hall is asked for that, sooner or later after they began: no seat leaps, and none is lost once the
/// network behaves.
#[track_caller]
fn comes_again(kind: Kind, report_ms: u32, asked: Asked, trouble: Trouble) {
    for before_ms in [0, 40, 300, 600] {
        let ether = ether(kind, |seat| seat.report_ms = report_ms);
        lead(kind, &ether, LedBefore::Ended, |hall| {
            hall.leads_to(asked);
            hall.is_troubled(trouble);
            hall.pass(before_ms);
            hall.asks_after(asked);
            hall.pass(trouble.ms + 2_000);
            // It is not lost: it comes down like any other.
            for _ in 0..3 {
                assert!(hall.parks(), "{asked:?}, {trouble:?}, {before_ms} ms: {:?}", hall.state);
                hall.pass(1_500);
            }
            let mm = hall.height();
            assert!(mm < 0.5, "{asked:?}, {trouble:?}, {before_ms} ms: it is lost at {mm} mm");
        });
        assert_no_breach(&ether);
    }
}

#[test]
fn a_seat_does_not_rejoin_from_an_old_answer_that_the_network_repeats() {
    for (kind, report_ms) in [(THREE, 0), (THREE, 100), (SIX, 0), (FAST, 0), (MBOX, 0)] {
        comes_again(kind, report_ms, Asked::Rejoin, ONE);
    }
}

#[test]
fn nor_does_a_parked_hall_go_from_there() {
    for (kind, report_ms) in [(THREE, 0), (THREE, 100), (SIX, 0), (MBOX, 0)] {
        comes_again(kind, report_ms, Asked::Go, ONE);
    }
}

#[test]
fn nor_does_a_hall_resume_from_there() {
    for (kind, report_ms) in [(THREE, 0), (THREE, 100), (EIGHT, 100), (FAST, 0)] {
        comes_again(kind, report_ms, Asked::Resume, ONE);
    }
}

#[test]
fn nor_does_a_cleared_hall_park_from_there() {
    for (kind, report_ms) in [(THREE, 0), (SIX, 100), (MBOX, 0)] {
        comes_again(kind, report_ms, Asked::Park, ONE);
    }
}

#[test]
fn nor_from_one_old_answer_while_every_true_one_is_lost() {
    for asked in [Asked::Rejoin, Asked::Go, Asked::Resume, Asked::Park] {
        comes_again(THREE, 0, asked, Trouble { is_mute: true, every_us: 5_000, ..ONE });
    }
}

#[test]
fn nor_from_old_answers_to_every_read_before_the_true_ones() {
    for (asked, ms) in [(Asked::Rejoin, 1_500), (Asked::Go, 800), (Asked::Resume, 3_000), (Asked::Park, 800)]
    {
        for every_us in [200, 3_000] {
            comes_again(THREE, 0, asked, Trouble { old: Old::Answers, every_us, ms, is_mute: false });
        }
    }
}

#[test]
fn nor_from_an_old_report_that_the_registers_contradict() {
    for kind in [THREE, EIGHT] {
        for asked in [Asked::Rejoin, Asked::Go, Asked::Resume, Asked::Park] {
            comes_again(kind, 100, asked, Trouble { old: Old::Report, every_us: 20_000, ..ONE });
        }
    }
}

#[test]
fn a_hall_is_parked_once_a_reading_that_was_made_after_the_last_frame_finds_its_seats_there() {
    for kind in [THREE, SIX, FAST, KINDS[6], MBOX] {
        let ether = ether(kind, |_| {});
        lead(kind, &ether, LedBefore::Ended, |hall| {
            hall.ride(0);
            hall.pass(700);
            hall.ask(Transition::Park);
            let (mut frames, mut last) = (0, 0);
            for _ in 0..20_000 {
                hall.pass(1);
                if hall.state == State::Parked {
                    break;
                }
                let count = hall.ether.world().lines[0].frames;
                (frames, last) = if count == frames { (frames, last) } else { (count, hall.ether.ns()) };
            }
            assert_eq!(hall.state, State::Parked, "{kind:?}");
            let line = &hall.ether.world().lines[0];
            let is_there = |octets: &[u8]| {
                let told = told_places(octets, line.seat.settings.high_first);
                told.is_some_and(|told| told.iter().all(|(_, at)| f64::from(*at) < 0.2 * PULSES_PER_MM))
            };
            let read = line.said.iter().any(|(at, octets)| *at > last + 50 * MS && is_there(octets));
            assert!(read, "{kind:?}: nobody has read it since its last frame");
        });
        assert_no_breach(&ether);
    }
}
