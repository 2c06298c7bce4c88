//! What is to be told, and when: alarms of a moment go together, one message goes at a time, no more than one in a while, and one that
//! cannot be sent is tried again a few times and then given up. Time is an argument.

use std::time::Duration;

use serde::Serialize;

use crate::time::MonoTime;

/// Seats are lost together: so long is waited for what belongs to an alarm.
const GATHERS: Duration = Duration::from_secs(2);
/// How long after each failure it is tried again; after the last it is given up.
const RETRIES: [Duration; 3] = [Duration::from_secs(5), Duration::from_secs(30), Duration::from_secs(120)];
/// Alarms of a message; of more the rest is counted.
pub(super) const MOST: usize = 100;

/// Whether an alarm begins or is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum AlarmTurn {
    Raised,
    Cleared,
}

/// An alarm that begins, or is over.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Alarm {
    pub(super) what: AlarmTurn,
    /// The stable word of the warning.
    pub(super) id: String,
    pub(super) severity: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) controller: Option<String>,
    pub(super) text: String,
    pub(super) remedy: String,
    /// When, as the clock of the day says.
    pub(super) at: String,
}

/// What is told at once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct AlarmMessage {
    /// The hall.
    pub(super) hall: String,
    /// The same in each try, so that a receiver knows it again.
    pub(super) message: String,
    /// In the order in which they came.
    pub(super) alarms: Vec<Alarm>,
    /// How many more there were.
    pub(super) omitted: u64,
}

/// What waits to be told by one way.
#[derive(Debug)]
pub(super) struct Outbox {
    hall: String,
    /// Of messages of this program.
    mark: String,
    every: Duration,
    waiting: Vec<Alarm>,
    omitted: u64,
    /// When what waits may go.
    due: MonoTime,
    /// What is being told, and how often that failed.
    current: Option<(AlarmMessage, usize)>,
    count: u64,
}

impl Outbox {
    /// Nothing to be told yet.
    pub(super) fn new(hall: &str, mark: String, every: Duration) -> Self {
        let (waiting, due) = (Vec::new(), MonoTime::default());
        Self { hall: hall.to_owned(), mark, every, waiting, omitted: 0, due, current: None, count: 0 }
    }

    /// Takes an alarm.
    pub(super) fn add(&mut self, alarm: Alarm, now: MonoTime) {
        if self.waiting.is_empty() && self.current.is_none() {
            self.due = self.due.max(now + GATHERS);
        }
        if self.waiting.len() < MOST {
            self.waiting.push(alarm);
        } else {
            self.omitted += 1;
        }
    }

    /// Notes alarms that did not even come here.
    pub(super) fn omit(&mut self, count: u64) {
        self.omitted += count;
    }

    /// How long nothing is to be done, if nothing comes; `None` while nothing waits.
    pub(super) fn waits(&self, now: MonoTime) -> Option<Duration> {
        (self.current.is_some() || !self.waiting.is_empty()).then(|| self.due.since(now))
    }

    /// What is to be sent now.
    pub(super) fn due(&mut self, now: MonoTime) -> Option<&AlarmMessage> {
        if now < self.due {
            return None;
        }
        if self.current.is_none() && !self.waiting.is_empty() {
            self.count += 1;
            let message = AlarmMessage {
                hall: self.hall.clone(),
                message: format!("{}-{}", self.mark, self.count),
                alarms: std::mem::take(&mut self.waiting),
                omitted: std::mem::take(&mut self.omitted),
            };
            self.current = Some((message, 0));
        }
        self.current.as_ref().map(|(message, _)| message)
    }

    /// It was sent.
    pub(super) fn sent(&mut self, now: MonoTime) {
        self.current = None;
        self.due = now + self.every;
    }

    /// It was not sent; says if it is given up.
    pub(super) fn failed(&mut self, now: MonoTime) -> bool {
        let Some((_, failures)) = &mut self.current else { return false };
        if let Some(wait) = RETRIES.get(*failures) {
            *failures += 1;
            self.due = now + *wait;
            return false;
        }
        self.sent(now);
        true
    }
}

#[cfg(test)]
pub(super) fn alarm(text: &str) -> Alarm {
    Alarm {
        what: AlarmTurn::Raised,
        id: "controller-lost".to_owned(),
        severity: "error",
        controller: Some("A1".to_owned()),
        text: text.to_owned(),
        remedy: "look".to_owned(),
        at: "2026-11-26T19:00:00+01:00".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn s(s: u64) -> MonoTime {
        MonoTime::from_nanos(s * 1_000_000_000)
    }

    fn outbox() -> Outbox {
        Outbox::new("Hall 1", "m".to_owned(), Duration::from_secs(60))
    }

    fn texts(message: Option<&AlarmMessage>) -> Vec<String> {
        message
            .into_iter()
            .flat_map(|message| message.alarms.iter().map(|alarm| alarm.text.clone()))
            .collect()
    }

    #[test]
    fn alarms_of_a_moment_go_together_and_the_next_message_waits_its_while() {
        let mut outbox = outbox();
        assert_eq!(outbox.due(s(99)), None);
        assert_eq!(outbox.waits(s(99)), None);
        outbox.add(alarm("A1"), s(100));
        outbox.add(alarm("A2"), s(101));
        assert_eq!(outbox.due(s(101)), None);
        assert_eq!(outbox.waits(s(101)), Some(Duration::from_secs(1)));
        assert_eq!(texts(outbox.due(s(102))), ["A1", "A2"]);
        outbox.sent(s(102));
        for second in 103..120 {
            outbox.add(alarm("flaps"), s(second));
            assert_eq!(outbox.due(s(second)), None, "one message a minute");
        }
        assert_eq!(texts(outbox.due(s(162))).len(), 17);
    }

    #[test]
    fn what_cannot_be_sent_is_tried_again_a_few_times_and_given_up_and_nothing_grows_meanwhile() {
        let mut outbox = outbox();
        outbox.add(alarm("first"), s(0));
        let mut tries = Vec::new();
        for second in 2..1_000 {
            for _ in 0..10 {
                outbox.add(alarm("more"), s(second));
            }
            if tries.len() < 4
                && texts(outbox.due(s(second)))
                    == [
                        "first", "more", "more", "more", "more", "more", "more", "more", "more", "more",
                        "more",
                    ]
            {
                tries.push(second);
                assert_eq!(outbox.failed(s(second)), tries.len() == 4, "{tries:?}");
            }
        }
        assert_eq!(tries, [2, 7, 37, 157]);
        let next = outbox.due(s(2_000)).unwrap();
        assert_eq!((next.alarms.len(), next.message.as_str()), (MOST, "m-2"));
        assert_eq!(next.omitted, 10 * 997 - MOST as u64, "counted, and told");
    }
}
