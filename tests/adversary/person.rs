//! A person, or a day, of whom nothing sensible can be expected.

use kinocue::harness::engine::Mix;
use kinocue::harness::state::{LedBefore, State, Transition};

use super::bent::Bent;
use super::dice::Dice;
use super::ether::{Ether, Weather};
use super::hall::{Hall, Thread};
use super::old;
use super::seat::MS;

/// How a hall ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Close {
    /// The history is over.
    Over,
    /// The program ends, or the configuration is read again, and the hall opens once more.
    Again(LedBefore),
}

/// Who leads a hall by chance: the seed says all that is done, up to so many deeds.
#[derive(Debug)]
pub(crate) struct Person {
    dice: Dice,
    pub(crate) deeds: u64,
    ends: u64,
    pressed: [bool; 4],
    /// What else happens, beside what always may.
    bent: Option<Bent>,
}

impl Person {
    /// One who goes away at `ends`, ns.
    pub(crate) const fn new(seed: u64, deeds: u64, ends: u64, bent: Option<Bent>) -> Self {
        Self { dice: Dice::new(seed), deeds, ends, pressed: [false; 4], bent }
    }

    /// Leads a hall until it closes.
    pub(crate) fn lead(&mut self, hall: &mut Hall<'_, '_>) -> Close {
        hall.planner_ns = self.dice.pick(&[1, 1, 8, 40]) * MS;
        hall.acks_ns = self.dice.pick(&[1, 5]) * MS;
        hall.load(self.dice.range(0, 3) as usize);
        let booted = hall.comes_to(|state| state != State::Boot, self.dice.range(400, 1_500));
        hall.note(|| format!("booted: {booted}"));
        while hall.ether.ns() < self.ends {
            let gap = self.dice.pick(&[5, 20, 60, 150, 300, 600]);
            hall.pass(self.dice.range(gap / 2, gap * 2));
            if hall.closed {
                return Close::Again(LedBefore::Ended);
            }
            if self.deeds == 0 {
                continue;
            }
            self.deeds -= 1;
            if self.dice.one_in(60) {
                hall.note(|| "the program crashes".to_owned());
                let rides = matches!(hall.state, State::Playing(_) | State::Paused);
                return Close::Again(if rides { LedBefore::OnCue } else { LedBefore::Crashed });
            }
            self.act(hall);
        }
        Close::Over
    }

    fn act(&mut self, hall: &mut Hall<'_, '_>) {
        if let Some(bent) = self.bent
            && self.dice.one_in(bent.times())
        {
            return bent.act(hall, &mut self.dice);
        }
        match self.dice.range(0, 10) {
            0..=4 => self.ask(hall),
            5..=7 => self.weather(hall),
            8 => self.handle(hall),
            _ => self.odd(hall),
        }
    }

    /// Something that leads somewhere from where the hall is, more often than not.
    fn ask(&mut self, hall: &mut Hall<'_, '_>) {
        let leads = match hall.state {
            State::Boot => &[Transition::Park, Transition::Stop][..],
            State::Recovering => &[
                Transition::Park,
                Transition::Park,
                Transition::Resume,
                Transition::Resume,
                Transition::Home,
            ],
            State::Parked => {
                &[Transition::Arm, Transition::Arm, Transition::Arm, Transition::Park, Transition::HomeAndArm]
            }
            State::Armed => &[Transition::Go, Transition::Go, Transition::Go, Transition::Disarm],
            State::Playing(_) => &[Transition::Pause, Transition::Stop, Transition::Park],
            State::Paused => &[
                Transition::Resume,
                Transition::Resume,
                Transition::Resume,
                Transition::Park,
                Transition::Stop,
            ],
            State::Stopped | State::Fault => &[Transition::Clear, Transition::Clear, Transition::Park],
            State::Homing | State::Stopping | State::Parking => {
                &[Transition::Stop, Transition::Pause, Transition::Go]
            }
        };
        let request =
            if self.dice.one_in(12) { self.dice.pick(&Transition::ALL) } else { self.dice.pick(leads) };
        // A ride is left alone for a while, or nothing would be far from park.
        if matches!(hall.state, State::Playing(_) | State::Parking) && !self.dice.one_in(4) {
            return;
        }
        if request == Transition::Seek {
            return hall.seek(self.dice.range(0, 5_900) as i64);
        }
        hall.ask(request);
        if request == Transition::Clear && self.dice.one_in(3) {
            hall.load(self.dice.range(0, 3) as usize);
        }
    }

    fn weather(&mut self, hall: &mut Hall<'_, '_>) {
        let seat = self.seat(hall);
        if self.dice.one_in(7) {
            return old::by_chance(hall, seat, &mut self.dice);
        }
        let ms = self.dice.pick(&[20, 45, 80, 150, 300, 700]);
        let weather = match self.dice.range(0, 11) {
            0 => Weather::Lost,
            1 => Weather::Thin(self.dice.range(2, 8)),
            2 => Weather::Mute,
            3 => Weather::Hoarse(self.dice.range(2, 8)),
            4 => Weather::Cut,
            5 => Weather::Held,
            6 => Weather::HeldBack,
            7 => Weather::Late(self.dice.range(2, 80)),
            8 => Weather::Shuffled,
            9 => Weather::Echo(self.dice.range(5, 400)),
            _ => Weather::Refused,
        };
        hall.note(|| format!("seat {}: {weather:?} for {ms} ms", seat + 1));
        hall.ether.turns(seat, weather, ms);
    }

    /// What is done to a seat.
    fn handle(&mut self, hall: &mut Hall<'_, '_>) {
        let (seat, now) = (self.seat(hall), hall.ether.ns());
        match self.dice.range(0, 8) {
            0 => {
                self.pressed[seat] = !self.pressed[seat];
                let pressed = self.pressed[seat];
                hall.note(|| format!("seat {}: pressed {pressed}", seat + 1));
                hall.ether.world().lines[seat].seat.press(pressed, now);
            }
            1 => {
                let dark = self.dice.pick(&[1_000, 1_500]);
                hall.note(|| format!("seat {}: its power goes for {dark} ms", seat + 1));
                hall.ether.world().lines[seat].seat.reboot(now, dark * MS);
            }
            2 | 3 => hall.set(seat, Mix { on: self.dice.one_in(2), ..hall.runtime.desk.mix(seat) }),
            4 => hall.set(
                seat,
                Mix { motion: self.dice.range(2, 11) as f64 / 10.0, ..hall.runtime.desk.mix(seat) },
            ),
            _ => {
                let axis = self.dice.range(0, hall.kind.axes[seat] as u64) as usize;
                let mm = self.dice.range(0, 120) as f64 - 60.0;
                let done = hall.ether.jog(seat, axis, mm, now);
                hall.note(|| format!("seat {}, axis {}: jogged by {mm} mm: {done}", seat + 1, axis + 1));
            }
        }
    }

    fn odd(&mut self, hall: &mut Hall<'_, '_>) {
        match self.dice.range(0, 8) {
            0..=2 => {
                let thread = self.dice.pick(&[Thread::Tick, Thread::Acks, Thread::Planner, Thread::All]);
                let ms = self.dice.pick(&[15, 40, 60, 120, 400]);
                let ms = if thread == Thread::All && self.dice.one_in(3) { 2_300 } else { ms };
                hall.still(thread, ms);
            }
            3 => hall.trim(self.dice.range(0, 1_000) as i32 - 500),
            4 | 5 => hall.load(self.dice.range(0, 3) as usize),
            6 => hall.seek(self.dice.range(0, 5_900) as i64),
            _ => hall.leave(),
        }
    }

    fn seat(&mut self, hall: &Hall<'_, '_>) -> usize {
        self.dice.range(0, hall.kind.axes.len() as u64) as usize
    }

    /// How seats are set before anybody comes.
    pub(crate) fn furnish(&mut self, ether: &Ether) {
        let world = &mut *ether.world();
        for line in &mut world.lines {
            let settings = &mut line.seat.settings;
            settings.hurry = !self.dice.one_in(3);
            settings.cut_ms = self.dice.pick(&[3_000, 3_000, 500, 0]);
            settings.stop_mode = self.dice.pick(&[0, 0, 1, 2]);
            settings.report_ms = self.dice.pick(&[0, 0, 100]);
            settings.high_first = self.dice.one_in(25);
            let axes = settings.axes;
            for axis in 0..axes {
                if self.dice.one_in(6) {
                    // Some stand a little outside of their stroke.
                    line.seat.put(axis, self.dice.range(0, 165) as f64 - 10.0);
                }
            }
            if let Some(bent) = self.bent {
                bent.furnish(&mut line.seat.settings);
            }
        }
    }
}
