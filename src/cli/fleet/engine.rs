//! The way to the engine, and what it keeps for a fleet.

use std::mem;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use anyhow::Context as _;
use async_nats::jetstream::context::{Context, ContextBuilder};
use async_nats::jetstream::message::StreamMessage;
use async_nats::jetstream::stream::{
    Config, DirectGetErrorKind, DiscardPolicy, LastRawMessageErrorKind, StorageType, Stream,
};
use async_nats::{Client, ConnectOptions, header};

use super::settings::Access;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::sys::clock::wall_now_ns;
use crate::{fleet, plain};

/// The longest text of an engine that is shown, bytes.
const TEXT: usize = 480;
/// How long a desk waits for the engine.
const ENTRY: Duration = Duration::from_secs(3);
/// How long an answer of the engine may take.
const ANSWER: Duration = Duration::from_secs(3);
/// What a desk asks it for at a time.
pub(super) const AT_ONCE: usize = 64;
/// How often the engine is asked whether it lives; after two of these without an answer it is looked for anew.
const PING: Duration = Duration::from_secs(5);
/// The longest wait between two tries to reach it.
const RETRY: Duration = Duration::from_secs(1);
/// How long proofs of play are kept, as the journal of a hall keeps them by default.
const LOG_AGE: Duration = Duration::from_secs(400 * 86_400);

/// Does `work` on a runtime of its own.
pub(super) fn block_on<T>(work: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("no runtime could be started").or_system()?.block_on(work)
}

/// What the inboxes of a member begin with, so that none hears what another is answered: of a hall by both its names, of a desk by one.
pub(super) fn inbox(name: &str) -> String {
    let kind = if name.contains('.') { "hall" } else { "desk" };
    format!("_INBOX_{kind}.{name}")
}

/// Connects a desk, or says why not.
pub(super) async fn connect_desk(access: &Access, name: &str) -> Result<Client, Failure> {
    let options = options(access, name)?.connection_timeout(ENTRY);
    let connected = tokio::time::timeout(2 * ENTRY, options.connect(&access.engine[..])).await;
    let told = || {
        format!(
            "no engine answers at {}; start it (nats-server -c nats-server.conf), and check address, certificate and key",
            access.engine.join(", ")
        )
    };
    connected
        .map_err(anyhow::Error::from)
        .and_then(|done| Ok(done?))
        .with_context(told)
        .or_exit(Exit::Unavailable)
}

/// Connects a link, at once or as soon as the engine is there, and again each time that it is lost.
pub(super) async fn connect_link(access: &Access, name: &str) -> Result<Client, Failure> {
    let options = options(access, name)?.retry_on_initial_connect();
    let told = Mutex::new(None);
    let options = options.event_callback(move |event| {
        // What is like the last one is told once: an engine may be away for days, and a member may be refused as often as it likes.
        let kind = Some(mem::discriminant(&event));
        let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
        if mem::replace(&mut *told, kind) != kind {
            print::tell(&plain::escaped(&format!("engine: {event}"), TEXT));
        }
        async {}
    });
    options.connect(&access.engine[..]).await.context("the engine cannot be looked for").or_system()
}

fn options(access: &Access, name: &str) -> Result<ConnectOptions, Failure> {
    let seed = access.pair.seed().context("the key has no secret half").or_exit(Exit::Config)?;
    let mut options = ConnectOptions::with_nkey(seed)
        .name(name)
        .custom_inbox_prefix(inbox(name))
        .ping_interval(PING)
        .require_tls(access.engine.iter().any(|one| one.starts_with("tls://")))
        .reconnect_delay_callback(|tries| {
            RETRY.min(Duration::from_millis(100 * u64::try_from(tries).unwrap_or(u64::MAX).min(100)))
        });
    if let Some(ca) = &access.ca {
        options = options.add_root_certificates(ca.clone());
    }
    Ok(options)
}

/// What the engine keeps, by the way that also passes leaf nodes.
pub(super) fn kept(client: &Client) -> Context {
    kept_within(client, ANSWER)
}

/// The same, with so long for an answer.
pub(super) fn kept_within(client: &Client, patience: Duration) -> Context {
    ContextBuilder::new().domain(fleet::DOMAIN).timeout(patience).build(client.clone())
}

/// Makes what the engine keeps for a fleet, where it is missing.
pub(super) async fn prepare(kept: &Context) -> Result<(), Failure> {
    for config in [log(), bucket(fleet::SEEN, 1), bucket(fleet::WANT, 5), bucket(fleet::HAVE, 1), cues()] {
        let name = config.name.clone();
        let made = kept.get_or_create_stream(config).await;
        let told = || {
            format!(
                "the engine keeps no {name}; it needs JetStream with the domain hub, as in nats-server.conf of `kinocue fleet init`"
            )
        };
        made.with_context(told).or_exit(Exit::Unavailable)?;
    }
    Ok(())
}

/// Proofs of play: nobody takes one away before its time.
fn log() -> Config {
    Config {
        name: fleet::LOG.to_owned(),
        subjects: vec![fleet::log_of(">")],
        max_age: LOG_AGE,
        storage: StorageType::File,
        discard: DiscardPolicy::Old,
        allow_direct: true,
        deny_delete: true,
        deny_purge: true,
        ..Config::default()
    }
}

/// A bucket, as other clients of the engine know them, with so many values of each key: the last status of each hall, what it shall
/// have, what it has.
fn bucket(name: &str, history: i64) -> Config {
    Config {
        name: format!("KV_{name}"),
        subjects: vec![format!("$KV.{name}.>")],
        max_messages_per_subject: history,
        storage: StorageType::File,
        discard: DiscardPolicy::New,
        allow_direct: true,
        allow_rollup: true,
        deny_delete: true,
        ..Config::default()
    }
}

/// Files of cues. What has been written stays as it is: the engine takes no second message of one place.
fn cues() -> Config {
    Config {
        name: fleet::CUES.to_owned(),
        subjects: vec![fleet::chunk_of("*", "*")],
        max_messages_per_subject: 1,
        storage: StorageType::File,
        discard: DiscardPolicy::New,
        discard_new_per_subject: true,
        allow_direct: true,
        ..Config::default()
    }
}

/// The last value of a hall in a bucket; `None` if it has none.
pub(super) async fn last_value(
    kept: &Context,
    bucket: &str,
    hall: &str,
) -> anyhow::Result<Option<StreamMessage>> {
    last_of(kept, &format!("KV_{bucket}"), &format!("$KV.{bucket}.{hall}")).await
}

/// The last message that a stream has of a subject; `None` if it has none.
pub(super) async fn last_of(
    kept: &Context,
    stream: &str,
    subject: &str,
) -> anyhow::Result<Option<StreamMessage>> {
    let stream = kept.get_stream_no_info(stream).await?;
    match stream.direct_get_last_for_subject(subject).await {
        Ok(message) => Ok(Some(message)),
        Err(error) if error.kind() == DirectGetErrorKind::NotFound => Ok(None),
        Err(error) => {
            Err(error).context("the engine does not say what it has; `kinocue fleet status` prepares it")
        }
    }
}

/// The same of what whoever asks has written there; wrapped by the engine, so that it is nothing where the engine is asked to answer to another.
pub(super) async fn own_last_of<I>(
    stream: &Stream<I>,
    subject: &str,
) -> anyhow::Result<Option<StreamMessage>> {
    match stream.get_last_raw_message_by_subject(subject).await {
        Ok(message) => Ok(Some(message)),
        Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(None),
        Err(error) => Err(error).context("the engine does not say what it has"),
    }
}

/// True of what the engine itself says. It answers to whatever subject it is asked to answer to, so also for a member that may not publish
/// there.
pub(super) fn is_said_by_engine(payload: &[u8]) -> bool {
    let says = [&b"{\"stream\":"[..], b"{\"error\":", b"{\"type\":\"io.nats."];
    says.iter().any(|start| payload.starts_with(start))
}

/// The same of a message that a stream has.
pub(super) fn is_answered(message: &StreamMessage) -> bool {
    message.headers.get_all(header::NATS_SUBJECT).count() > 1 || is_said_by_engine(&message.payload)
}

/// How long ago the engine took a message, by its clock and ours.
pub(super) fn age_of(message: &StreamMessage) -> Duration {
    let at = u64::try_from(message.time.unix_timestamp_nanos()).unwrap_or(0);
    Duration::from_nanos(wall_now_ns().saturating_sub(at))
}

/// Where the value of a hall in a bucket is written, by the way that also passes leaf nodes.
pub(super) fn value_to(bucket: &str, hall: &str) -> String {
    format!("$JS.{}.API.$KV.{bucket}.{hall}", fleet::DOMAIN)
}
