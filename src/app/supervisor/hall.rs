//! The hall as all features of the supervisor see it. Acts change it, one after the other, so that whatever they read is what the
//! tick thread has taken up.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::hall_settings::HallSettings;
use super::reach::Reach;
use super::show::{LeftAt, ProvedShow};
use super::state_mirror::StateMirror;
use crate::app::buttons::PadTable;
use crate::app::film::SharedTable;
use crate::app::notify::NotifyTable;
use crate::app::pair::PairWatch;
use crate::app::player::PlayerLink;
use crate::app::recorder::RecordLink;
use crate::app::runtime::RuntimeHandle;
use crate::config::Config;
use crate::control::{AwaitedPorts, Code, Problem, SharedClock};
use crate::engine::Unplanned;
use crate::health::Groups;
use crate::osc::Counts;
use crate::rt::{Desk, LinkEnd, Live, Loaded, Row, Times};
use crate::state::{Cause, State, Whose};
use crate::sys::realtime::RealTime;
use crate::time::{MonoTime, ShowTime, TickGrid, WallAt};

/// A show that was left sooner after its beginning is begun anew, not gone on with.
const WORTH_IT: ShowTime = ShowTime::from_millis(1_000);

/// The hall of now.
#[derive(Debug)]
pub(super) struct HallContext {
    pub(super) config: Arc<Config>,
    pub(super) desk: Arc<Desk>,
    pub(super) live: Arc<Live>,
    /// Set to have the seats parked and the hall closed.
    pub(super) leave: Arc<AtomicBool>,
    /// What the system granted the tick thread.
    pub(super) granted: RealTime,
    /// What to do where frames take too much of the time between ticks.
    pub(super) crowding: Option<String>,
    pub(super) mirror: StateMirror,
    pub(super) settings: HallSettings,
    /// What is loaded.
    pub(super) cued: Option<ProvedShow>,
    /// What was loaded before the test of the seats that is under way.
    pub(super) aside: Option<SetAside>,
    /// Where the film was when the seats left the cue.
    pub(super) left_at: Option<ShowTime>,
    /// Where the film was when the seats last left the cue, until they are parked.
    pub(super) halted_at: Option<ShowTime>,
    /// Why the last show ended.
    pub(super) ended: Cause,
    /// What is heard of the film, if one leads shows.
    pub(super) film: Option<SharedTable>,
    /// The way to the player, if the hall has one.
    pub(super) player: Option<PlayerLink>,
    /// What has come to the port for OSC, if there is one.
    pub(super) osc: Option<Arc<Counts>>,
    /// How the pads are, if there are any.
    pub(super) buttons: Option<PadTable>,
    /// The ports that cannot be had yet.
    pub(super) awaited: AwaitedPorts,
    /// Addresses and ways that this machine has not yet.
    pub(super) reach: Reach,
    /// The other show machine, where there is one.
    pub(super) pair: Option<PairWatch>,
    /// How the ways to tell alarms are, if there are any.
    pub(super) notify: Option<NotifyTable>,
    /// The way to the recorder.
    pub(super) recorder: RecordLink,
    /// The serial links that have seats.
    pub(super) links: Vec<LinkEnd>,
    /// The slow work that is under way.
    pub(super) job: Option<&'static str>,
    pub(super) now: MonoTime,
    /// What the wall clock showed just now.
    pub(super) wall: WallAt,
    /// How far that may be off, where somebody measures it.
    pub(super) clock: SharedClock,
    /// When ticks are due.
    pub(super) grid: TickGrid,
}

/// Where a show goes on that another machine led.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GoesOn {
    /// There.
    At(ShowTime),
    /// Where the film is that others show.
    WithFilm,
}

/// What was loaded before a test of the seats, if anything was.
#[derive(Debug)]
pub(super) struct SetAside(pub(super) Option<ProvedShow>);

/// What was counted before a show.
#[derive(Debug, Clone)]
pub(super) struct Counted {
    pub(super) ticks: u64,
    pub(super) missed: u64,
    pub(super) table: Vec<Row>,
    pub(super) times: Times,
}

/// What becomes another in the show that is next.
#[derive(Debug)]
pub(super) enum ShowChange {
    /// What is set. While the seats move the desk is enough for it.
    Settings(Box<HallSettings>),
    /// The cue, and what is set with it.
    Cue(Box<ProvedShow>, Option<Box<HallSettings>>),
    /// Where it begins.
    Start(ShowTime),
    /// It begins at its beginning.
    Rewind,
    /// Nothing: the one before it is over.
    Again,
    /// It tests the seats of these rows, or of all.
    Test(Box<ProvedShow>, Option<BTreeSet<String>>),
}

/// What becomes of a change that is not taken up.
#[derive(Debug)]
pub(super) enum Undo {
    /// It stays; what is to be done fails.
    Nothing,
    /// It is changed back; what is to be done fails.
    Change(ShowChange),
    /// The cue is dropped; what is to be done fails.
    Unload,
    /// The cue is dropped, which is noted; what is to be done goes on.
    Drop,
    /// The tick thread is told again of readiness; what is to be done goes on.
    Readiness,
}

impl HallContext {
    /// A hall that opens, where that is set.
    pub(super) fn new(runtime: &RuntimeHandle, settings: HallSettings, now: MonoTime) -> Self {
        Self {
            config: Arc::clone(&runtime.config),
            desk: Arc::clone(&runtime.desk),
            live: Arc::clone(&runtime.live),
            leave: Arc::clone(&runtime.leave),
            granted: runtime.granted.clone(),
            crowding: runtime.crowding.clone(),
            mirror: StateMirror::new(now),
            settings,
            cued: None,
            aside: None,
            left_at: None,
            halted_at: None,
            ended: Cause::Started,
            film: None,
            player: None,
            osc: None,
            buttons: None,
            awaited: AwaitedPorts::default(),
            reach: Reach::default(),
            pair: None,
            notify: None,
            recorder: RecordLink::default(),
            links: runtime.links.clone(),
            job: None,
            now,
            wall: WallAt::default(),
            clock: SharedClock::default(),
            grid: runtime.grid.clone(),
        }
    }

    /// True if the hall is at rest, and nobody has made it ready to go, so that another cue may be loaded, or controllers asked.
    ///
    /// # Errors
    /// Why it may not.
    pub(super) fn may(&self, what: &str) -> Result<(), Problem> {
        let remedy = match self.mirror.state {
            State::Armed => "disarm first",
            state if state.may_send_motion() => "park first",
            _ => return Ok(()),
        };
        Err(Problem::new(Code::State, format!("cannot {what} while {}", self.mirror.state), remedy))
    }

    /// True if something long may begin. In a hall that closes nothing may: it would hold the port that the next one opens.
    ///
    /// # Errors
    /// Why it may not.
    pub(super) fn is_free(&self) -> Result<(), Problem> {
        if self.is_closing() {
            return Err(Problem::new(Code::Busy, "the hall is closing", "try again in a second"));
        }
        match self.job {
            None => Ok(()),
            Some(word) => {
                Err(Problem::new(Code::Busy, format!("{word} is under way"), "try again when it is done"))
            }
        }
    }

    /// True if the hall closes, for good or for another configuration.
    pub(super) fn is_closing(&self) -> bool {
        self.leave.load(Ordering::Acquire)
    }

    /// Has the seats parked and the hall closed.
    pub(super) fn close(&self) {
        self.leave.store(true, Ordering::Release);
    }

    /// Why the hall is in its state, with the name of whom that is about.
    pub(super) fn cause(&self) -> String {
        let cause = self.mirror.cause;
        self.whose().map_or_else(|| cause.to_string(), |whose| format!("{whose}: {cause}"))
    }

    /// The name of whom that is about; `None` if it is the hall.
    pub(super) fn whose(&self) -> Option<String> {
        match self.mirror.cause.whose()? {
            Whose::Controller(index) => Some(self.config.controllers.get(index)?.name.clone()),
            Whose::Group(index) => Some(Groups::of(&self.config.controllers).name(index).to_owned()),
        }
    }

    /// What could not be planned, with the name of whose move that is.
    pub(super) fn name_unplanned(&self, what: Unplanned) -> String {
        match what {
            Unplanned::Seek => what.to_string(),
            Unplanned::Lane(lane) => format!("{}: {what}", self.config.controllers[lane].name),
        }
    }

    /// The lanes that take part.
    pub(super) fn lanes_on(&self) -> impl Iterator<Item = usize> {
        (0..self.config.controllers.len()).filter(|lane| self.settings.is_on(*lane))
    }

    /// The controllers of a group.
    pub(super) fn names_of(&self, group: &str) -> impl Iterator<Item = &str> {
        let all = self.config.controllers.iter().filter(move |one| one.group == group);
        all.map(|one| one.name.as_str())
    }

    /// What is counted so far; to be taken before a show is let go.
    pub(super) fn count(&self) -> Counted {
        let live = &self.live;
        Counted { ticks: live.ticks(), missed: live.missed(), table: live.table(), times: live.times() }
    }

    /// True if the seats follow the cue, or may go on with it.
    pub(super) const fn is_on_cue(&self) -> bool {
        rides(self.mirror.state)
    }

    /// Sets the tick thread's desk as it is set here.
    pub(super) fn set_desk(&self) {
        let effects = self.cued.as_ref().map_or(&[][..], |cued| cued.timeline.effect_names());
        self.settings.set(&self.desk, effects);
    }

    /// Changes what is loaded or set; says what becomes of that where it is not taken up.
    pub(super) fn apply(&mut self, change: ShowChange) -> Undo {
        match change {
            ShowChange::Settings(settings) => {
                let before = std::mem::replace(&mut self.settings, *settings);
                return Undo::Change(ShowChange::Settings(Box::new(before)));
            }
            ShowChange::Cue(cued, settings) => {
                (self.cued, self.halted_at) = (Some(*cued), None);
                self.settings = settings.map_or_else(|| self.settings.clone(), |settings| *settings);
                return Undo::Unload;
            }
            ShowChange::Start(film) => {
                let start = self.cued.as_mut().map(|cued| std::mem::replace(&mut cued.start, film));
                return start.map_or(Undo::Nothing, |before| Undo::Change(ShowChange::Start(before)));
            }
            ShowChange::Test(cued, only) => {
                self.live.tests(true);
                self.aside = Some(SetAside(self.cued.replace(*cued)));
                self.settings.only = only;
                return Undo::Nothing;
            }
            ShowChange::Rewind => {
                if let Some(cued) = &mut self.cued {
                    cued.start = ShowTime::ZERO;
                }
            }
            ShowChange::Again => {}
        }
        Undo::Drop
    }

    /// The test of the seats is over: what was loaded before is back.
    pub(super) fn end_test(&mut self) {
        if let Some(SetAside(before)) = self.aside.take() {
            self.settings.only = None;
            self.cued = before;
            self.live.tests(false);
        }
    }

    /// The show that the tick thread plays next, of what is loaded and as everything is set now; `None` if nothing is loaded.
    ///
    /// # Errors
    /// Where none can be made of it.
    pub(super) fn show(&mut self) -> Result<Option<Box<Loaded>>, Problem> {
        self.cued.as_mut().map(|cued| cued.staged(&self.config, &self.settings)).transpose()
    }

    /// True if a show is loaded where another machine died with one under way.
    pub(super) fn has_taken_over(&self) -> bool {
        let mirror = &self.mirror;
        mirror.state == State::Recovering && mirror.cause == Cause::TookOver && self.cued.is_some()
    }

    /// Where the show goes on that was under way at the machine that died; `None` if none was, what is loaded is another one, or its film is
    /// over.
    pub(super) fn goes_on(&self) -> Option<GoesOn> {
        let cued = self.cued.as_ref().filter(|_| self.has_taken_over())?;
        match cued.left_at {
            Some(_) if cued.is_led_elsewhere() => Some(GoesOn::WithFilm),
            _ => cued.left(self.now).map(GoesOn::At),
        }
    }

    /// The hall goes from one state to another: where the film is when the seats leave the cue is where a show may go on.
    pub(super) fn note_place(&mut self, from: State, to: State) {
        let is_led = self.cued.as_ref().is_some_and(ProvedShow::is_led_elsewhere);
        if rides(from) && !rides(to) {
            self.halted_at = Some(self.live.show());
            self.left_at =
                self.halted_at.filter(|_| !is_led && !self.mirror.cause.completes()).or(self.left_at);
        }
        if to == State::Parked {
            self.halted_at = None;
        }
    }

    /// A show is over: where it was left is kept with its cue.
    pub(super) fn keep_place(&mut self) {
        let left_at = self.left_at.take();
        if let Some(cued) = &mut self.cued {
            let end = cued.timeline.duration();
            cued.left_at = left_at.filter(|film| (WORTH_IT..end).contains(film)).map(LeftAt::waits);
        }
    }

    /// A show begins: where the one before was left is forgotten.
    pub(super) fn forget_place(&mut self) {
        (self.left_at, self.halted_at) = (None, None);
        if let Some(cued) = &mut self.cued {
            cued.left_at = None;
        }
    }
}

const fn rides(state: State) -> bool {
    matches!(state, State::Playing(_) | State::Paused)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{hall, proved};

    #[test]
    fn what_is_not_taken_up_is_changed_back() {
        let mut hall = hall(State::Parked, "one");
        let mut settings = hall.settings.clone();
        settings.trim_ms = 40;
        let start = ShowTime::from_millis(2_000);
        for change in [ShowChange::Settings(Box::new(settings)), ShowChange::Start(start)] {
            let Undo::Change(back) = hall.apply(change) else { panic!("it can be changed back") };
            let is = |hall: &HallContext| (hall.settings.trim_ms, hall.cued.as_ref().unwrap().start);
            assert_ne!(is(&hall), (0, ShowTime::ZERO));
            hall.apply(back);
            assert_eq!(is(&hall), (0, ShowTime::ZERO));
        }
        let other = Box::new(proved("two", &hall.config));
        assert!(matches!(hall.apply(ShowChange::Cue(other, None)), Undo::Unload));
        assert_eq!(hall.cued.unwrap().id, "two");
    }

    #[test]
    fn the_place_where_a_show_was_left_is_kept_where_it_is_neither_at_its_beginning_nor_past_its_end() {
        for (film_ms, kept) in [(999, false), (1_000, true), (3_999, true), (4_000, false)] {
            let mut hall = hall(State::Stopping, "one");
            let film = ShowTime::from_millis(film_ms);
            hall.live.on_show(film);
            hall.note_place(State::Paused, State::Stopping);
            hall.keep_place();
            assert_eq!(hall.cued.unwrap().left_at, kept.then_some(LeftAt::waits(film)));
        }
    }
}
