//! A file whose chunks are taken apart on threads of their own, ahead of whoever takes what comes of them in the order of the file.

use std::collections::VecDeque;
use std::io::Read;
use std::mem::take;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, Scope};

use mcap::records::op;

use super::chunks::{WithinChunk, each_in_chunk, whole_chunks};
use super::{Trouble, checked};

/// Threads at the most: one that walks through a file has no more to do for several.
const THREADS: usize = 4;
/// Chunks that a thread has, the one that it is at included.
const EACH: usize = 2;

/// Whoever reads a file in two steps: what a record comes to, on any thread, and that in the order of the file.
pub(crate) trait SplitReader {
    /// What of the file before it has to be known to take a record apart.
    type Known: Send + Sync;
    /// What a record comes to.
    type Part: Send;
    /// Why it reads no further.
    type Error: From<Trouble>;

    /// What is known by now; another one where it is not as it was.
    fn known(&self) -> &Arc<Self::Known>;

    /// Takes a record apart; without what is known, where that is about to change. `None` where it is not wanted.
    fn part(known: Option<&Self::Known>, opcode: u8, body: &[u8]) -> Option<Self::Part>;

    /// Takes what a record came to.
    ///
    /// # Errors
    /// Why it reads no further.
    fn take(&mut self, part: Self::Part) -> Result<(), Self::Error>;
}

/// The same as [`super::each_sound`], also in its order, where chunks are taken apart ahead.
///
/// # Errors
/// That of the reader, or what is wrong with the file.
pub(crate) fn each_sound_ahead<R: SplitReader>(
    input: impl Read,
    most: u64,
    reader: &mut R,
) -> Result<(), R::Error> {
    thread::scope(|scope| {
        let mut crew = Crew::new(most);
        let options = checked().with_emit_chunks(true);
        let walked = whole_chunks(input, most, options, |opcode, body| match opcode {
            op::CHUNK => crew.put(scope, body, reader),
            // One stands behind each chunk.
            op::MESSAGE_INDEX => Ok(()),
            _ => {
                crew.settle(reader)?;
                let part = R::part(Some(reader.known()), opcode, body);
                part.map_or(Ok(()), |part| reader.take(part)).map_err(WithinChunk::Taker)
            }
        });
        // What precedes a fault is taken before that is told.
        let settled = if matches!(walked, Err(WithinChunk::Taker(_))) { Ok(()) } else { crew.settle(reader) };
        settled.and(walked).map_err(|error| match error {
            WithinChunk::Taker(error) => error,
            WithinChunk::Chunk(trouble) => trouble.into(),
        })
    })
}

/// A chunk, and what was known when it was met.
struct ChunkJob<R: SplitReader> {
    chunk: Vec<u8>,
    known: Arc<R::Known>,
    parts: Vec<R::Part>,
    unpacked: u64,
    trouble: Option<Trouble>,
}

impl<R: SplitReader> ChunkJob<R> {
    /// Takes the chunk apart.
    fn work(&mut self) {
        let Self { chunk, known, parts, unpacked, trouble } = self;
        parts.clear();
        let mut is_known = true;
        let read = each_in_chunk(chunk, |opcode, body| {
            *unpacked += body.len() as u64;
            // Anything else may change what is known, and is taken in its turn.
            is_known &= opcode == op::MESSAGE;
            parts.extend(R::part(Some(&**known).filter(|_| is_known), opcode, body));
            Ok::<(), Trouble>(())
        });
        *trouble = read.err();
    }
}

/// The way to a thread that takes chunks apart, and the way back.
type ChunkThread<R> = (SyncSender<ChunkJob<R>>, Receiver<ChunkJob<R>>);

/// The threads, and what they have.
struct Crew<R: SplitReader> {
    threads: Vec<ChunkThread<R>>,
    /// Threads that have a chunk, in the order of these.
    waiting: VecDeque<usize>,
    /// Chunks so far, and what they unpacked to.
    chunks: usize,
    unpacked: u64,
    most: u64,
    /// Memory to be used again.
    spare: Vec<(Vec<u8>, Vec<R::Part>)>,
}

impl<R: SplitReader> Crew<R> {
    fn new(most: u64) -> Self {
        let (threads, waiting, spare) = (Vec::new(), VecDeque::new(), Vec::new());
        Self { threads, waiting, chunks: 0, unpacked: 0, most, spare }
    }

    /// Has a chunk taken apart, and takes what came of the oldest where all have enough to do.
    fn put<'scope>(
        &mut self,
        scope: &'scope Scope<'scope, '_>,
        chunk: &[u8],
        reader: &mut R,
    ) -> Result<(), WithinChunk<R::Error>>
    where
        R: 'scope,
    {
        // The first of a file is short, and says what the others are.
        if self.chunks == 1 {
            self.start(scope);
        }
        self.chunks += 1;
        if self.waiting.len() == EACH * self.threads.len() {
            self.take_next(reader)?;
        }
        let (mut own, parts) = self.spare.pop().unwrap_or_default();
        own.clear();
        own.extend_from_slice(chunk);
        let job =
            ChunkJob { chunk: own, known: Arc::clone(reader.known()), parts, unpacked: 0, trouble: None };
        if self.threads.is_empty() {
            return self.take_apart_here(job, reader);
        }
        let thread = self.chunks % self.threads.len();
        self.threads[thread].0.send(job).map_err(|_| gone())?;
        self.waiting.push_back(thread);
        Ok(())
    }

    /// Starts as many threads as there are processors; fewer, or none, where the system has none.
    fn start<'scope>(&mut self, scope: &'scope Scope<'scope, '_>)
    where
        R: 'scope,
    {
        let processors = thread::available_parallelism().map_or(1, usize::from);
        for _ in 0..if processors > 1 { processors.min(THREADS) } else { 0 } {
            let ((to, jobs), (done, from)) = (sync_channel::<ChunkJob<R>>(EACH), sync_channel(EACH));
            let thread = thread::Builder::new().name("unpack".to_owned()).spawn_scoped(scope, move || {
                for mut job in jobs {
                    job.work();
                    if done.send(job).is_err() {
                        return;
                    }
                }
            });
            if thread.is_err() {
                return;
            }
            self.threads.push((to, from));
        }
    }

    /// Takes what came of all that are under way.
    fn settle(&mut self, reader: &mut R) -> Result<(), WithinChunk<R::Error>> {
        while !self.waiting.is_empty() {
            self.take_next(reader)?;
        }
        Ok(())
    }

    fn take_next(&mut self, reader: &mut R) -> Result<(), WithinChunk<R::Error>> {
        let Some(thread) = self.waiting.pop_front() else { return Ok(()) };
        let job = self.threads[thread].1.recv().map_err(|_| gone())?;
        if Arc::ptr_eq(&job.known, reader.known()) {
            return self.take_job(job, reader);
        }
        // More is known since: of what was read without it nothing is taken.
        self.take_apart_here(ChunkJob { known: Arc::clone(reader.known()), unpacked: 0, ..job }, reader)
    }

    fn take_apart_here(&mut self, mut job: ChunkJob<R>, reader: &mut R) -> Result<(), WithinChunk<R::Error>> {
        job.work();
        self.take_job(job, reader)
    }

    fn take_job(&mut self, mut job: ChunkJob<R>, reader: &mut R) -> Result<(), WithinChunk<R::Error>> {
        self.unpacked = self.unpacked.saturating_add(job.unpacked);
        let taken = job.parts.drain(..).try_for_each(|part| reader.take(part));
        let taken = taken.map_err(WithinChunk::Taker).and_then(|()| match take(&mut job.trouble) {
            Some(trouble) => Err(WithinChunk::Chunk(trouble)),
            None if self.unpacked > self.most => Err(WithinChunk::Chunk(Trouble::TooLarge)),
            None => Ok(()),
        });
        if taken.is_err() {
            // Nothing behind it counts.
            self.waiting.clear();
        }
        self.spare.push((job.chunk, job.parts));
        taken
    }
}

/// So little is left of a thread that failed.
fn gone<E>() -> WithinChunk<E> {
    WithinChunk::Chunk(Trouble::Unread("a thread that takes it apart has failed".to_owned()))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::{ChannelRecord, MAGIC, each_sound, message};
    use super::*;

    /// Says of each message what its topic was.
    #[derive(Default)]
    struct Topics {
        known: Arc<BTreeMap<u16, String>>,
        said: Vec<String>,
    }

    enum SaidPart {
        Said(String),
        Record(u8, Vec<u8>),
    }

    impl SplitReader for Topics {
        type Known = BTreeMap<u16, String>;
        type Part = SaidPart;
        type Error = Trouble;

        fn known(&self) -> &Arc<Self::Known> {
            &self.known
        }

        fn part(known: Option<&Self::Known>, opcode: u8, body: &[u8]) -> Option<SaidPart> {
            match (opcode, known) {
                (op::MESSAGE, Some(known)) => {
                    let (channel, at, _) = message(body)?;
                    Some(SaidPart::Said(format!("{} {at}", known.get(&channel)?)))
                }
                (op::MESSAGE | op::CHANNEL, _) => Some(SaidPart::Record(opcode, body.to_vec())),
                _ => None,
            }
        }

        fn take(&mut self, part: SaidPart) -> Result<(), Trouble> {
            match part {
                SaidPart::Said(said) => self.said.push(said),
                SaidPart::Record(op::CHANNEL, body) => {
                    let channel = ChannelRecord::parse(&body).expect("it is whole");
                    Arc::make_mut(&mut self.known).insert(channel.id, channel.topic.to_owned());
                }
                SaidPart::Record(opcode, body) => {
                    if let Some(SaidPart::Said(said)) = Self::part(Some(&self.known), opcode, &body) {
                        self.said.push(said);
                    }
                }
            }
            Ok(())
        }
    }

    fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
        [&[opcode][..], (body.len() as u64).to_le_bytes().as_slice(), body].concat()
    }

    fn text(text: &str) -> Vec<u8> {
        [u32::try_from(text.len()).unwrap().to_le_bytes().as_slice(), text.as_bytes()].concat()
    }

    fn channel(topic: &str) -> Vec<u8> {
        record(op::CHANNEL, &[&[1, 0, 0, 0][..], &text(topic), &text("json"), &[0; 4]].concat())
    }

    fn said(at: u64) -> Vec<u8> {
        record(op::MESSAGE, &[&[1, 0, 0, 0, 0, 0][..], &at.to_le_bytes(), &[0; 8]].concat())
    }

    fn chunk(records: &[u8]) -> Vec<u8> {
        let len = (records.len() as u64).to_le_bytes();
        let sum = crc32fast::hash(records).to_le_bytes();
        record(op::CHUNK, &[&[0; 16][..], &len, &sum, &text(""), &len, records].concat())
    }

    fn file(chunks: &[Vec<u8>]) -> Vec<u8> {
        let end = [record(op::DATA_END, &[0; 4]), record(op::FOOTER, &[0; 20]), MAGIC.to_vec()].concat();
        [MAGIC, &chunks.concat(), &end].concat()
    }

    /// What is said on the caller's thread alone, and ahead; each with why there is no more.
    fn both(file: &[u8]) -> [(Vec<String>, Option<Trouble>); 2] {
        let (mut one, mut ahead) = (Topics::default(), Topics::default());
        let read = each_sound(file, u64::MAX, |opcode, body| {
            let known = Arc::clone(&one.known);
            Topics::part(Some(&known), opcode, body).map_or(Ok(()), |part| one.take(part))
        });
        let read_ahead = each_sound_ahead(file, u64::MAX, &mut ahead);
        [(one.said, read.err().map(|(_, trouble)| trouble)), (ahead.said, read_ahead.err())]
    }

    #[test]
    fn what_is_taken_apart_ahead_is_what_is_read_one_after_the_other() {
        // A channel becomes another one now and then, while chunks behind it are under way.
        let is_new = |number: u64| number.is_multiple_of(7) || number == 30;
        let one = |number: u64| {
            let named = if is_new(number) { channel(&format!("/{number}")) } else { Vec::new() };
            chunk(&[said(10 * number), named, said(10 * number + 1)].concat())
        };
        let chunks: Vec<Vec<u8>> = (0..60).map(one).collect();
        let [(said, trouble), ahead] = both(&file(&chunks));
        assert_eq!((&said, &trouble), (&ahead.0, &ahead.1));
        assert_eq!((said.len(), trouble), (119, None), "the first has no topic");
        assert!(said.contains(&"/28 300".to_owned()) && said.contains(&"/30 301".to_owned()), "{said:?}");
    }

    #[test]
    fn nothing_is_taken_of_what_is_behind_a_damaged_chunk() {
        let mut chunks: Vec<Vec<u8>> = (0..40).map(|number| chunk(&said(number))).collect();
        chunks[0] = chunk(&[channel("/a"), said(0)].concat());
        *chunks[23].last_mut().unwrap() ^= 1;
        let [one, ahead] = both(&file(&chunks));
        assert_eq!(one, ahead);
        assert_eq!((ahead.0.len(), ahead.1.is_some()), (23, true), "{ahead:?}");
        // Nor is what precedes the end of a file that is cut short left out.
        let whole = file(&chunks[..20]);
        let [one, ahead] = both(&whole[..whole.len() - 60]);
        assert_eq!(one, ahead);
        assert!(ahead.0.len() >= 18 && ahead.1 == Some(Trouble::CutShort), "{ahead:?}");
    }
}
