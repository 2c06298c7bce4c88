//! Seats that are home, and a play to them.

use std::time::Duration;

use rtrb::{Consumer, Producer, RingBuffer};

use super::bench::*;
use crate::config::drive::DriveFamily;
use crate::cue::Vibration;
use crate::drive::link::{LedPose, LinkPose, StreamEvent, StreamTerms};
use crate::drive::sixpack2::*;
use crate::motion::MAX_AXES;
use crate::sim::serial::SerialLine;
use crate::sim::sixpack2::{SixpackBus, SixpackSetup};
use crate::time::MonoTime;
use crate::wire::FrameNo;

pub(super) const TICK: Duration = Duration::from_millis(10);

pub(super) fn wired(unit: u8, is_two_wires: bool) -> SixpackSetup {
    SixpackSetup { is_two_wires, ..unit_with(unit, shaft()) }
}

/// A play of one seat on the first three motors of each unit, all led alike.
pub(super) struct Play {
    pub(super) stream: Stream<VirtualPort>,
    poses: Producer<LedPose>,
    events: Consumer<StreamEvent>,
    pub(super) terms: StreamTerms,
    pub(super) seats: u16,
    ticks: u32,
    begin: MonoTime,
    pub(super) told: Vec<(MonoTime, StreamEvent)>,
    /// The farthest that each axis of any seat was beside its poses, mm.
    pub(super) worst: [f64; 3],
    /// Poses as a function of seconds, in mm.
    course: fn(f64, usize) -> f64,
    /// When the first pose was to be executed.
    pub(super) origin: MonoTime,
    pub(super) judged: bool,
}

type Opened = (Stream<VirtualPort>, Producer<LedPose>, Consumer<StreamEvent>, StreamTerms);

impl Play {
    /// A stream to a seat on each of so many units.
    pub(super) fn stream_over(talk: Talk<VirtualPort>, units: u8) -> Result<Opened, HomeError> {
        let period = if units > 1 { Duration::from_micros(11_900) } else { PERIOD };
        let (poses, from_tick) = RingBuffer::new(64);
        let (to_health, events) = RingBuffer::new(16_384);
        let terms = StreamTerms { period, tick: TICK };
        let (seat, drive) = (seat(), drive(SWITCH));
        let sixpack2 = drive.sixpack2.clone().unwrap();
        let of = |unit| SeatMotors {
            seat: &seat,
            drive: &drive,
            sixpack2: &sixpack2,
            unit,
            motors: &[0, 1, 2],
            period: PERIOD,
        };
        let lanes: Vec<_> = (1..=units).map(of).collect();
        Ok((Stream::new(talk, terms, &lanes, from_tick, to_health)?, poses, events, terms))
    }

    pub(super) fn over(setups: &[SixpackSetup], baud: u32) -> Self {
        let mut talk = talk_at(setups, baud);
        let numbers: Vec<u8> = setups.iter().map(|setup| setup.unit).collect();
        find(&mut talk, &numbers).unwrap();
        for unit in &numbers {
            assert_eq!(home_on(&mut talk, &drive(SWITCH), *unit, &[0, 1, 2]).0, Ok(()));
        }
        talk.port().line.bus_mut().forget();
        let (stream, poses, events, terms) = Self::stream_over(talk, setups.len() as u8).unwrap();
        let (begin, seats) = (MonoTime::from_nanos(0), setups.len() as u16);
        let mut play = Self {
            stream,
            poses,
            events,
            terms,
            seats,
            ticks: 0,
            begin,
            told: Vec::new(),
            worst: [0.0; 3],
            course: |_, _| 0.0,
            origin: begin,
            judged: true,
        };
        (0..seats).for_each(|seat| play.stream.look(seat));
        play.wait(1.0);
        assert!((0..seats).all(|seat| play.stream.is_ready(seat)), "{:?}", play.rare());
        play
    }

    pub(super) fn now(&mut self) -> MonoTime {
        self.stream.talk().now()
    }

    pub(super) fn line(&mut self) -> &mut SerialLine<SixpackBus> {
        &mut self.stream.talk().port().line
    }

    pub(super) fn bus(&mut self) -> &SixpackBus {
        self.line().bus()
    }

    pub(super) fn bus_mut(&mut self) -> &mut SixpackBus {
        self.line().bus_mut()
    }

    /// Rounds without poses.
    pub(super) fn wait(&mut self, seconds: f64) {
        let until = self.now() + Duration::from_secs_f64(seconds);
        while self.now() < until {
            let _ = self.stream.round();
            self.hear();
        }
    }

    pub(super) fn hear(&mut self) {
        let now = self.now();
        while let Ok(event) = self.events.pop() {
            self.told.push((now, event));
        }
    }

    /// Begins to play a course, from now on.
    pub(super) fn begin(&mut self, course: fn(f64, usize) -> f64) {
        (self.course, self.ticks, self.begin) = (course, 0, self.now());
        self.origin = self.begin + self.terms.lead(DriveFamily::Sixpack2);
    }

    /// Ticks of so many seconds; `missed` of them, at the beginning, are slept through.
    pub(super) fn play(&mut self, seconds: f64, missed: u32) {
        self.begin = self.begin + TICK * missed;
        let count = (seconds / TICK.as_secs_f64()).round() as u32;
        for _ in 0..count {
            let due = self.begin + TICK * self.ticks;
            while self.now() < due {
                let _ = self.stream.round();
                self.hear();
                self.judge();
            }
            let stream = f64::from(self.ticks) * TICK.as_secs_f64();
            let mut axes = [0.0; MAX_AXES];
            for (index, place) in axes.iter_mut().take(3).enumerate() {
                *place = (self.course)(stream, index) / 150.0;
            }
            for lane in 0..self.seats {
                let vibration = [Vibration { hz: 0.0, amplitude: 0.0 }; MAX_AXES];
                let pose = LinkPose { frame: FrameNo(self.ticks), lasts_ms: 10, axes, vibration };
                let _ =
                    self.poses.push(LedPose { lane, at: due + self.terms.lead(DriveFamily::Sixpack2), pose });
            }
            self.ticks += 1;
        }
    }

    /// How far the axes are beside where they should be by now.
    fn judge(&mut self) {
        let now = self.now();
        if !self.judged || now < self.origin || self.ticks == 0 {
            return;
        }
        let at = now.since(self.origin).as_secs_f64();
        for (index, place) in self.places().into_iter().enumerate() {
            let wanted = (self.course)(at, index % 3);
            // Where a motor is between two loops is that of the first: half a loop late.
            let later = (self.course)(at - 0.002, index % 3);
            let off = if (place - wanted) * (place - later) <= 0.0 {
                0.0
            } else {
                (place - wanted).abs().min((place - later).abs())
            };
            self.worst[index % 3] = self.worst[index % 3].max(off);
        }
    }

    /// Where the axes are, mm, seat by seat.
    pub(super) fn places(&mut self) -> Vec<f64> {
        let motors = self.bus().units().iter().flat_map(|unit| &unit.motors[..3]);
        motors.map(|motor| motor.shaft.place() / MM).collect()
    }

    /// The farthest that an axis is beside these places.
    pub(super) fn off(&mut self, places: [f64; 3]) -> f64 {
        let off =
            self.places().into_iter().enumerate().map(|(index, place)| (place - places[index % 3]).abs());
        off.fold(0.0, f64::max)
    }

    /// Of the fastest axis, mm/s.
    pub(super) fn speed(&mut self) -> f64 {
        let motors = self.bus().units().iter().flat_map(|unit| &unit.motors[..3]);
        let speeds = motors
            .map(|motor| f64::from(motor.speed()).abs() * crate::wire::sixpack2::steps_of_a_unit(3) / MM);
        speeds.fold(0.0, f64::max)
    }

    /// What happened that should not, as words.
    pub(super) fn rare(&self) -> Vec<String> {
        let rare = |event: &&(_, StreamEvent)| {
            !matches!(
                event.1,
                StreamEvent::Confirmed { .. }
                    | StreamEvent::Read { .. }
                    | StreamEvent::Homed { homed: true, .. }
                    | StreamEvent::Moves { .. }
                    | StreamEvent::Rests { .. }
            )
        };
        self.told.iter().filter(rare).map(|(_, event)| format!("{event:?}")).collect()
    }

    pub(super) fn has(&self, word: &str) -> bool {
        self.rare().iter().any(|event| event.contains(word))
    }

    /// That no axis left its stroke, and none lost a step.
    pub(super) fn assert_inside(&mut self) {
        for unit in self.bus().units() {
            for (index, motor) in unit.motors[..3].iter().enumerate() {
                let executed = motor.shaft.executed();
                let (low, high) = (executed.lowest / MM, executed.highest / MM);
                assert!(low >= -0.06 && high <= 150.06, "{index}: {low} {high}");
                assert_eq!((executed.lost, motor.own_searches), (0.0, 0), "{index}");
            }
        }
    }

    /// That besides no motor was made to jump by more than a seat's acceleration makes in a slice, and the whole units of speed add.
    pub(super) fn assert_gentle(&mut self) {
        self.assert_inside();
        for unit in self.bus().units() {
            for (index, motor) in unit.motors[..3].iter().enumerate() {
                let jump = motor.shaft.executed().jump / MM;
                assert!(jump <= 32.0, "{index}: {jump} mm/s at once");
            }
        }
    }
}

/// Swings of up to some 190 mm/s and 1,900 mm/s² that begin gently, in mm.
pub(super) fn ride(at: f64, axis: usize) -> f64 {
    use std::f64::consts::TAU;
    let phase = 0.4 * axis as f64;
    let at = (at - 0.5).max(0.0);
    let grown = (at / 3.0).min(1.0);
    let grown = grown * grown * grown * (10.0 - grown * (15.0 - 6.0 * grown));
    let swing = |hz: f64, mm: f64| mm * (TAU * hz * at + phase).sin();
    grown * (72.0 + swing(0.31, 35.0) + swing(0.83, 12.0) + swing(1.7, 7.0))
}
