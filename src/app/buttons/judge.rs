//! Presses out of what a pad says: a press, and no bounce of its contact, no key that is held, and none that was down before
//! anybody listened. Time is an argument.

use std::time::Duration;

use super::event::{InputEvent, InputKind};
use crate::config::{ButtonPad, PadWord};
use crate::time::MonoTime;

/// A device that is plugged in, or opened, tells first which keys are down, and that looks as if they were pressed.
const SETTLES: Duration = Duration::from_millis(500);
/// The second press of GO comes in this time, as on the page; one that comes sooner is that of a double press.
const SURE_WITHIN: Duration = Duration::from_secs(3);
const SURE_AFTER: Duration = Duration::from_millis(250);

/// What a press comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Press {
    /// Of STOP, or of nobody knows what: it stops at once.
    Stop,
    /// Of what is asked of the hall, and when it was pressed.
    Ask(PadWord, MonoTime),
    /// Of GO, which waits for the second one.
    AsksAgain,
    /// Of GO where nobody has armed the hall.
    NotArmed,
}

/// A key, what it asks, and when it moved last.
#[derive(Debug)]
struct PadKey {
    code: u16,
    word: PadWord,
    moved: Option<MonoTime>,
}

/// Tells presses of one device, from when it was opened.
#[derive(Debug)]
pub(super) struct PressJudge {
    keys: Vec<PadKey>,
    debounce: Duration,
    opened: MonoTime,
    /// When GO was pressed for the first time.
    asked: Option<MonoTime>,
}

impl PressJudge {
    /// One of a pad that was opened then.
    pub(super) fn new(pad: &ButtonPad, opened: MonoTime) -> Self {
        let key = |&(code, word)| PadKey { code, word, moved: None };
        let keys = pad.keys.iter().map(key).collect();
        Self { keys, debounce: pad.debounce, opened, asked: None }
    }

    /// What an event comes to. A stop is told before anything is looked at, `is_armed` among it.
    pub(super) fn take(
        &mut self,
        event: InputEvent,
        now: MonoTime,
        is_armed: impl FnOnce() -> bool,
    ) -> Option<Press> {
        let (code, is_down) = match event.kind {
            InputKind::Down(code) => (code, true),
            InputKind::Up(code) => (code, false),
            // What is lost may have been a stop.
            InputKind::Dropped if self.keys.iter().any(|key| key.word == PadWord::Stop) => {
                return Some(Press::Stop);
            }
            InputKind::Dropped | InputKind::Other => return None,
        };
        let key = self.keys.iter_mut().find(|key| key.code == code)?;
        if key.word == PadWord::Stop {
            self.asked = None;
            return is_down.then_some(Press::Stop);
        }
        let at = event.at.min(now);
        let bounces = key.moved.replace(at).is_some_and(|before| at.since(before) < self.debounce);
        if !is_down || bounces || at.since(self.opened) < SETTLES {
            return None;
        }
        let word = key.word;
        self.press(word, at, is_armed)
    }

    fn press(&mut self, word: PadWord, at: MonoTime, is_armed: impl FnOnce() -> bool) -> Option<Press> {
        let asked = self.asked.take();
        if word != PadWord::Go {
            return Some(Press::Ask(word, at));
        }
        if !is_armed() {
            return Some(Press::NotArmed);
        }
        match asked.map(|first| at.since(first)) {
            Some(after) if after < SURE_AFTER => {
                self.asked = asked;
                None
            }
            Some(after) if after <= SURE_WITHIN => Some(Press::Ask(word, at)),
            _ => {
                self.asked = Some(at);
                Some(Press::AsksAgain)
            }
        }
    }

    /// True while GO waits for its second press; what was asked of a hall that is not armed any more is forgotten.
    pub(super) fn waits_for_go(&mut self, now: MonoTime, is_armed: bool) -> bool {
        self.asked = self.asked.filter(|first| is_armed && now.since(*first) <= SURE_WITHIN);
        self.asked.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::super::event::{beat, key, read};
    use super::*;
    use crate::config::PadDevice;

    const GO: u16 = 2;
    const STOP: u16 = 1;
    const PAUSE: u16 = 3;
    const MARK: u16 = 4;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    fn judge() -> PressJudge {
        let pad = ButtonPad {
            name: "desk".to_owned(),
            device: PadDevice::Event("/dev/input/event3".into()),
            keys: vec![
                (GO, PadWord::Go),
                (STOP, PadWord::Stop),
                (PAUSE, PadWord::Pause),
                (MARK, PadWord::Mark),
            ],
            lamps: Vec::new(),
            debounce: Duration::from_millis(30),
        };
        PressJudge::new(&pad, ms(0))
    }

    /// What bytes come to that the kernel gave then, and that are read at once.
    fn press(judge: &mut PressJudge, code: u16, value: i32, at_ms: u64) -> Option<Press> {
        judge.take(read(&key(code, value, ms(at_ms))), ms(at_ms), || true)
    }

    #[test]
    fn a_press_asks_once_however_its_contact_bounces_and_however_long_it_is_held() {
        let mut judge = judge();
        assert_eq!(press(&mut judge, PAUSE, 1, 1_000), Some(Press::Ask(PadWord::Pause, ms(1_000))));
        for (value, at) in
            [(0, 1_003), (1, 1_006), (0, 1_009), (1, 1_012), (2, 1_300), (2, 1_330), (2, 9_000)]
        {
            assert_eq!(press(&mut judge, PAUSE, value, at), None, "{value} at {at}");
        }
        for (value, at) in [(0, 9_100), (1, 9_110), (0, 9_120)] {
            assert_eq!(
                press(&mut judge, PAUSE, value, at),
                None,
                "it bounces as it is let go, too: {value} at {at}"
            );
        }
        assert_eq!(press(&mut judge, PAUSE, 1, 9_160), Some(Press::Ask(PadWord::Pause, ms(9_160))));
        assert_eq!(
            press(&mut judge, MARK, 1, 9_161),
            Some(Press::Ask(PadWord::Mark, ms(9_161))),
            "each key by itself"
        );
        assert_eq!(press(&mut judge, 30, 1, 9_900), None, "a key that asks nothing");
    }

    #[test]
    fn a_key_that_was_down_before_anybody_listened_asks_nothing_until_it_is_pressed_anew() {
        // Held as the device is opened, so that the kernel tells of it no more than repeats and its release.
        let mut held = judge();
        for (value, at) in [(2, 600), (2, 700), (0, 800)] {
            assert_eq!(press(&mut held, PAUSE, value, at), None);
        }
        assert!(press(&mut held, PAUSE, 1, 900).is_some());
        // Held as it is plugged in, of which its first report makes a press.
        let mut plugged = judge();
        for (value, at) in [(1, 0), (2, 900), (0, 1_000)] {
            assert_eq!(press(&mut plugged, PAUSE, value, at), None);
        }
        assert!(press(&mut plugged, PAUSE, 1, 1_100).is_some());
        // What it said before it was opened.
        let mut late = judge();
        late.opened = ms(5_000);
        assert_eq!(late.take(read(&key(PAUSE, 1, ms(4_000))), ms(5_600), || true), None);
    }

    #[test]
    fn go_wants_two_presses_of_a_hall_that_a_person_has_armed_in_between_of_nothing_else() {
        let mut judge = judge();
        let go = |judge: &mut PressJudge, at| {
            let pressed = press(judge, GO, 1, at);
            press(judge, GO, 0, at + 40);
            pressed
        };
        let goes = |at| Some(Press::Ask(PadWord::Go, ms(at)));
        assert_eq!(go(&mut judge, 1_000), Some(Press::AsksAgain));
        assert_eq!(go(&mut judge, 1_200), None, "a double press is no second thought");
        assert_eq!(go(&mut judge, 1_300), goes(1_300));
        assert_eq!(go(&mut judge, 1_600), Some(Press::AsksAgain), "it has gone");
        assert_eq!(go(&mut judge, 4_601), Some(Press::AsksAgain), "too late");
        for (other, at) in [(PAUSE, 10_000), (MARK, 11_000), (STOP, 12_000)] {
            assert_eq!(go(&mut judge, at), Some(Press::AsksAgain));
            press(&mut judge, other, 1, at + 300);
            press(&mut judge, other, 0, at + 340);
            assert_eq!(go(&mut judge, at + 400), Some(Press::AsksAgain), "{other} came between");
            assert!(!judge.waits_for_go(ms(at + 500), false), "it was disarmed");
        }
        let at = ms(20_000);
        assert_eq!(judge.take(read(&key(GO, 1, at)), at, || false), Some(Press::NotArmed));
        assert_eq!(go(&mut judge, 20_300), Some(Press::AsksAgain), "the press before it counts for nothing");
        assert!(judge.waits_for_go(ms(20_400), true) && !judge.waits_for_go(ms(23_301), true));
    }

    #[test]
    fn stop_acts_on_its_press_whatever_else_is_so() {
        let mut judge = judge();
        let mut stop = |value, at| {
            judge.take(read(&key(STOP, value, ms(at))), ms(at + 60_000), || panic!("it asks nobody"))
        };
        for at in [0, 1, 2, 3, 700] {
            assert_eq!(
                stop(1, at),
                Some(Press::Stop),
                "as soon as it is there, and however late it is read: {at}"
            );
        }
        assert_eq!((stop(2, 800), stop(0, 900)), (None, None));
        assert_eq!(judge.take(read(&beat()), ms(1_000), || true), None);
    }

    #[test]
    fn what_the_kernel_had_no_room_for_counts_as_a_stop_of_a_pad_that_has_one() {
        let lost = InputEvent { at: ms(1_000), kind: InputKind::Dropped };
        let mut with = judge();
        assert_eq!(with.take(lost, ms(1_000), || true), Some(Press::Stop));
        with.keys.retain(|key| key.word != PadWord::Stop);
        assert_eq!(with.take(lost, ms(1_000), || true), None);
    }
}
