//! What comes in with a request: bodies, names in paths. Whatever is not exactly as it may be is refused, in our own words.

use std::time::Duration;

use axum::body::Body;
use axum::extract::{FromRequest, FromRequestParts, Path, Request};
use axum::http::header::{CONTENT_LENGTH, CONTENT_TYPE};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue};
use http_body_util::{BodyExt as _, LengthLimitError, Limited};
use hyper::body::Bytes;
use serde::de::DeserializeOwned;

use super::problem::bad_value;
use crate::control::{Code, Problem};
use crate::{json, library};

/// The longest body outside of uploads, bytes.
pub(super) const MAX_BODY: usize = 64 << 10;
/// How long a body may take to come.
const BODY_TIME: Duration = Duration::from_secs(10);
/// The longest name.
const MAX_NAME: usize = 64;

/// A JSON body.
pub(super) struct Json<T>(pub(super) T);

/// No body, or an empty object.
pub(super) struct Nothing;

/// A JSON body; none is as good as an empty object.
pub(super) struct OrNothing<T>(pub(super) T);

/// A name in the path: of a controller, a preset.
pub(super) struct Name(pub(super) String);

/// An id in the path: of a cue.
pub(super) struct Id(pub(super) library::Id);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for Json<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<Self, Problem> {
        let headers = request.headers().clone();
        let body = whole(&headers, request.into_body()).await?;
        json_only(&headers)?;
        parse(&body).map(Self)
    }
}

impl<T: DeserializeOwned + Default, S: Send + Sync> FromRequest<S> for OrNothing<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<Self, Problem> {
        let headers = request.headers().clone();
        let body = whole(&headers, request.into_body()).await?;
        if body.is_empty() {
            return Ok(Self(T::default()));
        }
        json_only(&headers)?;
        parse(&body).map(Self)
    }
}

impl<S: Send + Sync> FromRequest<S> for Nothing {
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<Self, Problem> {
        let headers = request.headers().clone();
        let body = whole(&headers, request.into_body()).await?;
        if !body.is_empty() {
            json_only(&headers)?;
            let object: serde_json::Map<String, serde_json::Value> = parse(&body)?;
            if let Some(key) = object.keys().next() {
                return Err(bad_value(format!("unknown key {key:?}"), "send no body here"));
            }
        }
        Ok(Self)
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Name {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let name = in_path(parts, state).await?;
        if name.is_empty() || name.chars().count() > MAX_NAME || name.chars().any(char::is_control) {
            return Err(bad_value(
                format!("{name:?} is not a name"),
                format!("a name has 1 to {MAX_NAME} characters"),
            ));
        }
        Ok(Self(name))
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Id {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        id(&in_path(parts, state).await?).map(Self)
    }
}

pub(super) async fn in_path<S: Send + Sync>(parts: &mut Parts, state: &S) -> Result<String, Problem> {
    let Path(text) = Path::<String>::from_request_parts(parts, state)
        .await
        .map_err(|_| bad_value("the path is not UTF-8", "write it as in the status"))?;
    Ok(text)
}

/// A text as the id of a cue or a playlist, which is never a path.
pub(super) fn id(text: &str) -> Result<library::Id, Problem> {
    text.parse().map_err(|error: library::IdError| bad_value(error.to_string(), "use the name in the lists"))
}

/// The body, of at most [`MAX_BODY`] bytes.
pub(super) async fn whole(headers: &HeaderMap, body: Body) -> Result<Bytes, Problem> {
    whole_within(headers, body, MAX_BODY).await
}

/// The body, of at most so many bytes.
pub(super) async fn whole_within(headers: &HeaderMap, body: Body, most: usize) -> Result<Bytes, Problem> {
    check_length(headers, most as u64)?;
    match tokio::time::timeout(BODY_TIME, Limited::new(body, most).collect()).await {
        Ok(Ok(body)) => Ok(body.to_bytes()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => Err(too_long(most as u64)),
        Ok(Err(_)) => Err(bad_value("the body ended before its length", "send it whole")),
        Err(_) => {
            let detail = format!("the body took more than {} s", BODY_TIME.as_secs());
            Err(Problem { status: 408, ..Problem::new(Code::Timeout, detail, "send it faster") })
        }
    }
}

/// Refuses a body that says by itself that it is too long, before any of it is read.
pub(super) fn check_length(headers: &HeaderMap, most: u64) -> Result<(), Problem> {
    let length = headers.get(CONTENT_LENGTH).and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
    if length.is_some_and(|length| length > most) { Err(too_long(most)) } else { Ok(()) }
}

/// A body that is longer than may be.
pub(super) fn too_long(most: u64) -> Problem {
    Problem::new(Code::Size, format!("the body is longer than {most} bytes"), "send a shorter one")
}

fn json_only(headers: &HeaderMap) -> Result<(), Problem> {
    let essence = |value: &HeaderValue| {
        let essence = value.to_str().ok()?.split(';').next()?.trim();
        Some(essence.eq_ignore_ascii_case("application/json"))
    };
    if headers.get(CONTENT_TYPE).and_then(essence) == Some(true) {
        return Ok(());
    }
    let detail = "the body is not declared as JSON";
    Err(Problem::new(Code::Media, detail, "send it with Content-Type: application/json"))
}

pub(super) fn parse<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
    json::from_slice(body).map_err(|error| {
        bad_value(format!("the body is not valid here: {error}"), "see /api/v1/openapi.json")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(content_type: &'static str, body: &'static str) -> Request {
        Request::builder().header(CONTENT_TYPE, content_type).body(Body::from(body)).unwrap()
    }

    fn run<F: Future>(future: F) -> F::Output {
        tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap().block_on(future)
    }

    fn number(content_type: &'static str, body: &'static str) -> Result<u8, Code> {
        run(Json::<u8>::from_request(request(content_type, body), &())).map(|json| json.0).map_err(|p| p.code)
    }

    #[test]
    fn a_body_is_json_and_says_so() {
        assert_eq!(number("application/json", "7"), Ok(7));
        assert_eq!(number("Application/JSON; charset=utf-8", " 7 "), Ok(7));
        assert_eq!(number("text/plain", "7"), Err(Code::Media));
        assert_eq!(number("application/jsonx", "7"), Err(Code::Media));
        for bad in ["", "300", "\"7\"", "7 8", "{", "nan"] {
            assert_eq!(number("application/json", bad), Err(Code::Value), "{bad}");
        }
    }

    #[test]
    fn where_no_body_is_wanted_an_empty_one_passes() {
        let nothing =
            |body| run(Nothing::from_request(request("application/json", body), &())).map_err(|p| p.code);
        assert!(nothing("").is_ok() && nothing("{}").is_ok());
        assert_eq!(nothing("{\"position_s\":1}").err(), Some(Code::Value));
        assert_eq!(nothing("[]").err(), Some(Code::Value));
    }

    #[test]
    fn a_body_beyond_the_limit_is_refused_before_and_while_it_comes() {
        let long: &'static str = "7".repeat(MAX_BODY + 1).leak();
        assert_eq!(number("application/json", long), Err(Code::Size));
        let mut headers = HeaderMap::new();
        headers.insert(CONTENT_LENGTH, HeaderValue::from(MAX_BODY + 1));
        assert_eq!(check_length(&headers, MAX_BODY as u64).unwrap_err().status, 413);
    }
}
