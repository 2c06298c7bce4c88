//! Seats on virtual drives, and whoever plays to them, in virtual time.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "numbers of axes and ticks"
)]

use std::time::Duration;

use rtrb::{Consumer, Producer, RingBuffer};

use super::{
    Family, LedPose, LinkPlay as _, LinkPose, LinkTalk as _, Stalls, Stream, StreamEvent, StreamTerms,
    VirtualPort,
};
use crate::cue::Vibration;
use crate::motion::MAX_AXES;
use crate::sim::chance::Chance;
use crate::sim::serial::{Bus, SerialLine};
use crate::time::MonoTime;
use crate::wire::FrameNo;

pub(crate) const TICK: Duration = Duration::from_millis(10);

/// A play to seats of three axes each, all led alike.
pub(crate) struct VirtualPlay<F: Family, B: Bus> {
    pub(crate) stream: Stream<F, VirtualPort<B>>,
    poses: Producer<LedPose>,
    pub(crate) events: Consumer<StreamEvent>,
    pub(crate) terms: StreamTerms,
    pub(crate) seats: u16,
    /// Ticks so far, and when the first was.
    ticks: u32,
    begin: MonoTime,
    pub(crate) told: Vec<(MonoTime, StreamEvent)>,
    /// The farthest that each axis of any seat was beside its poses, mm.
    pub(crate) worst: [f64; 3],
    /// Poses as a function of seconds, in mm.
    pub(crate) course: fn(f64, usize) -> f64,
    /// When the first pose was to be executed.
    pub(crate) origin: MonoTime,
    /// Keeps `worst`, told the seconds since then.
    judge: fn(&mut Self, f64),
    pub(crate) judged: bool,
}

impl<F: Family, B: Bus> VirtualPlay<F, B> {
    /// A play to seats that are home or not, each for the first time.
    pub(crate) fn over(
        talk: F::Talk<VirtualPort<B>>,
        period: Duration,
        seats: &[F::Seat<'_>],
        judge: fn(&mut Self, f64),
    ) -> Result<Self, F::Error> {
        let (poses, from_tick) = RingBuffer::new(64);
        let (to_health, events) = RingBuffer::new(16_384);
        let terms = StreamTerms { period, tick: TICK };
        let begin = MonoTime::from_nanos(0);
        let mut play = Self {
            stream: Stream::new(talk, terms, seats, from_tick, to_health)?,
            poses,
            events,
            terms,
            seats: u16::try_from(seats.len()).unwrap(),
            ticks: 0,
            begin,
            told: Vec::new(),
            worst: [0.0; 3],
            course: |_, _| 0.0,
            origin: begin,
            judge,
            judged: true,
        };
        (0..play.seats).for_each(|seat| play.stream.look(seat));
        Ok(play)
    }

    pub(crate) fn now(&mut self) -> MonoTime {
        self.stream.talk.now()
    }

    pub(crate) fn line(&mut self) -> &mut SerialLine<B> {
        &mut self.stream.talk.port().line
    }

    /// How long before a seat is there its poses come.
    pub(crate) fn lead(&self) -> Duration {
        F::LEAD.over(self.terms)
    }

    pub(crate) fn all_ready(&self) -> bool {
        (0..self.seats).all(|seat| self.stream.is_ready(seat))
    }

    /// Rounds without poses.
    pub(crate) fn wait(&mut self, seconds: f64) {
        let until = self.now() + Duration::from_secs_f64(seconds);
        while self.now() < until {
            let _ = self.stream.round();
            self.hear();
        }
    }

    pub(crate) fn hear(&mut self) {
        let now = self.now();
        while let Ok(event) = self.events.pop() {
            self.told.push((now, event));
        }
    }

    /// Begins to play a course, from now on.
    pub(crate) fn begin(&mut self, course: fn(f64, usize) -> f64) {
        (self.course, self.ticks, self.begin) = (course, 0, self.now());
        self.origin = self.begin + self.lead();
    }

    /// Ticks of so many seconds; `missed` of them, at the beginning, are slept through.
    pub(crate) fn play(&mut self, seconds: f64, missed: u32) {
        self.begin = self.begin + TICK * missed;
        let count = (seconds / TICK.as_secs_f64()).round() as u32;
        for _ in 0..count {
            let due = self.begin + TICK * self.ticks;
            while self.now() < due {
                let _ = self.stream.round();
                self.hear();
                let now = self.now();
                if self.judged && now >= self.origin && self.ticks > 0 {
                    (self.judge)(self, now.since(self.origin).as_secs_f64());
                }
            }
            let stream = f64::from(self.ticks) * TICK.as_secs_f64();
            let mut axes = [0.0; MAX_AXES];
            for (index, place) in axes.iter_mut().take(3).enumerate() {
                *place = (self.course)(stream, index) / 150.0;
            }
            let vibration = [Vibration { hz: 0.0, amplitude: 0.0 }; MAX_AXES];
            let pose = LinkPose { frame: FrameNo(self.ticks), lasts_ms: 10, axes, vibration };
            let at = due + self.lead();
            for lane in 0..self.seats {
                let _ = self.poses.push(LedPose { lane, at, pose });
            }
            self.ticks += 1;
        }
    }

    /// So many shows of a minute each, over a thread that is held up as one of a real-time priority is; nothing is to happen in them that
    /// should not.
    pub(crate) fn shows(&mut self, count: u64, course: fn(f64, usize) -> f64) {
        self.judged = false;
        self.stream.talk.port().stalls = Some(Stalls(Chance::new(7, 0)));
        for show in 0..count {
            self.begin(course);
            self.play(57.0, 0);
            self.wait(3.0);
            assert!(self.rare().is_empty() && self.all_ready(), "show {show}: {:?}", self.rare());
            self.told.clear();
            self.stream.talk.port().sent.clear();
        }
    }

    /// What happened that should not, as words.
    pub(crate) fn rare(&self) -> Vec<String> {
        let rare = |event: &&(_, StreamEvent)| {
            !matches!(
                event.1,
                StreamEvent::Confirmed { .. }
                    | StreamEvent::Withdrawn { .. }
                    | StreamEvent::Read { .. }
                    | StreamEvent::Homed { homed: true, .. }
                    | StreamEvent::Moves { .. }
                    | StreamEvent::Rests { .. }
            )
        };
        self.told.iter().filter(rare).map(|(_, event)| format!("{event:?}")).collect()
    }

    pub(crate) fn has(&self, word: &str) -> bool {
        self.rare().iter().any(|event| event.contains(word))
    }
}

/// Swings about a place of up to some 190 mm/s and 1,900 mm/s² that begin gently, in mm.
pub(crate) fn ride_about(middle: f64, at: f64, axis: usize) -> f64 {
    use std::f64::consts::TAU;
    let phase = 0.4 * axis as f64;
    let at = (at - 0.5).max(0.0);
    let grown = (at / 3.0).min(1.0);
    let grown = grown * grown * grown * (10.0 - grown * (15.0 - 6.0 * grown));
    let swing = |hz: f64, mm: f64| mm * (TAU * hz * at + phase).sin();
    grown * (middle + swing(0.31, 35.0) + swing(0.83, 12.0) + swing(1.7, 7.0))
}

/// The same for a minute less three seconds, ended as gently.
pub(crate) fn ride_for_a_minute(middle: f64, at: f64, axis: usize) -> f64 {
    let ends = ((at - 52.0) / 4.0).clamp(0.0, 1.0);
    ride_about(middle, at, axis) * (1.0 - ends * ends * ends * (10.0 - ends * (15.0 - 6.0 * ends)))
}

/// How many shows of a minute are played in the two soaks: 60 are an hour.
pub(crate) fn soaks() -> u64 {
    std::env::var("KINOCUE_SHOWS").map_or(1, |shows| shows.parse().expect("a number"))
}

/// To 40, 50 and 60 mm in two seconds, in mm.
pub(crate) fn there(at: f64, axis: usize) -> f64 {
    let part = (at / 2.0).clamp(0.0, 1.0);
    (40.0 + 10.0 * axis as f64) * part * part * part * (10.0 - part * (15.0 - 6.0 * part))
}

/// And back.
pub(crate) fn back(at: f64, axis: usize) -> f64 {
    there(2.0 - at, axis)
}
