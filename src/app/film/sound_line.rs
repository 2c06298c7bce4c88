//! Sound from wherever it comes, heard as LTC or as the film's own: bytes as they are read, and when that was, into what they say of
//! the film.

use std::fs::{File, FileType};
use std::io::{self, Read as _};
use std::os::fd::AsFd as _;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};

use super::heard::{Listener, Listening};
use super::line::{ByteLine, LineTaker, RELAY};
use super::riff::{Channels, HEADER, SampleStream};
use super::{ChildSlot, FilmError, WantedFile, WordSink, is_line, start};
use crate::film::observation::{FilmWord, Observation};
use crate::film::source::{FilmArgs, LineKind, SoundLine};
use crate::sys::clock::Monotonic;
use crate::sys::file;
use crate::time::{Clock as _, MonoTime};

const RECORDING: WantedFile = WantedFile {
    is_one: FileType::is_file,
    other: "it is not a file",
    remedy: "give a WAV file; a FIFO is written fifo:PATH, a sound card alsa:DEVICE",
};
const FIFO: WantedFile = WantedFile {
    is_one: is_line,
    other: "it is not a FIFO",
    remedy: "make one with mkfifo; a WAV file is written without fifo:",
};

/// Begins to read an input, and to listen to it; a command that is started for it is put there.
pub(super) fn start_reading(
    input: &SoundLine,
    listening: Listening,
    args: &FilmArgs,
    told: WordSink,
    child: &ChildSlot,
) -> Result<(), FilmError> {
    let (args, sink) = (args.clone(), told.clone());
    let (channels, most) = match listening {
        Listening::Ltc => (Channels::One(args.channel), args.channel),
        Listening::Sound(_) => (Channels::Mixed, 1),
    };
    let paced = if let SoundLine::File(path) = input {
        check(path, channels)?;
        true
    } else {
        false
    };
    let open = move || SoundTaker {
        samples: SampleStream::of(channels),
        listening: listening.clone(),
        args: args.clone(),
        told: sink.clone(),
        block: Vec::new(),
        listener: None,
        paced: paced.then(|| (Monotonic.now(), 0)),
    };
    start_line(input, most, ByteLine::new(told, open), child)
}

/// Whether a recording can be read: said before anything waits for what it brings.
fn check(path: &Path, channels: Channels) -> Result<(), FilmError> {
    RECORDING.check(path)?;
    let mut begin = Vec::new();
    let read = file::open(path).and_then(|file| file.take(HEADER as u64).read_to_end(&mut begin));
    read.map_err(failed(path))?;
    let wrong = |source| FilmError::Sound { what: path.display().to_string(), source };
    SampleStream::of(channels).check(&begin).map_err(wrong)
}

fn failed(path: &Path) -> impl FnOnce(io::Error) -> FilmError {
    let what = path.display().to_string();
    move |source| FilmError::Open { what, source }
}

/// Begins to read an input, of a sound card with so many channels.
pub(super) fn start_line(
    input: &SoundLine,
    channels: u8,
    line: ByteLine,
    child: &ChildSlot,
) -> Result<(), FilmError> {
    match input {
        SoundLine::File(path) => {
            let file = file::open(path).map_err(failed(path))?;
            start("line", move || end(&line, line.read(file)))?;
        }
        SoundLine::Stdin => {
            // Not through the buffer that is shared: what lies in there no poll tells of.
            let input = io::stdin().as_fd().try_clone_to_owned().map_err(failed(Path::new("stdin")))?;
            start("line", move || end(&line, line.read(File::from(input))))?;
        }
        SoundLine::Fifo(path) => {
            let path = FIFO.check(path)?;
            start("line", move || while line.told.again(line.read_at(&path)) {})?;
        }
        SoundLine::Relay(socket) => {
            let socket = RELAY.check_if_there(socket)?;
            start("line", move || while line.told.again(line.read_relayed(&socket, LineKind::Ltc)) {})?;
        }
        SoundLine::Pipe(command) => {
            let mut shell = Command::new("sh");
            shell.args(["-c", command]);
            run(shell, command, line, child)?;
        }
        SoundLine::Alsa(device) => {
            let mut arecord = Command::new("arecord");
            // What is raw has one channel; of more its header says how many there are.
            let kind = if channels == 1 { "raw" } else { "wav" };
            arecord.args(["-q", "-t", kind, "-f", "S16_LE", "-r", "48000", "-D", device]);
            arecord.args(["-c", &channels.to_string()]);
            run(arecord, "arecord", line, child)?;
        }
    }
    Ok(())
}

/// Reads what a command writes. One that fails, as a sound card does that is pulled out, is started anew; one that ends well has
/// nothing more to say.
fn run(mut command: Command, name: &str, line: ByteLine, child: &ChildSlot) -> Result<(), FilmError> {
    // In a group of its own: a shell is ended with all that it has started.
    command.stdin(Stdio::null()).stdout(Stdio::piped()).process_group(0);
    let failed = |source| FilmError::Command { command: name.to_owned(), source };
    let mut output = put(command.spawn().map_err(failed)?, child);
    let child = Arc::clone(child);
    start("line", move || {
        // Whoever ended what was started ends no more: this one was started meanwhile.
        while !line.told.is_over() {
            let read = output.take().map_or(Ok(()), |output| line.read(output));
            // Whoever ends the program meanwhile does not wait for the lock.
            let done = lock(&child).take();
            let ended = done.map(|mut one| one.wait());
            if matches!(ended, Some(Ok(status)) if status.success()) {
                return end(&line, read);
            }
            if !line.told.again(read.and_then(|()| ended.map_or(Ok(()), |ended| failure(ended?)))) {
                return;
            }
            output = command.spawn().ok().and_then(|one| put(one, &child));
        }
        kill(&child);
    })?;
    Ok(())
}

/// Why nothing comes of a command any more.
fn failure(status: ExitStatus) -> io::Result<()> {
    let why =
        format!("its command has failed ({status}), and is started again each second; see what it reports");
    Err(io::Error::other(why))
}

/// Keeps a command that runs, so that it ends with whoever started it; gives what it writes.
fn put(mut one: Child, child: &Mutex<Option<Child>>) -> Option<ChildStdout> {
    let output = one.stdout.take();
    *lock(child) = Some(one);
    output
}

/// Ends a command, and what it has started.
pub(super) fn kill(child: &Mutex<Option<Child>>) {
    if let Some(mut one) = lock(child).take() {
        // One that has ended by itself cannot be ended any more.
        let _ = kill_process_group(Pid::from_child(&one), Signal::KILL);
        let _ = one.wait();
    }
}

fn lock(child: &Mutex<Option<Child>>) -> MutexGuard<'_, Option<Child>> {
    child.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Nothing more can come, whatever ended it: whoever wrote is gone for good, and the film over.
fn end(line: &ByteLine, read: io::Result<()>) {
    line.told.note(|notes| notes.trouble = read.err().map(|error| error.to_string()));
    line.told.tell(Observation::new(Monotonic.now(), FilmWord::End));
}

/// Hears what the sound of a line says.
struct SoundTaker {
    listening: Listening,
    args: FilmArgs,
    told: WordSink,
    samples: SampleStream,
    block: Vec<i16>,
    /// None before it is known how many samples a second there are.
    listener: Option<Listener>,
    /// Since when a recording is heard, at the speed of its sound, and how many samples of it were.
    paced: Option<(MonoTime, u64)>,
}

impl LineTaker for SoundTaker {
    fn take(&mut self, bytes: &[u8], mut at: MonoTime) -> io::Result<()> {
        self.block.clear();
        self.samples.push(bytes, &mut self.block).map_err(io::Error::other)?;
        let Some(per_s) = self.samples.samples_per_s() else { return Ok(()) };
        if let Some((begun, heard)) = &mut self.paced {
            *heard += self.block.len() as u64;
            at = *begun + Duration::from_nanos(*heard * 1_000_000_000 / u64::from(per_s));
            Monotonic.sleep_until(at);
        }
        let listener = self.listener.get_or_insert_with(|| self.listening.begin(per_s, &self.args));
        listener.hear(&self.block, at, |what| {
            self.told.tell(what);
        });
        self.told.note(|notes| listener.note(notes));
        Ok(())
    }
}
