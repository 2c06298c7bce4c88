//! What is said of a play while it runs, by a thread of its own: live lines on a terminal, in a pipe a line for each
//! change; and where a person sits at the terminal, a second thread that reads the keys.

use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, Builder, JoinHandle};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use rtrb::Producer;

use super::health::HealthMessages;
use super::keyboard::{self, Leader};
use super::keys;
use super::messages::Messages;
use crate::app::PlayHandle;
use crate::cli::print;
use crate::rt::{Command, News, NewsIn};
use crate::state::{Next, PlayMode, State};
use crate::sys::terminal::Keyboard;
use crate::time::ShowTime;

/// Looks after which a second Ctrl-C is one of its own: half a second.
const ARM_AFTER: u32 = 6;
/// How often is looked.
const LOOK: Duration = Duration::from_millis(100);
/// What a first Ctrl-C does, and what a second one will.
const LEAVING: &str = "the seats that may move park, and the play ends; Ctrl-C again, half a second from now or later, ends it at once";
/// What a play ends with that nothing can lead any more.
const NO_FILM: &str =
    "the film is over, the seats did not follow it, and no source can report another; the play ends";

/// The threads; `None` if the system starts no further one, which is no reason to fail.
pub(super) struct Progress {
    over: Arc<AtomicBool>,
    teller: Option<JoinHandle<()>>,
    keys: Option<JoinHandle<()>>,
    news: Sender<NewsIn>,
    commands: Sender<Producer<Command>>,
}

impl Progress {
    /// Begins to speak, and where standard input and standard error are a terminal, to listen.
    pub(super) fn start(said: Messages, for_ever: bool) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let (news, news_end) = channel();
        let (commands, commands_end) = channel();
        let (notes, notes_end) = channel();
        let on_terminal = std::io::stderr().is_terminal();
        let keys = on_terminal.then(Keyboard::take).flatten().and_then(|keyboard| {
            let leader = Leader::new(
                said.control.clone(),
                said.length,
                said.film.clone().unwrap_or_default(),
                Arc::clone(&said.roll),
            );
            keyboard::start(leader, keyboard, commands_end, notes, Arc::clone(&over)).ok()
        });
        let led = keys.is_some();
        if led {
            said.roll.ask();
        }
        let mut teller = Teller {
            said,
            news_end,
            notes: notes_end,
            news: None,
            pressed: 0,
            parks: false,
            missed: false,
            now: None,
            standings: HealthMessages::default(),
            film: Vec::new(),
            film_was_over: false,
        };
        let done = Arc::clone(&over);
        let teller = Builder::new()
            .name("progress".to_owned())
            .spawn(move || if on_terminal { teller.draw(for_ever, led, &done) } else { teller.tell(&done) });
        Self { over, teller: teller.ok(), keys, news, commands }
    }

    /// Takes the handle; whether anybody holds them.
    pub(super) fn lead(&self, handle: PlayHandle) -> bool {
        let _ = self.news.send(handle.news); // without a teller nobody wants it
        self.commands.send(handle.commands).is_ok()
    }

    /// Says what is left to say, and gives the terminal back.
    pub(super) fn finish(self) {
        self.over.store(true, Ordering::Relaxed);
        for thread in self.keys.into_iter().chain(self.teller) {
            thread.thread().unpark();
            let _ = thread.join(); // a progress line that failed is no reason to fail
        }
    }
}

/// Collects what there is to say, and says it.
struct Teller {
    said: Messages,
    news_end: Receiver<NewsIn>,
    /// What the keys have to say.
    notes: Receiver<&'static str>,
    /// None until the tick loop runs.
    news: Option<NewsIn>,
    /// For how many looks Ctrl-C has been pressed.
    pressed: u32,
    /// True if seats are brought to park before the show, and that was said.
    parks: bool,
    /// True if it was said who does not answer.
    missed: bool,
    /// The state of the hall and the next action, once it plays.
    now: Option<(State, Next)>,
    /// How the controllers stood when they were looked at last.
    standings: HealthMessages,
    /// What was true of the film's sources when they were looked at last.
    film: Vec<String>,
    /// Whether no source of it could tell any more by then.
    film_was_over: bool,
}

impl Teller {
    /// What is to be said now.
    fn lines(&mut self) -> Vec<String> {
        let mut lines: Vec<String> = self.notes.try_iter().map(str::to_owned).collect();
        self.pressed += u32::from(self.said.ctrl_c.is_pressed());
        match self.pressed {
            // It stays so for as long as it is looked at.
            1 => lines.push(LEAVING.to_owned()),
            ARM_AFTER => {
                self.said.ctrl_c.arm();
                lines.push("Ctrl-C again ends at once, and leaves the seats where they are".to_owned());
            }
            _ => {}
        }
        if !self.parks && self.said.control.live.parking().0 > 0 {
            self.parks = true;
            lines.push(self.said.preparing());
        }
        if !self.missed {
            let silent = self.said.silent();
            self.missed = silent.is_some();
            lines.extend(silent);
        }
        self.news = self.news.take().or_else(|| self.news_end.try_recv().ok());
        while let Some(news) = self.news.as_mut().and_then(|news| news.pop().ok()) {
            if let News::Entered { state, next, .. } = news {
                self.now = Some((state, next));
            }
            lines.extend(self.said.news(&news));
        }
        lines.extend(self.standings.changes(&self.said.control.live.table(), &self.said.names));
        self.look_at_film(&mut lines);
        lines
    }

    /// What is newly true of the film's sources.
    fn look_at_film(&mut self, lines: &mut Vec<String>) {
        let Some(table) = &self.said.film else { return };
        let table = table.read();
        // By the look before: a film that has led the seats parks them as it ends.
        let waits = matches!(self.now, Some((State::Playing(PlayMode::Waiting), _)));
        if self.film_was_over && waits && !self.said.control.leave.swap(true, Ordering::Relaxed) {
            lines.push(NO_FILM.to_owned());
        }
        self.film_was_over = table.over;
        let warnings = table.warnings();
        lines.extend(warnings.iter().filter(|warning| !self.film.contains(warning)).cloned());
        self.film = warnings;
    }

    fn draw(&mut self, for_ever: bool, led: bool, over: &AtomicBool) {
        let ms = |at: ShowTime| u64::try_from(at.as_nanos() / 1_000_000).unwrap_or(0);
        let bar = if for_ever { ProgressBar::no_length() } else { ProgressBar::new(ms(self.said.length)) };
        let keys = if led { format!("\n{}", keys::IN_SHORT) } else { String::new() };
        let template = format!("{{msg}} [{{wide_bar}}]\n{{prefix}}{keys}");
        let style = ProgressStyle::with_template(&template).expect("the template is fixed");
        bar.set_style(style.progress_chars("=> "));
        loop {
            // Looked at once more after the end, for what has happened since.
            let ended = over.load(Ordering::Relaxed);
            self.lines().iter().for_each(|line| bar.println(line));
            if ended {
                break;
            }
            let (figures, next) = match self.now {
                Some((state, next)) => (self.said.figures(state), self.said.next(next)),
                None => (self.said.preparing(), self.said.next("wait")),
            };
            let film = self.said.film_place(true).map(|film| format!("film {film}\n"));
            bar.set_prefix(film.unwrap_or_default() + &next);
            bar.set_message(figures);
            bar.set_position(ms(self.said.show()));
            thread::park_timeout(LOOK);
        }
        bar.finish_and_clear();
    }

    fn tell(&mut self, over: &AtomicBool) {
        loop {
            let ended = over.load(Ordering::Relaxed);
            self.lines().iter().for_each(|line| print::tell(&format!("kinocue: {line}")));
            if ended {
                return;
            }
            thread::park_timeout(LOOK);
        }
    }
}
