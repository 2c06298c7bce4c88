//! What is asked of units while they play, and what the answers mean.

use std::time::Duration;

use super::axis::Doubt;
use super::polls::Question;
use super::{LOST, PROBES, SilverMax, number};
use crate::drive::link::{
    BrakeReason, LinkAxis as _, LinkPort, LinkTalk as _, Stage, Stream, StreamEvent, axis_number,
};
use crate::drive::silvermax::talk::{Answer, TalkFault, internal_word};
use crate::time::MonoTime;
use crate::wire::silvermax::register::{CANARY, KILL_CAUSE};
use crate::wire::silvermax::{Poll, Request, StatusWord, Words};

/// How far a target may be from the model of its segments, mm.
const OFF_COURSE_MM: f64 = 0.5;
/// How far a motor is beside the model where its target is asked at once, mm: farther than a servo lags.
const FAR_MM: f64 = 1.5;
/// A unit that takes its segments, and tells nothing for so long when asked where it is or whether it was restarted, leads its seat
/// nobody knows where.
const BLIND: Duration = Duration::from_secs(2);
/// When exactly a unit reads its registers is not known to better than this, seconds.
const READING: f64 = 0.000_5;

impl<P: LinkPort> Stream<SilverMax, P> {
    /// Asks, and believes what is answered.
    pub(super) fn ask(&mut self, l: usize, a: usize, question: Question) -> Result<(), TalkFault> {
        let now = self.talk.now();
        let axis = &mut self.lanes[l].axes[a];
        axis.polls.asked(question, now);
        let request = question.request();
        let answer = self.talk.exchange(axis.terms.unit, request);
        self.heard(l, a, request, &answer);
        let words = if let Ok(Answer::Data(words)) = &answer { Some(words) } else { None };
        let (event, value) = (words.and_then(Words::word), words.and_then(Words::value));
        // A bare ACK says that nothing happened.
        let is_quiet = matches!(&answer, Ok(Answer::Ack));
        let is_told =
            if question == Question::Events { is_quiet || event.is_some() } else { value.is_some() };
        let untold = self.lanes[l].axes[a].polls.told(question, is_told, now);
        if untold.is_some_and(|since| now.since(since) > BLIND) {
            self.lose(l, a);
        }
        answer?;
        let sent = self.talk.moment().sent;
        match (question, event, value) {
            (Question::Events, Some(event), _) => self.happened(l, a, event),
            (_, _, Some(value)) => {
                self.read(l, a, question, value, sent);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// A register was read.
    fn read(&mut self, l: usize, a: usize, question: Question, value: i32, sent: MonoTime) {
        let axis = &mut self.lanes[l].axes[a];
        let scale = axis.terms.scale;
        match question {
            Question::TicksLeft if value > 0 => {
                axis.see_left(sent, value);
            }
            Question::Position => {
                axis.figures.position = scale.fraction(f64::from(value));
                let course = if axis.has_started() { axis.course_at(sent) } else { axis.course };
                axis.figures.error_mm = scale.mm(f64::from(value) - course.position());
                let (position, place) = (axis.figures.position, axis.place());
                if axis.figures.error_mm.abs() > FAR_MM {
                    // A segment that was damaged leads it there, or its load does: the target tells.
                    axis.polls.hurry(Question::Target, self.talk.now());
                }
                let stage = self.lanes[l].stage;
                if !matches!(stage, Stage::Out | Stage::Lost) {
                    let held = (stage == Stage::Ready).then_some(place);
                    self.tell(StreamEvent::Read {
                        lane: number(l),
                        axis: axis_number(a),
                        position,
                        held,
                        at: sent,
                    });
                }
            }
            Question::Target if self.lanes[l].stage == Stage::Runs => self.compare(l, a, value, sent),
            Question::Status => self.lanes[l].axes[a].figures.is_hot = internal_word(value).is_hot(),
            Question::Canary => self.compare_canary(l, a, value),
            _ => {}
        }
    }

    /// A unit that was restarted has another canary. One bad digit makes one, too: what is not that of the lane is believed
    /// once it was read twice.
    fn compare_canary(&mut self, l: usize, a: usize, value: i32) {
        let now = self.talk.now();
        let lane = &mut self.lanes[l];
        let (known, axis) = (lane.own.canary, &mut lane.axes[a]);
        if axis.read_canary.replace(value) != Some(value) && known != Some(value) {
            axis.polls.hurry(Question::Canary, now);
            return;
        }
        axis.canary = Some(value);
        if known.is_some_and(|known| known != value) && lane.stage != Stage::Out {
            self.put_out(l, StreamEvent::Restarted { lane: number(l), axis: axis_number(a) });
        } else {
            self.mind_home(l);
        }
    }

    /// Tells whether all units of a lane are home; one that is out, and waits for that, is made ready.
    fn mind_home(&mut self, l: usize) {
        let lane = &mut self.lanes[l];
        let Some(homed) = lane.is_home() else { return };
        if homed && lane.stage == Stage::Out && std::mem::take(&mut lane.own.returns) {
            lane.own.canary = lane.axes.first().and_then(|axis| axis.canary);
            lane.make_ready(true);
        }
        let homed = homed && lane.stage != Stage::Out;
        self.tell(StreamEvent::Homed { lane: number(l), homed });
    }

    /// The target against the model of the segments: one that was damaged on the way is obeyed all the same.
    fn compare(&mut self, l: usize, a: usize, target: i32, sent: MonoTime) {
        let axis = &mut self.lanes[l].axes[a];
        let (scale, course) = (axis.terms.scale, axis.course_at(sent));
        let by_mm = scale.mm(f64::from(target) - course.position());
        let (before, after) = (axis.course_at(sent.before(TENTH)), axis.course_at(sent + TENTH));
        let speed = scale.mm(after.position() - before.position()).abs() / (2.0 * TENTH.as_secs_f64());
        axis.figures.off_course_mm = axis.figures.off_course_mm.max(by_mm.abs());
        if by_mm.abs() > OFF_COURSE_MM + speed * READING {
            // What was damaged may be the answer: read once more.
            axis.strayed += 1;
            axis.polls.hurry(Question::Target, self.talk.now());
            if axis.strayed > 1 {
                self.put_out(l, StreamEvent::OffCourse { lane: number(l), axis: axis_number(a), by_mm });
            }
        } else {
            axis.strayed = 0;
        }
    }

    /// What a unit says has happened: read, then cleared, by the bits that were read.
    pub(super) fn happened(&mut self, l: usize, a: usize, word: u16) -> Result<(), TalkFault> {
        let unit = self.lanes[l].axes[a].terms.unit;
        self.lanes[l].axes[a].figures.poll = word;
        let mut exchange = |request| {
            let answer = self.talk.exchange(unit, request);
            self.heard(l, a, request, &answer);
            answer
        };
        let poll = Poll(word);
        if poll.has(Poll::KILLED) {
            // What it is home by is taken back first: whoever looks later, in another run, finds no trace in its events.
            exchange(Request::WriteRegister { register: CANARY, value: 0 })?;
        }
        exchange(Request::ClearPoll { mask: word })?;
        if poll.has(Poll::KILLED) {
            let cause = match exchange(Request::ReadRegister { register: KILL_CAUSE })? {
                Answer::Data(words) => words.value().unwrap_or_default(),
                _ => 0,
            };
            self.put_out(l, StreamEvent::Killed { lane: number(l), axis: axis_number(a), cause });
        } else if poll.has(Poll::PROGRAM_ERROR) && matches!(self.lanes[l].stage, Stage::Runs | Stage::Ends) {
            self.lanes[l].axes[a].figures.dry += 1;
            self.brake(l, BrakeReason::Dry);
        }
        Ok(())
    }

    /// Whether a unit answers; what it did not answer is in doubt from now on.
    pub(super) fn heard<T>(&mut self, l: usize, a: usize, request: Request, answer: &Result<T, TalkFault>) {
        let now = self.talk.now();
        let axis = &mut self.lanes[l].axes[a];
        match answer {
            Ok(_) => {
                axis.failing_since = None;
                axis.doubt = axis.doubt.filter(|doubt| !matches!(doubt, Doubt::Unanswered(_)));
            }
            Err(_) => {
                let since = *axis.failing_since.get_or_insert(now);
                axis.doubt = Some(match axis.doubt {
                    // What is in doubt first is what matters: reads change nothing.
                    Some(first @ Doubt::Unanswered(_)) => first,
                    _ => Doubt::Unanswered(request),
                });
                if now.since(since) > LOST.max(self.terms.period * 10) {
                    self.lose(l, a);
                }
            }
        }
    }

    /// Whether a unit of a lost lane answers: those that do brake.
    pub(super) fn probe(&mut self, l: usize, a: usize) -> Result<(), TalkFault> {
        let now = self.talk.now();
        let axis = &mut self.lanes[l].axes[a];
        axis.not_before = now + PROBES;
        let unit = axis.terms.unit;
        if axis.owes_stop {
            let stop = Request::Stop { deceleration: axis.terms.brake };
            let braked = self.talk.exchange(unit, stop);
            self.lanes[l].axes[a].owes_stop = braked.is_err();
            let late = self.talk.fence(unit, stop);
            self.heard(l, a, stop, &late);
            late?;
        }
        let read = Request::ReadRegister { register: CANARY };
        let answer = self.talk.exchange(unit, read);
        self.heard(l, a, read, &answer);
        let Answer::Data(words) = answer? else { return Ok(()) };
        let lane = &mut self.lanes[l];
        if words.value() != lane.own.canary {
            self.compare_canary(l, a, words.value().unwrap_or_default());
        } else if lane.axes.iter().all(|axis| axis.failing_since.is_none() && !axis.owes_stop) {
            lane.make_ready(true);
            self.tell(StreamEvent::Back { lane: number(l) });
        }
        Ok(())
    }
}

/// A tenth of a millisecond.
const TENTH: Duration = Duration::from_micros(100);
