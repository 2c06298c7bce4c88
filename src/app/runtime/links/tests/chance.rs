//! Plays over lines and units that fail by chance ([`faults`]), judged by what the axes executed.
//!
//! `KINOCUE_FAULTS` is how many faults there are at least, `KINOCUE_SEED` the first seed.

mod faults;

use std::collections::BTreeMap;

use self::faults::{BadLine, Failing, Fate, Harms};
use super::*;
use crate::drive::sixpack2::{OrderGap, Reach};
use crate::motion::AxisGeometry;
use crate::sim::chance::Chance;
use crate::sim::sixpack2::{SixpackBus, SixpackFault};

/// What an axis executed.
#[derive(Debug)]
pub(super) struct Done {
    /// mm.
    lowest: f64,
    highest: f64,
    /// mm/s.
    velocity: f64,
    /// mm/s² of a drive that ramps; of a motor that is told its speeds, by how many mm/s that changed at once.
    hardest: f64,
    /// Steps that were not made, leaps in no time, and searches that nobody asked for.
    wrong: f64,
    restarts: u32,
}

/// Drives of one family that fail.
pub(super) trait Rig: Bus + Send + Sized + 'static {
    /// The octets of an answer; those of a line where that is none.
    const ANSWER: Option<usize>;
    /// The most of [`Done::hardest`] that a seat may do.
    const HARDEST: f64;

    /// How far beyond its stroke what is damaged on the way may lead it, mm.
    fn damaged_mm() -> f64;

    /// Something happens to a unit; what, and whether it restarts one.
    fn fail(&mut self, kind: u64, fate: &mut Chance, at: MonoTime) -> (&'static str, bool);

    /// All is well again.
    fn mend(&mut self, at: MonoTime);

    fn places_mm(&self) -> Vec<f64>;

    fn done(&self) -> Vec<Done>;

    /// Opens a hall whose seat was homed, where its play has the line by a port of this kind.
    fn hall_over(
        over: impl FnOnce(SharedLine<Self>) -> Port,
        lead: impl FnOnce(&mut Hall<'_, '_, Self>, StagedShow, &Timeline),
    );
}

impl Rig for SilverBus {
    const ANSWER: Option<usize> = None;
    const HARDEST: f64 = 3_030.0;

    /// The margin of its soft limits.
    fn damaged_mm() -> f64 {
        1.01
    }

    fn fail(&mut self, kind: u64, chance: &mut Chance, at: MonoTime) -> (&'static str, bool) {
        let (index, number) = (chance.bits() % 3, 16 + (chance.bits() % 3) as u8);
        let is_reset = kind == 8 && chance.bits().is_multiple_of(8);
        let (what, action) = match kind {
            8 if is_reset => ("unit restarted", Action::Reset),
            8 | 9 => ("unit silent", Action::Dead(true)),
            10 => ("unit answers as another", Action::AnswersAs(Some(16 + index as u8))),
            _ => ("crystal off", Action::Crystal(300 * (index as i32 - 1))),
        };
        self.act(Some(number), action, at);
        (what, is_reset)
    }

    fn mend(&mut self, at: MonoTime) {
        for action in [Action::Dead(false), Action::AnswersAs(None)] {
            self.act(None, action, at);
        }
    }

    fn places_mm(&self) -> Vec<f64> {
        self.units().iter().map(|unit| (unit.place() - ZERO) / MM).collect()
    }

    fn done(&self) -> Vec<Done> {
        let done = |unit: &Unit| {
            let executed = unit.executed();
            Done {
                lowest: (executed.lowest - ZERO) / MM,
                highest: (executed.highest - ZERO) / MM,
                velocity: executed.velocity / MM,
                hardest: executed.acceleration / MM,
                wrong: f64::from(executed.jumps.saturating_sub(unit.tally().resets)),
                restarts: unit.tally().resets,
            }
        };
        self.units().iter().map(done).collect()
    }

    fn hall_over(
        over: impl FnOnce(SharedLine<Self>) -> Port,
        lead: impl FnOnce(&mut Hall<'_, '_, Self>, StagedShow, &Timeline),
    ) {
        hall_over(over, lead);
    }
}

impl Rig for SixpackBus {
    const ANSWER: Option<usize> = Some(9);
    /// What its acceleration makes in a slice, and the whole units of speed add.
    const HARDEST: f64 = 32.0;

    /// What a motor can go by one order before the next stops it, as docs/drives.md has it; answers begin within a period.
    fn damaged_mm() -> f64 {
        let period = Duration::from_micros(9_505);
        let octets = [56_818, 19_231].map(|baud| Duration::from_secs(10) / baud);
        let gap = OrderGap { period, octets, motors: 3, delay: period }.longest();
        Reach::of(&AxisGeometry { pulses_per_rev: 3_200.0, ..AxisGeometry::BENCH }, 3).stopped_mm(gap)
    }

    fn fail(&mut self, kind: u64, chance: &mut Chance, at: MonoTime) -> (&'static str, bool) {
        let is_reset = kind == 8 && chance.bits().is_multiple_of(8);
        let (what, fault) = match kind {
            8 if is_reset => ("unit restarted", SixpackFault::Reset),
            8 | 9 => ("unit hot", SixpackFault::Celsius(90)),
            _ => ("supply low", SixpackFault::Volts(11)),
        };
        self.suffer(None, fault, at);
        (what, is_reset)
    }

    fn mend(&mut self, _: MonoTime) {}

    fn places_mm(&self) -> Vec<f64> {
        self.units()[0].motors[..3].iter().map(|motor| motor.shaft.place() / sixpack::MM).collect()
    }

    fn done(&self) -> Vec<Done> {
        let motors = self.units()[0].motors[..3].iter();
        let done = motors.map(|motor| {
            let executed = motor.shaft.executed();
            Done {
                lowest: executed.lowest / sixpack::MM,
                highest: executed.highest / sixpack::MM,
                velocity: executed.velocity / sixpack::MM,
                hardest: executed.jump / sixpack::MM,
                wrong: executed.lost + f64::from(motor.own_searches),
                restarts: 0,
            }
        });
        done.collect()
    }

    fn hall_over(
        over: impl FnOnce(SharedLine<Self>) -> Port,
        lead: impl FnOnce(&mut Hall<'_, '_, Self>, StagedShow, &Timeline),
    ) {
        sixpack::hall_over(over, lead);
    }
}

impl<B: Rig> Hall<'_, '_, B> {
    fn really_mm(&self) -> Vec<f64> {
        self.line.lock().line.bus().places_mm()
    }
}

/// What came of the plays of some seeds.
#[derive(Debug, Default)]
struct Sum {
    faults: u64,
    in_motion: u64,
    kinds: BTreeMap<&'static str, u64>,
    plays: u64,
    /// Plays in which an axis moved faster or harder than a seat may.
    hard: u64,
    /// The farthest beyond a stroke, mm.
    beyond: f64,
    velocity: f64,
    hardest: f64,
}

impl Sum {
    /// Plays to a seat while things fail, then stops it.
    fn play<B: Rig>(&mut self, seed: u64, failing: Failing) {
        let harms = Harms::default();
        let bad = harms.clone();
        B::hall_over(
            |line| Box::new(BadLine::new(line, bad)),
            |hall, show, _| {
                let lead = show.lanes[0].window.lead();
                hall.go(show);
                let mut fate = Fate::new(seed, failing, harms);
                let seconds = 4.0 + 18.0 * fate.chance.draw();
                hall.run(seconds, |hall| fate.pass(hall));
                hall.runtime.desk.stop();
                // What it has braked by itself is over by then, too, if nobody could tell it to stop.
                hall.run(lead.as_secs_f64() + 0.3, |hall| fate.pass(hall));
                let places = hall.really_mm();
                hall.run(1.0, |hall| fate.pass(hall));
                if failing == Failing::Line {
                    assert_eq!(hall.really_mm(), places, "seed {seed}: it rests after a stop");
                }
                self.judge(hall, fate, seed);
            },
        );
    }

    fn judge<B: Rig>(&mut self, hall: &Hall<'_, '_, B>, fate: Fate, seed: u64) {
        let failing = fate.failing;
        let mut is_hard = false;
        for done in hall.line.lock().line.bus().done() {
            let what = format!("seed {seed}, {failing:?}: {done:?}");
            let damages = matches!(failing, Failing::Digits | Failing::Noise);
            let room = if damages { B::damaged_mm() } else { 0.1 };
            let beyond = (-done.lowest).max(done.highest - 150.0);
            assert!(beyond < room && done.wrong == 0.0, "{what}");
            assert!(done.restarts <= fate.resets || damages, "{what}");
            let exceeds = done.velocity > 241.0 || done.hardest > B::HARDEST;
            // A unit that is restarted stops as no seat does, by itself; whoever missed targets makes up for them with the next.
            let may = damages || done.restarts > 0 || B::ANSWER.is_some();
            assert!(!exceeds || may, "{what}");
            is_hard |= exceeds && done.restarts == 0;
            self.beyond = self.beyond.max(beyond);
            self.velocity = self.velocity.max(done.velocity);
            self.hardest = self.hardest.max(done.hardest);
        }
        self.hard += u64::from(is_hard);
        self.plays += 1;
        self.faults += fate.faults;
        self.in_motion += fate.in_motion;
        for (kind, count) in fate.kinds {
            *self.kinds.entry(kind).or_default() += count;
        }
    }
}

fn setting(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|value| value.parse().expect("a number"))
}

/// As many plays as there are faults to be, or enough of them for a quick look.
#[expect(clippy::print_stdout, reason = "the figures are for who asks to see them")]
fn plays<B: Rig>(failing: Failing) {
    let (faults, mut seed) = (setting("KINOCUE_FAULTS").unwrap_or(60), setting("KINOCUE_SEED").unwrap_or(1));
    let (first, mut sum) = (seed, Sum::default());
    while sum.faults < faults {
        sum.play::<B>(seed, failing);
        seed += 1;
    }
    println!("{failing:?}, seeds {first} to {}: {sum:?}", seed - 1);
}

#[test]
fn whatever_fails_on_a_line_no_axis_leaves_its_stroke_or_moves_harder_than_a_seat_may() {
    plays::<SilverBus>(Failing::Line);
}

#[test]
fn whatever_units_do_beside_no_axis_leaves_its_stroke_or_moves_harder_than_a_seat_may() {
    plays::<SilverBus>(Failing::Units);
}

#[test]
fn digits_that_units_hear_wrongly_lead_no_axis_beyond_its_soft_limits() {
    plays::<SilverBus>(Failing::Digits);
}

#[test]
fn whatever_fails_on_a_line_no_motor_leaves_its_stroke_loses_a_step_or_moves_on_after_a_stop() {
    plays::<SixpackBus>(Failing::Line);
}

#[test]
fn whatever_a_unit_of_motors_does_beside_no_motor_leaves_its_stroke_or_loses_a_step() {
    plays::<SixpackBus>(Failing::Units);
}

#[test]
fn targets_that_are_damaged_lead_no_motor_farther_than_it_goes_until_the_next() {
    plays::<SixpackBus>(Failing::Digits);
}

#[test]
fn noise_on_a_line_leads_no_axis_beyond_its_soft_limits() {
    plays::<SilverBus>(Failing::Noise);
}

#[test]
fn noise_on_a_line_leads_no_motor_farther_than_it_goes_until_the_next_order() {
    plays::<SixpackBus>(Failing::Noise);
}

/// With both of these the last target before a seat stood still had an octet twice.
#[test]
fn a_damaged_last_target_before_a_seat_stands_runs_no_motor_into_its_stop() {
    let mut sum = Sum::default();
    [1_008, 7_000].into_iter().for_each(|seed| sum.play::<SixpackBus>(seed, Failing::Digits));
}
