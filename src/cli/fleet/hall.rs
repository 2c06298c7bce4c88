//! A hall as its link reaches it, and the client by which it reaches the engine.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

use anyhow::Context as _;
use async_nats::Client;
use async_nats::connection::State;
use http_body_util::Full;
use hyper::Method;
use hyper::body::{Body, Bytes};
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::cli::client::http::{self, HttpReply};

/// How long the hall may take to answer what is looked up.
pub(super) const LOOKED_UP: Duration = Duration::from_secs(2);

/// What a link has.
pub(super) struct Link {
    /// `SITE.HALL`.
    pub(super) hall: String,
    pub(super) client: Client,
    pub(super) socket: PathBuf,
}

impl Link {
    /// True if the hall has another show machine, whose link hears the same: only who leads answers for the hall.
    pub(super) fn is_of_two(&self) -> bool {
        self.socket.with_file_name("pair.sock").exists()
    }

    /// True while the other machine leads, as far as is known here. The service of the one that leads has a file that says so.
    pub(super) fn stands_by(&self) -> bool {
        self.is_of_two() && !self.socket.with_file_name("lead").exists()
    }

    /// True if what is told now goes out now: what is told meanwhile would come late, when it is no longer so.
    pub(super) fn is_connected(&self) -> bool {
        self.client.connection_state() == State::Connected
    }

    /// How often the engine was reached: one that comes back may have less than it had.
    pub(super) fn connects(&self) -> u64 {
        self.client.statistics().connects.load(Ordering::Relaxed)
    }

    /// Looks something up at the hall.
    pub(super) async fn look_up<T: DeserializeOwned>(&self, path: &str) -> anyhow::Result<T> {
        told(&self.get(path).await?)
    }

    /// The same with a body that says what.
    pub(super) async fn look_up_by<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &Value,
    ) -> anyhow::Result<T> {
        told(&self.post(path, body.to_string().into(), LOOKED_UP).await?)
    }

    pub(super) async fn get(&self, path: &str) -> anyhow::Result<HttpReply> {
        let request = http::request(Method::GET, path, None, Full::<Bytes>::default());
        let reply = async { http::exchange(&self.socket, request?, LOOKED_UP).await };
        reply.await.map_err(|failure| failure.error)
    }

    pub(super) async fn post(
        &self,
        path: &str,
        body: Bytes,
        patience: Duration,
    ) -> anyhow::Result<HttpReply> {
        let request = http::request(Method::POST, path, Some("application/json"), Full::new(body));
        let reply = async { http::exchange(&self.socket, request?, patience).await };
        reply.await.map_err(|failure| failure.error)
    }

    /// Hands something over that may come again.
    pub(super) async fn put(&self, path: &str, body: Full<Bytes>) -> anyhow::Result<HttpReply> {
        self.give(path, body, LOOKED_UP).await
    }

    /// The same of a file, which the hall takes its time for.
    pub(super) async fn give<B>(&self, path: &str, body: B, patience: Duration) -> anyhow::Result<HttpReply>
    where
        B: Body + Send + 'static,
        B::Data: Send,
        B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        let request = http::request(Method::PUT, path, Some("application/octet-stream"), body);
        let reply = async { http::exchange(&self.socket, request?, patience).await };
        reply.await.map_err(|failure| failure.error)
    }
}

fn told<T: DeserializeOwned>(reply: &HttpReply) -> anyhow::Result<T> {
    anyhow::ensure!(reply.status == 200, "the hall replied {}: {}", reply.status, reply.text);
    serde_json::from_str(&reply.text).context("the hall is of another version")
}
