//! The keys of a play on a terminal: what they do, and how the terminal is left.

use std::fs::File;
use std::io::{PipeReader, PipeWriter, Read as _, Write as _, pipe};
use std::os::fd::{AsFd as _, OwnedFd};
use std::process::Stdio;
use std::sync::mpsc::{Receiver, channel};

use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::Signal;
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, unlockpt};
use rustix::termios::{LocalModes, Termios, Winsize, tcgetattr, tcsetwinsize};

use super::Folder;
use super::process::{PATIENCE, Playing, Run, Sim};

/// A terminal with a play on it.
struct Terminal {
    ours: File,
    /// The program's end, held open to look at its modes.
    theirs: OwnedFd,
    /// Its modes before the program began.
    before: Termios,
    written: Receiver<String>,
    /// Ends the reading when it is dropped.
    open: PipeWriter,
    /// What was written and not waited for yet.
    text: String,
    playing: Playing,
    sim: Sim,
    /// Of the cue.
    _folder: Folder,
}

impl Terminal {
    /// Plays a minute in which the seat stands 45 mm above its park pose, and waits until it is there.
    fn playing() -> Self {
        let mut terminal = Self::begun(&[]);
        terminal.wait_for("playing: the seats that take part are on the cue");
        terminal
    }

    /// The same with further controllers, as far as the program is by itself.
    fn begun(more: &[String]) -> Self {
        let (ours, theirs) = terminal(80);
        let before = tcgetattr(&theirs).expect("it is a terminal");
        let (closed, open) = pipe().expect("a pipe");
        let written = read_all(ours.try_clone().expect("a handle"), closed);
        let (folder, sim) = (Folder::new(), Sim::one(&[]));
        let end = || Stdio::from(theirs.try_clone().expect("a handle"));
        let cue = folder.write("stand.csv", "time_ms,a1\n0,0.3\n60000,0.3\n");
        let to = [&sim.to(), more].concat();
        let playing = Playing::start_with(&cue, &to, &["--json"], end(), end());
        Self { ours, theirs, before, written, open, text: String::new(), playing, sim, _folder: folder }
    }

    fn press(&mut self, keys: &str) {
        self.ours.write_all(keys.as_bytes()).expect("it has room");
    }

    /// Waits until the program has written `text`, after what was waited for before.
    fn wait_for(&mut self, text: &str) {
        loop {
            if let Some(at) = self.text.find(text) {
                self.text.drain(..at + text.len());
                return;
            }
            let more = self.written.recv_timeout(PATIENCE);
            self.text += &more.unwrap_or_else(|_| panic!("no {text:?} in {:?}", self.text));
        }
    }

    fn modes(&self) -> Termios {
        tcgetattr(&self.theirs).expect("it is a terminal")
    }

    /// Waits for the end of the program, looks whether the terminal is as it was, and says what else came of it.
    fn finish(self) -> (Run, Sim) {
        let run = self.playing.finish();
        let after = tcgetattr(self.theirs.as_fd()).expect("it is a terminal");
        assert_eq!(format!("{after:?}"), format!("{:?}", self.before));
        (run, self.sim)
    }
}

/// A terminal so many characters wide: our end, and the program's.
pub(super) fn terminal(columns: u16) -> (File, OwnedFd) {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let ours = openpt(flags).expect("a terminal");
    grantpt(&ours).and_then(|()| unlockpt(&ours)).expect("it is ours");
    let theirs = ioctl_tiocgptpeer(&ours, flags).expect("its other end");
    let size = Winsize { ws_row: 24, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
    tcsetwinsize(&ours, size).expect("it takes any");
    (File::from(ours), theirs)
}

/// What comes out of a terminal, until nobody writes to it any more, or the other end of `open` is closed.
pub(super) fn read_all(mut terminal: File, open: PipeReader) -> Receiver<String> {
    let (written, read) = channel();
    std::thread::spawn(move || {
        let mut bytes = [0; 4096];
        loop {
            let mut both = [
                PollFd::new(&terminal, PollFlags::IN),
                PollFd::from_borrowed_fd(open.as_fd(), PollFlags::IN),
            ];
            poll(&mut both, None).expect("both are open");
            if !both[1].revents().is_empty() {
                return;
            }
            let Ok(count @ 1..) = terminal.read(&mut bytes) else { return };
            let _ = written.send(String::from_utf8_lossy(&bytes[..count]).into_owned()); // nobody may be waiting
        }
    });
    read
}

#[test]
fn on_a_terminal_a_play_waits_for_a_word_where_a_controller_does_not_answer() {
    let mute = Sim::one(&["--mute"]);
    for (key, motion) in [("y", true), ("q", false)] {
        let mut terminal = Terminal::begun(&mute.to());
        terminal.wait_for("c2: nobody answers; press y to play without, or q to end");
        terminal.press(key);
        if motion {
            terminal.wait_for("playing: the seats that take part are on the cue");
            terminal.press("q");
        }
        let (run, sim) = terminal.finish();
        assert_eq!(run.report_of(69)["result"], "stopped", "{key}");
        assert_eq!(sim.end().motion() > 0, motion, "{key}");
    }
}

#[test]
fn space_pauses_and_resumes_and_q_parks_and_leaves_the_terminal_as_it_was() {
    let mut terminal = Terminal::playing();
    let keyboard = LocalModes::ICANON | LocalModes::ECHO;
    assert!(terminal.before.local_modes.contains(keyboard));
    let modes = terminal.modes();
    assert!(!modes.local_modes.intersects(keyboard) && modes.local_modes.contains(LocalModes::ISIG));
    assert_eq!(modes.output_modes, terminal.before.output_modes);
    terminal.press(" ");
    terminal.wait_for("paused: paused by the operator; next: resume, or park");
    terminal.press(" ");
    terminal.wait_for("joining: resumed by the operator");
    terminal.wait_for("playing: the seats that take part are on the cue");
    terminal.press("q");
    terminal.wait_for("parked: the seats that take part have parked");
    let (run, sim) = terminal.finish();
    assert_eq!(run.report_of(0)["result"], "stopped");
    assert!(sim.end().rest_in_park());
}

#[test]
fn level_trim_seeks_and_help_show_on_the_live_lines() {
    let mut terminal = Terminal::playing();
    terminal.press("--.");
    terminal.wait_for("level 90 %, trim +10 ms");
    terminal.press("?");
    terminal.wait_for("the emergency stop is hard-wired");
    terminal.press("\u{1b}[C\u{1b}[C");
    terminal.wait_for("joining: moved to another place by the operator");
    terminal.wait_for(": 00:1"); // ten seconds on
    terminal.press("p");
    terminal.wait_for("parking: parked by the operator");
    let (run, sim) = terminal.finish();
    assert_eq!(run.report_of(0)["result"], "stopped");
    assert!(sim.end().rest_in_park());
}

#[test]
fn a_stop_stays_until_it_is_cleared_and_the_seats_park_once_they_have_been_read_again() {
    let mut terminal = Terminal::playing();
    terminal.press("s");
    terminal.wait_for("stopped: stopped by the operator; next: clear, then park");
    terminal.press("p");
    terminal.wait_for("cannot park while stopped: it is latched; clear it first");
    terminal.press("c");
    terminal.wait_for("recovering: cleared by the operator; next: park");
    terminal.press("p");
    terminal.wait_for("parked: the seats that take part have parked");
    let (run, sim) = terminal.finish();
    assert_eq!(run.report_of(0)["result"], "stopped");
    assert!(sim.end().rest_in_park());
}

#[test]
fn a_second_ctrl_c_that_ends_at_once_leaves_the_terminal_as_it_was() {
    let mut terminal = Terminal::playing();
    terminal.playing.signal(Signal::INT);
    terminal.wait_for("parking: parked by the operator");
    terminal.wait_for("Ctrl-C again ends at once");
    terminal.playing.signal(Signal::INT);
    let (run, _) = terminal.finish();
    assert_eq!(run.code, Some(130));
}

#[test]
fn sigterm_parks_the_seats_and_leaves_the_terminal_as_it_was() {
    let mut terminal = Terminal::playing();
    terminal.playing.signal(Signal::TERM);
    terminal.wait_for("parked: the seats that take part have parked");
    let (run, sim) = terminal.finish();
    assert_eq!(run.report_of(0)["result"], "stopped");
    assert!(sim.end().rest_in_park());
}

#[test]
fn a_terminal_that_is_closed_parks_the_seats_of_whoever_sat_at_it() {
    let Terminal { ours, open, theirs, playing, sim, .. } = Terminal::playing();
    drop((ours, open, theirs));
    assert_eq!(playing.finish().report_of(0)["result"], "stopped");
    assert!(sim.end().rest_in_park());
}
