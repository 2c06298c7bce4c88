//! What is said of a play while it runs, by a thread of its own: a line on a terminal; in a pipe a line a phase.

use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Builder, JoinHandle};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::cli::print;
use crate::rt::{Live, Phase};
use crate::time::ShowTime;

/// How often is looked.
const LOOK: Duration = Duration::from_millis(100);

/// What there is to say of a play.
pub(super) struct Said {
    pub(super) live: Arc<Live>,
    /// Set by the first Ctrl-C.
    pub(super) stop: Arc<AtomicBool>,
    /// Length of the cue.
    pub(super) length: ShowTime,
    /// How long the first move onto the cue takes.
    pub(super) join: Duration,
}

impl Said {
    /// What is going on in that phase.
    fn words(&self, phase: Phase) -> String {
        match phase {
            Phase::Asking => "asking where the seats stand".to_owned(),
            Phase::Homing => {
                let (seats, time) = self.live.homing();
                let noun = if seats == 1 { "seat" } else { "seats" };
                format!("bringing {seats} {noun} to park (up to {:.1} s)", time.as_secs_f64())
            }
            Phase::Joining => format!("joining the cue ({:.2} s)", self.join.as_secs_f64()),
            Phase::Playing => "playing".to_owned(),
            Phase::Freewheeling => "frames were late; the seats hold, and join again".to_owned(),
            Phase::Paused => "paused".to_owned(),
            Phase::Stopping => "stopping".to_owned(),
            Phase::Stopped => "stopped".to_owned(),
            Phase::Fault => "fault; the seats were stopped".to_owned(),
            Phase::Recovering => "cleared".to_owned(),
            Phase::Parking if self.stop.load(Ordering::Relaxed) => {
                "parking; Ctrl-C again ends at once".to_owned()
            }
            Phase::Parking => "parking".to_owned(),
        }
    }

    /// Where the show stands; behind the end of the cue that is its end.
    fn show(&self) -> ShowTime {
        self.live.show().min(self.length)
    }

    /// The line of this instant.
    fn line(&self) -> String {
        let (phase, live) = (self.live.phase(), &self.live);
        let words = self.words(phase);
        if phase < Phase::Joining {
            return words;
        }
        format!(
            "{words}: {} / {}, {} ticks, {} missed",
            self.show(),
            self.length,
            live.ticks(),
            live.missed()
        )
    }

    /// What is to be said where `last` has been: of each phase once, also where the cue is played again and again.
    fn news(&self, last: &mut Phase) -> Option<String> {
        let phase = self.live.phase();
        let is_new = phase > *last;
        *last = phase.max(*last);
        is_new.then(|| self.words(phase))
    }
}

/// The thread that says it; none where the system starts no further one, which is no reason to fail.
pub(super) struct Progress {
    done: Arc<AtomicBool>,
    teller: Option<JoinHandle<()>>,
}

impl Progress {
    pub(super) fn start(said: Said, for_ever: bool) -> Self {
        let done = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&done);
        let on_terminal = std::io::stderr().is_terminal();
        let teller = Builder::new()
            .name("progress".to_owned())
            .spawn(move || if on_terminal { draw(&said, for_ever, &over) } else { tell(&said, &over) });
        Self { done, teller: teller.ok() }
    }

    pub(super) fn finish(self) {
        if let Some(teller) = self.teller {
            self.done.store(true, Ordering::Relaxed);
            teller.thread().unpark();
            let _ = teller.join(); // a progress line that failed is no reason to fail
        }
    }
}

fn draw(said: &Said, for_ever: bool, over: &AtomicBool) {
    let ms = |at: ShowTime| u64::try_from(at.as_nanos() / 1_000_000).unwrap_or(0);
    let bar = if for_ever { ProgressBar::no_length() } else { ProgressBar::new(ms(said.length)) };
    let style = ProgressStyle::with_template("{msg} [{wide_bar}]").expect("the template is fixed");
    bar.set_style(style.progress_chars("=> "));
    while !over.load(Ordering::Relaxed) {
        bar.set_position(ms(said.show()));
        bar.set_message(said.line());
        thread::park_timeout(LOOK);
    }
    bar.finish_and_clear();
}

fn tell(said: &Said, over: &AtomicBool) {
    let mut last = Phase::default();
    loop {
        // Looked at once more after the end, for a phase that was shorter than the time between two looks.
        let ended = over.load(Ordering::Relaxed);
        if let Some(news) = said.news(&mut last) {
            print::tell(&format!("kinocue: {news}"));
        }
        if ended {
            return;
        }
        thread::park_timeout(LOOK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rt::TickReport;

    fn said() -> Said {
        Said {
            live: Arc::default(),
            stop: Arc::default(),
            length: ShowTime::from_secs_f64(8.0),
            join: Duration::from_millis(1_250),
        }
    }

    #[test]
    fn the_line_says_what_the_seats_are_doing() {
        let said = said();
        assert_eq!(said.line(), "asking where the seats stand");
        [2_000, 3_000].into_iter().for_each(|ms| said.live.on_homing(ms));
        said.live.enter(Phase::Homing);
        assert_eq!(said.line(), "bringing 2 seats to park (up to 3.0 s)");
        said.live.enter(Phase::Joining);
        assert_eq!(said.line(), "joining the cue (1.25 s): 00:00.000 / 00:08.000, 0 ticks, 0 missed");
        said.live.enter(Phase::Parking);
        assert!(said.line().starts_with("parking: "), "{}", said.line());
        said.stop.store(true, Ordering::Relaxed);
        assert!(said.line().starts_with("parking; Ctrl-C again ends at once: "), "{}", said.line());
    }

    #[test]
    fn no_position_is_past_the_end_of_the_cue() {
        let past = said();
        let show = ShowTime::from_secs_f64(9.0);
        past.live.on_tick(&TickReport { late_ns: 0, missed: 0, show });
        assert_eq!(past.show(), past.length);
    }

    #[test]
    fn each_phase_is_news_once_also_in_a_loop() {
        let said = said();
        let mut last = Phase::default();
        assert_eq!(said.news(&mut last), None);
        said.live.enter(Phase::Playing);
        assert_eq!(said.news(&mut last).as_deref(), Some("playing"));
        for again in [Phase::Playing, Phase::Joining, Phase::Playing] {
            said.live.enter(again);
            assert_eq!(said.news(&mut last), None);
        }
    }
}
