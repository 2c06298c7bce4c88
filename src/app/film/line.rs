//! Lines that carry LTC, or a film's own sound: blocks are read as they come, and each is stamped with the instant at which it was.

use std::fs::File;
use std::io::{self, Read};
use std::os::fd::AsFd;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};

use super::heard::{Listener, Listening};
use super::riff::{Channels, SampleStream};
use super::{ChildSlot, FilmError, LeftRead, WordSink, start};
use crate::film::observation::{FilmWord, Observation};
use crate::film::source::{FilmArgs, SoundLine};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// A block is 10 ms of sound at 48,000 samples a second, or what of it there is.
const BLOCK: usize = 960;

/// Begins to read an input; a command that is started for it is put there.
pub(super) fn start_reading(
    input: &SoundLine,
    listening: Listening,
    args: &FilmArgs,
    told: WordSink,
    child: &ChildSlot,
) -> Result<(), FilmError> {
    let line = HeardLine { listening, args: args.clone(), told };
    let failed = |path: &Path| {
        let what = path.display().to_string();
        move |source| FilmError::Open { what, source }
    };
    match input {
        SoundLine::File(path) => {
            let file = File::open(path).map_err(failed(path))?;
            start("line", move || line.end(line.read(file, true)))?;
        }
        SoundLine::Stdin => {
            // Not through the buffer that is shared: what lies in there no poll tells of.
            let input = io::stdin().as_fd().try_clone_to_owned().map_err(failed(Path::new("stdin")))?;
            start("line", move || line.end(line.read(File::from(input), false)))?;
        }
        SoundLine::Fifo(path) => {
            let path = path.clone();
            path.metadata().map_err(failed(&path))?;
            start("line", move || {
                let read = || LeftRead::open(&path, &line.told).and_then(|fifo| line.read_from(fifo, false));
                while line.told.again(read()) {}
            })?;
        }
        SoundLine::Pipe(command) => {
            let mut shell = Command::new("sh");
            shell.args(["-c", command]);
            run(shell, command, line, child)?;
        }
        SoundLine::Alsa(device) => {
            let mut arecord = Command::new("arecord");
            arecord.args(["-q", "-t", "raw", "-f", "S16_LE", "-c", "1", "-r", "48000", "-D", device]);
            run(arecord, "arecord", line, child)?;
        }
    }
    Ok(())
}

/// Reads what a command writes. One that fails, as a sound card does that is pulled out, is started anew; one that ends well has
/// nothing more to say.
fn run(mut command: Command, name: &str, line: HeardLine, child: &ChildSlot) -> Result<(), FilmError> {
    // In a group of its own: a shell is ended with all that it has started.
    command.stdin(Stdio::null()).stdout(Stdio::piped()).process_group(0);
    let failed = |source| FilmError::Command { command: name.to_owned(), source };
    let mut output = put(command.spawn().map_err(failed)?, child);
    let child = Arc::clone(child);
    start("line", move || {
        // Whoever ended what was started ends no more: this one was started meanwhile.
        while !line.told.is_over() {
            let read = output.take().map_or(Ok(()), |output| line.read(output, false));
            // Whoever ends the program meanwhile does not wait for the lock.
            let done = lock(&child).take();
            let ended = done.map(|mut one| one.wait());
            if matches!(ended, Some(Ok(status)) if status.success()) {
                return line.end(read);
            }
            if !line.told.again(read) {
                return;
            }
            output = command.spawn().ok().and_then(|one| put(one, &child));
        }
        end(&child);
    })?;
    Ok(())
}

/// Keeps a command that runs, so that it ends with whoever started it; gives what it writes.
fn put(mut one: Child, child: &Mutex<Option<Child>>) -> Option<ChildStdout> {
    let output = one.stdout.take();
    *lock(child) = Some(one);
    output
}

/// Ends a command, and what it has started.
pub(super) fn end(child: &Mutex<Option<Child>>) {
    if let Some(mut one) = lock(child).take() {
        // One that has ended by itself cannot be ended any more.
        let _ = kill_process_group(Pid::from_child(&one), Signal::KILL);
        let _ = one.wait();
    }
}

fn lock(child: &Mutex<Option<Child>>) -> MutexGuard<'_, Option<Child>> {
    child.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A line, and what it is listened to for.
struct HeardLine {
    listening: Listening,
    args: FilmArgs,
    told: WordSink,
}

impl HeardLine {
    /// Reads to the end of a stream, or until nobody listens; one that is `paced`, at the speed of its sound.
    fn read(&self, stream: impl Read + AsFd, paced: bool) -> io::Result<()> {
        self.read_from(LeftRead::new(stream, &self.told), paced)
    }

    fn read_from(&self, mut stream: impl Read, paced: bool) -> io::Result<()> {
        let channels = match self.listening {
            Listening::Ltc => Channels::First,
            Listening::Sound(_) => Channels::Mixed,
        };
        let (mut samples, mut block, mut octets) = (SampleStream::of(channels), Vec::new(), [0; BLOCK]);
        let (begun, mut heard) = (Monotonic.now(), 0_u64);
        let mut listener: Option<Listener> = None;
        loop {
            let count = stream.read(&mut octets)?;
            if count == 0 {
                return Ok(());
            }
            let mut at = Monotonic.now();
            block.clear();
            samples.push(&octets[..count], &mut block).map_err(io::Error::other)?;
            let Some(per_s) = samples.samples_per_s() else { continue };
            heard += block.len() as u64;
            if paced {
                at = begun + Duration::from_nanos(heard * 1_000_000_000 / u64::from(per_s));
                Monotonic.sleep_until(at);
            }
            let listener = listener.get_or_insert_with(|| self.listening.begin(per_s, &self.args));
            listener.hear(&block, at, |what| {
                self.told.tell(what);
            });
            self.told.note(|notes| listener.note(notes));
        }
    }

    /// Nothing more can come: whoever wrote is gone for good, and the film over.
    fn end(&self, _read: io::Result<()>) {
        self.told.tell(Observation::new(Monotonic.now(), FilmWord::End));
    }
}
