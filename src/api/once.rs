//! Requests that come twice: a POST with an `Idempotency-Key` is done once, and its repeats get the first reply.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::body::Body;
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderValue, StatusCode};
use axum::response::Response;
use hyper::body::Bytes;
use tokio::sync::OnceCell;

use super::problem::bad_value;
use crate::control::Problem;
use crate::time::MonoTime;

/// The longest key.
const MAX_KEY: usize = 64;
/// Keys that are remembered.
const KEYS: usize = 1024;
/// Bytes of replies that are remembered; of more the oldest are forgotten with their keys.
const BYTES: usize = 16 << 20;
/// How long a key is remembered.
const AGE: Duration = Duration::from_secs(600);

/// The keys of late, and the replies to them.
#[derive(Debug, Default)]
pub(super) struct Once(Mutex<VecDeque<Kept>>);

/// The reply to the first request with a key; empty until it is there.
pub(super) type First = Arc<OnceCell<KeptReply>>;

#[derive(Debug)]
struct Kept {
    /// Whose key it is: two people may choose the same.
    asker: String,
    key: String,
    /// What was asked with it.
    request: String,
    since: MonoTime,
    first: First,
}

/// A reply that can be given again.
#[derive(Debug, Clone)]
pub(super) struct KeptReply {
    status: StatusCode,
    content_type: Option<HeaderValue>,
    body: Bytes,
}

impl Once {
    /// The place for the reply to that key of `asker`; whoever finds it empty fills it.
    pub(super) fn first(
        &self,
        asker: &str,
        key: &str,
        request: &str,
        now: MonoTime,
    ) -> Result<First, Problem> {
        if key.is_empty() || key.len() > MAX_KEY || !key.bytes().all(|byte| byte.is_ascii_graphic()) {
            let remedy = format!("use 1 to {MAX_KEY} characters of ASCII, a new key for each request");
            return Err(bad_value(format!("{key:?} is not an Idempotency-Key"), remedy));
        }
        let mut kept = self.kept();
        forget(&mut kept, now);
        if let Some(before) = kept.iter().find(|kept| kept.asker == asker && kept.key == key) {
            if before.request == request {
                return Ok(Arc::clone(&before.first));
            }
            let detail = format!("the Idempotency-Key {key:?} was already used for {}", before.request);
            return Err(bad_value(detail, "use a new key for a new request"));
        }
        let first = First::default();
        let [asker, key, request] = [asker, key, request].map(str::to_owned);
        kept.push_back(Kept { asker, key, request, since: now, first: Arc::clone(&first) });
        Ok(first)
    }

    /// Forgets a key whose request was not even begun.
    pub(super) fn release(&self, first: &First) {
        self.kept().retain(|kept| !Arc::ptr_eq(&kept.first, first));
    }

    fn kept(&self) -> MutexGuard<'_, VecDeque<Kept>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Makes room for one more.
fn forget(kept: &mut VecDeque<Kept>, now: MonoTime) {
    let size = |kept: &Kept| kept.first.get().map_or(0, |reply| reply.body.len());
    let mut bytes: usize = kept.iter().map(size).sum();
    while let Some(oldest) = kept.front() {
        if now.since(oldest.since) < AGE && kept.len() < KEYS && bytes <= BYTES {
            break;
        }
        bytes -= size(oldest);
        kept.pop_front();
    }
}

impl KeptReply {
    /// A response, whole.
    pub(super) async fn of(response: Response) -> Self {
        let (parts, body) = response.into_parts();
        let content_type = parts.headers.get(CONTENT_TYPE).cloned();
        // Bodies of our own, all in memory already.
        let body = axum::body::to_bytes(body, usize::MAX).await.unwrap_or_default();
        Self { status: parts.status, content_type, body }
    }

    /// True if it says that nothing was done for now, and to try again.
    pub(super) fn is_busy(&self) -> bool {
        self.status == StatusCode::TOO_MANY_REQUESTS
    }

    /// The response, once more.
    pub(super) fn response(&self) -> Response {
        let mut response = Response::new(Body::from(self.body.clone()));
        *response.status_mut() = self.status;
        if let Some(content_type) = &self.content_type {
            response.headers_mut().insert(CONTENT_TYPE, content_type.clone());
        }
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Code;

    fn at(seconds: u64) -> MonoTime {
        MonoTime::from_nanos(0) + Duration::from_secs(seconds)
    }

    fn reply(bytes: usize) -> KeptReply {
        KeptReply { status: StatusCode::OK, content_type: None, body: vec![b'x'; bytes].into() }
    }

    #[test]
    fn a_key_stands_for_one_request_of_one_person() {
        let once = Once::default();
        let first = once.first("anna", "k", "POST /go", at(0)).unwrap();
        let again = once.first("anna", "k", "POST /go", at(1)).unwrap();
        assert!(Arc::ptr_eq(&first, &again));
        assert!(!Arc::ptr_eq(&first, &once.first("ben", "k", "POST /go", at(1)).unwrap()));
        assert_eq!(once.first("anna", "k", "POST /stop", at(1)).unwrap_err().code, Code::Value);
        for bad in ["", "a b", "ä", &"k".repeat(65)] {
            assert_eq!(once.first("anna", bad, "POST /go", at(1)).unwrap_err().code, Code::Value, "{bad}");
        }
    }

    #[test]
    fn a_key_is_forgotten_after_ten_minutes_or_when_nothing_was_done() {
        let once = Once::default();
        let first = once.first("anna", "k", "POST /go", at(0)).unwrap();
        assert!(Arc::ptr_eq(&first, &once.first("anna", "k", "POST /go", at(599)).unwrap()));
        let later = once.first("anna", "k", "POST /go", at(600)).unwrap();
        assert!(!Arc::ptr_eq(&first, &later));
        once.release(&later);
        assert!(!Arc::ptr_eq(&later, &once.first("anna", "k", "POST /go", at(601)).unwrap()));
    }

    #[test]
    fn neither_many_keys_nor_long_replies_fill_the_memory() {
        let once = Once::default();
        for n in 0..3000 {
            once.first("anna", &n.to_string(), "POST /go", at(0)).unwrap();
        }
        assert_eq!(once.kept().len(), KEYS);
        for n in 0..100 {
            let first = once.first("ben", &n.to_string(), "POST /go", at(0)).unwrap();
            first.set(reply(1 << 20)).unwrap();
        }
        once.first("ben", "last", "POST /go", at(0)).unwrap();
        assert_eq!(once.kept().len(), 17, "16 MiB, and the one that is under way");
    }
}
