//! A line with virtual units, a seat on them, and whoever plays to it.

use std::time::Duration;

use rtrb::{Consumer, Producer, RingBuffer};

use super::super::*;
use crate::config::drive::DriveFamily;
use crate::config::drive::homing::{DriveHoming, HomeWay, Side};
use crate::config::drive::{SeatDrive, SilverMaxDrive, Torque};
use crate::cue::Vibration;
use crate::drive::link::*;
use crate::motion::{AxisGeometry, MAX_AXES, SeatType};
use crate::sim::serial::{LineFaults, SerialLine};
use crate::sim::silvermax::{SilverBus, Unit, UnitSetup};
use crate::time::MonoTime;
use crate::wire::FrameNo;

pub(super) const CANARY: i32 = 20_251_123;
pub(super) const BAUD: u32 = 57_600;
/// Counts of a millimetre, and of 0 mm above the lower stop.
pub(super) const MM: f64 = 800.0;
pub(super) const ZERO: f64 = 3_200.0;

/// The host's end of a virtual line of units.
pub(super) type VirtualPort = crate::drive::link::VirtualPort<SilverBus>;

/// Units 16 and up as they are set up, on a line without faults.
pub(super) fn talk_to(setups: &[UnitSetup]) -> Talk<VirtualPort> {
    let now = MonoTime::from_nanos(3_000_000_000);
    let bus = SilverBus::new(setups, BAUD, now);
    let line = SerialLine::new(bus, 11, LineFaults::default(), 7);
    Talk::new(
        VirtualPort::new(line, now),
        TalkTerms { baud: BAUD, octet_bits: 11, has_echo: false, is_two_wires: false },
    )
}

/// A seat type of three axes as the drives of the bench have it.
pub(super) fn seat() -> SeatType {
    SeatType::bench3(3).with_each(|axis| {
        *axis = AxisGeometry { pulses_per_rev: 4_000.0, ..AxisGeometry::BENCH };
    })
}

pub(super) fn drive(way: HomeWay) -> SeatDrive {
    let homing = DriveHoming {
        way,
        toward: Side::Down,
        speed_mm_s: 10.0,
        travel_mm: 165.0,
        zero_mm: -2.0,
        torque: Some(0.4),
        together: false,
    };
    SeatDrive {
        reverse: [false; MAX_AXES],
        homing,
        margin_mm: 1.0,
        max_deviation_mm: 0.5,
        vibration: 1.0,
        silvermax: Some(SilverMaxDrive {
            torque: Torque { hold: 0.6, moving: 1.0, full: 20_000 },
            gravity: 0,
            max_error_mm: 3.0,
            hold_error_mm: 1.0,
            settle_ms: 120,
        }),
        sixpack2: None,
    }
}

pub(super) const SWITCH: HomeWay = HomeWay::Switch { input: Some(1), active_high: true };

/// Homes units 16, 17, 18; with what was told.
pub(super) fn home_as(
    talk: &mut Talk<VirtualPort>,
    drive: &SeatDrive,
    units: &[u8],
) -> (Result<(), HomeError>, Vec<Step>) {
    let mut steps = Vec::new();
    let seat = SeatType { axes: units.len(), ..seat() };
    let silvermax = drive.silvermax.clone().unwrap();
    let of = SeatUnits { seat: &seat, drive, silvermax: &silvermax, units };
    let mut told = |step| steps.push(step);
    let around = Homing { canary: CANARY, goes_on: &|| true, told: &mut told };
    (home(talk, of, around), steps)
}

pub(super) fn unit(talk: &mut Talk<VirtualPort>, index: usize) -> &Unit {
    &talk.port().line.bus().units()[index]
}

/// A seat that is home, and a play to it.
pub(super) struct Play {
    pub(super) stream: Stream<VirtualPort>,
    poses: Producer<LedPose>,
    pub(super) events: Consumer<StreamEvent>,
    pub(super) terms: StreamTerms,
    /// Ticks so far, and when the first was.
    ticks: u32,
    begin: MonoTime,
    pub(super) told: Vec<(MonoTime, StreamEvent)>,
    /// The farthest that each axis was beside its poses, mm.
    pub(super) worst: [f64; 3],
    /// Poses as a function of seconds, in mm.
    pub(super) course: fn(f64, usize) -> f64,
    /// When the first pose was to be executed.
    pub(super) origin: MonoTime,
    pub(super) judged: bool,
}

pub(super) const TICK: Duration = Duration::from_millis(10);
pub(super) const PERIOD: Duration = Duration::from_micros(33_352);

impl Play {
    /// Units whose crystals are off by so much.
    pub(super) fn with_ppm(ppm: [i32; 3]) -> Self {
        let mut unit = 15;
        let setups = ppm.map(|ppm| {
            unit += 1;
            UnitSetup { ppm, place: 12_000, ..UnitSetup::new(unit) }
        });
        let mut talk = talk_to(&setups);
        let drive = drive(SWITCH);
        let (homed, _) = home_as(&mut talk, &drive, &[16, 17, 18]);
        assert_eq!(homed, Ok(()));
        talk.port().line.bus_mut().units_mut().iter_mut().for_each(Unit::forget_executed);
        let (poses, from_tick) = RingBuffer::new(64);
        let (to_health, events) = RingBuffer::new(4_096);
        let terms = StreamTerms { period: PERIOD, tick: TICK };
        let (seat, silvermax) = (seat(), drive.silvermax.clone().unwrap());
        let seat = SeatUnits { seat: &seat, drive: &drive, silvermax: &silvermax, units: &[16, 17, 18] };
        let lanes = [LaneUnits { seat, canary: Some(CANARY) }];
        let stream = Stream::new(talk, terms, &lanes, from_tick, to_health).unwrap();
        let mut play = Self {
            stream,
            poses,
            events,
            terms,
            ticks: 0,
            begin: MonoTime::from_nanos(0),
            told: Vec::new(),
            worst: [0.0; 3],
            course: |_, _| 0.0,
            origin: MonoTime::from_nanos(0),
            judged: true,
        };
        play.wait(1.0);
        assert!(play.stream.is_ready(0));
        play
    }

    pub(super) fn now(&mut self) -> MonoTime {
        self.stream.talk().now()
    }

    pub(super) fn line(&mut self) -> &mut SerialLine<SilverBus> {
        &mut self.stream.talk().port().line
    }

    pub(super) fn unit(&mut self, index: usize) -> &Unit {
        unit(self.stream.talk(), index)
    }

    /// Rounds without poses.
    pub(super) fn wait(&mut self, seconds: f64) {
        let until = self.now() + Duration::from_secs_f64(seconds);
        while self.now() < until {
            let _ = self.stream.round();
            self.hear();
        }
    }

    fn hear(&mut self) {
        let now = self.now();
        while let Ok(event) = self.events.pop() {
            self.told.push((now, event));
        }
    }

    /// Begins to play a course, from now on.
    pub(super) fn begin(&mut self, course: fn(f64, usize) -> f64) {
        (self.course, self.ticks, self.begin) = (course, 0, self.now());
        self.origin = self.begin + self.terms.lead(DriveFamily::SilverMax);
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
            let vibration = [Vibration { hz: 0.0, amplitude: 0.0 }; MAX_AXES];
            let pose = LinkPose { frame: FrameNo(self.ticks), lasts_ms: 10, axes, vibration };
            let _ =
                self.poses.push(LedPose { lane: 0, at: due + self.terms.lead(DriveFamily::SilverMax), pose });
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
        for index in 0..3 {
            let wanted = (self.course)(at, index);
            let off = (self.place(index) - wanted).abs();
            self.worst[index] = self.worst[index].max(off);
        }
    }

    /// Where an axis is, mm.
    pub(super) fn place(&mut self, index: usize) -> f64 {
        (self.unit(index).place() - ZERO) / MM
    }

    pub(super) fn figures(&self) -> [AxisFigures; 3] {
        [0, 1, 2].map(|axis| self.stream.axis(0, axis).unwrap())
    }

    /// That it stands there, mm; by the edge that homing found to a count.
    pub(super) fn assert_at(&mut self, places: [f64; 3]) {
        for (index, wanted) in places.into_iter().enumerate() {
            assert!((self.place(index) - wanted).abs() < 2.0 / MM, "{index}: {} {wanted}", self.place(index));
        }
    }

    /// That no axis left its stroke, and none moved harder than a seat may.
    pub(super) fn assert_gentle(&mut self) {
        for index in 0..3 {
            let executed = self.unit(index).executed().clone();
            let (low, high) = ((executed.lowest - ZERO) / MM, (executed.highest - ZERO) / MM);
            let (speed, acceleration) = (executed.velocity / MM, executed.acceleration / MM);
            assert!((-0.01..=150.01).contains(&low) && high <= 150.01, "{index}: {low} {high}");
            assert!(speed <= 240.5 && acceleration <= 3_060.0, "{index}: {speed} {acceleration}");
            assert_eq!((executed.jumps, self.unit(index).tally().forbidden), (0, 0), "{index}");
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
    grown * (60.0 + swing(0.31, 35.0) + swing(0.83, 12.0) + swing(1.7, 7.0))
}
