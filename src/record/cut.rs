//! A stretch of a whole recording as plain topics: a sample for every tick, which every viewer draws.

use std::collections::VecDeque;
use std::io::{Read, Seek, Write};

use mcap::McapError;

use super::ack_columns::AckPacker;
use super::anonymous::Anonymous;
use super::block::Block;
use super::read::{Contents, ReadError, Told, Wanted, WantedSamples};
use super::reading::read;
use super::scene::SeatScene;
use super::{About, AckChunk, Chunk, EntryMaker, Message, Mode, Opening, RecordedSeat, Recording, Sampled};
use crate::time::{MonoTime, ShowTime};

/// What is taken.
#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    /// Show times of its ends.
    pub(crate) from: ShowTime,
    /// The end, in it.
    pub(crate) until: ShowTime,
    /// The seat; `None` for all.
    pub(crate) seat: Option<String>,
}

impl Stretch {
    /// True if a tick is in it.
    fn holds(&self, film: ShowTime) -> bool {
        self.from <= film && film <= self.until
    }

    /// True if a seat is in it.
    pub(crate) fn has(&self, seat: &RecordedSeat) -> bool {
        self.seat.as_ref().is_none_or(|name| *name == seat.name)
    }
}

/// How it is written: arguments of `record cut`.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub(crate) struct CutManner {
    /// Time messages by the film rather than by the clock.
    #[arg(long)]
    pub(crate) film_time: bool,
    /// Omit what tells whose recording it is: names of seats, hall and cue, the cue's digest, the date, and addresses, also those in
    /// frames and replies.
    #[arg(long)]
    pub(crate) anonymous: bool,
    /// Also keep the original ticks and replies, so that the cut is itself a full recording.
    #[arg(long, conflicts_with = "film_time")]
    pub(crate) whole: bool,
    /// Also add each seat as a cube that moves, for viewers that draw scenes in space.
    #[arg(long)]
    pub(crate) scene: bool,
}

/// Why nothing was cut.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum CutError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file has no ticks.
    #[error("is a sampled recording; only a full one (play --record-mode full) has every tick")]
    Sampled,
    /// There is no such seat.
    #[error("there is no seat {0:?}; its seats are {1}")]
    Seat(String, String),
    /// None of its ticks is in the stretch.
    #[error("no tick between {0} and {1}")]
    Nothing(ShowTime, ShowTime),
    /// Writing failed.
    #[error("writing failed: {0}")]
    Write(#[from] McapError),
}

/// What is in a stretch.
#[derive(Debug)]
pub(crate) enum Piece<'a> {
    /// A tick with all its frames, and its octets.
    Tick(Chunk<'a>, &'a [u8]),
    /// Some of what the ack thread took then, after a tick and before the next, and its octets.
    Drain(MonoTime, AckChunk<'a>, &'a [u8]),
    /// What was told then under another topic.
    Note(MonoTime, &'a str, &'a [u8]),
}

/// Which of the ticks that are not over are in a stretch.
struct HeldTicks {
    ticks: VecDeque<(MonoTime, bool)>,
    /// Whether the last that is over is, or the beginning of the file.
    is_in: bool,
}

impl HeldTicks {
    /// Whether the last tick before an instant is in it; instants are asked for in their order.
    fn holds(&mut self, at: MonoTime) -> bool {
        while let Some((_, is_in)) = self.ticks.pop_front_if(|(deadline, _)| *deadline <= at) {
            self.is_in = is_in;
        }
        self.is_in
    }
}

/// Hands over each tick of a stretch with all its frames, and what the ack thread took meanwhile.
///
/// # Errors
/// Where the file is no whole recording, or has no such seat or stretch.
pub(crate) fn each_tick(
    input: impl Read,
    stretch: &Stretch,
    take: &mut dyn FnMut(&Contents, Piece<'_>),
) -> Result<Contents, CutError> {
    let (mut ticks, mut is_whole) = (0_u64, false);
    let mut held =
        HeldTicks { ticks: VecDeque::new(), is_in: stretch.from == ShowTime::from_nanos(i64::MIN) };
    let wanted = Wanted { samples: WantedSamples::None, ..Wanted::ALL };
    let contents = read(input, wanted, &mut |contents, at, told| {
        let chunks = match told {
            Told::Chunks(chunks) => chunks,
            Told::Drains(drains) => {
                return each_drain(&drains, &mut held, &mut |piece| take(contents, piece));
            }
            Told::Other(topic, data) if ticks > 0 && held.ticks.back().is_none_or(|(_, is_in)| *is_in) => {
                return take(contents, Piece::Note(at, topic, data));
            }
            _ => return,
        };
        is_whole = true;
        let mut rest = chunks.as_slice();
        while let Some((chunk, behind)) = Chunk::parse(rest) {
            let octets = &rest[..rest.len() - behind.len()];
            rest = behind;
            let is_in = stretch.holds(chunk.head.film);
            held.ticks.push_back((chunk.head.deadline, is_in));
            if is_in {
                ticks += 1;
                take(contents, Piece::Tick(chunk, octets));
            }
        }
    })?;
    if let Some(name) = stretch.seat.as_ref().filter(|name| contents.seat(name).is_none()) {
        let names: Vec<&str> = contents.seats.iter().map(|seat| seat.name.as_str()).collect();
        return Err(CutError::Seat(name.clone(), names.join(", ")));
    }
    match (is_whole, ticks) {
        (false, _) => Err(CutError::Sampled),
        (true, 0) => Err(CutError::Nothing(stretch.from, stretch.until)),
        _ => Ok(contents),
    }
}

/// Hands over those drains that began in the stretch.
fn each_drain(drains: &[u8], held: &mut HeldTicks, take: &mut dyn FnMut(Piece<'_>)) {
    let (mut rest, mut open) = (drains, drains);
    while let Some((chunk, behind)) = AckChunk::parse(rest) {
        rest = behind;
        let Some(began) = chunk.drained else { continue };
        let is_in = held.holds(began);
        // All chunks of the drain that is over with this one.
        while open.len() > rest.len() {
            let Some((chunk, behind)) = AckChunk::parse(open) else { return };
            if is_in {
                take(Piece::Drain(began, chunk, &open[..open.len() - behind.len()]));
            }
            open = behind;
        }
    }
}

/// Cuts a stretch out into a file of its own; gives what was written to, and what the recording says of itself.
///
/// # Errors
/// As [`each_tick`], and where writing fails.
pub(crate) fn cut<W: Write + Seek>(
    input: impl Read,
    stretch: &Stretch,
    manner: CutManner,
    out: W,
) -> Result<(W, Contents), CutError> {
    let mut out = Some(out);
    let mut file: Option<Cutting<W>> = None;
    let mut result = Ok(());
    let contents = each_tick(input, stretch, &mut |contents, piece| {
        if result.is_err() {
            return;
        }
        if let Some(out) = out.take() {
            match Cutting::begin(contents, stretch, manner, out) {
                Ok(cutting) => file = Some(cutting),
                Err(error) => result = Err(error),
            }
        }
        if let (Some(cutting), Ok(())) = (&mut file, &result) {
            result = cutting.take(&piece);
        }
    })?;
    result?;
    // There was a tick, or it had said so.
    let cutting = file.ok_or(CutError::Nothing(stretch.from, stretch.until))?;
    Ok((cutting.finish()?, contents))
}

struct Cutting<W: Write + Seek> {
    file: Recording<W>,
    fold: Sampled,
    seats: Vec<RecordedSeat>,
    /// Which seats are taken.
    taken: Vec<bool>,
    maker: EntryMaker,
    scene: Option<SeatScene>,
    block: Option<Block>,
    /// When its last tick was due.
    last: MonoTime,
    /// Drains of the block that is not over.
    drains: Vec<u8>,
    /// Ticks behind which what the ack thread took is still to come: of half a second all ticks stand before that.
    open: VecDeque<Vec<u8>>,
    anonymous: Option<Anonymous>,
    film_time: bool,
    ticks: u64,
}

impl<W: Write + Seek> Cutting<W> {
    fn begin(contents: &Contents, stretch: &Stretch, manner: CutManner, out: W) -> Result<Self, McapError> {
        let anonymous = manner.anonymous.then(|| Anonymous::of(contents));
        let seats = anonymous.as_ref().map_or(contents.seats.as_slice(), Anonymous::seats).to_vec();
        let entry = |key: &str| if manner.anonymous { String::new() } else { contents.entry(key).to_owned() };
        let origin = contents.wall(MonoTime::default());
        let about = About {
            hall: entry("hall"),
            cue: entry("cue"),
            title: entry("title"),
            cue_sha256: entry("cue_sha256"),
            rate_hz: contents.rate_hz(),
            mode: if manner.whole { Mode::Full } else { Mode::Sampled },
            clocks: (MonoTime::default(), if manner.film_time || manner.anonymous { 0 } else { origin }),
        };
        let taken: Vec<bool> = contents.seats.iter().map(|seat| stretch.has(seat)).collect();
        let own = contents.judging();
        let judging = anonymous.as_ref().map_or(own.as_ref(), Anonymous::judging);
        let opening = Opening::new(&about, &seats);
        let opening = judging.into_iter().fold(opening, Opening::judged);
        let maker = EntryMaker::new(seats.len(), about.clocks);
        let (scene, opening) = if manner.scene {
            let (scene, opening) = SeatScene::of(opening, &taken);
            (Some(scene), opening)
        } else {
            (None, opening)
        };
        let file = Recording::open(out, &opening, maker)?;
        // A window for each tick, whatever the rate.
        let fold = Sampled::new(seats.clone(), 1_000_000);
        let block = manner.whole.then(Block::default);
        Ok(Self {
            file,
            fold,
            seats,
            taken,
            maker,
            scene,
            block,
            last: MonoTime::default(),
            drains: Vec::new(),
            open: VecDeque::new(),
            anonymous,
            film_time: manner.film_time,
            ticks: 0,
        })
    }

    fn take(&mut self, piece: &Piece<'_>) -> Result<(), McapError> {
        match (piece, &self.anonymous) {
            (Piece::Tick(_, octets), None) => self.open.push_back(octets.to_vec()),
            (Piece::Tick(chunk, _), Some(anonymous)) => self.open.extend(anonymous.tick(chunk)),
            (Piece::Drain(began, chunk, octets), anonymous) => {
                let octets = anonymous.as_ref().map_or_else(|| octets.to_vec(), |one| one.drain(chunk));
                self.ticks_before(*began)?;
                if let Some((chunk, _)) = AckChunk::parse(&octets) {
                    chunk.records().for_each(|record| self.fold.ack(&record));
                }
                if self.block.is_some() {
                    self.drains.extend(octets);
                }
            }
            // On the clock alone, and nobody knows who is named in it.
            (Piece::Note(at, topic, data), None) if !self.film_time => self.file.note(*at, topic, data)?,
            (Piece::Note(..), _) => {}
        }
        Ok(())
    }

    /// Takes the ticks that were due before an instant.
    fn ticks_before(&mut self, until: MonoTime) -> Result<(), McapError> {
        while let Some(octets) = self.open.pop_front() {
            let Some((chunk, _)) = Chunk::parse(&octets) else { continue };
            if chunk.head.deadline >= until {
                self.open.push_front(octets);
                break;
            }
            self.tick(&chunk)?;
        }
        Ok(())
    }

    fn tick(&mut self, chunk: &Chunk<'_>) -> Result<(), McapError> {
        let Self { file, fold, seats, taken, maker, scene, block, last, drains, film_time, ticks, .. } = self;
        *ticks += 1;
        let mut result = Ok(());
        let film = MonoTime::from_nanos(chunk.head.film.as_nanos().max(0).cast_unsigned());
        fold.take(chunk, &mut writer(file, taken, film_time.then_some(film), &mut result));
        result?;
        let at = if *film_time { film } else { chunk.head.deadline };
        let of_scene = scene.iter_mut().flat_map(|scene| scene.take(chunk, seats, at, *maker));
        of_scene.into_iter().try_for_each(|entry| file.put(&entry))?;
        let full = block.as_mut().and_then(|block| block.add(chunk, seats));
        // As of its last tick: by then its samples are told.
        let at = std::mem::replace(last, chunk.head.deadline);
        full.map_or(Ok(()), |(_, block)| put_block(file, at, block, drains))
    }

    fn finish(mut self) -> Result<W, McapError> {
        self.ticks_before(MonoTime::from_nanos(u64::MAX))?;
        let (film, mut result) = (self.film_time.then(MonoTime::default), Ok(()));
        self.fold.close(&mut writer(&mut self.file, &self.taken, film, &mut result));
        result?;
        if let Some((_, block)) = self.block.as_mut().and_then(Block::close) {
            put_block(&mut self.file, self.last, block, &mut self.drains)?;
        }
        self.file.finish(&[("ticks", self.ticks.to_string())], None)
    }
}

/// Writes a block whose last tick was then, and the drains so far.
fn put_block<W: Write + Seek>(
    file: &mut Recording<W>,
    at: MonoTime,
    block: Vec<u8>,
    drains: &mut Vec<u8>,
) -> Result<(), McapError> {
    file.write(at, &Message::Ticks(block))?;
    file.write(at, &Message::Drains(AckPacker::default().pack(&std::mem::take(drains))))
}

/// Writes what is of a seat that was asked for, by the clock or, where the film is given, by that.
fn writer<'a, W: Write + Seek>(
    file: &'a mut Recording<W>,
    taken: &'a [bool],
    mut film: Option<MonoTime>,
    result: &'a mut Result<(), McapError>,
) -> impl FnMut(MonoTime, Message) + 'a {
    move |at, message| {
        let film_s = match &message {
            Message::Seat(lane, _) if !taken[*lane] => return,
            Message::Seat(_, sample) => Some(sample.film_s),
            Message::Tick(sample) => Some(sample.film_s),
            _ => None,
        };
        if let (Some(film), Some(film_s)) = (&mut film, film_s) {
            let ns = ShowTime::from_secs_f64(film_s).as_nanos().max(0);
            *film = MonoTime::from_nanos(ns.cast_unsigned());
        }
        if result.is_ok() {
            *result = file.write(film.unwrap_or(at), &message);
        }
    }
}
