//! Proof of play from the journal of a hall into the engine, each record exactly once and in its order. The journal is the queue; what the
//! engine has last says where to go on. Each record is taken only behind the one before it, so that a repeat, and a record that came
//! late, are refused by the engine for ever.

use std::collections::VecDeque;
use std::mem;

use anyhow::Context as _;
use async_nats::jetstream::context::Context;
use async_nats::jetstream::message::PublishMessage;
use serde_json::json;

use super::engine;
use super::hall::Link;
use crate::cli::print;
use crate::fleet::{self, LogRecord};
use crate::journal::JournalPart;

/// Tells the engine.
pub(super) struct LogTeller<'l> {
    link: &'l Link,
    kept: Context,
    subject: String,
    /// The last record that the engine has, with its number there; not known before it was asked, and after a failure.
    last: Option<(u64, Option<LogRecord>)>,
    waiting: VecDeque<JournalPart>,
    /// How often the engine was reached.
    connects: u64,
}

impl<'l> LogTeller<'l> {
    pub(super) fn new(link: &'l Link) -> Self {
        Self {
            link,
            kept: engine::kept(&link.client),
            subject: fleet::log_of(&link.hall),
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
        let hall = &self.link.hall;
        let subject = self
            .link
            .leads_as()
            .map_or_else(|| fleet::log_of(hall), |machine| fleet::log_of_machine(hall, &machine));
        let is_other = mem::replace(&mut self.subject, subject) != self.subject;
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
        self.last = None;
        self.waiting.clear();
    }

    async fn tell_next(&mut self) -> anyhow::Result<bool> {
        let (seq, before) = match self.last.take() {
            Some(last) => last,
            None => self.ask().await?,
        };
        if self.waiting.is_empty() {
            let told = before.as_ref().map(|before| &before.told);
            let body = json!({ "told": told.cloned().unwrap_or_default() });
            self.waiting = self.link.look_up_by("/api/v1/fleet/journal", &body).await?;
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

    /// What the engine has last of this hall. Behind what is no record of ours the journal is told from its first line: nobody can take that
    /// away again, and reports have each line once.
    async fn ask(&self) -> anyhow::Result<(u64, Option<LogRecord>)> {
        let Some(message) = engine::last_of(&self.kept, fleet::LOG, &self.subject).await? else {
            return Ok((0, None));
        };
        let record = serde_json::from_slice(&message.payload).ok();
        if record.is_none() {
            print::tell("the log: what the engine has last is no record of ours; telling the journal again");
        }
        Ok((message.sequence, record))
    }
}
