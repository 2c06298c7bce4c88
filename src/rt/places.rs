//! Between what is known of where seats are and the engine that leads them: seats that were found go into the engine, lanes of
//! which nobody knows which frames arrive go blind, and each frame is held against what is known before it leaves. Tick
//! thread; allocates nothing.

use std::time::Duration;

use super::mail::{Mail, Sent};
use crate::belief::{Belief, Fall, Found, Known, KnownPose, Lead, Taken, Tally};
use crate::drive::Lane;
use crate::engine::{Beat, Engine, LaneOrder, PlayProgress};
use crate::motion::Pose;
use crate::net::Delivery;
use crate::time::{MonoTime, Rate};
use crate::wire::Timing;

/// What is known of the seats of all lanes, over all shows of a hall.
#[derive(Debug)]
pub struct Places {
    lanes: Vec<Place>,
    /// Whether frames went out in the tick before.
    moved: bool,
    /// When it looked last.
    looked: MonoTime,
    /// A motion waits for all seats to be read once more.
    waits: Option<Wait>,
    /// After how long without a tick a seat may have been moved meanwhile.
    asleep: Duration,
}

#[derive(Debug, Clone, Copy)]
struct Wait {
    since: MonoTime,
    /// When that was asked for last.
    asked: MonoTime,
    /// When no seat was waited for last.
    met: MonoTime,
    /// Whether nothing has begun yet: else the film runs on meanwhile.
    begins: bool,
}

/// How often seats are read that a motion waits for, and for how long it waits.
const READ_EVERY: Duration = Duration::from_millis(50);
const WAITS_FOR: Duration = Duration::from_millis(400);
/// A seat to which no frame went for so long may have been moved by hand.
const ASLEEP: Duration = Duration::from_millis(250);

#[derive(Debug)]
struct Place {
    belief: Belief,
    /// The longest Time that its controller executes as it is, ms (PA0b).
    longest_ms: u32,
}

impl Place {
    /// An absolute Time takes the longer the more of the frames before it are lost: by itself it keeps the greatest speed.
    #[inline]
    fn is_plain(&self, beat: &Beat, at: MonoTime) -> bool {
        self.belief.is_sure() || beat.timing == Timing::Absolute || !self.belief.may_hold_back(at)
    }
}

impl Places {
    /// Nothing is known of the seats of these lanes.
    #[must_use]
    pub fn new(lanes: &[Lane], rate: Rate) -> Self {
        let place = |lane: &Lane| Place {
            belief: Belief::new(&lane.window, rate.period(), lane.ack_every),
            longest_ms: lane.longest_ms,
        };
        Self {
            lanes: lanes.iter().map(place).collect(),
            moved: false,
            looked: MonoTime::default(),
            waits: None,
            asleep: ASLEEP.max(3 * rate.period()),
        }
    }

    /// What is known of a lane's seat.
    ///
    /// # Panics
    /// Where there is no such lane.
    #[must_use]
    pub(crate) fn belief(&self, lane: usize) -> &Belief {
        &self.lanes[lane].belief
    }

    /// What was withheld, lane by lane.
    pub(crate) fn tallies(&self) -> impl Iterator<Item = Tally> {
        self.lanes.iter().map(|place| *place.belief.tally())
    }

    /// Takes up what the ack thread has seen, once a tick; `moving` says whether frames go out.
    pub fn look(&mut self, engine: &mut Engine, mail: &Mail, now: MonoTime, moving: bool) {
        let since = std::mem::replace(&mut self.looked, now);
        if moving && self.moved && now.since(since) > self.asleep && mail.live().has_reader() {
            self.lose_sight(engine, mail, now);
        }
        let told = mail.told();
        for lane in 0..self.lanes.len() {
            match self.take_evidence(lane, mail, told, now) {
                Found::Nothing => {}
                // One that is led ahead brakes by itself where nothing reaches it; slow lines do not.
                Found::Gap if self.lanes[lane].belief.is_led_ahead() => {
                    engine.order(lane, LaneOrder::FallOut(Fall::Gap));
                }
                Found::Gap => {
                    let elsewhere = self.lanes[lane].belief.led_elsewhere();
                    elsewhere.iter().for_each(|led| engine.led_instead(lane, led));
                    engine.order(lane, LaneOrder::GoBlind);
                }
                Found::Astray => engine.order(lane, LaneOrder::FallOut(Fall::Astray)),
            }
            let Place { belief, .. } = &self.lanes[lane];
            let is_unseen = engine.lane(lane).is_unseen();
            if !is_unseen && !engine.rests_at(lane).is_some_and(|pose| belief.contradicts(pose)) {
                continue;
            }
            if let Some(known) = known(belief, moving && self.moved, mail, now) {
                engine.found(lane, &known, belief.near());
            } else if is_unseen && moving && self.waits.is_none() {
                engine.order(lane, LaneOrder::FallOut(Fall::Gap));
            }
        }
    }

    /// The tick thread was held up for so long that seats may have been moved meanwhile: each is read before a frame goes to it
    /// again.
    #[cold]
    fn lose_sight(&mut self, engine: &mut Engine, mail: &Mail, now: MonoTime) {
        for (lane, place) in self.lanes.iter_mut().enumerate() {
            place.belief.forget();
            engine.order(lane, LaneOrder::LoseSight);
        }
        self.wait(mail, now, self.waits.is_some_and(|wait| wait.begins));
    }

    fn wait(&mut self, mail: &Mail, now: MonoTime, begins: bool) {
        self.waits = Some(Wait { since: now, asked: now, met: now, begins });
        mail.live().want(now);
    }

    /// Whether a motion may go on. One that begins waits until all seats were read since it was asked for, some milliseconds, and goes on
    /// reading them until its way is planned and its first frame leaves; a seat that moves meanwhile, or does not answer, is left out. For
    /// one that begins `soon`, at an instant, all of that is done before, and at the instant nothing waits.
    pub(super) fn may_go_on(
        &mut self,
        engine: &mut Engine,
        mail: &Mail,
        now: MonoTime,
        moving: bool,
        soon: bool,
    ) -> bool {
        let moved = std::mem::replace(&mut self.moved, moving);
        // Whoever parks may rest until one comes back that is waited for, and go on then.
        let rests = self.waits.is_none() && engine.sends_nothing();
        let begins = if soon { self.waits.is_none() } else { moving && (!moved || rests) };
        if begins && mail.live().has_reader() {
            self.wait(mail, now, true);
        }
        let Some(mut wait) = self.waits.take().filter(|_| moving || soon) else { return true };
        if engine.sends_nothing() && self.is_any_under_way(engine, now) {
            wait.met = now;
        }
        let is_over = moving && (soon || now.since(wait.met) >= WAITS_FOR);
        let mut goes_on = true;
        for lane in 0..self.lanes.len() {
            let is_open = self.is_open(lane, &wait, engine, now);
            if is_open && is_over {
                engine.order(lane, LaneOrder::FallOut(Fall::Gap));
            }
            goes_on &= is_over || !is_open;
        }
        if goes_on {
            wait.met = now;
        }
        if now.since(wait.asked) >= READ_EVERY {
            wait.asked = now;
            mail.live().want(now);
        }
        // One that begins is over with the first frame.
        self.waits = Some(wait).filter(|wait| wait.begins || !goes_on);
        goes_on || !wait.begins || !moving
    }

    /// Whether a seat that is led may still be on its way to where its last frame leads.
    fn is_any_under_way(&self, engine: &Engine, now: MonoTime) -> bool {
        let is_led = |lane: usize| engine.lane(lane).takes_part() && !engine.lane(lane).is_blind();
        self.lanes
            .iter()
            .enumerate()
            .any(|(lane, Place { belief, .. })| is_led(lane) && belief.is_under_way(now))
    }

    /// Whether a lane's seat is still to be read.
    fn is_open(&self, lane: usize, wait: &Wait, engine: &Engine, now: MonoTime) -> bool {
        let motion = engine.lane(lane);
        if wait.begins {
            // The way of one that is blind is slow enough from wherever it is.
            let is_led = motion.takes_part() && !motion.is_blind();
            let belief = &self.lanes[lane].belief;
            // Where all is over nothing is to begin: that its seat was read since is enough.
            let is_over = matches!(engine.progress(), PlayProgress::Over(_));
            is_led && !(if is_over { belief.was_read(wait.since) } else { belief.may_begin(wait.since, now) })
        } else {
            motion.is_unseen()
        }
    }

    /// A controller takes part again. Where its seat stands is known by what was read since the last frame went to it; else it
    /// is looked at once more. Gives the pose about which it vibrates where no frame of the engine's ends that: none `flows`.
    pub(super) fn find(
        &mut self,
        lane: usize,
        engine: &mut Engine,
        mail: &mut Mail,
        now: MonoTime,
        flows: bool,
    ) -> Option<Pose> {
        self.take_evidence(lane, mail, mail.told(), now);
        if engine.is_led(lane) {
            return None; // it is looked at again as soon as it is away
        }
        let belief = &self.lanes[lane].belief;
        // What begins meanwhile has it read once more.
        match known(belief, self.moved, mail, now) {
            Some(known) => engine.found(lane, &known, belief.near()),
            None if let Some(pose) = belief.vibrates_about(now) => {
                if !flows {
                    return Some(*pose);
                }
                engine.still(lane, pose);
            }
            None if belief.is_measured_in_part() => {
                engine.order(lane, LaneOrder::Cut);
                mail.post(Sent::Unread { lane: number(lane) });
            }
            None if matches!(belief.known(), Known::Measured(..)) => {
                engine.order(lane, LaneOrder::FallOut(Fall::Stale));
            }
            None => engine.order(lane, LaneOrder::FallOut(Fall::Gap)),
        }
        None
    }

    /// All that arrived before `told`, which was asked before, is in what is taken.
    fn take_evidence(&mut self, lane: usize, mail: &Mail, told: MonoTime, now: MonoTime) -> Found {
        let Some(evidence) = mail.evidence(lane) else { return Found::Nothing };
        self.lanes[lane].belief.look(evidence, told, now)
    }

    /// This tick's frame of a lane: what it says, and where it leads. Where it would be too fast from somewhere that
    /// the seat may be, the lane is held: nothing is sent to it, and it is looked at. One that is blind gets a frame of its own.
    #[inline]
    #[must_use]
    pub fn admit(&mut self, lane: usize, engine: &mut Engine, at: MonoTime) -> Option<(Beat, Pose)> {
        let beat = if engine.lane(lane).is_blind() {
            self.slow_down(lane, engine, at)?
        } else {
            let beat = *engine.beat_of(lane);
            if !self.lanes[lane].is_plain(&beat, at) {
                return self.hold_back(lane, engine, &beat, at);
            }
            beat
        };
        let (belief, pose) = (&self.lanes[lane].belief, *engine.lane(lane).pose());
        if belief.allows(&pose, beat.lasts_ms, at) {
            return Some((beat, pose));
        }
        self.withhold(lane, engine);
        None
    }

    /// Whether the seat of a lane is where it was asked to be, and its next frame begins there.
    #[must_use]
    pub(super) fn is_plain(&self, lane: usize, beat: &Beat, at: MonoTime) -> bool {
        self.lanes[lane].is_plain(beat, at)
    }

    /// The frame of a lane whose last frames may not have arrived.
    #[cold]
    fn hold_back(
        &mut self,
        lane: usize,
        engine: &mut Engine,
        beat: &Beat,
        at: MonoTime,
    ) -> Option<(Beat, Pose)> {
        let Place { belief, longest_ms } = &mut self.lanes[lane];
        let lead = belief.lead(&engine.lane(lane).wish(), *longest_ms, |ticks| engine.span_ms(ticks));
        let allowed = lead.filter(|lead| belief.allows(&lead.to, lead.lasts_ms, at));
        let Some(Lead { to, lasts_ms, ticks }) = allowed else {
            self.withhold(lane, engine);
            return None;
        };
        engine.stretch(lane, ticks);
        Some((Beat { time_ms: lasts_ms, lasts_ms, ..*beat }, to))
    }

    fn withhold(&mut self, lane: usize, engine: &mut Engine) {
        self.lanes[lane].belief.withheld();
        engine.order(lane, LaneOrder::FallOut(Fall::Gap));
    }

    #[cold]
    fn slow_down(&self, lane: usize, engine: &mut Engine, at: MonoTime) -> Option<Beat> {
        let Place { belief, longest_ms } = &self.lanes[lane];
        let farthest = belief.farthest(engine.lane(lane).pose(), at);
        let lasts_ms = engine.slow_down(lane, *longest_ms, &farthest)?;
        Some(Beat::still(Timing::Relative, lasts_ms))
    }

    /// Notes what became of a frame.
    #[inline]
    pub fn sent(&mut self, lane: usize, taken: &Taken<'_>, delivery: Delivery) {
        self.waits = self.waits.filter(|wait| !wait.begins);
        let belief = &mut self.lanes[lane].belief;
        match delivery {
            Delivery::Sent | Delivery::SentAfterRefusal => belief.taken(taken),
            Delivery::Failed(_) => belief.refused(taken.at, taken.asked),
        }
    }
}

/// The pose of a seat that is found: while frames flow the next leads it on, so that it has to be of now where seats are read.
fn known(belief: &Belief, flows: bool, mail: &Mail, now: MonoTime) -> Option<KnownPose> {
    if flows && mail.live().has_reader() { belief.start(now) } else { belief.pose(now) }
}

/// A lane's number in the mail.
pub(super) fn number(lane: usize) -> u16 {
    u16::try_from(lane).expect("fewer controllers than ports")
}
