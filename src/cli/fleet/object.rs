//! The file of a cue into the engine, in messages of its own that nobody can overwrite: what is there already is compared, and what is
//! missing is sent.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use anyhow::{Context as _, anyhow};
use async_nats::jetstream::context::Context;
use async_nats::jetstream::message::PublishMessage;
use futures_util::StreamExt as _;
use futures_util::future::try_join_all;
use hyper::body::Bytes;

use super::engine;
use crate::cli::{Exit, Failure, OrExit as _};
use crate::cue::limits;
use crate::fleet::{self, CHUNK, WishedCue};
use crate::library::Hashed;
use crate::sys;

/// Messages that are under way at a time.
const BATCH: usize = 8;

/// The file of a cue at the desk.
pub(super) struct CueFile {
    /// The id that it gets.
    pub(super) id: String,
    pub(super) cue: WishedCue,
    file: File,
    name: String,
}

impl CueFile {
    /// Opens and reads it.
    pub(super) fn open(path: &Path, id: String) -> Result<Self, Failure> {
        let name = path.display().to_string();
        let unread = || format!("cannot read {name}");
        let file = sys::file::open(path).with_context(unread).or_exit(Exit::NoInput)?;
        let bytes = file.metadata().with_context(unread).or_exit(Exit::Io)?.len();
        if bytes == 0 || bytes > limits::MAX_FILE {
            let why = anyhow!("{name} has {bytes} bytes, outside 1..={}", limits::MAX_FILE);
            return Err(why).or_exit(Exit::BadCue);
        }
        let sha256 = Hashed::new(&file).finish().with_context(unread).or_exit(Exit::Io)?;
        Ok(Self { id, cue: WishedCue { sha256, bytes }, file, name })
    }

    /// Has the engine have all of it; says how many messages were missing.
    ///
    /// # Errors
    /// Where the engine does not take it, or has another file under its digest.
    pub(super) async fn put(&mut self, kept: &Context) -> Result<usize, Failure> {
        let there = self
            .there(kept)
            .await
            .context("the engine does not say what it has")
            .or_exit(Exit::Unavailable)?;
        let all: Vec<u64> = (0..self.cue.chunks()).collect();
        for numbers in all.chunks(BATCH) {
            let mut pieces = Vec::new();
            for &n in numbers {
                let read = self.piece(n).with_context(|| format!("cannot read {}", self.name));
                pieces.push((n, read.or_exit(Exit::Io)?));
            }
            try_join_all(
                pieces.into_iter().map(|(n, piece)| self.put_one(kept, n, piece, there.contains(&n))),
            )
            .await?;
        }
        Ok(all.len() - there.len())
    }

    /// The numbers of the messages that the engine has.
    async fn there(&self, kept: &Context) -> anyhow::Result<BTreeSet<u64>> {
        let stream = kept.get_stream_no_info(fleet::CUES).await?;
        let mut subjects = stream.info_with_subjects(fleet::chunk_of(&self.cue.sha256, "*")).await?;
        let mut there = BTreeSet::new();
        while let Some(subject) = subjects.next().await {
            there.extend(subject?.0.rsplit('.').next().and_then(|n| n.parse::<u64>().ok()));
        }
        there.retain(|n| *n < self.cue.chunks());
        Ok(there)
    }

    fn piece(&mut self, n: u64) -> std::io::Result<Bytes> {
        self.file.seek(SeekFrom::Start(n * CHUNK))?;
        let mut piece = vec![0; usize::try_from(self.cue.chunk_len(n)).expect("128 KiB at the most")];
        self.file.read_exact(&mut piece)?;
        Ok(piece.into())
    }

    async fn put_one(&self, kept: &Context, n: u64, piece: Bytes, is_there: bool) -> Result<(), Failure> {
        let subject = fleet::chunk_of(&self.cue.sha256, &n.to_string());
        if is_there {
            let message = engine::last_of(kept, fleet::CUES, &subject).await.or_exit(Exit::Unavailable)?;
            if message.is_none_or(|message| message.payload != piece) {
                let all = fleet::chunk_of(&self.cue.sha256, "*");
                let why = anyhow!(
                    "the engine has another file under the digest of {}; have whoever keeps it purge {all}, and push again",
                    self.name
                );
                return Err(why).or_exit(Exit::CheckFailed);
            }
            return Ok(());
        }
        let message = PublishMessage::build().payload(piece);
        let told =
            || format!("the engine does not take {}; push it again, which sends what is missing", self.name);
        let sent = kept.send_publish(subject, message).await.with_context(told).or_exit(Exit::Unavailable)?;
        sent.await.with_context(told).or_exit(Exit::Unavailable).map(drop)
    }
}
