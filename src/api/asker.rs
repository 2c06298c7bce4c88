//! A request that changes something: its sender, its time, and the handle of the hall.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::FromRequestParts;
use axum::http::header::CONTENT_TYPE;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue};
use axum::response::{IntoResponse, Response};
use hyper::body::Bytes;

use super::access::one;
use super::problem::{bad_value, panicked};
use super::shared::Shared;
use crate::control::{self, Code, Command, Problem, Status, Surface, Who};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::time::{Clock as _, MonoTime};

/// When the person asked, unix milliseconds by the clock of their machine.
pub(super) const SENT: HeaderName = HeaderName::from_static("x-kinocue-sent");
/// How long a stop waits for the state that it led to; it is under way meanwhile.
const STOP_PATIENCE: Duration = Duration::from_millis(400);

/// Who asks, and the way to the hall.
pub(super) struct Asker {
    who: Who,
    /// How long ago they asked, ms, by two wall clocks: negative where theirs is ahead. None where they did not say. What is
    /// wrong with it matters only to what goes stale.
    age_ms: Result<Option<i128>, Problem>,
    shared: Arc<Shared>,
}

/// A status as a reply.
pub(super) struct StatusReply(pub(super) Bytes);

impl IntoResponse for StatusReply {
    fn into_response(self) -> Response {
        ([(CONTENT_TYPE, HeaderValue::from_static("application/json"))], self.0).into_response()
    }
}

impl FromRequestParts<Arc<Shared>> for Asker {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, shared: &Arc<Shared>) -> Result<Self, Problem> {
        let who = parts.extensions.get::<Who>().cloned().ok_or_else(panicked)?; // the gate names all who may get here
        let age_ms = age_ms(&parts.headers, wall_now_ns());
        Ok(Self { who, age_ms, shared: Arc::clone(shared) })
    }
}

impl Asker {
    /// Asks, and replies with the state that it led to.
    pub(super) async fn ask(self, ask: Command) -> Result<StatusReply, Problem> {
        let asked_at = self.asked_at(&ask, Monotonic.now())?;
        let status = if ask == Command::Stop {
            self.stop().await
        } else {
            self.shared.handle.post_asked(self.who, ask, asked_at)?.answer().await?
        };
        Ok(StatusReply(self.shared.write(&status)))
    }

    /// When it was asked, by our own clock; now, where nobody said and it does not matter.
    fn asked_at(&self, ask: &Command, now: MonoTime) -> Result<MonoTime, Problem> {
        if !ask.goes_stale() {
            return Ok(now);
        }
        let Some(age_ms) = self.age_ms.clone()? else {
            if matches!(ask, Command::Go | Command::GoFrom(_)) && self.who.surface != Surface::Socket {
                let remedy = format!("send the header {SENT}, in Unix milliseconds, with a go");
                return Err(bad_value("the age of this go is unknown", remedy));
            }
            return Ok(now);
        };
        control::asked_at(age_ms, now).map_err(|most| {
            let (word, most) = (ask.word(), most.as_millis());
            let (detail, remedy) = if age_ms < 0 {
                let detail =
                    format!("{word} was sent {} ms from now, more than {most}: the clocks differ", -age_ms);
                (detail, "set the clock of the sender, or correct for it with X-Kinocue-Time of the replies")
            } else {
                let detail = format!("{word} came {age_ms} ms after it was sent, more than {most}");
                (detail, "check the seats, then repeat it; if this happens every time, the clocks differ")
            };
            Problem::new(Code::Late, detail, remedy)
        })
    }

    /// A stop is set at once; that it is done is replied also where the hall is busy with something long.
    async fn stop(&self) -> Arc<Status> {
        let handle = &self.shared.handle;
        handle.stop();
        if let Ok(posted) = handle.post(self.who.clone(), Command::Stop)
            && let Ok(Ok(status)) = tokio::time::timeout(STOP_PATIENCE, posted.answer()).await
        {
            return status;
        }
        handle.status()
    }
}

fn age_ms(headers: &HeaderMap, wall_ns: u64) -> Result<Option<i128>, Problem> {
    let Some(text) = one(headers, &SENT)? else { return Ok(None) };
    let sent: i64 = text.parse().map_err(|_| {
        bad_value(format!("{text:?} is not a time"), format!("{SENT} is in whole milliseconds since 1970"))
    })?;
    Ok(Some(i128::from(wall_ns / 1_000_000) - i128::from(sent)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn age(text: &str) -> Result<Option<i128>, Code> {
        let mut headers = HeaderMap::new();
        headers.insert(SENT, HeaderValue::from_str(text).unwrap());
        age_ms(&headers, 10_000_000_000).map_err(|problem| problem.code)
    }

    #[test]
    fn the_age_of_a_request_is_told_by_two_wall_clocks() {
        assert_eq!(age_ms(&HeaderMap::new(), 0), Ok(None));
        assert_eq!(age("9000"), Ok(Some(1000)));
        assert_eq!(age("12500"), Ok(Some(-2500)));
        assert_eq!(age("-9223372036854775808").unwrap().unwrap(), 9_223_372_036_854_785_808);
        for bad in ["", "now", "1.5", "99999999999999999999"] {
            assert_eq!(age(bad), Err(Code::Value), "{bad}");
        }
    }
}
