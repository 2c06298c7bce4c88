//! A recording judged again: what its ack thread took goes to the books, the observer and the health of a hall that is made anew, in
//! virtual time, and what these say is held against what was recorded. Control thread; nothing is sent; takes any bytes without a panic.
//!
//! A recording that was begun in the middle of a hall's life, or in which something found no room, is judged from where enough is known.

mod bench;
mod frames;
mod totals;
mod turn;
mod verdict;

use std::io::Read;

pub(crate) use verdict::{ReplayDifference, ReplayVerdict};

use crate::record::{AckChunk, AckRecord, Chunk, Contents, ReadError, Told, Wanted, read};
use crate::tracker::{Books, Tracker};
use crate::wire::FrameNo;
use bench::Bench;
use turn::Turn;

/// Octets of drains that wait for their frames at the most; of more the recording lacks the frames.
const WAITING: usize = 64 << 20;

/// Why a recording is not judged again.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum ReplayError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It has no replies.
    #[error(
        "has no replies to judge again; a play in full (play --record-mode full), an incident, and a cut with --whole have them"
    )]
    NoReplies,
    /// It does not say how its hall judges.
    #[error(
        "does not say how its hall judges acks (metadata \"judging\"); it was recorded by an earlier program"
    )]
    NoJudging,
}

/// Judges a recording again.
///
/// # Errors
/// Where it cannot be read, and where it holds no replies.
pub(crate) fn replay(input: impl Read) -> Result<(Contents, ReplayVerdict), ReplayError> {
    let mut replay: Option<Replay> = None;
    let mut is_judged = true;
    let contents = read(input, Wanted::ALL, &mut |contents, _, told| {
        if replay.is_none() && is_judged {
            replay = Replay::new(contents);
            is_judged = replay.is_some();
        }
        if let Some(replay) = &mut replay {
            replay.take(told);
        }
    })?;
    if !contents.messages.contains_key(crate::record::ACKS) {
        return Err(ReplayError::NoReplies);
    }
    let verdict = replay.ok_or(ReplayError::NoJudging)?.finish(&contents);
    Ok((contents, verdict))
}

/// A recording on its way through a hall.
struct Replay {
    books: Books,
    bench: Bench,
    /// Drains that were not judged yet.
    drains: Vec<u8>,
}

impl Replay {
    fn new(contents: &Contents) -> Option<Self> {
        let judging = contents.judging()?;
        let firsts = vec![FrameNo::FIRST; contents.seats.len()];
        let books = Books::new(Tracker::starting_at(&firsts, judging.ack_every));
        Some(Self { books, bench: Bench::new(contents, judging), drains: Vec::new() })
    }

    fn take(&mut self, told: Told<'_>) {
        match told {
            Told::Chunks(octets) => {
                let mut rest = octets.as_slice();
                while let Some((chunk, behind)) = Chunk::parse(rest) {
                    rest = behind;
                    self.bench.on_tick(&chunk);
                }
            }
            Told::Drains(octets) => {
                self.drains.extend_from_slice(&octets);
                self.judge(self.drains.len() > WAITING);
            }
            Told::Seat(lane, sample) => self.bench.on_sample(lane, &sample),
            Told::Sum(..) | Told::Motions(_) | Told::Tick(_) | Told::State(_) | Told::Other(..) => {}
        }
    }

    /// Judges the drains whose frames are there, or all.
    fn judge(&mut self, all: bool) {
        let Self { books, bench, drains } = self;
        let mut rest = drains.as_slice();
        let (mut records, mut is_torn) = (Vec::new(), false);
        let mut behind = rest;
        while let Some((chunk, next)) = AckChunk::parse(behind) {
            behind = next;
            is_torn |= chunk.dropped > 0;
            records.extend(chunk.records());
            let Some(began) = chunk.drained else { continue };
            let posted = |record: &AckRecord<'_>| match record {
                AckRecord::Posted(frames, ..) => u64::from(*frames),
                _ => 0,
            };
            if !all && records.iter().map(posted).sum::<u64>() > bench.frames_there() {
                break;
            }
            if std::mem::take(&mut is_torn) {
                bench.forget();
            }
            Turn::new(bench, &records, began).go(books);
            records.clear();
            rest = behind;
        }
        let left = rest.len();
        drains.drain(..drains.len() - left);
    }

    fn finish(mut self, contents: &Contents) -> ReplayVerdict {
        self.judge(true);
        let Self { mut books, mut bench, .. } = self;
        totals::of_samples(&mut bench, &books, contents);
        // What had no fate by the end was recorded with none.
        books.finish(&mut |_: &mut Tracker| ());
        totals::of_report(&mut bench, &books, contents);
        bench.into_verdict(&books)
    }
}

#[cfg(test)]
mod tests;
