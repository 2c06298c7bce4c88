//! The rest of a request's body. Much is answered before its body is read, a stop above all; where bytes of it were left in
//! the socket at its end, the system would take back the answer that is on its way.

use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::Body;
use axum::extract::Request;
use axum::http::header::EXPECT;
use http_body_util::BodyExt as _;
use hyper::body::{Body as _, Bytes, Frame, SizeHint};

use super::input::MAX_BODY;

/// How long the rest may take to come; the answer waits meanwhile.
const PATIENCE: Duration = Duration::from_millis(500);

/// A body that the handler reads as far as it likes, and the gate afterwards.
#[derive(Debug, Clone)]
pub(super) struct BodyRest(Arc<Mutex<Body>>);

impl BodyRest {
    /// The request with a body that is shared with what is given beside it.
    pub(super) fn of(request: Request) -> (Request, Option<Self>) {
        // Who asks first whether to send it is answered by the reply itself.
        if request.headers().contains_key(EXPECT) || request.body().is_end_stream() {
            return (request, None);
        }
        let (parts, body) = request.into_parts();
        let rest = Self(Arc::new(Mutex::new(body)));
        (Request::from_parts(parts, Body::new(rest.clone())), Some(rest))
    }

    /// Reads what is left, no more than a body may be long, and waits for it no longer than a moment.
    pub(super) async fn read_out(mut self) {
        let read = async {
            let mut bytes = 0;
            while let Some(Ok(frame)) = self.frame().await {
                bytes += frame.data_ref().map_or(0, Bytes::len);
                if bytes > MAX_BODY {
                    break;
                }
            }
        };
        let _ = tokio::time::timeout(PATIENCE, read).await; // the connection ends then, as one does that sends no end
    }

    fn body(&self) -> MutexGuard<'_, Body> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl hyper::body::Body for BodyRest {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut *self.body()).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.body().is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body().size_hint()
    }
}
