//! What is said and kept of a measurement while it runs, by a thread of its own: drawings on a terminal, a line a second in
//! a pipe, an interval a second in the file.

use std::fs::File;
use std::io::{self, BufWriter, IsTerminal as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Builder, JoinHandle};
use std::time::{Duration, SystemTime};

use anyhow::Context as _;
use indicatif::{ProgressBar, ProgressStyle};

use super::report::charts;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::doctor::lateness::us;
use crate::latency::{Log, between};
use crate::rt::{Live, Times};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::sys::file::create_ours;
use crate::time::{Clock as _, MonoTime};
use crate::tracker::Histogram;

/// How often is looked.
const LOOK: Duration = Duration::from_millis(100);
/// What one interval of the file is long, and one line in a pipe apart from the next.
const INTERVAL: Duration = Duration::from_secs(1);

/// A file that has its name only once it is whole.
pub(super) struct UnfinishedFile {
    path: PathBuf,
    part: PathBuf,
    file: File,
}

impl UnfinishedFile {
    /// Creates the file under another name.
    pub(super) fn create(path: &Path) -> Result<Self, Failure> {
        let mut part = path.as_os_str().to_owned();
        part.push(".part");
        let part = PathBuf::from(part);
        let file = create_ours(&part);
        let file = file.with_context(|| format!("cannot write {}", path.display())).or_exit(Exit::Io)?;
        Ok(Self { path: path.to_path_buf(), part, file })
    }
}

/// The thread.
pub(super) struct LatencyWatch {
    done: Arc<AtomicBool>,
    thread: JoinHandle<io::Result<()>>,
    /// The name that the file is to have, and the one that it has.
    names: Option<(PathBuf, PathBuf)>,
}

impl LatencyWatch {
    pub(super) fn start(
        live: Arc<Live>,
        seconds: u32,
        about: &str,
        out: Option<UnfinishedFile>,
    ) -> Result<Self, Failure> {
        let names = out.as_ref().map(|out| (out.path.clone(), out.part.clone()));
        let done = Arc::new(AtomicBool::new(false));
        let (over, about) = (Arc::clone(&done), about.to_owned());
        let watch = move || {
            wait_for_ticks(&live, &over);
            let mut diary = Diary::begin(&about, out)?;
            if io::stderr().is_terminal() {
                draw(&live, seconds, &about, &mut diary, &over)?;
            } else {
                tell(&live, &mut diary, &over)?;
            }
            diary.end()
        };
        let thread = Builder::new().name("watch".to_owned()).spawn(watch);
        let thread = thread.context("no thread could be started").or_system()?;
        Ok(Self { done, thread, names })
    }

    /// Ends the thread; gives the file its name if there is anything in it.
    pub(super) fn finish(self, measured: bool) -> Result<(), Failure> {
        self.done.store(true, Ordering::Release);
        self.thread.thread().unpark();
        let written = self.thread.join().expect("the watching thread does not panic");
        let Some((path, part)) = self.names else { return Ok(()) };
        let kept = written.and_then(|()| {
            if measured { std::fs::rename(&part, &path) } else { std::fs::remove_file(&part) }
        });
        kept.with_context(|| format!("cannot write {}", path.display())).or_exit(Exit::Io)
    }
}

/// The intervals so far.
struct Diary {
    log: Option<Log<BufWriter<File>>>,
    begun: MonoTime,
    /// The end of the last interval, and the times until then.
    until: MonoTime,
    times: Times,
}

impl Diary {
    fn begin(about: &str, out: Option<UnfinishedFile>) -> io::Result<Self> {
        let start = SystemTime::UNIX_EPOCH + Duration::from_nanos(wall_now_ns());
        let log =
            out.map(|out| Log::begin(BufWriter::new(out.file), &format!("kinocue latency, {about}"), start));
        let begun = Monotonic.now();
        Ok(Self { log: log.transpose()?, begun, until: begun, times: Times::default() })
    }

    /// Ends an interval where one is due, or where `ended`; whether it did.
    fn keep(&mut self, live: &Live, ended: bool) -> io::Result<bool> {
        let now = Monotonic.now();
        if !ended && now < self.until + INTERVAL {
            return Ok(false);
        }
        let times = live.times();
        let part = between(&self.times, &times);
        // The last second only waits for acks.
        let anything = !part.lateness.is_empty() || !part.acks.is_empty();
        if let Some(log) = self.log.as_mut().filter(|_| anything) {
            log.interval(&part, self.until.since(self.begun), now.since(self.until))?;
        }
        // On the grid of whole seconds as long as it is kept up with.
        self.until = if ended || now >= self.until + 2 * INTERVAL { now } else { self.until + INTERVAL };
        self.times = times;
        Ok(true)
    }

    fn end(self) -> io::Result<()> {
        self.log.map_or(Ok(()), |log| log.end().map(drop))
    }
}

/// Asking where the seats stand takes its time.
fn wait_for_ticks(live: &Live, over: &AtomicBool) {
    while live.ticks() == 0 && !over.load(Ordering::Acquire) {
        thread::park_timeout(LOOK);
    }
}

fn draw(live: &Live, seconds: u32, about: &str, diary: &mut Diary, over: &AtomicBool) -> io::Result<()> {
    let bar = ProgressBar::new(u64::from(seconds));
    let style = ProgressStyle::with_template("{msg}\n[{wide_bar}] {pos} of {len} s");
    bar.set_style(style.expect("the template is fixed").progress_chars("=> "));
    loop {
        let ended = over.load(Ordering::Acquire);
        diary.keep(live, ended)?;
        let times = live.times();
        bar.set_message(format!(
            "{about}\n{}\n{} ticks, {} missed",
            charts(&times),
            live.ticks(),
            live.missed()
        ));
        bar.set_position(Monotonic.now().since(diary.begun).as_secs().min(u64::from(seconds)));
        if ended {
            bar.finish_and_clear();
            return Ok(());
        }
        thread::park_timeout(LOOK);
    }
}

fn tell(live: &Live, diary: &mut Diary, over: &AtomicBool) -> io::Result<()> {
    loop {
        let ended = over.load(Ordering::Acquire);
        if diary.keep(live, ended)? && !ended {
            print::tell(&format!("kinocue: {}", line(diary, live.missed())));
        }
        if ended {
            return Ok(());
        }
        thread::park_timeout(LOOK);
    }
}

/// All times so far in a line.
fn line(diary: &Diary, missed: u64) -> String {
    let figures = |times: &Histogram| {
        let at = |quantile| us(times.value_at_quantile(quantile));
        match times.len() {
            0 => "none".to_owned(),
            _ => format!("p50 {}, p99 {}, max {}", at(0.5), at(0.99), us(times.max())),
        }
    };
    let Times { lateness, acks, .. } = &diary.times;
    let second = diary.until.since(diary.begun).as_secs();
    format!("{second} s: lateness {}; acks {}; {missed} missed", figures(lateness), figures(acks))
}
