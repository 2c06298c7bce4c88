//! What a receiver of feedback is told: what it has not been told yet.

use rosc::{OscMessage, OscType};

use crate::control::model::Word;
use crate::control::{FilmStatus, Severity, Status, Warning};
use crate::state::State;

/// What one receiver has been told so far.
#[derive(Debug, Default)]
pub(super) struct Said {
    state: Option<Word<State>>,
    position: Option<f64>,
    film: FilmSaid,
    /// Whole seconds of the hall.
    beat: Option<i32>,
    warnings: Vec<Warning>,
}

impl Said {
    /// What is new to it. A heartbeat is the hall's own clock in whole seconds: a hall that hangs does not beat.
    pub(super) fn news(&mut self, status: &Status) -> Vec<OscMessage> {
        let mut news = Vec::new();
        if self.state.as_ref() != Some(&status.state) {
            self.state = Some(status.state.clone());
            news.push(message("state", vec![OscType::from(status.state.to_string())]));
        }
        let position = status.show.as_ref().map(|show| show.position_s);
        if let Some(s) = position.filter(|_| position != self.position) {
            #[expect(clippy::cast_possible_truncation, reason = "OSC 1.0 has no doubles; it is to be shown")]
            news.push(message("position", vec![OscType::Float(s as f32)]));
        }
        self.position = position;
        news.extend(status.film.iter().flat_map(|film| self.film.news(film)));
        let new = status.warnings.iter().filter(|warning| !self.warnings.contains(warning));
        news.extend(new.map(|warning| warn(warning.severity, &sentence(warning))));
        self.warnings.clone_from(&status.warnings);
        #[expect(clippy::cast_possible_truncation, reason = "a saturating cast, after 68 years")]
        let beat = status.uptime_s as i32;
        if self.beat.replace(beat) != Some(beat) {
            news.push(message("heartbeat", vec![OscType::Int(beat)]));
        }
        news
    }
}

/// What one receiver has been told of the film that the hall follows.
#[derive(Debug, Default)]
struct FilmSaid {
    /// Its state, and why.
    state: Option<[String; 2]>,
    timecode: Option<String>,
}

impl FilmSaid {
    fn news(&mut self, film: &FilmStatus) -> Vec<OscMessage> {
        let mut news = Vec::new();
        let state = [film.state.clone(), film.cause.clone()];
        if self.state.as_ref() != Some(&state) {
            news.push(message("film", state.iter().map(|text| OscType::from(text.as_str())).collect()));
            self.state = Some(state);
        }
        if let Some(timecode) = film.timecode.as_ref().filter(|_| film.timecode != self.timecode) {
            news.push(message("timecode", vec![OscType::from(timecode.as_str())]));
        }
        self.timecode.clone_from(&film.timecode);
        news
    }
}

/// `/kinocue/warning`, with 0 for news, 1 for a warning and 2 for an error.
pub(super) fn warn(severity: Severity, text: &str) -> OscMessage {
    let grade = match severity {
        Severity::Info => 0,
        Severity::Warning => 1,
        Severity::Error => 2,
    };
    message("warning", vec![OscType::Int(grade), OscType::from(text)])
}

fn sentence(warning: &Warning) -> String {
    let Warning { controller, text, remedy, .. } = warning;
    let about = controller.as_ref().map_or_else(String::new, |name| format!("{name}: "));
    format!("{about}{text}; {remedy}")
}

fn message(word: &str, args: Vec<OscType>) -> OscMessage {
    OscMessage { addr: format!("/kinocue/{word}"), args }
}
