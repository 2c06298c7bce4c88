//! mpv over its socket, lines of JSON: what it is asked, and what its replies and events say. `audio-pts` is its clock, and asked for
//! some times a second; `time-pos` names the frame that was queued last, a frame early, and serves where there is no sound. On a
//! reader's thread; told the bytes and the time.

#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value, json};

use super::observation::{FilmWord, Observation};
use super::timecode::FrameRate;
use crate::time::{MonoTime, ShowTime};

/// From one question to the next: more of them make the estimate no better.
const ASK_EVERY: Duration = Duration::from_millis(50);
/// The same while little is known: seats wait for four answers that agree, for so long after it began to run, or was wound.
const ASK_SOON: Duration = Duration::from_millis(5);
/// Measured: after a seek the sound has no clock for up to 0.3 s, while the picture runs as much as a frame beside it.
const SETTLES: Duration = Duration::from_millis(500);
/// An answer that takes longer says nothing; the next question goes out.
const MUTE_AFTER: Duration = Duration::from_millis(250);
/// The longest line that is read. mpv's are shorter than a kilobyte, but for lists that nobody asked for.
const LONGEST_LINE: usize = 65_536;
/// What is observed. The event of a property carries its place in here.
const OBSERVED: [&str; 8] =
    ["pause", "core-idle", "speed", "path", "eof-reached", "avsync", "container-fps", "time-pos"];
/// A film of which nobody knows the frame rate.
const FRAME_S: f64 = 1.0 / 24.0;

#[derive(Deserialize)]
struct MpvMessage<'a> {
    #[serde(borrow)]
    event: Option<Cow<'a, str>>,
    #[serde(borrow)]
    name: Option<Cow<'a, str>>,
    #[serde(borrow)]
    reason: Option<Cow<'a, str>>,
    #[serde(borrow)]
    error: Option<Cow<'a, str>>,
    request_id: Option<u64>,
    data: Option<Value>,
}

/// What is known of the sound of the film that is open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MpvSound {
    /// It is the clock.
    Heard,
    /// Whether there is any is not known: it was just opened or wound, or stands where it was wound to.
    Away,
    /// There is none.
    Absent,
}

/// A question that is under way.
#[derive(Debug, Clone, Copy)]
struct MpvQuestion {
    id: u64,
    sent: MonoTime,
}

/// The client's side of one connection to mpv.
#[derive(Debug)]
pub(crate) struct MpvClient {
    line: Vec<u8>,
    /// The line is too long: the rest of it is left out.
    overlong: bool,
    question: Option<MpvQuestion>,
    questions: u64,
    next_at: MonoTime,
    sound: MpvSound,
    /// When it began to run last, or was wound.
    began: MonoTime,
    paused: bool,
    idle: bool,
    winding: bool,
    /// Whether it was said to run; not known at first.
    runs: Option<bool>,
    frame_s: f64,
    path: Option<String>,
    avsync_s: Option<f64>,
    garbage: u64,
}

impl MpvClient {
    /// A connection that was just made.
    pub(crate) const fn new(now: MonoTime) -> Self {
        Self {
            line: Vec::new(),
            overlong: false,
            question: None,
            questions: 0,
            next_at: now,
            sound: MpvSound::Away,
            began: now,
            paused: false,
            idle: false,
            winding: false,
            runs: None,
            frame_s: FRAME_S,
            path: None,
            avsync_s: None,
            garbage: 0,
        }
    }

    /// What is to be sent first.
    pub(crate) fn greeting() -> String {
        let observe = |(id, name): (usize, &str)| {
            json!({ "command": ["observe_property", id, name] }).to_string() + "\n"
        };
        OBSERVED.into_iter().enumerate().map(observe).collect()
    }

    /// The film that it has open.
    pub(crate) fn path(&self) -> Option<&str> {
        self.path.as_deref()
    }

    /// The film's frames a second, where they are of a rate that films have.
    pub(crate) fn rate(&self) -> Option<FrameRate> {
        let is_it = |rate: &FrameRate| (rate.frames_per_second() * self.frame_s - 1.0).abs() < 1e-4;
        FrameRate::ALL.into_iter().find(is_it)
    }

    /// How far picture and sound are apart by its own account, seconds.
    pub(crate) const fn avsync_s(&self) -> Option<f64> {
        self.avsync_s
    }

    /// Lines that were none of its protocol.
    pub(crate) const fn garbage(&self) -> u64 {
        self.garbage
    }

    /// When [`Self::poll`] has something to ask next.
    pub(crate) fn next_at(&self) -> MonoTime {
        self.question.map_or(self.next_at, |question| question.sent + MUTE_AFTER)
    }

    /// The question that is due, as a line to be sent now.
    pub(crate) fn poll(&mut self, now: MonoTime) -> Option<String> {
        if now < self.next_at() {
            return None;
        }
        self.questions += 1;
        self.question = Some(MpvQuestion { id: self.questions, sent: now });
        self.next_at = now + if self.settles(now) { ASK_SOON } else { ASK_EVERY };
        Some(
            json!({ "command": ["get_property", "audio-pts"], "request_id": self.questions }).to_string()
                + "\n",
        )
    }

    /// True shortly after it began to run, or was wound.
    fn settles(&self, now: MonoTime) -> bool {
        now.since(self.began) < SETTLES
    }

    /// It runs from here on; what was asked before is answered by where it was.
    fn begin(&mut self, at: MonoTime) {
        (self.began, self.next_at, self.question) = (at, at, None);
    }

    /// Takes bytes that came at an instant.
    pub(crate) fn hear(&mut self, bytes: &[u8], at: MonoTime, out: &mut impl FnMut(Observation)) {
        for piece in bytes.split_inclusive(|byte| *byte == b'\n') {
            let is_whole = piece.ends_with(b"\n");
            // Nothing is kept of a line that grows too long, so that a player that lies fills no memory.
            self.overlong |= self.line.len() + piece.len() > LONGEST_LINE;
            if !self.overlong {
                self.line.extend_from_slice(piece);
            }
            if is_whole {
                let line = std::mem::take(&mut self.line);
                if std::mem::take(&mut self.overlong) || !self.on_line(&line, at, out) {
                    self.garbage += 1;
                }
                // Its room is used again.
                self.line = line;
                self.line.clear();
            }
        }
    }

    /// Takes that the connection has ended.
    pub(crate) fn hear_end(&mut self, at: MonoTime, out: &mut impl FnMut(Observation)) {
        out(Observation::new(at, FilmWord::Gone));
    }

    fn on_line(&mut self, line: &[u8], at: MonoTime, out: &mut impl FnMut(Observation)) -> bool {
        let Ok(message) = serde_json::from_slice::<MpvMessage<'_>>(line) else { return false };
        match message.event.as_deref() {
            Some("property-change") => self.on_property(&message, at, out),
            Some(event) => self.on_event(event, message.reason.as_deref(), at, out),
            None => self.on_reply(&message, at, out),
        }
        true
    }

    /// The answer to a question: true at some instant between the two, most likely half way.
    fn on_reply(&mut self, message: &MpvMessage<'_>, at: MonoTime, out: &mut impl FnMut(Observation)) {
        let Some(question) = self.question.filter(|question| message.request_id == Some(question.id)) else {
            return;
        };
        self.question = None;
        let trip = at.since(question.sent);
        let position = message.data.as_ref().and_then(Value::as_f64);
        self.sound = match (message.error.as_deref(), position, self.sound) {
            (Some("success"), Some(_), _) => MpvSound::Heard,
            (.., MpvSound::Absent) => MpvSound::Absent,
            // Too early to say that there is none: the picture would lead, a frame beside the sound.
            _ if self.paused || self.winding || self.settles(at) => MpvSound::Away,
            _ => MpvSound::Absent,
        };
        let is_heard = self.sound == MpvSound::Heard;
        // Neither way is known to be the slower one: half way, and off by half the trip at the most.
        let Some(position) = position.filter(|_| is_heard && trip <= MUTE_AFTER) else { return };
        let word = FilmWord::Position(ShowTime::from_secs_f64(position));
        out(Observation { at: question.sent + trip / 2, bound: trip / 2, word });
    }

    fn on_property(&mut self, message: &MpvMessage<'_>, at: MonoTime, out: &mut impl FnMut(Observation)) {
        let data = message.data.as_ref();
        let (number, is_true) = (data.and_then(Value::as_f64), data.and_then(Value::as_bool));
        match message.name.as_deref() {
            Some("pause") => self.paused = is_true.unwrap_or(self.paused),
            // Buffers run dry; while it is wound it is idle as well, and says that otherwise.
            Some("core-idle") => self.idle = is_true.unwrap_or(self.idle),
            Some("speed") => {
                out(Observation::new(at, FilmWord::Speed(number.unwrap_or(1.0))));
                return;
            }
            Some("eof-reached") if is_true == Some(true) => {
                self.runs = Some(false);
                out(Observation::new(at, FilmWord::End));
                return;
            }
            Some("path") => self.path = data.and_then(Value::as_str).map(str::to_owned),
            Some("avsync") => self.avsync_s = number,
            Some("container-fps") => {
                self.frame_s =
                    number.filter(|fps| (1.0..=1_000.0).contains(fps)).map_or(FRAME_S, |fps| 1.0 / fps);
            }
            Some("time-pos") => {
                let is_clock = match self.sound {
                    MpvSound::Heard => false,
                    // Paused, the picture stands where sound will begin. Running, it may be a frame off.
                    MpvSound::Away => self.paused,
                    MpvSound::Absent => true,
                };
                let shown = number.filter(|_| is_clock);
                let word =
                    // It names the frame that was queued; people see the one before.
                    shown.map(|queued| FilmWord::Position(ShowTime::from_secs_f64(queued - self.frame_s)));
                word.into_iter().for_each(|word| out(Observation::new(at, word)));
                return;
            }
            _ => return,
        }
        self.say_if_it_runs(at, out);
    }

    fn say_if_it_runs(&mut self, at: MonoTime, out: &mut impl FnMut(Observation)) {
        let runs = !self.paused && (!self.idle || self.winding);
        if self.runs != Some(runs) {
            self.runs = Some(runs);
            if runs {
                self.begin(at);
            }
            out(Observation::new(at, if runs { FilmWord::Play } else { FilmWord::Stop }));
        }
    }

    /// Says once more if it runs, for somebody who heard nothing of it before: of a film that stands nothing else comes.
    pub(crate) fn say_again(&self, at: MonoTime, out: &mut impl FnMut(Observation)) {
        let runs = self.runs.map(|runs| if runs { FilmWord::Play } else { FilmWord::Stop });
        runs.into_iter().for_each(|word| out(Observation::new(at, word)));
    }

    fn on_event(
        &mut self,
        event: &str,
        reason: Option<&str>,
        at: MonoTime,
        out: &mut impl FnMut(Observation),
    ) {
        let mut say = |word| out(Observation::new(at, word));
        match event {
            "seek" | "start-file" => {
                self.winding = true;
                if event == "start-file" {
                    self.sound = MpvSound::Away;
                }
                say(FilmWord::Seek);
            }
            "playback-restart" => {
                self.winding = false;
                self.begin(at);
                say(FilmWord::Landed);
                // After the end of a film it was said to stand, and nothing has said that it does not any more.
                if self.runs == Some(false) && !self.paused {
                    self.runs = Some(true);
                    say(FilmWord::Play);
                }
            }
            "end-file" => {
                (self.winding, self.runs) = (false, Some(false));
                say(if reason == Some("eof") { FilmWord::End } else { FilmWord::Stop });
            }
            "shutdown" => say(FilmWord::Gone),
            _ => {}
        }
    }
}
