//! A recorder without a hall: both taps, and what is behind them.

use std::fs::File;
use std::io::{BufWriter, Cursor, Result};
use std::path::Path;
use std::time::Duration;

use crate::app::recording::seats;
use crate::app::runtime::Runtime;
use crate::record::{
    self, About, AckRecord, AckTap, Chunk, CutManner, Entry, EntryMaker, Flight, Handed, Intake, Opening,
    RecordedSeat, Recorder, Recording, SentFrame, Stretch, Tap, Taps, Wanted,
};
use crate::replay::replay;
use crate::time::{MonoTime, Rate, ShowTime};
use crate::tracker::{Fate, Reply};
use crate::wire::{FrameNo, ReplyCode};

/// What takes from the taps into a flight recorder.
#[derive(Debug)]
pub struct RecorderRig {
    intake: Intake,
    flight: Flight,
    maker: EntryMaker,
    opening: Opening,
}

impl RecorderRig {
    /// One of these seats, with a file of that size.
    pub fn new(seats: Vec<RecordedSeat>, rate: Rate, path: &Path, room: u64) -> (Tap, AckTap, Self) {
        let clocks = (MonoTime::default(), 0);
        let about = About::of_hall("bench", rate, clocks);
        let (opening, maker) = (Opening::new(&about, &seats), EntryMaker::new(seats.len(), clocks));
        let flight = Flight::create(path, &opening.to_octets(), room).expect("there is room");
        let (Taps { ticks, acks }, intake) = Intake::new(seats, rate, 20);
        (ticks, acks, Self { intake: intake.in_full(), flight, maker, opening })
    }

    /// Takes all that is there; gives how many octets of messages that made.
    pub fn take(&mut self) -> u64 {
        let Self { intake, flight, maker, .. } = self;
        let mut octets = 0;
        intake.take(&mut |at, message| {
            let entry: Entry = maker.entry(at, &message).expect("figures");
            octets += entry.data.len() as u64;
            flight.put(&entry);
        });
        flight.write().expect("there is room");
        octets
    }

    /// Writes what it holds to a file; gives how many messages that were.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn incident(&self, path: &Path) -> Result<usize> {
        let entries = self.flight.read()?;
        let out = BufWriter::new(File::create(path)?);
        let mut file = Recording::open(out, &self.opening, self.maker).map_err(std::io::Error::other)?;
        for some in entries.chunks(100) {
            some.iter().try_for_each(|entry| file.put(entry)).map_err(std::io::Error::other)?;
            file.flush().map_err(std::io::Error::other)?;
        }
        let out = file.finish(&[], None).map_err(std::io::Error::other)?;
        out.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()?;
        Ok(entries.len())
    }

    /// Ticks and records that found no room.
    pub const fn dropped(&self) -> (u64, u64) {
        let counts = self.intake.counts();
        (counts.dropped, counts.dropped_records)
    }
}

/// Records a show of so many ticks, which `tick` taps, in virtual time.
pub fn recorded_show(
    seats: Vec<RecordedSeat>,
    rate: Rate,
    path: &Path,
    ticks: u64,
    mut tick: impl FnMut(&mut Tap, &mut AckTap, u64),
) {
    /// The thread behind the taps looks so often, and gives the disk what it has.
    const LOOKS: u64 = 50;
    let clocks = (MonoTime::default(), 0);
    let opening = Opening::new(&About::of_hall("bench", rate, clocks), &seats).sampled();
    let maker = EntryMaker::new(seats.len(), clocks);
    let out = BufWriter::new(File::create(path).expect("there is room"));
    let file = Recording::open(out, &opening, maker).expect("there is room");
    let (Taps { ticks: mut tap, mut acks }, intake) = Intake::new(seats, rate, record::SAMPLE_HZ);
    let mut recorder = Recorder::new(intake, file);
    for number in 0..ticks {
        tick(&mut tap, &mut acks, number);
        if number % LOOKS == LOOKS - 1 {
            recorder.take().and_then(|()| recorder.flush()).expect("there is room");
        }
    }
    recorder.finish(None).expect("there is room");
}

/// A hall in virtual time that is recorded in full.
pub struct HallRecording(Recorder<Cursor<Vec<u8>>>);

impl HallRecording {
    /// Taps a hall that is about to open.
    pub fn tap(runtime: &mut Runtime) -> Self {
        let config = runtime.config().clone();
        let rate = Rate::from_hz(config.show.rate_hz);
        let seats = seats(&config, runtime.lanes());
        let clocks = (MonoTime::default(), 0);
        let opening =
            Opening::new(&About::of_hall("virtual", rate, clocks), &seats).judged(&runtime.judging(true));
        let maker = EntryMaker::new(seats.len(), clocks);
        let file = Recording::open(Cursor::default(), &opening, maker).expect("memory takes it");
        let (taps, intake) = Intake::new(seats, rate, record::SAMPLE_HZ);
        runtime.record(taps);
        Self(Recorder::new(intake.in_full(), file))
    }

    /// Takes all that is there.
    pub fn take(&mut self) {
        self.0.take().expect("memory takes it");
    }

    /// The file.
    pub fn finish(mut self) -> Vec<u8> {
        self.take();
        self.0.finish(None).expect("memory takes it").into_inner()
    }
}

/// All of a recording without what its hall is known by, as `record cut --anonymous --whole` writes it.
#[must_use]
pub fn nameless(file: &[u8]) -> Vec<u8> {
    let [from, until] = [i64::MIN, i64::MAX].map(ShowTime::from_nanos);
    let manner = CutManner { anonymous: true, whole: true, ..CutManner::default() };
    let cut = record::cut(file, &Stretch { from, until, seat: None }, manner, Cursor::default());
    let (out, _) = cut.expect("a recording in full");
    out.into_inner()
}

/// What came of judging a recording again.
#[derive(Debug, Default)]
pub struct Replayed {
    /// Frames and replies that were judged.
    pub frames: u64,
    pub fates: u64,
    /// Changes of how seats stood.
    pub standings: u64,
    /// True if it begins with its hall and nothing is missing.
    pub is_whole: bool,
    /// What differs, in words.
    pub differences: Vec<String>,
}

/// Judges a recording again.
#[must_use]
pub fn replayed(file: &[u8]) -> Replayed {
    let (_, verdict) = replay(file).expect("a recording in full");
    Replayed {
        frames: verdict.frames,
        fates: verdict.fates,
        standings: verdict.standings,
        is_whole: verdict.from_the_start && verdict.gaps == 0,
        differences: verdict.differences.iter().map(|one| format!("{one:?}")).collect(),
    }
}

/// The frames of a recording of whole ticks: lane, octets and whether the kernel took it, in the order in which they left.
#[must_use]
pub fn datagrams(file: &[u8]) -> Vec<(usize, Vec<u8>, bool)> {
    let mut all = Vec::new();
    let mut take = |_: &record::Contents, _, told: record::Told<'_>| {
        let record::Told::Chunks(octets) = told else { return };
        let mut rest = octets.as_slice();
        while let Some((chunk, behind)) = Chunk::parse(rest) {
            rest = behind;
            let frame =
                |frame: SentFrame<'_>| (frame.lane, frame.datagram.to_vec(), frame.handed != Handed::Refused);
            all.extend(chunk.frames().map(frame));
        }
    };
    record::read(file, Wanted::ALL, &mut take).expect("a recording");
    all
}

/// The ack thread takes replies to a frame of each controller, so many microseconds after it was sent, and says what they were.
pub fn replies(tap: &mut AckTap, frame: FrameNo, sent: MonoTime, after_us: &[u32]) {
    let code = ReplyCode::Running;
    for (controller, us) in after_us.iter().enumerate() {
        let at = sent + Duration::from_micros(u64::from(*us));
        tap.take(&AckRecord::Reply(Reply { controller, frame, code, error: 0, inputs: 0, at }));
    }
    let last = after_us.len().saturating_sub(1);
    tap.take(&AckRecord::Posted(u32::try_from(after_us.len()).unwrap_or(u32::MAX), last, frame));
    for (controller, us) in after_us.iter().enumerate() {
        tap.take(&AckRecord::Fate(controller, frame, Fate::Answered(code), us * 1_000));
    }
}

/// A drain is over.
pub fn drained(tap: &mut AckTap, at: MonoTime) {
    tap.drained(at);
}
