//! The lease of a hall with two show machines: what its service wants is asked of the engine, one request at a time. Nothing is kept here,
//! and nothing asked again: an answer that is late, or none, the service counts as it is.

use std::path::Path;
use std::time::Duration;

use anyhow::Context as _;
use async_nats::jetstream::context::{Context, PublishErrorKind};
use async_nats::jetstream::message::PublishMessage;
use async_nats::jetstream::stream::{Config, DiscardPolicy, StorageType};
use tokio::io::{AsyncBufReadExt as _, AsyncWriteExt as _, BufReader};
use tokio::net::UnixStream;
use tokio::sync::watch;
use tokio::time::{Instant, sleep, timeout};

use super::engine;
use super::hall::Link;
use crate::fleet;
use crate::pair::{Answer, Answered, Ask, Holder, Want};

/// How often the socket of the service is looked for.
const AGAIN: Duration = Duration::from_millis(200);
/// How long the engine may take: what it says later is worth nothing.
const ANSWER: Duration = Duration::from_millis(800);

/// When the machine that leads was last seen to renew its lease: then its own link reached the engine.
pub(super) type Renewed = watch::Receiver<Option<Instant>>;

/// Carries what a service asks of its lease, for ever. A hall of one machine has no such socket.
pub(super) async fn carry(link: &Link, renewed: &watch::Sender<Option<Instant>>) {
    let socket = link.socket.with_file_name("pair.sock");
    loop {
        let _ = serve(link, &socket, renewed).await; // the service is gone, or has no second machine: it is looked for again
        sleep(AGAIN).await;
    }
}

async fn serve(link: &Link, socket: &Path, renewed: &watch::Sender<Option<Instant>>) -> anyhow::Result<()> {
    let mut stream = UnixStream::connect(socket).await?;
    let (read, mut write) = stream.split();
    let mut lines = BufReader::new(read).lines();
    let kept = engine::kept_within(&link.client, ANSWER);
    let mut seen = None;
    while let Some(line) = lines.next_line().await? {
        let Ask { ticket, want } = serde_json::from_str(&line)?;
        let answer = if link.is_connected() { put(link, &kept, want).await } else { None };
        if let Some(Answer::Key { revision, .. }) = answer
            && seen.replace(revision).is_some_and(|before| before != revision)
        {
            renewed.send_replace(Some(Instant::now()));
        }
        let mut reply = serde_json::to_string(&Answered { ticket, answer })?;
        reply.push('\n');
        write.write_all(reply.as_bytes()).await?;
    }
    Ok(())
}

/// Asks; `None` where nobody answered in time.
async fn put(link: &Link, kept: &Context, want: Want) -> Option<Answer> {
    let asked = async {
        match want {
            Want::Read => read(link, kept).await,
            Want::Swap { revision, holder } => write(link, kept, revision, &holder).await,
        }
    };
    timeout(ANSWER, asked).await.ok()?.ok()
}

async fn read(link: &Link, kept: &Context) -> anyhow::Result<Answer> {
    // Made where it is missing: with nothing in it, which is no key.
    let stream = kept.get_or_create_stream(bucket(&link.hall)).await?;
    let Some(message) = engine::own_last_of(&stream, &fleet::lease_of(&link.hall)).await? else {
        return Ok(Answer::NoKey);
    };
    let holder: Holder = serde_json::from_slice(&message.payload).context("it is no lease")?;
    Ok(Answer::Key { holder, revision: message.sequence })
}

async fn write(link: &Link, kept: &Context, revision: u64, holder: &Holder) -> anyhow::Result<Answer> {
    let text = serde_json::to_vec(holder)?;
    let message = PublishMessage::build().payload(text.into()).expected_last_subject_sequence(revision);
    let sent = kept.send_publish(fleet::lease_of(&link.hall), message).await?;
    match sent.await {
        Ok(ack) => Ok(Answer::Granted { revision: ack.sequence }),
        // An engine that has lost the stream has no such revision either; it is made anew at the next look.
        Err(error)
            if matches!(
                error.kind(),
                PublishErrorKind::WrongLastSequence | PublishErrorKind::StreamNotFound
            ) =>
        {
            Ok(Answer::Refused)
        }
        Err(error) => Err(error.into()),
    }
}

/// The stream of one hall's lease, in memory: what an engine that was killed still had on its disk would be an old one. One of its own, so that
/// nobody else moves its numbers on.
fn bucket(hall: &str) -> Config {
    Config {
        name: fleet::lease_stream(hall),
        subjects: vec![fleet::lease_of(hall)],
        max_messages_per_subject: 1,
        storage: StorageType::Memory,
        discard: DiscardPolicy::Old,
        ..Config::default()
    }
}
