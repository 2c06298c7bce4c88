//! Requests that come twice: a POST with an `Idempotency-Key` is done once, and its repeats get the first reply.

use std::collections::{HashMap, VecDeque};
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
/// Keys of one asker that are remembered.
const KEYS: usize = 1024;
/// Bytes of replies to one asker that are remembered; of more the oldest are forgotten with their keys.
const BYTES: usize = 4 << 20;
/// How long a key is remembered.
const AGE: Duration = Duration::from_secs(600);

/// The keys of late, and the replies to them: those of each asker by themselves, so that nobody has the keys of others forgotten. A request of
/// theirs that came again would be done again.
#[derive(Debug, Default)]
pub(super) struct Once(Mutex<HashMap<Option<String>, VecDeque<Kept>>>);

/// Who asks with a key.
#[derive(Debug)]
pub(super) struct KeyHolder {
    pub(super) name: String,
    /// Whether they have a token, or may open the control socket. The keys of all who do not are kept together, from however many
    /// addresses they come.
    pub(super) is_known: bool,
}

/// A request as it is compared with another of the same key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct KeyedRequest {
    /// Method and path.
    pub(super) line: String,
    /// SHA-256 of the body.
    pub(super) body: [u8; 32],
}

/// The reply to the first request with a key; empty until it is there.
pub(super) type First = Arc<OnceCell<KeptReply>>;

#[derive(Debug)]
struct Kept {
    /// Whose key it is: two people may choose the same.
    asker: String,
    key: String,
    /// What was asked with it.
    asked: KeyedRequest,
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
        asker: &KeyHolder,
        key: &str,
        asked: KeyedRequest,
        now: MonoTime,
    ) -> Result<First, Problem> {
        if key.is_empty() || key.len() > MAX_KEY || !key.bytes().all(|byte| byte.is_ascii_graphic()) {
            let remedy = format!("use 1 to {MAX_KEY} characters of ASCII, a new key for each request");
            return Err(bad_value(format!("{key:?} is not an Idempotency-Key"), remedy));
        }
        let mut rings = self.rings();
        rings.retain(|_, kept| {
            while kept.pop_front_if(|oldest| now.since(oldest.since) >= AGE).is_some() {}
            !kept.is_empty()
        });
        let kept = rings.entry(asker.is_known.then(|| asker.name.clone())).or_default();
        if let Some(before) = kept.iter().find(|kept| kept.asker == asker.name && kept.key == key) {
            if before.asked == asked {
                return Ok(Arc::clone(&before.first));
            }
            let with = if before.asked.line == asked.line { " with another body" } else { "" };
            let detail =
                format!("the Idempotency-Key {key:?} was already used for {}{with}", before.asked.line);
            return Err(bad_value(detail, "use a new key for a new request"));
        }
        make_room(kept);
        let first = First::default();
        let (asker, key) = (asker.name.clone(), key.to_owned());
        kept.push_back(Kept { asker, key, asked, since: now, first: Arc::clone(&first) });
        Ok(first)
    }

    /// Forgets a key whose request was not even begun.
    pub(super) fn release(&self, first: &First) {
        self.rings().values_mut().for_each(|kept| kept.retain(|kept| !Arc::ptr_eq(&kept.first, first)));
    }

    fn rings(&self) -> MutexGuard<'_, HashMap<Option<String>, VecDeque<Kept>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Makes room for one more: a repeat needs none.
fn make_room(kept: &mut VecDeque<Kept>) {
    let size = |kept: &Kept| kept.first.get().map_or(0, |reply| reply.body.len());
    let mut bytes: usize = kept.iter().map(size).sum();
    while let Some(oldest) = kept.front() {
        if kept.len() < KEYS && bytes <= BYTES {
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

    fn post(path: &str) -> KeyedRequest {
        KeyedRequest { line: format!("POST {path}"), body: [0; 32] }
    }

    fn ask(
        once: &Once,
        asker: &str,
        key: &str,
        asked: KeyedRequest,
        now: MonoTime,
    ) -> Result<First, Problem> {
        once.first(&KeyHolder { name: asker.to_owned(), is_known: true }, key, asked, now)
    }

    #[test]
    fn a_key_stands_for_one_request_of_one_person() {
        let once = Once::default();
        let first = ask(&once, "anna", "k", post("/go"), at(0)).unwrap();
        let again = ask(&once, "anna", "k", post("/go"), at(1)).unwrap();
        assert!(Arc::ptr_eq(&first, &again));
        assert!(!Arc::ptr_eq(&first, &ask(&once, "ben", "k", post("/go"), at(1)).unwrap()));
        assert_eq!(ask(&once, "anna", "k", post("/stop"), at(1)).unwrap_err().code, Code::Value);
        let other = KeyedRequest { body: [1; 32], ..post("/go") };
        assert_eq!(ask(&once, "anna", "k", other, at(1)).unwrap_err().code, Code::Value);
        for bad in ["", "a b", "ä", &"k".repeat(65)] {
            assert_eq!(ask(&once, "anna", bad, post("/go"), at(1)).unwrap_err().code, Code::Value, "{bad}");
        }
    }

    #[test]
    fn a_key_is_forgotten_after_ten_minutes_or_when_nothing_was_done() {
        let once = Once::default();
        let first = ask(&once, "anna", "k", post("/go"), at(0)).unwrap();
        assert!(Arc::ptr_eq(&first, &ask(&once, "anna", "k", post("/go"), at(599)).unwrap()));
        let later = ask(&once, "anna", "k", post("/go"), at(600)).unwrap();
        assert!(!Arc::ptr_eq(&first, &later));
        once.release(&later);
        assert!(!Arc::ptr_eq(&later, &ask(&once, "anna", "k", post("/go"), at(601)).unwrap()));
    }

    #[test]
    fn a_repeat_has_nothing_forgotten_though_there_is_room_for_no_more() {
        let once = Once::default();
        let firsts: Vec<First> =
            (0..KEYS).map(|n| ask(&once, "anna", &n.to_string(), post("/go"), at(0)).unwrap()).collect();
        ask(&once, "ben", "k", post("/go"), at(1)).unwrap();
        let again = ask(&once, "anna", "0", post("/go"), at(2)).unwrap();
        assert!(Arc::ptr_eq(&firsts[0], &again), "it is not done again");
    }

    #[test]
    fn neither_many_keys_nor_long_replies_fill_the_memory_nor_have_the_keys_of_others_forgotten() {
        let once = Once::default();
        let of = |asker: &str| once.rings()[&Some(asker.to_owned())].len();
        let resume = ask(&once, "carl", "k", post("/resume"), at(0)).unwrap();
        for n in 0..3000 {
            let guest = KeyHolder { name: format!("10.0.{}.{}", n / 256, n % 256), is_known: false };
            once.first(&guest, "k", post("/go"), at(0)).unwrap();
        }
        assert_eq!(once.rings()[&None].len(), KEYS);
        for n in 0..3000 {
            ask(&once, "anna", &n.to_string(), post("/go"), at(0)).unwrap();
        }
        assert_eq!(of("anna"), KEYS);
        for n in 0..100 {
            let first = ask(&once, "ben", &n.to_string(), post("/go"), at(0)).unwrap();
            first.set(reply(1 << 20)).unwrap();
        }
        ask(&once, "ben", "last", post("/go"), at(0)).unwrap();
        assert_eq!(of("ben"), 5, "4 MiB, and the one that is under way");
        let again = ask(&once, "carl", "k", post("/resume"), at(1)).unwrap();
        assert!(Arc::ptr_eq(&resume, &again), "it is not done again");
    }
}
