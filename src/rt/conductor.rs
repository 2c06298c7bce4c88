//! Between the state machine of the hall and the engine of the play: what is asked and what happens goes to the machine,
//! what the machine says is done by the engine, and what the engine then does is told to the machine. Tick thread.

#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Duration;

use super::film::{FilmLead, FilmStart};
use super::mail::{Alarm, News};
use super::timed::{StartOff, StartTurn, TimedStart};
use crate::engine::{Directive, Ending, Engine, EngineEvent, LaneOrder, PlayProgress, Rest};
use crate::film::chase::{FilmLeave, ParkCause};
use crate::net::Lead;
use crate::state::{
    Cause, Event, Finding, LedBefore, Machine, Next, PlayMode, Readiness, Refusal, State, Transition,
    Trouble, Why,
};
use crate::time::{MonoTime, ShowTime, Tick};

/// The machine, and what was last told of it.
#[derive(Debug)]
pub struct Conductor {
    machine: Machine,
    /// The state that was made known last, why, since when it lasts, and what a person does next.
    known: Option<(State, Cause, MonoTime, Next)>,
    /// Whether a person is there to clear what is latched; else the play ends with it.
    attended: bool,
    /// Whether the hall lives on when its show is over.
    stays: bool,
    /// Whether somebody wants the program to end.
    left: bool,
    /// When the last tick was.
    ticked: Option<MonoTime>,
    /// Until then the ack thread may be late as well: this thread was.
    excused: MonoTime,
    /// Since when a signal wants the program to end.
    ended: Option<MonoTime>,
    /// The film that leads the show; none where that is a film of its own.
    film: Option<FilmLead>,
    /// Whether it led them to its end, and that is why the seats parked.
    film_is_over: bool,
    /// How far ahead of the film the seats are that follow it.
    film_error_ns: Option<i64>,
    /// Until when this machine leads the hall; none where it is the only one.
    lead: Option<Arc<Lead>>,
    /// What starts by itself at its instant.
    start: TimedStart,
    /// Since when an end waits for the seats to be dark, and when it did last.
    ends: Option<(MonoTime, MonoTime)>,
}

/// A signal goes to whoever leads the hall as well, who knows more: this long it is left to them.
const LEFT_TO_KEEPER: Duration = Duration::from_millis(500);
/// The way to park is known within this time, or the seats come to rest first.
const PLANNED_WITHIN: Duration = Duration::from_secs(1);
/// After a gap the ack thread has this long to read what came in it.
const EXCUSED_FOR: Duration = Duration::from_millis(100);
/// Where no more of the lead is left than this, the seats are braked: nobody has promised more for the rest of its second. Whatever the
/// limits of a seat are, what is not at rest by then halts with the last frame.
const BRAKES_IN: Duration = Duration::from_millis(400);

/// What ends waits so long for the seats to be dark and still.
const DARKENED_WITHIN: Duration = Duration::from_secs(5);
/// Ticks that are farther apart are of two ends.
const APART: Duration = Duration::from_millis(1_500);

/// Whether that is the end of a stop, or of the way to park.
const fn ends(event: Event) -> bool {
    matches!(event, Event::AtRest | Event::Parked)
}

impl Conductor {
    /// One of a hall in that state.
    #[must_use]
    pub(crate) const fn new(machine: Machine, attended: bool) -> Self {
        Self {
            machine,
            known: None,
            attended,
            stays: false,
            left: false,
            ticked: None,
            excused: MonoTime::from_nanos(0),
            ended: None,
            film: None,
            film_is_over: false,
            film_error_ns: None,
            lead: None,
            start: TimedStart::NONE,
            ends: None,
        }
    }

    /// One of a hall that lives on when its show is over.
    #[must_use]
    pub fn of_a_hall(now: MonoTime) -> Self {
        Self { stays: true, ..Self::new(Machine::new(now), true) }
    }

    /// Whether somebody wants the program to end.
    pub(super) const fn is_left(&self) -> bool {
        self.left
    }

    /// Whether no signal that asks for the end was seen before this one.
    pub(super) const fn hears_first_of_the_end(&self) -> bool {
        self.ended.is_none()
    }

    /// Whether a signal that asks for the end has found nobody to hear it; `asked` says whether there is one.
    pub(super) fn is_ended(&mut self, asked: bool, now: MonoTime) -> bool {
        asked && now.since(*self.ended.get_or_insert(now)) >= LEFT_TO_KEEPER
    }

    /// Minds how long no tick came; to be told every tick, before all else. Nothing goes on by itself after a sleep.
    pub(super) fn mind_gap(&mut self, missed: u64, engine: &mut Engine, now: MonoTime) {
        let before = self.ticked.replace(now).unwrap_or(now);
        if missed > 0 {
            self.excused = now + EXCUSED_FOR;
            self.machine.event(Event::Slept(now.since(before)), now);
            self.steer(engine);
        }
    }

    /// Minds until when the ack thread is to have read replies again. While it hangs nobody hears of an emergency stop.
    pub(super) fn mind_acks(&mut self, due: Option<MonoTime>, engine: &mut Engine, now: MonoTime) {
        let hangs = due.is_some_and(|due| now > due.max(self.excused));
        if hangs && self.machine.may_send_motion() && self.machine.fault().is_none() {
            self.machine.event(Event::Trouble(Trouble::Deaf), now);
            self.steer(engine);
        }
    }

    /// Minds how long this machine still leads the hall. Where it hears nothing any more of whoever may promise that, it cannot know whether
    /// it is alone, and brakes as for a stop while it may.
    pub(super) fn mind_lead(&mut self, engine: &mut Engine, now: MonoTime) {
        let is_short = self.lead.as_ref().is_some_and(|lead| lead.until().since(now) <= BRAKES_IN);
        if is_short && self.machine.may_send_motion() && self.machine.fault().is_none() {
            self.machine.event(Event::Trouble(Trouble::Alone), now);
            self.steer(engine);
        }
    }

    /// The same of a machine that leads its hall until then.
    #[must_use]
    pub fn led_by(self, lead: Option<Arc<Lead>>) -> Self {
        Self { lead, ..self }
    }

    /// Whether the hall lives on when its show is over.
    #[must_use]
    pub(crate) const fn stays(&self) -> bool {
        self.stays
    }

    /// One of a play in the foreground: whoever started it has armed the hall and let it go. Its seats are brought to park
    /// before the first tick. Where it is not `attended`, a stop or a fault is the end of it.
    #[must_use]
    pub fn of_a_play(now: MonoTime, attended: bool) -> Self {
        let mut machine = armed(now);
        let _ = machine.request(Transition::Go, now);
        Self::new(machine, attended)
    }

    /// One of a hall that a person has armed; it ends where somebody wants that.
    #[must_use]
    #[cfg(feature = "harness")]
    pub(crate) fn of_an_armed_hall(now: MonoTime) -> Self {
        Self::new(armed(now), true)
    }

    /// Holds a start until its instant.
    pub(super) const fn hold_start(&mut self, film_zero: MonoTime) {
        self.start.hold(film_zero);
    }

    /// Drops it; says whether there was one.
    pub(super) const fn call_off_start(&mut self) -> bool {
        self.start.call_off()
    }

    /// What becomes of it, which may be a GO as a person asks it; to be told every tick, after all that is asked.
    pub(super) fn mind_start(&mut self, tick: &Tick, engine: &mut Engine, now: MonoTime) -> StartTurn {
        let is_armed = self.machine.state() == State::Armed && self.film().is_none() && !self.left;
        let turn = self.start.turn(tick, engine.playhead().film(), is_armed);
        if turn == StartTurn::Due && self.request(Transition::Go, engine, now).is_err() {
            return StartTurn::Off(StartOff::NotArmed);
        }
        turn
    }

    /// The same of a show that chases a film.
    #[must_use]
    pub fn chasing(self, film: Option<FilmLead>) -> Self {
        Self { film, ..self }
    }

    /// Another show is loaded, which follows the film so, or not at all.
    pub(super) fn load_film(&mut self, start: Option<FilmStart>, now: MonoTime) {
        if let Some(film) = &mut self.film {
            film.load(start, now);
        }
        self.film_is_over = false;
    }

    /// The film that leads the show, if one does.
    fn film(&self) -> Option<&FilmLead> {
        self.film.as_ref().filter(|film| film.is_followed())
    }

    /// Has the film lead a show that chases one; to be told every tick, before the engine's. Says where in the cue that wants its
    /// frame to lead, if anywhere.
    pub(super) fn mind_film(
        &mut self,
        tick: &Tick,
        engine: &mut Engine,
        trim_ms: i32,
        now: MonoTime,
    ) -> Option<ShowTime> {
        self.film_error_ns = None;
        let film = self.film.as_mut().filter(|film| film.is_followed())?;
        let leave = match self.machine.state() {
            State::Playing(_) => FilmLeave::Lead,
            State::Paused => FilmLeave::Paused,
            _ => FilmLeave::Nothing,
        };
        let rides = leave == FilmLeave::Lead;
        let (event, target) = film.tick(tick, engine.playhead().frame_time(), trim_ms, leave);
        // The pose that was sent a tick ago is reached now.
        let reached = engine.playhead().reached();
        // At the tick that loses the film the point falls back to its last sample: that is no error of the seats.
        let is_led = self.machine.state() == State::Playing(PlayMode::Following) && film.leads();
        let follows = is_led && engine.is_any_on_cue();
        self.film_error_ns = film.error_ns(reached, tick.deadline, trim_ms).filter(|_| follows);
        if rides {
            self.machine.event(event, now);
            self.film_is_over = matches!(event, Event::FilmOver(ParkCause::FilmEnded));
            self.steer(engine);
        }
        target.filter(|_| rides)
    }

    /// How far ahead of the film that they follow the seats are, nanoseconds; none while they follow none.
    pub(super) const fn film_error_ns(&self) -> Option<i64> {
        self.film_error_ns
    }

    /// How often seats have joined the film.
    pub(super) fn film_joins(&self) -> u64 {
        self.film.as_ref().map_or(0, FilmLead::joins)
    }

    /// Where the hall stands, and why.
    #[must_use]
    pub const fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Takes a request.
    ///
    /// # Errors
    /// [`Refusal`] where the state does not allow it; nothing has changed then.
    pub(crate) fn request(
        &mut self,
        request: Transition,
        engine: &mut Engine,
        now: MonoTime,
    ) -> Result<(), Refusal> {
        self.look_for_stray(engine, now);
        self.machine.request(request, now)?;
        if let (Transition::Resume, Some(film)) = (request, &mut self.film) {
            film.let_join(now);
        }
        self.steer(engine);
        Ok(())
    }

    /// Goes on at that time of the film.
    ///
    /// # Errors
    /// As [`Conductor::request`].
    pub(crate) fn seek(&mut self, film: ShowTime, engine: &mut Engine, now: MonoTime) -> Result<(), Refusal> {
        if self.film().is_some() {
            let (state, asked, why) = (self.machine.state(), Transition::Seek, Why::FilmLeads);
            return Err(Refusal { state, asked, why });
        }
        self.machine.request(Transition::Seek, now)?;
        engine.seek(film);
        self.steer(engine);
        Ok(())
    }

    /// Takes what the control plane has found out.
    pub(crate) fn event(&mut self, event: Event, engine: &mut Engine, now: MonoTime) {
        self.machine.event(event, now);
        self.steer(engine);
    }

    /// Takes what was seen of a controller.
    pub(crate) fn alarm(&mut self, alarm: Alarm, engine: &mut Engine, now: MonoTime) {
        match alarm {
            Alarm::Event(event) => self.machine.event(event, now),
            Alarm::Leave(lane) => engine.order(usize::from(lane), LaneOrder::Leave),
            Alarm::Cut(lane) => engine.order(usize::from(lane), LaneOrder::Cut),
            // Where it was found is looked up by whoever knows what the lane was sent.
            Alarm::Found(_) => {}
        }
        self.steer(engine);
    }

    /// Somebody wants the program to end: the seats park, as far as the hall may move; where it may not, the play is over.
    pub(crate) fn leave(&mut self, engine: &mut Engine, now: MonoTime) {
        self.left = true;
        match self.machine.state() {
            State::Playing(_) | State::Paused => {
                let _ = self.machine.request(Transition::Park, now);
                self.steer(engine);
            }
            State::Stopping | State::Parking => {}
            _ => engine.end(),
        }
    }

    /// Stops; never refused.
    pub(crate) fn stop(&mut self, engine: &mut Engine, now: MonoTime) {
        let _ = self.machine.request(Transition::Stop, now);
        self.steer(engine);
    }

    /// Ends what has lasted too long; to be told every tick, before the engine's.
    pub(crate) fn tick(&mut self, engine: &mut Engine, now: MonoTime) {
        self.machine.tick(now);
        if self.machine.state() == State::Parking && now.since(self.machine.since()) >= PLANNED_WITHIN {
            engine.rest_to_park();
        }
        self.steer(engine);
    }

    /// Has the engine do what the state says.
    pub(super) fn steer(&self, engine: &mut Engine) {
        let directive = match self.machine.state() {
            State::Boot | State::Recovering => Directive::Off,
            State::Homing | State::Parked | State::Armed => Directive::Wait,
            State::Playing(_) if self.film().is_none_or(FilmLead::leads) => Directive::Play,
            State::Playing(_) if self.film().is_some_and(FilmLead::is_lost_briefly) => Directive::HoldBriefly,
            State::Playing(_) | State::Paused => Directive::Hold,
            State::Stopping | State::Stopped | State::Fault => Directive::Stop,
            State::Parking => Directive::Park,
        };
        if directive == Directive::Stop {
            engine.cut_led_ahead();
        }
        engine.obey(directive);
    }

    /// Tells the machine what the engine does; to be called every tick, after the engine's. What happened comes before how far it is.
    /// `is_read`: all seats that are led were read since the engine was over. `is_left_on`: one that answers is not dark and still.
    pub(crate) fn watch(&mut self, engine: &mut Engine, is_read: bool, is_left_on: bool, now: MonoTime) {
        let mut trouble = None;
        engine.events().take(|event| {
            match event {
                EngineEvent::NoMove if !self.machine.state().is_latched() => {
                    trouble = Some(Trouble::Planner);
                }
                EngineEvent::LimiterFault => trouble = trouble.or(Some(Trouble::Limiter)),
                EngineEvent::NoMove => {}
                EngineEvent::Unplanned(_) | EngineEvent::Joined(_) | EngineEvent::FellOut(..) => {
                    return false;
                }
            }
            true
        });
        let means = self.what_it_means(engine.progress(), engine.playhead().frames() > 0);
        let means = means.filter(|event| is_read || *event != Event::Parked);
        let waits = means.is_some_and(|event| self.waits_for_dark(ends(event), is_left_on, now));
        let means = means.filter(|_| !waits);
        if let Some(event) = trouble.map(Event::Trouble).or(means) {
            self.machine.event(event, now);
            self.steer(engine);
        }
        self.look_for_stray(engine, now);
        if !self.attended && self.machine.state().is_latched() {
            engine.end();
        }
    }

    /// Between shows a person may want a seat down that rests up.
    fn look_for_stray(&mut self, engine: &Engine, now: MonoTime) {
        if self.machine.state() == State::Parked {
            self.machine.event(Event::Astray(engine.is_astray()), now);
        }
    }

    /// The event that the engine's progress is for the hall; `led` says if a frame of this show has left. Without a wildcard: a state that
    /// ends by a progress which has no row here would last until its time is over.
    #[rustfmt::skip] // As a table.
    fn what_it_means(&self, progress: PlayProgress, led: bool) -> Option<Event> {
        use PlayMode::{Following, Holding};
        use PlayProgress::{Homeward, Joining, OnCue, Over, Resting, Waiting};
        match (self.machine.state(), progress) {
            (State::Playing(_), Homeward | Over(_)) => Some(Event::CueEnded),
            (State::Playing(PlayMode::Joining | Following), Resting { why: Rest::Late, .. }) => Some(Event::Late),
            (State::Playing(Holding), Waiting | Joining | OnCue) => Some(Event::JoinBegun),
            // Seats that are to join a film are on no cue before a frame has left, though both may be at park.
            (State::Playing(PlayMode::Joining), OnCue) => (led || self.film().is_none()).then_some(Event::Joined),
            (State::Playing(_), Waiting | Joining | OnCue | Resting { .. }) => None,
            // Of a show that waits no frame has left, or none since its seats rest.
            (State::Stopping, Waiting | Resting { why: Rest::Stopped, told: true } | Over(_)) => Some(Event::AtRest),
            (State::Stopping, Joining | OnCue | Resting { .. } | Homeward) => None,
            (State::Parking, Over(_)) => Some(Event::Parked),
            (State::Parking, Waiting | Joining | OnCue | Resting { .. } | Homeward) => None,
            (State::Boot | State::Recovering | State::Parked | State::Homing | State::Armed, _) => None,
            (State::Paused | State::Stopped | State::Fault, _) => None,
        }
    }

    /// Whether what `ends` is to wait until all that answer are dark and still, for a while at the most: then somebody is warned.
    pub(super) fn waits_for_dark(&mut self, ends: bool, is_left_on: bool, now: MonoTime) -> bool {
        if !(ends && is_left_on) {
            return false;
        }
        if self.ends.is_none_or(|(_, looked)| now.since(looked) > APART) {
            self.ends = Some((now, now));
        }
        let (since, looked) = self.ends.as_mut().expect("it was set above");
        *looked = now;
        now.since(*since) < DARKENED_WITHIN
    }

    /// What is new since it was asked last.
    pub(crate) fn news(&mut self) -> Option<News> {
        let known = (self.machine.state(), self.machine.cause(), self.machine.since(), self.machine.next());
        if self.known.replace(known) == Some(known) {
            return None;
        }
        let (state, cause, at, next) = known;
        Some(News::Entered { state, cause, next, at })
    }

    /// How the play ended.
    #[must_use]
    pub fn ending(&self, engine: &Engine) -> Ending {
        match engine.progress() {
            PlayProgress::Over(Ending::Stopped) if self.film_is_over && self.machine.fault().is_none() => {
                Ending::Completed
            }
            PlayProgress::Over(ending) if self.machine.fault().is_none() => ending,
            _ => Ending::Fault,
        }
    }
}

/// A hall that is parked, ready and armed.
fn armed(now: MonoTime) -> Machine {
    let mut machine = Machine::new(now);
    machine.event(Event::Identified(Finding { homed: true, at_park: true, before: LedBefore::Ended }), now);
    machine.event(Event::Readiness(Readiness::Ready), now);
    // It is not refused to a parked hall that is ready.
    let _ = machine.request(Transition::Arm, now);
    machine
}
