//! Orders that are damaged on their way into others that a unit takes, in each stage of a lane: how far they lead a motor, by what it executed.

use std::time::Duration;

use super::super::{OrderGap, Reach};
use super::bench::*;
use super::play::*;

use crate::drive::link::*;
use crate::sim::serial::LineFaults;
use crate::wire::sixpack2::{PiTarget, Rotation, SixpackCommand};

/// What becomes of an order to the first motor, or of a question where it is.
#[derive(Debug, Clone, Copy)]
enum Becomes {
    /// A target so many mm from where it is.
    Near(f64),
    /// One that no seat has.
    Far(i32),
    /// The order to turn.
    Turn(i16),
    /// A question becomes a target at the address of its answer, by one bit.
    Asked,
}

const KINDS: [Becomes; 9] = [
    Becomes::Near(2.0),
    Becomes::Near(-30.0),
    // By a bit of a stop; by an octet of a target that came twice: 0f8e8e00 in place of 000f8e.
    Becomes::Far(0),
    Becomes::Far(261_000_910),
    Becomes::Turn(256),
    Becomes::Turn(-511),
    Becomes::Turn(i16::MAX),
    Becomes::Turn(i16::MIN),
    Becomes::Asked,
];

/// How a lane comes to the stage in which the order is damaged; each stage at least once.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Scene {
    stage: Stage,
    /// It was led before, and is told to hold.
    holds: bool,
}

/// All of them. A stage that is new has to say which one it comes before.
fn scenes() -> Vec<Scene> {
    let next = |stage: &Stage| match stage {
        Stage::Ready => Some(Stage::Runs),
        Stage::Runs => Some(Stage::Ends),
        Stage::Ends => Some(Stage::Readying),
        Stage::Readying => Some(Stage::Lost),
        Stage::Lost => Some(Stage::Out),
        Stage::Out => None,
    };
    let stages = std::iter::successors(Some(Stage::Ready), next);
    let scene = |stage| [true, false].map(|holds| Scene { stage, holds });
    let is_one = |scene: &Scene| scene.holds != matches!(scene.stage, Stage::Lost | Stage::Out);
    stages.flat_map(scene).filter(|scene| is_one(scene) || scene.stage == Stage::Readying).collect()
}

impl Scene {
    /// A play to a seat that is in it.
    fn set(self) -> Play {
        let mut play = Play::homed(&[wired(1, false)], BAUD);
        if self.stage == Stage::Ready {
            return play;
        }
        play.begin(ride);
        play.play(5.0, 0);
        play.judged = false;
        match self.stage {
            Stage::Ready | Stage::Runs => {}
            Stage::Ends => play.stream.stop().unwrap(),
            Stage::Readying if self.holds => {
                play.stream.stop().unwrap();
                until(&mut play, Stage::Readying);
            }
            Stage::Readying | Stage::Lost => {
                // What it is told arrives.
                play.line().faults = LineFaults { answer_lost: 1.0, ..LineFaults::default() };
                until(&mut play, Stage::Lost);
                play.wait(0.5);
                if self.stage == Stage::Readying {
                    play.line().faults = LineFaults::default();
                    until(&mut play, Stage::Readying);
                }
            }
            Stage::Out => {
                play.stream.put_out(0, StreamEvent::OffCourse { lane: 0, axis: 0, by_mm: 1.0 });
                play.wait(0.5);
            }
        }
        assert_eq!(play.stream.lanes[0].stage, self.stage);
        play
    }

    /// The most that a damaged order may lead the motor beside its way, mm.
    fn most(self, play: &Play) -> f64 {
        let octet = |baud: u32| Duration::from_secs(10) / baud;
        // Who is lost is asked at the rate with which it wakes, too.
        let asked = octet(if self.stage == Stage::Lost { 19_231 } else { BAUD });
        let (octets, delay) = ([octet(BAUD), asked], play.stream.talk.delay_p99());
        let gap = OrderGap { period: PERIOD, octets, motors: 3, delay }.longest();
        let reach = Reach::of(&seat().own()[0], 3);
        let seat_mm_s = if self.stage == Stage::Runs { 190.0 } else { 0.0 };
        if self.holds { reach.led_mm(gap, seat_mm_s) } else { reach.stopped_mm(gap) }
    }
}

fn until(play: &mut Play, stage: Stage) {
    for _ in 0..10_000 {
        if play.stream.lanes[0].stage == stage {
            return;
        }
        let _ = play.stream.round();
        play.hear();
    }
    panic!("never {stage:?}: {:?}", play.rare());
}

impl Becomes {
    /// Damages the next order to the first motor, or the next question where it is; false where none comes.
    fn happen(self, play: &mut Play) -> bool {
        let here = motor(&mut play.stream.talk, 0).position();
        let order: SixpackCommand = match self {
            Self::Near(mm) => PiTarget { motor: 0, target: here + (mm * MM) as i32 }.into(),
            Self::Far(target) => PiTarget { motor: 0, target }.into(),
            Self::Turn(velocity) => Rotation { motor: 0, velocity }.into(),
            Self::Asked => PiTarget { motor: 0, target: 255 }.into(),
        };
        let (octets, is_question) = (order.frame(1).octets(), matches!(self, Self::Asked));
        play.stream.talk.port().damage = Some(Box::new(move |sent| {
            let is_it = |frame: &&mut [u8]| {
                let is_order = matches!(frame[1], 0x24 | 0x25) && !is_question;
                (is_order || frame[1] == 0x20 && is_question) && frame[2] == 0
            };
            let frame = sent.chunks_exact_mut(octets.len()).find(is_it);
            frame.map(|frame| frame.copy_from_slice(&octets)).is_some()
        }));
        let seconds = play.now() + Duration::from_secs(1);
        while play.now() < seconds {
            if play.judged {
                play.play(0.01, 0)
            } else {
                let _ = play.stream.round();
            }
            if play.stream.talk.port().damage.is_none() {
                return true;
            }
        }
        play.stream.talk.port().damage = None;
        false
    }
}

/// How far beside its way a motor was led, mm; none where no such order is sent.
fn led(scene: Scene, becomes: Becomes, late_ms: u32, play: &mut Play) -> Option<f64> {
    play.judged = scene.stage == Stage::Runs;
    play.worst = [0.0; 3];
    if !play.judged {
        play.wait(f64::from(late_ms) / 1e3);
    }
    let from = place(&mut play.stream.talk, 0);
    play.bus_mut().forget();
    if !becomes.happen(play) {
        return None;
    }
    if play.judged {
        play.play(1.0, 0);
        return Some(play.worst[0]);
    }
    play.wait(1.0);
    assert!(play.speed() == 0.0, "{scene:?} {becomes:?}: it rests");
    let to = place(&mut play.stream.talk, 0);
    let executed = motor(&mut play.stream.talk, 0).shaft.executed();
    // A brake goes on from where it was.
    let ends = if scene.stage == Stage::Ends { to } else { from };
    assert!(!scene.holds || (to - ends).abs() < 0.1, "{scene:?} {becomes:?}: it is back");
    Some((from.min(ends) - executed.lowest / MM).max(executed.highest / MM - from.max(ends)))
}

/// Nothing is told to a lane while another is homed or asked, and none once a play is over.
#[test]
fn what_was_damaged_right_before_nobody_is_told_anything_is_found_and_stopped() {
    for (scene, becomes) in scenes().into_iter().flat_map(|scene| KINDS.map(|becomes| (scene, becomes))) {
        // The others are busy, and not left alone.
        if !matches!(scene.stage, Stage::Ready | Stage::Out) {
            continue;
        }
        let mut play = scene.set();
        let (from, most) = (place(&mut play.stream.talk, 0), Scene { holds: false, ..scene }.most(&play));
        play.bus_mut().forget();
        if !becomes.happen(&mut play) {
            continue;
        }
        play.stream.settle().unwrap();
        let settled = play.now() + Duration::from_secs(2);
        play.stream.talk.port().sleep_until(settled);
        let executed = motor(&mut play.stream.talk, 0).shaft.executed();
        let mm = (from - executed.lowest / MM).max(executed.highest / MM - from);
        assert!(mm <= most && play.speed() == 0.0, "{scene:?} {becomes:?}: {mm} of {most} mm");
    }
}

#[test]
fn a_stop_that_has_a_counter_begin_anew_before_nobody_is_told_anything_is_found_and_its_lane_is_out() {
    let scene = Scene { stage: Stage::Ready, holds: true };
    let mut play = scene.set();
    play.stream.talk.port().damage = Some(Box::new(|sent| {
        let stop = sent.chunks_exact_mut(9).find(|frame| frame[1] == 0x25);
        stop.map(|frame| frame[1] ^= 0x02).is_some()
    }));
    // Its motor holds a place, and that is elsewhere by its counter now.
    let (from, most) = (place(&mut play.stream.talk, 0), Scene { holds: false, ..scene }.most(&play));
    play.stream.settle().unwrap();
    let last = play.stream.talk.port().sent.last().map(|(_, octets)| octets[1]);
    assert_eq!(last, Some(0x20), "the reading that says so is the last that it is asked");
    play.wait(1.0);
    assert!(play.has("OffCourse") && !play.stream.is_ready(0), "{:?}", play.rare());
    let mm = (place(&mut play.stream.talk, 0) - from).abs();
    assert!(mm <= most && play.speed() == 0.0, "{mm} of {most} mm");
}

#[test]
fn no_damaged_order_leads_a_motor_farther_than_it_goes_until_the_next_whatever_its_lane_does() {
    let mut farthest = Vec::new();
    for scene in scenes() {
        let lasts = matches!(scene.stage, Stage::Ready | Stage::Runs | Stage::Lost | Stage::Out);
        let (mut play, mut worst) = (scene.set(), (0.0_f64, None));
        for becomes in KINDS {
            for late_ms in [0, 5, 13] {
                if !lasts {
                    play = scene.set();
                }
                let most = scene.most(&play);
                let Some(mm) = led(scene, becomes, late_ms, &mut play) else { continue };
                assert!(
                    mm <= most,
                    "{scene:?} {becomes:?} {late_ms} ms: {mm} of {most} mm {:?}",
                    play.rare()
                );
                if mm > worst.0 {
                    worst = (mm, Some((becomes, most)));
                }
            }
        }
        farthest.push((scene, worst));
    }
    // They do go somewhere.
    assert!(farthest.iter().all(|(_, (mm, _))| *mm > 1.0), "{farthest:#?}");
}
