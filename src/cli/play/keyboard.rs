//! The thread that reads keys and does what they ask for. It never writes to the terminal: a terminal that takes nothing
//! more must not hold up a stop.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use rtrb::Producer;

use super::keys::{HELP, KeyAction, KeyDecoder};
use crate::app::film::SharedTable;
use crate::app::{Control, RollCall};
use crate::engine::Mix;
use crate::rt::Command;
use crate::state::{State, Transition};
use crate::sys::clock::Monotonic;
use crate::sys::terminal::Keyboard;
use crate::time::{Clock as _, MonoTime, ShowTime, TRIM_MS};

/// How long a key is waited for before it is looked whether the play is over.
const WAIT: Duration = Duration::from_millis(50);
/// So long after a jump the next one counts from where that one leads: the show may not be there yet.
const JUMPING: Duration = Duration::from_millis(300);

/// Does what keys ask for.
pub(super) struct Leader {
    control: Control,
    /// Length of the cue.
    length: ShowTime,
    /// What is heard of the film.
    film: SharedTable,
    roll: Arc<RollCall>,
    /// What was set for the lanes when the play began.
    begun: Vec<Mix>,
    /// The greatest level of a lane, percent.
    percent: i32,
    /// None until the tick loop runs.
    commands: Option<Producer<Command>>,
    /// The last jump, and where it leads.
    jumped: Option<(MonoTime, ShowTime)>,
}

impl Leader {
    /// One of a play that has not begun, with its cue's length and what is heard of its film.
    pub(super) fn new(control: Control, length: ShowTime, film: SharedTable, roll: Arc<RollCall>) -> Self {
        let begun: Vec<Mix> = (0..control.desk.lanes()).map(|lane| control.desk.mix(lane)).collect();
        let percent = percent(&begun);
        Self { control, length, film, roll, begun, percent, commands: None, jumped: None }
    }

    /// Does it; returns what there is to say at once.
    fn act(&mut self, action: KeyAction, now: MonoTime) -> Option<&'static str> {
        match action {
            KeyAction::PauseOrResume if self.control.live.state() == State::Paused => {
                self.ask(Command::Request(Transition::Resume))
            }
            KeyAction::PauseOrResume => self.ask(Command::Request(Transition::Pause)),
            KeyAction::Jump(seconds) => self.jump(seconds, now),
            KeyAction::Clear => self.ask(Command::Request(Transition::Clear)),
            KeyAction::Park => self.ask(Command::Request(Transition::Park)),
            KeyAction::Stop => self.stop(),
            KeyAction::Level(step) => self.level(step),
            KeyAction::Trim(step) => self.trim(step),
            KeyAction::Nudge(frames) => self.trim(self.film.read().frames_ms(frames)),
            KeyAction::Agree => {
                self.roll.agree();
                None
            }
            KeyAction::Leave => {
                self.control.leave.store(true, Ordering::Relaxed);
                None
            }
            KeyAction::Help => Some(HELP),
        }
    }

    fn ask(&mut self, command: Command) -> Option<&'static str> {
        match &mut self.commands {
            Some(commands) => {
                commands.push(command).is_err().then_some("too many keys at once; press the key again")
            }
            None => Some("the cue has not begun; wait, or quit with q"),
        }
    }

    fn stop(&self) -> Option<&'static str> {
        self.control.desk.stop();
        self.commands.is_none().then_some(
            "the cue will not begin; a slow move to park continues to its end, which only the hard-wired emergency stop \
             prevents",
        )
    }

    fn jump(&mut self, seconds: i64, now: MonoTime) -> Option<&'static str> {
        let from = match self.jumped {
            Some((at, target)) if now.since(at) < JUMPING => target,
            _ => self.control.live.show(),
        };
        let target = ShowTime::from_nanos(from.as_nanos() + seconds * 1_000_000_000);
        let target = target.clamp(ShowTime::ZERO, self.length);
        self.jumped = Some((now, target));
        self.ask(Command::Seek(target))
    }

    fn level(&mut self, step: i32) -> Option<&'static str> {
        let begun = percent(&self.begun);
        if step > 0 && self.percent == begun {
            return Some("this is the level at the start of the play; start with a higher --level for more");
        }
        self.percent = (self.percent + step).clamp(0, begun);
        self.set_levels();
        None
    }

    /// Lanes that began at different levels keep their proportions.
    fn set_levels(&self) {
        let part = f64::from(self.percent) / f64::from(percent(&self.begun).max(1));
        for (lane, begun) in self.begun.iter().enumerate() {
            let (motion, vibration) = (begun.motion * part, begun.vibration * part);
            self.control.desk.set_levels(lane, motion, vibration);
        }
    }

    fn trim(&self, step: i32) -> Option<&'static str> {
        let desk = &self.control.desk;
        desk.set_trim_ms((desk.trim_ms() + step).clamp(-TRIM_MS, TRIM_MS));
        None
    }
}

/// The greatest level of motion among lanes, whole percent.
#[expect(clippy::cast_possible_truncation, reason = "0 to 100")]
pub(super) fn percent(mixes: &[Mix]) -> i32 {
    (mixes.iter().map(|mix| mix.motion).fold(0.0, f64::max) * 100.0).round() as i32
}

/// Starts the thread, which gives the terminal back when it ends. What is asked of the hall goes where `handle` says once it is there; what there is to say goes to
/// `notes`.
///
/// # Errors
/// That of the system where it starts no further thread.
pub(super) fn start(
    mut leader: Leader,
    keyboard: Keyboard,
    handle: Receiver<Producer<Command>>,
    notes: Sender<&'static str>,
    over: Arc<AtomicBool>,
) -> io::Result<JoinHandle<()>> {
    Builder::new().name("keys".to_owned()).spawn(move || {
        let mut decoder = KeyDecoder::default();
        let mut bytes = [0; 64];
        while !over.load(Ordering::Relaxed) {
            let Ok(count) = keyboard.read(&mut bytes, WAIT) else {
                // Nobody is there any more to clear or to park: as if the terminal had been closed.
                leader.control.leave.store(true, Ordering::Relaxed);
                return;
            };
            if count == 0 {
                decoder.forget();
            }
            leader.commands = leader.commands.take().or_else(|| handle.try_recv().ok());
            for action in bytes[..count].iter().filter_map(|byte| decoder.take(*byte)) {
                if let Some(note) = leader.act(action, Monotonic.now()) {
                    let _ = notes.send(note); // where nobody speaks, nothing is said
                }
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::film::{FilmTable, SourceRow};
    use crate::film::point::FilmState;
    use crate::rt::Desk;
    use crate::state::PlayMode;
    use rtrb::{Consumer, RingBuffer};
    use std::iter;

    /// A leader of two lanes, one at half the level of the other, in a cue of 60 s that is at 30 s; and what it asks.
    fn leading(level: f64) -> (Leader, Consumer<Command>) {
        let mixes = [level, level / 2.0].map(|level| Mix { motion: level, vibration: level, ..Mix::FULL });
        let desk = Arc::new(Desk::new(mixes.into_iter()));
        let control = Control { desk, live: Arc::default(), leave: Arc::default() };
        let show = ShowTime::from_millis(30_000);
        control.live.on_show(show);
        let (commands, asked) = RingBuffer::new(4);
        let mut leader = Leader::new(control, ShowTime::from_millis(60_000), film(), Arc::default());
        leader.commands = Some(commands);
        (leader, asked)
    }

    /// A film of 25 frames a second.
    fn film() -> SharedTable {
        let mut row = SourceRow::named("mpv", FilmState::Locked);
        row.notes.fps = Some("25".to_owned());
        SharedTable::of(FilmTable { sources: vec![row], ..FilmTable::default() })
    }

    fn at(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    /// What was asked: a request, or a jump.
    fn asked(consumer: &mut Consumer<Command>) -> Vec<Result<Transition, ShowTime>> {
        let command = |command| match command {
            Command::Request(request) => Ok(request),
            Command::Seek(film) => Err(film),
            Command::Event(_)
            | Command::Load(_)
            | Command::ParkSlowly { .. }
            | Command::StartAt(_)
            | Command::CallOff => {
                panic!("no key asks for {command:?}")
            }
        };
        iter::from_fn(|| consumer.pop().ok()).map(command).collect()
    }

    #[test]
    fn space_resumes_a_pause_and_pauses_all_else() {
        let (mut leader, mut commands) = leading(1.0);
        let plays = [PlayMode::Following, PlayMode::Joining].map(State::Playing);
        for state in [plays[0], State::Paused, plays[1]] {
            leader.control.live.enter(state);
            assert_eq!(leader.act(KeyAction::PauseOrResume, at(0)), None);
        }
        let expected = [Transition::Pause, Transition::Resume, Transition::Pause].map(Ok);
        assert_eq!(asked(&mut commands), expected);
    }

    #[test]
    fn jumps_add_up_where_the_film_is_not_yet_there_and_stay_within_the_cue() {
        let (mut leader, mut commands) = leading(1.0);
        let presses = [(5, 0), (5, 100), (-5, 200), (-5, 5_000), (-50, 9_000), (90, 9_200)];
        let targets = presses.map(|(seconds, ms)| {
            assert_eq!(leader.act(KeyAction::Jump(seconds), at(ms)), None);
            asked(&mut commands)
        });
        let expected = [35, 40, 35, 25, 0, 60].map(|s| vec![Err(ShowTime::from_millis(s * 1_000))]);
        assert_eq!(targets, expected);
    }

    #[test]
    fn levels_keep_their_proportions_and_never_rise_above_those_of_the_start() {
        let (mut leader, _commands) = leading(0.62);
        let desk = Arc::clone(&leader.control.desk);
        let levels = || [0, 1].map(|lane| (desk.mix(lane).motion * 1000.0).round());
        assert!(
            leader
                .act(KeyAction::Level(5), at(0))
                .is_some_and(|said| said.contains("at the start of the play"))
        );
        assert_eq!(levels(), [620.0, 310.0]);
        assert_eq!(leader.act(KeyAction::Level(-5), at(0)), None);
        assert_eq!(levels(), [570.0, 285.0]);
        (0..20).for_each(|_| assert_eq!(leader.act(KeyAction::Level(-5), at(0)), None));
        assert_eq!(levels(), [0.0, 0.0]);
        (0..13).for_each(|_| assert_eq!(leader.act(KeyAction::Level(5), at(0)), None));
        assert_eq!(levels(), [620.0, 310.0]);
        assert_eq!(desk.mix(0).vibration.to_bits(), desk.mix(0).motion.to_bits());
    }

    #[test]
    fn trim_goes_as_far_as_the_engine_takes_it() {
        let (mut leader, _commands) = leading(1.0);
        leader.act(KeyAction::Trim(-10), at(0));
        assert_eq!(leader.control.desk.trim_ms(), -10);
        (0..60).for_each(|_| assert_eq!(leader.act(KeyAction::Trim(10), at(0)), None));
        assert_eq!(leader.control.desk.trim_ms(), TRIM_MS);
        leader.act(KeyAction::Nudge(-2), at(0));
        assert_eq!(leader.control.desk.trim_ms(), TRIM_MS - 80, "two frames of 25 a second");
        leader.film = SharedTable::default();
        leader.act(KeyAction::Nudge(-1), at(0));
        assert_eq!(leader.control.desk.trim_ms(), TRIM_MS - 122, "one more of 24");
    }

    #[test]
    fn a_stop_needs_no_place_among_the_commands() {
        let (mut leader, _commands) = leading(1.0);
        (0..4).for_each(|_| assert_eq!(leader.act(KeyAction::Park, at(0)), None));
        assert!(leader.act(KeyAction::Park, at(0)).is_some_and(|said| said.contains("again")));
        assert_eq!(leader.act(KeyAction::Stop, at(0)), None);
        assert!(leader.control.desk.take_stop());
    }

    #[test]
    fn before_the_cue_begins_a_stop_and_leaving_count_and_all_else_is_told_to_wait() {
        let (mut leader, _commands) = leading(1.0);
        leader.commands = None;
        assert!(leader.act(KeyAction::Clear, at(0)).is_some_and(|said| said.contains("not begun")));
        assert!(leader.act(KeyAction::Stop, at(0)).is_some_and(|said| said.contains("hard-wired")));
        assert!(leader.control.desk.take_stop());
        assert_eq!(leader.act(KeyAction::Leave, at(0)), None);
        assert!(leader.control.leave.load(Ordering::Relaxed));
    }
}
