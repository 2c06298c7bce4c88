//! A reply of the daemon into what the program ends with and tells.

use anyhow::anyhow;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::http::HttpReply;
use crate::cli::{Exit, Failure, OrExit as _};
use crate::control::{FilmStatus, HallFacts, Status};

/// Why something was not done (RFC 9457), as the daemon writes it.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::cli) struct ServiceProblem {
    code: String,
    detail: String,
    remedy: String,
    /// Every fault, where there are several.
    pub(in crate::cli) faults: Vec<String>,
}

/// The status in a reply, or why there is none.
pub(super) fn status(reply: &HttpReply) -> Result<Status, Failure> {
    parsed(reply, "status")
}

/// The film in a reply, or why there is none.
pub(super) fn film(reply: &HttpReply) -> Result<FilmStatus, Failure> {
    parsed(reply, "film")
}

fn parsed<T: DeserializeOwned>(reply: &HttpReply, what: &str) -> Result<T, Failure> {
    done(reply)?;
    serde_json::from_str(&reply.text).map_err(|error| Failure {
        exit: Exit::Internal,
        error: anyhow!(error).context(format!("the daemon's reply is not a {what}; is it another version?")),
    })
}

/// Nothing where the reply says that it was done.
pub(super) fn done(reply: &HttpReply) -> Result<(), Failure> {
    if (200..300).contains(&reply.status) {
        return Ok(());
    }
    let problem = ServiceProblem::of(&reply.text);
    let hall: HallFacts = serde_json::from_str(&reply.text).unwrap_or_default();
    Err(anyhow!(problem.text(reply.status, &hall))).or_exit(exit(&problem.code, reply.status))
}

impl ServiceProblem {
    /// What a body says; of no other than the service's, nothing.
    pub(in crate::cli) fn of(body: &str) -> Self {
        serde_json::from_str(body).unwrap_or_default()
    }

    /// It in a line.
    pub(in crate::cli) fn line(&self) -> String {
        if self.detail.is_empty() {
            return "the hall is of another version".to_owned();
        }
        format!("{}; {}", self.detail, self.remedy)
    }

    fn text(&self, status: u16, hall: &HallFacts) -> String {
        if self.detail.is_empty() {
            return format!("the daemon sent {status} with an empty body; see its log");
        }
        let mut text = self.line();
        self.faults.iter().for_each(|fault| text.extend(["\n  ", fault]));
        if *hall != HallFacts::default() {
            text.extend(["\n", &hall.line(None)]);
        }
        text
    }
}

/// How the program ends, by the stable word of a problem; by the status where there is none.
fn exit(code: &str, status: u16) -> Exit {
    match (code, status) {
        ("state" | "busy" | "timeout" | "late", _) | (_, 409 | 429 | 503) => Exit::TryAgain,
        ("role" | "token" | "origin", _) | (_, 401 | 403) => Exit::NotAllowed,
        ("unknown", _) | (_, 404) => Exit::NoInput,
        ("cue", _) => Exit::BadCue,
        ("check", _) | (_, 422) => Exit::CheckFailed,
        ("file", _) => Exit::Io,
        ("off", _) => Exit::Config,
        (_, 400..=499) => Exit::Usage,
        _ => Exit::Internal,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Code;

    fn failure(status: u16, text: &str) -> Failure {
        done(&HttpReply { status, text: text.to_owned() }).unwrap_err()
    }

    #[test]
    fn a_problem_is_told_with_what_to_do_its_faults_and_the_state() {
        let failure = failure(
            422,
            r#"{"status":422,"code":"check","detail":"coaster does not pass","remedy":"fit it","faults":["a1: too fast"],
                "state":"parked","cause":"by anna","next":"load a cue","position_s":null}"#,
        );
        assert_eq!(failure.exit, Exit::CheckFailed);
        let told = "coaster does not pass; fit it\n  a1: too fast\nparked: by anna; next: load a cue";
        assert_eq!(failure.to_string(), told);
    }

    #[test]
    fn each_code_has_its_exit_code_whether_it_is_named_or_not() {
        for (code, wanted) in [
            (Code::State, Exit::TryAgain),
            (Code::Late, Exit::TryAgain),
            (Code::Busy, Exit::TryAgain),
            (Code::Timeout, Exit::TryAgain),
            (Code::Role, Exit::NotAllowed),
            (Code::Token, Exit::NotAllowed),
            (Code::Origin, Exit::NotAllowed),
            (Code::Value, Exit::Usage),
            (Code::Unknown, Exit::NoInput),
            (Code::Check, Exit::CheckFailed),
        ] {
            assert_eq!(exit(code.word(), code.status()), wanted, "{code:?}");
            assert_eq!(exit("", code.status()), wanted, "{code:?} by its status");
        }
        assert_eq!(exit(Code::Cue.word(), Code::Cue.status()), Exit::BadCue);
        assert_eq!(exit(Code::File.word(), 500), Exit::Io);
        assert_eq!(exit(Code::Off.word(), 501), Exit::Config);
        assert_eq!(exit("", 500), Exit::Internal);
    }

    #[test]
    fn a_reply_that_is_no_json_is_no_reason_to_panic() {
        assert_eq!(failure(431, "Request Header Fields Too Large").exit, Exit::Usage);
        assert!(status(&HttpReply { status: 200, text: "<html>".to_owned() }).is_err());
    }
}
