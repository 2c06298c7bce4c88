//! Proof of play from the journal of a hall into the engine, each record exactly once and in its order. The journal is the queue; what the
//! engine has last says where to go on. Each record is taken only behind the one before it, so that a repeat, and a record that came
//! late, are refused by the engine for ever.

use std::collections::VecDeque;
use std::mem;

use anyhow::Context as _;
use async_nats::jetstream::context::Context;
use async_nats::jetstream::message::PublishMessage;
use serde::de::DeserializeOwned;
use tokio::io::{AsyncBufReadExt as _, AsyncReadExt as _, AsyncWriteExt as _, BufStream};
use tokio::net::UnixStream;
use tokio::time::timeout;

use super::engine;
use super::hall::{LOOKED_UP, Link};
use crate::cli::print;
use crate::fleet::{self, LogRecord};
use crate::journal::{JournalPart, LONGEST_TOLD, Told};

/// Tells the engine.
pub(super) struct LogTeller<'l> {
    link: &'l Link,
    kept: Context,
    /// `None` where the hall has one machine, which tells by the fleet socket.
    machine: Option<MachineJournal>,
    subject: String,
    /// The last record that the engine has, with its number there; not known before it was asked, and after a failure.
    last: Option<(u64, Option<LogRecord>)>,
    waiting: VecDeque<JournalPart>,
    /// How often the engine was reached.
    connects: u64,
}

/// The journal of one of two show machines, which is told whichever of them leads.
struct MachineJournal {
    name: String,
    stream: BufStream<UnixStream>,
}

impl<'l> LogTeller<'l> {
    pub(super) fn new(link: &'l Link) -> Self {
        Self {
            link,
            kept: engine::kept(&link.client),
            machine: None,
            subject: String::new(),
            last: None,
            waiting: VecDeque::new(),
            connects: 0,
        }
    }

    /// Tells the next record; says if there was one.
    ///
    /// # Errors
    /// Where it was not, as far as is known: the engine is asked again before the next.
    pub(super) async fn tell(&mut self) -> anyhow::Result<bool> {
        if !self.link.is_connected() {
            return Ok(false);
        }
        let connects = self.link.connects();
        let is_other = self.link.is_of_two() != self.machine.is_some();
        if mem::replace(&mut self.connects, connects) != connects || is_other {
            self.forget();
        }
        let told = self.tell_next().await;
        if told.is_err() {
            self.forget();
        }
        told
    }

    fn forget(&mut self) {
        self.machine = None; // the service tells one link at a time
        self.last = None;
        self.waiting.clear();
    }

    async fn tell_next(&mut self) -> anyhow::Result<bool> {
        let (seq, before) = match self.last.take() {
            Some(last) => last,
            None => self.begin().await?,
        };
        if self.waiting.is_empty() {
            self.waiting = self.behind(before.as_ref().map(LogRecord::told).unwrap_or_default()).await?;
        }
        let Some(part) = self.waiting.pop_front() else {
            self.last = Some((seq, before));
            return Ok(false);
        };
        let record = LogRecord::after(before.as_ref(), part);
        let text = serde_json::to_vec(&record).context("a record cannot be written")?;
        let message = PublishMessage::build().payload(text.into()).expected_last_subject_sequence(seq);
        let sent = self.kept.send_publish(self.subject.clone(), message).await;
        let ack = sent.context("the engine takes no record")?.await.context("the engine took no record")?;
        self.last = Some((ack.sequence, Some(record)));
        Ok(true)
    }

    /// Finds out whose journal it is, and what the engine has of it.
    async fn begin(&mut self) -> anyhow::Result<(u64, Option<LogRecord>)> {
        let hall = &self.link.hall;
        (self.machine, self.subject) = if self.link.is_of_two() {
            let machine = MachineJournal::open(self.link).await?;
            let subject = fleet::log_of_machine(hall, &machine.name);
            (Some(machine), subject)
        } else {
            (None, fleet::log_of(hall))
        };
        self.ask().await
    }

    /// The next lines of the journal.
    async fn behind(&mut self, told: Told) -> anyhow::Result<VecDeque<JournalPart>> {
        match &mut self.machine {
            Some(machine) => machine.behind(&told).await,
            None => self.link.look_up_by("/api/v1/fleet/journal", &serde_json::to_value(told)?).await,
        }
    }

    /// What the engine has last of this hall. Behind what is no record of ours the journal is told from its first line: nobody can take that
    /// away again, and reports have each line once.
    async fn ask(&self) -> anyhow::Result<(u64, Option<LogRecord>)> {
        let stream = self.kept.get_stream_no_info(fleet::LOG).await?;
        let Some(message) = engine::own_last_of(&stream, &self.subject).await? else {
            return Ok((0, None));
        };
        let record = serde_json::from_slice(&message.payload).ok();
        if record.is_none() {
            print::tell("the log: what the engine has last is no record of ours; telling the journal again");
        }
        Ok((message.sequence, record))
    }
}

impl MachineJournal {
    async fn open(link: &Link) -> anyhow::Result<Self> {
        let stream = UnixStream::connect(link.socket.with_file_name("pair-journal.sock")).await?;
        let mut journal = Self { name: String::new(), stream: BufStream::new(stream) };
        journal.name = journal.line().await?;
        Ok(journal)
    }

    async fn behind(&mut self, told: &Told) -> anyhow::Result<VecDeque<JournalPart>> {
        let mut line = serde_json::to_vec(told)?;
        line.push(b'\n');
        self.stream.write_all(&line).await?;
        self.stream.flush().await?;
        let parts: Result<VecDeque<JournalPart>, String> = self.line().await?;
        parts.map_err(anyhow::Error::msg)
    }

    /// What the service says.
    async fn line<T: DeserializeOwned>(&mut self) -> anyhow::Result<T> {
        let mut text = String::new();
        let mut most = (&mut self.stream).take(LONGEST_TOLD);
        timeout(LOOKED_UP, most.read_line(&mut text)).await.context("the service does not answer")??;
        serde_json::from_str(&text).context("the service is of another version")
    }
}
