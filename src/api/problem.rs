//! Problems as replies (RFC 9457), always with the state of the hall for whoever may see it.

use axum::http::header::{CONTENT_TYPE, WWW_AUTHENTICATE};
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::control::{Code, HallFacts, Problem, Status};

/// The type of a problem's body.
pub(super) const PROBLEM_JSON: &str = "application/problem+json";

/// Why something was not done, and how the hall is (RFC 9457).
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Problem)]
pub(super) struct ProblemBody<'p> {
    /// Names the kind: `urn:kinocue:problem:` and the code.
    #[serde(rename = "type")]
    kind: String,
    /// The kind in words.
    title: &'static str,
    /// The status of the reply.
    status: u16,
    /// The kind in one word, stable for programs.
    code: Code,
    /// What went wrong, with the value and the limit.
    detail: &'p str,
    /// What stands against it, by a stable word, where the state of the hall does.
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<&'static str>,
    /// What to do.
    remedy: &'p str,
    /// Every fault, where there are several.
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    faults: &'p [String],
    /// The state of the hall, its cause and the next action, as in its status.
    #[serde(flatten)]
    hall: Option<HallFacts>,
}

impl IntoResponse for Problem {
    /// A reply without its body, which `render` gives it.
    fn into_response(self) -> Response {
        let mut response = StatusCode::INTERNAL_SERVER_ERROR.into_response();
        response.extensions_mut().insert(self);
        response
    }
}

/// Gives a problem its body; other replies pass as they are.
pub(super) fn render(mut response: Response, hall: Option<&Status>) -> Response {
    let Some(problem) = response.extensions_mut().remove::<Problem>() else { return response };
    let (status, code) = (problem.status, problem.code);
    let text = text(&problem, hall);
    let mut rendered = (
        StatusCode::from_u16(status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR),
        [(CONTENT_TYPE, HeaderValue::from_static(PROBLEM_JSON))],
        text,
    )
        .into_response();
    if code == Code::Token {
        rendered.headers_mut().insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    }
    // What axum says of its own accord (Allow, of a wrong method).
    for (name, value) in response.headers() {
        if name != CONTENT_TYPE && name != axum::http::header::CONTENT_LENGTH {
            rendered.headers_mut().append(name, value.clone());
        }
    }
    rendered
}

/// A problem as JSON.
pub(super) fn text(problem: &Problem, hall: Option<&Status>) -> String {
    let Problem { status, code, detail, why, remedy, faults } = problem;
    let body = ProblemBody {
        kind: format!("urn:kinocue:problem:{}", code.word()),
        title: title(*code),
        status: *status,
        code: *code,
        detail,
        why: *why,
        remedy,
        faults,
        hall: hall.map(HallFacts::from),
    };
    serde_json::to_string(&body).expect("text and numbers are written without fail")
}

const fn title(code: Code) -> &'static str {
    match code {
        Code::State => "the state of the hall does not allow it",
        Code::Role => "not allowed",
        Code::Token => "unknown sender",
        Code::Value => "a value is not allowed",
        Code::Unknown => "unknown name",
        Code::Method => "wrong method",
        Code::Size => "too long",
        Code::Media => "unsupported format",
        Code::Cue => "a bad cue",
        Code::Check => "it does not pass",
        Code::Late => "too late",
        Code::Origin => "foreign origin",
        Code::Busy => "too many requests",
        Code::Timeout => "no answer in time",
        Code::File => "a file cannot be read or written",
        Code::Off => "not built, or turned off",
        Code::Internal => "a fault of the program",
    }
}

/// There is nothing at that path.
pub(super) fn nothing_there(path: &str) -> Problem {
    let detail = format!("there is nothing at {path:?}");
    Problem::new(Code::Unknown, detail, "see /api/v1/openapi.json for what there is")
}

/// A value that is not what it may be.
pub(super) fn bad_value(detail: impl Into<String>, remedy: impl Into<String>) -> Problem {
    Problem::new(Code::Value, detail, remedy)
}

/// What a handler that panicked leaves.
pub(super) fn panicked() -> Problem {
    let remedy = "check the status, and report this with the log of the service";
    Problem::new(Code::Internal, "an internal fault; the program continues", remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_is_written_with_its_kind_and_the_state_of_the_hall() {
        let problem = Problem::new(Code::State, "cannot go while parked", "arm first").with(vec!["x".into()]);
        let response = render(problem.into_response(), Some(&Status::starting("Hall 1")));
        assert_eq!(response.status(), StatusCode::CONFLICT);
        assert_eq!(response.headers()[CONTENT_TYPE], PROBLEM_JSON);
    }

    #[test]
    fn who_has_no_token_is_told_which_kind_is_wanted_and_nothing_of_the_hall() {
        let response = render(Problem::new(Code::Token, "a", "b").into_response(), None);
        assert_eq!(
            (response.status().as_u16(), &response.headers()[WWW_AUTHENTICATE]),
            (401, &"Bearer".parse().unwrap())
        );
    }

    #[test]
    fn other_replies_pass() {
        assert_eq!(render("fine".into_response(), None).status(), StatusCode::OK);
    }
}
