//! `kinocue fleet desk`: a page with all halls of a desk, worst first, and a STOP for each of them; the same as figures for Prometheus.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use async_nats::Client;
use async_nats::connection::State as EngineState;
use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::response::{IntoResponse as _, Response};
use axum::routing::{get, post};
use futures_util::StreamExt as _;
use futures_util::future::join_all;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;
use tokio::time::sleep;

use super::desk::{HallSeen, Halls, kept_of};
use super::settings::DeskSettings;
use super::{DeskArgs, act, engine, settings};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::control::{Code, Problem};
use crate::fleet;
use crate::json as strict;
use crate::log::Log;
use crate::metrics::halls::{FleetFigures, HallFigures};
use crate::sys::clock::Monotonic;
use crate::sys::lock::lock;
use crate::time::Clock as _;
use crate::{api, console};

/// How often the engine is asked for what it has kept of halls that are not heard.
const LOOK_UP: Duration = Duration::from_secs(10);
/// The longest request that somebody may send.
const LONGEST: usize = 64 << 10;

/// Serves the page of all halls of a desk.
///
/// Worst first, each with the age of what is known of it, and a STOP for each hall and one for all. Where it listens, and who may come,
/// is in the table [api] of the desk's settings, with the keys of that of a hall. Figures for Prometheus are at /metrics.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue fleet desk --desk fleet/office/desk.toml

Ends on SIGTERM and Ctrl-C. While it is down halls play on, and `kinocue fleet status` and `stop` do the same.")]
pub(super) struct Args {
    #[command(flatten)]
    desk: DeskArgs,
}

/// What all requests share.
struct Desk {
    settings: DeskSettings,
    /// By it halls are heard, and what the engine has kept of them.
    client: Client,
    /// By it stops are asked. What a hall tells may end the connection that hears it: headers that are none do (async-nats).
    asks: Client,
    /// What was heard of them.
    heard: Mutex<Halls>,
    /// How many halls were asked for a stop from here, by what came of it.
    stops: Mutex<BTreeMap<&'static str, u64>>,
}

/// The halls as the page shows them.
#[derive(Debug, Serialize)]
struct DeskPage<'d> {
    desk: &'d str,
    /// False while the engine is not reached: no hall is heard then, and no stop goes out.
    engine: bool,
    halls: Vec<Tile<'d>>,
}

#[derive(Debug, Serialize)]
struct Tile<'d> {
    #[serde(flatten)]
    seen: HallSeen,
    /// How much it needs a person: 0 most.
    rank: u8,
    /// Where its console is; null if the settings do not say.
    console: Option<&'d String>,
}

/// Whom a stop is for: `SITE.HALL`, `SITE.*` or `all`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StopRequest {
    halls: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let settings = settings::desk(&args.desk.desk)?;
    let Some(api) = settings.api.clone().filter(|api| !api.listen.is_empty()) else {
        let file = args.desk.desk.display();
        let error = anyhow!(
            "{file} does not say where the page is served; add\n  [api]\n  listen = [\"127.0.0.1:8470\"]\nand \
             open_role = \"view\" if whoever comes may look and stop, or tokens ([[api.token]], `kinocue token`)"
        );
        return Err(error).or_exit(Exit::Config);
    };
    let log = Log::start(print::tell).context("no thread could be started").or_system()?;
    engine::block_on(async {
        let mut ends = signal(SignalKind::terminate()).context("signals cannot be handled").or_system()?;
        let client = engine::connect_link(&settings.access, &settings.name).await?;
        let asks = engine::connect_link(&settings.access, &settings.name).await?;
        let heard = Mutex::new(Halls::of(&settings));
        let desk = Arc::new(Desk { settings, client, asks, heard, stops: Mutex::default() });
        let (closing, closed) = watch::channel(false);
        let addresses = api::serve_behind_doors(&api, routes(Arc::clone(&desk)), closed, log);
        for address in addresses.map_err(anyhow::Error::from).or_exit(Exit::Unavailable)? {
            print::tell(&format!("shows {} halls at http://{address}/", desk.settings.halls.len()));
        }
        tokio::select! {
            heard = desk.hear() => heard?,
            () = desk.look_up() => {}
            _ = ends.recv() => {}
            _ = tokio::signal::ctrl_c() => {}
        }
        closing.send_replace(true);
        Ok(Exit::Done)
    })
}

fn routes(desk: Arc<Desk>) -> Router {
    Router::new()
        .route("/api/v1/fleet/halls", get(halls))
        .route(api::FLEET_STOP, post(stop))
        .route("/metrics", get(figures))
        .fallback(get(page))
        .layer(DefaultBodyLimit::max(LONGEST))
        .with_state(desk)
}

impl Desk {
    /// Hears the halls.
    async fn hear(&self) -> Result<(), Failure> {
        let mut heard = self.client.subscribe(fleet::status_of("*.*")).await.or_exit(Exit::Unavailable)?;
        while let Some(message) = heard.next().await {
            lock(&self.heard).hear(&message);
        }
        Err(anyhow!("the engine takes this desk no more")).or_exit(Exit::Unavailable)
    }

    /// Asks the engine again and again for what it has kept.
    async fn look_up(&self) {
        loop {
            if let Ok(kept) = kept_of(&self.client, &self.settings.halls).await {
                let _ = lock(&self.heard).take(kept); // what is not known is asked for again
            }
            sleep(LOOK_UP).await;
        }
    }

    /// The halls as they are now, worst first.
    fn table(&self) -> Vec<HallSeen> {
        lock(&self.heard).table(Monotonic.now())
    }

    fn is_connected(&self) -> bool {
        self.client.connection_state() == EngineState::Connected
    }
}

async fn halls(State(desk): State<Arc<Desk>>) -> Response {
    let consoles = &desk.settings.consoles;
    let tile = |seen: HallSeen| Tile { rank: seen.rank(), console: consoles.get(&seen.name), seen };
    let page = DeskPage {
        desk: &desk.settings.name,
        engine: desk.is_connected(),
        halls: desk.table().into_iter().map(tile).collect(),
    };
    json(&page)
}

/// Asks halls for a stop, and says what came of it in each.
async fn stop(State(desk): State<Arc<Desk>>, body: Bytes) -> Response {
    let wrong = |detail: String| {
        let remedy = "send {\"halls\": [\"all\"]}, or names of halls of this desk";
        Problem::new(Code::Value, detail, remedy).into_response()
    };
    let asked: StopRequest = match strict::from_slice(&body) {
        Ok(asked) => asked,
        Err(error) => return wrong(format!("no list of halls: {error}")),
    };
    let (halls, unknown) = match act::known(&desk.settings.halls, &asked.halls) {
        Ok((halls, _)) if halls.is_empty() => return wrong("no hall is named".to_owned()),
        Ok(both) => both,
        Err(failure) => return wrong(failure.to_string()),
    };
    let ask = async |hall: String| {
        let answer = act::ask_one(&desk.settings, &desk.asks, &hall, &act::STOP).await;
        *lock(&desk.stops).entry(answer.result()).or_default() += 1;
        answer.json(&hall)
    };
    let mut answers: Vec<Value> = join_all(halls.into_iter().map(ask)).await;
    answers.extend(
        unknown.iter().map(|one| act::Answer::Silent("it is no hall of this desk".to_owned()).json(one)),
    );
    json(&answers)
}

async fn figures(State(desk): State<Arc<Desk>>, headers: HeaderMap) -> Response {
    let halls = desk.table();
    let of_hall = |hall: &HallSeen| HallFigures {
        name: hall.name.clone(),
        age_s: hall.age_s,
        silent: hall.silent,
        status: hall.status.clone().filter(|_| !hall.silent),
    };
    let figures = FleetFigures {
        engine: desk.is_connected(),
        halls: halls.iter().map(of_hall).collect(),
        stops: lock(&desk.stops).clone(),
    };
    api::figures_as(&headers, figures.render())
}

async fn page(uri: Uri) -> Response {
    match console::fleet(uri.path()) {
        Some((content_type, body)) => ([(header::CONTENT_TYPE, content_type)], body).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

fn json(value: &impl Serialize) -> Response {
    let text = serde_json::to_string(value).expect("text and numbers are written without fail");
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}
