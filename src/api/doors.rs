//! The doors of the API before the routes of another server: a desk of a fleet. Names of hosts, origins of pages, tokens and the limits of
//! connections are those of a hall.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse as _, Response};
use tokio::sync::{mpsc, watch};

use super::access::Access;
use super::problem::render;
use super::tries::Tries;
use super::{ApiError, gate, ports, serve};
use crate::config;
use crate::control::AwaitedPorts;
use crate::log::Log;

/// What is asked of whoever comes.
#[derive(Debug)]
struct Doors {
    access: Access,
    tries: Tries,
    log: Log,
}

/// Serves `router` where `config` says, on the runtime that calls, until `closing` says true; says where that is. Below `/api`, and
/// `/metrics`, nobody comes without a token unless `config` lets them.
///
/// # Errors
/// [`ApiError`] where a port cannot be had.
pub(crate) fn serve_behind_doors(
    config: &config::Api,
    router: axum::Router,
    closing: watch::Receiver<bool>,
    log: Log,
) -> Result<Vec<SocketAddr>, ApiError> {
    let (listeners, addresses) = ports(&config.listen)?;
    let access = Access::new(config, &addresses);
    let doors = Arc::new(Doors { access, tries: Tries::default(), log: log.clone() });
    let router = router.layer(from_fn_with_state(doors, pass));
    let (alive, _) = mpsc::channel(1); // nobody waits for the last of them
    let served = serve::ServedHall { router, closing, alive, log };
    let served_at = addresses.iter().copied().zip(listeners.into_iter().map(Some)).collect();
    serve::tcp(served_at, &served, &AwaitedPorts::default());
    Ok(addresses)
}

/// Passes a request on, or refuses it.
async fn pass(State(doors): State<Arc<Doors>>, mut request: Request, next: Next) -> Response {
    let response = match gate::admit(&doors.access, &doors.tries, &request) {
        Ok(who) => {
            if let Some(who) = who {
                gate::introduce(&mut request, who);
            }
            gate::caught(next.run(request)).await
        }
        Err(problem) => {
            gate::note(&doors.log, &request, &problem);
            problem.into_response()
        }
    };
    gate::with_headers(render(response, None))
}
