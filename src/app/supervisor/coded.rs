//! The stable codes of what the supervisor says itself, beside those of states, controllers and films.

use crate::control::model::words;

words! {
    /// Of what is next.
    pub(super) NextCode {
        /// GO waits for belts: whose.
        Belts = "belts",
        /// GO, or from where the show was left.
        GoFrom = "go-or-from",
        /// Arm, and it can go from there.
        ArmFrom = "arm-or-from",
        /// Park: which seats are not at park.
        ParkFirst = "park-first",
        /// Enable and park them: which are out, and not at park.
        EnableFirst = "enable-first",
        /// What preflight found is corrected first.
        Correct = "correct-findings",
    }
}

words! {
    /// Of how a controller stands.
    pub(super) StandingCode {
        /// Nobody has asked it yet.
        NotPolled = "not-polled",
        /// The configuration has it out.
        ConfiguredOut = "configured-out",
        /// Another controller of its seat stands so.
        Beside = "beside",
        /// Its drives are not where they were led.
        OffCourse = "off-course",
        /// No way leads to it.
        NoRoute = "no-route",
    }
}

words! {
    /// Of warnings: what they are called, or say.
    pub(super) WarningCode {
        /// How many acks in a minute another master got.
        AnotherMaster = "another-master",
        /// Which outputs are left on.
        LeftOn = "left-on",
        /// Its seat may vibrate.
        LeftShaking = "left-shaking",
        /// None takes part.
        NoSeat = "no-seat",
        /// How many fell silent at one instant, which are all.
        AllSilent = "all-silent",
        /// It is not, though the hall is parked or armed.
        NotAtPark = "not-at-park",
        /// Preflight was not run.
        PreflightNever = "preflight-never",
        /// It failed.
        PreflightFailed = "preflight-failed",
        /// Since when, and by whom.
        SeatOut = "seat-out",
        /// Since when, by whom, and why.
        SeatOutWhy = "seat-out-why",
        /// Which are open.
        BeltOpen = "belt-open",
        /// Nobody tells.
        BeltUntold = "belt-untold",
        /// What the system refused.
        NotRealTime = "not-real-time",
        /// What frames take of the time between ticks.
        Sending = "sending",
        /// Of a network that is broadcast to.
        Broadcast = "broadcast",
        /// Of the film.
        Film = "film",
        /// The cue follows none.
        NoFilm = "no-film",
        /// An entry of the playlist did not start.
        Playlist = "playlist",
        /// Of what shows it.
        Player = "player",
        /// Of a serial link.
        Link = "link",
        /// Of a pad.
        Buttons = "buttons",
        /// An address of this machine that is not there.
        Address = "address",
        /// A port that cannot be had.
        Port = "port",
        /// Of the other show machine, and of the engine by which it would take over.
        Pair = "pair",
        /// Of alarms that nobody was told.
        Notify = "notify",
        /// Of the recording of a show.
        RecordShow = "record-show",
        /// Of an incident.
        RecordIncident = "record-incident",
        /// Of the flight recorder.
        RecordFlight = "record-flight",
        /// Of what an earlier program left.
        RecordEarlier = "record-earlier",
        /// Of the room for recordings.
        RecordRoom = "record-room",
        /// Of the file of the settings.
        Settings = "settings",
        /// Of the journal.
        Journal = "journal",
        /// What no state says.
        Note = "note",
        /// What came back with the start.
        Kept = "kept",
    }
}

words! {
    /// Of what to do about a warning.
    pub(super) RemedyCode {
        /// Find the other machine.
        AnotherMaster = "another-master",
        /// Switch off what is on there.
        LeftOn = "left-on",
        /// Enable seats.
        NoSeat = "no-seat",
        /// Look at what all seats have in common.
        AllSilent = "all-silent",
        /// Park it.
        ParkIt = "park-it",
        /// Enable it, and park it.
        EnableIt = "enable-it",
        /// Look for the network.
        NoRoute = "no-route",
        /// Run preflight.
        Preflight = "preflight",
        /// Correct what it found.
        Correct = "correct-findings",
        /// Say in the configuration or the playlist where the film is.
        NoFilm = "no-film",
        /// Enable it once it is repaired.
        SeatOut = "seat-out",
        /// Change what should be different.
        Kept = "kept",
        /// Buckle the belt.
        Buckle = "buckle",
        /// The same, for which GO waits.
        BuckleFirst = "buckle-first",
    }
}

#[cfg(test)]
mod tests {
    //! The page has a text for every code that the hall may send, in every language but English, which is the hall's own.

    use std::collections::{BTreeMap, BTreeSet};

    use super::*;
    use crate::console;
    use crate::control::model::{Ending, Health};
    use crate::control::{Code, MarginOf, NEEDS_ENGINEER, NOT_TAKEN, Role};
    use crate::film::chase::{HoldCause, ParkCause};
    use crate::film::point::FilmState;
    use crate::film::words::FilmLed;
    use crate::health::{HealthState, Pushed as PushedAxis, Why as Standing};
    use crate::motion::Pulses;
    use crate::state::{Cause, Next, Readiness, State, Transition, Trouble, Why};

    /// A value of each variant; one that is not named does not compile.
    macro_rules! each {
        ($type:ident { $($variant:ident $(($($inner:expr),+))? $({$($field:ident: $of:expr),+})?),+ $(,)? }) => {{
            #[allow(dead_code, reason = "it only has to compile")]
            const fn is_complete(one: $type) {
                match one { $($type::$variant { .. } => (),)+ }
            }
            vec![$($type::$variant $(($($inner),+))? $({$($field: $of),+})?),+]
        }};
    }

    fn causes() -> Vec<Cause> {
        let (asked, films) = (Transition::ALL.map(Cause::Asked), FilmState::ALL.map(HoldCause::Film));
        let ready =
            each!(Readiness { NoCue, NotProved, NotPreflighted, Ready }).into_iter().map(Cause::NotReady);
        let troubles = each!(Trouble { Limiter, Planner, Deaf, Alone, Homing(0), HomingTime, ParkingTime, OtherMaster(0) });
        let over = each!(ParkCause { FilmEnded, FilmCutShort, CueLeft, HeldTooLong });
        let awaited = each!(HoldCause { Film(FilmState::Lost), Apart, Behind, Unstable, Asks });
        let mut all = each!(Cause {
            Started, Crashed, TookOver, AwayFromPark, FoundParked, Asked(Transition::Go), StoppedHoming, Homed, ArrivedAtPark, ArmLapsed,
            NotReady(Readiness::NoCue), Rebooted(0), GapOver, Joined, Late, CueEnded, PausedTooLong, GroupOut(0), EmergencyStop(0),
            Trouble(Trouble::Deaf), Cleared, Slept, FilmOver(ParkCause::CueLeft), FilmAwaited(HoldCause::Asks), FilmLeads,
        });
        all.extend(asked.into_iter().chain(ready).chain(troubles.into_iter().map(Cause::Trouble)));
        all.extend(over.into_iter().map(Cause::FilmOver));
        all.extend(films.into_iter().chain(awaited).map(Cause::FilmAwaited));
        all
    }

    fn refusals() -> Vec<Why> {
        each!(Why {
            NotIdentified,
            PositionsNotRead,
            PositionUnknown,
            HomesFirst,
            NoCue,
            NotProved,
            NotPreflighted,
            NotArmed,
            PlaysAlready,
            PausedNow,
            FilmLeads,
            Riding,
            NothingPlays,
            HomingNow,
            ParkingNow,
            StoppingNow,
            Latched,
            SeatsAnywhere,
            ArmedNow,
            StillPressed,
            StillWrong,
            NothingToClear,
        })
    }

    fn standings() -> Vec<Standing> {
        let mut all = each!(Standing {
            Acked, AcksOff, AcksMissing(0), Silent(0), NotSeenYet, SeenAgain, Moved(0), Unsure(0), CutShort(0), Astray(0), Unsteady(0),
            Unread(0), Ambiguous(0), Outside { controller: 0, axis: 1, pulses: Pulses(2) },
            Pushed { controller: 0, pushed: PushedAxis { axis: 1, at: 1_400, held: 0 } }, EmergencyStop(0), HeldUntilReset(0),
            Error { controller: 0, error: 21 }, Drive { controller: 0, axis: 1, error: 2 }, Killed { controller: 0, axis: 1, cause: 256 },
            Alarm { controller: 0, register: 0x30, value: 1 }, Refuses(0), Wide(0), OtherAxes { controller: 0, drives: 6 },
            Rebooted(0), OtherMaster(0), NotHome(0), Other(0), Gap(0), Unproved(0),
        });
        all.push(Standing::Alarm { controller: 0, register: crate::wire::DPFE, value: 1 });
        all
    }

    fn health() -> Vec<HealthState> {
        each!(HealthState { Ok, Degraded, Lost, Rejoining, Stopped, Error, Excluded, Unwatched })
    }

    /// Every key that a table has for what the hall says, with how many values its text has.
    fn keys() -> BTreeMap<String, usize> {
        let mut keys = BTreeMap::new();
        let mut add = |kind: &str, code: &str, values: usize| {
            let before = keys.insert(format!("{kind}.{code}"), values);
            assert!(
                before.is_none_or(|before| before == values),
                "{kind}.{code} has {before:?} values and {values}"
            );
        };
        State::ALL.into_iter().for_each(|state| add("state", state.word(), 0));
        Health::ALL.iter().for_each(|health| add("health", health.word(), 0));
        add("health", "disabled", 0); // the page's own, of one that a person took out
        FilmState::ALL.into_iter().for_each(|state| add("film-state", state.word(), 0));
        Ending::ALL.iter().for_each(|ending| add("ending", ending.word(), 0));
        Code::ALL.iter().for_each(|code| add("problem", code.word(), 0));
        Next::ALL.into_iter().for_each(|next| add("next", next.code(), 0));
        NextCode::ALL
            .iter()
            .for_each(|next| add("next", next.word(), usize::from(*next != NextCode::Correct)));
        causes().into_iter().for_each(|cause| add("cause", cause.code(), 0)); // whose it is goes before it
        for why in refusals() {
            add("refusal", why.code(), 0);
            add("refusal-remedy", why.code(), 0);
        }
        for why in [NEEDS_ENGINEER, NOT_TAKEN] {
            add("refusal", why, 0);
            add("refusal-remedy", why, 0);
        }
        for why in standings() {
            add("standing", why.code(), why.figures().len());
            why.next().iter().for_each(|_| add("remedy", why.code(), 0));
        }
        StandingCode::ALL.iter().for_each(|code| {
            add("standing", code.word(), usize::from(*code == StandingCode::Beside));
        });
        let warned = health().into_iter().filter(|standing| *standing != HealthState::Ok);
        warned.for_each(|standing| add("remedy", &standing.to_string(), 0));
        RemedyCode::ALL.iter().for_each(|code| add("remedy", code.word(), 0));
        for code in WarningCode::ALL {
            let values = match code {
                WarningCode::AnotherMaster
                | WarningCode::BeltOpen
                | WarningCode::LeftOn
                | WarningCode::AllSilent => 1,
                WarningCode::SeatOut => 2,
                WarningCode::SeatOutWhy => 3,
                _ => 0,
            };
            add("warning", code.word(), values);
        }
        for state in FilmState::ALL {
            for led in each!(FilmLed { Nobody, Own, Joining, Following }) {
                add("film-next", state.next(led).0, 0);
            }
        }
        MarginOf::ALL.iter().for_each(|of| add("margin", of.word(), 0));
        [Role::View, Role::Operate, Role::Engineer].iter().for_each(|role| add("role", &role.to_string(), 0));
        add("film-means", "runs", 0); // of a film that is locked, for which no cause has words
        keys
    }

    /// A table of the page.
    fn table(language: &str) -> BTreeMap<String, String> {
        let (_, bytes) = console::page(&format!("/js/lang/{language}.js")).unwrap();
        let text = std::str::from_utf8(bytes).unwrap();
        let json = text.strip_prefix("export default ").and_then(|rest| rest.strip_suffix(";\n")).unwrap();
        serde_json::from_str(json).unwrap()
    }

    /// The names of what is said in a text, in order.
    fn values(text: &str) -> Vec<&str> {
        let mut names: Vec<_> =
            text.split('{').skip(1).map(|rest| rest.split_once('}').expect("it ends").0).collect();
        names.sort_unstable();
        names
    }

    const OTHERS: [&str; 5] = ["de", "es", "fr", "ja", "zh"];

    #[test]
    fn every_language_has_every_text_of_the_page_and_every_code_of_the_hall_with_the_same_values() {
        let (english, codes) = (table("en"), keys());
        let wanted: BTreeSet<_> = english.keys().chain(codes.keys()).collect();
        assert_eq!(
            wanted.len(),
            english.len() + codes.len(),
            "the hall's own words are not in the English table"
        );
        for language in OTHERS {
            let texts = table(language);
            let has: BTreeSet<_> = texts.keys().collect();
            let missing: Vec<_> = wanted.difference(&has).collect();
            let unknown: Vec<_> = has.difference(&wanted).collect();
            assert!(missing.is_empty() && unknown.is_empty(), "{language}: not {missing:?}, but {unknown:?}");
            for (key, text) in &texts {
                let of_codes: Vec<String> =
                    (0..codes.get(key).copied().unwrap_or(0)).map(|n| n.to_string()).collect();
                match english.get(key) {
                    Some(english) => assert_eq!(values(text), values(english), "{language} {key}"),
                    None => assert_eq!(values(text), of_codes, "{language} {key}"),
                }
                assert!(!text.is_empty(), "{language} {key}");
            }
        }
    }

    /// What the page says in English of a key that is the hall's, or the page's.
    fn in_english() -> BTreeMap<String, String> {
        let mut texts = table("en");
        let mut add = |kind: &str, code: &str, text: String| texts.insert(format!("{kind}.{code}"), text);
        for next in Next::ALL {
            add("next", next.code(), next.to_string());
        }
        for cause in causes() {
            add("cause", cause.code(), cause.words().to_owned());
        }
        for why in refusals() {
            add("refusal", why.code(), why.words().to_owned());
            add("refusal-remedy", why.code(), why.remedy().to_owned());
        }
        for why in standings() {
            add("standing", why.code(), why.to_string());
            if let Some(next) = why.next() {
                add("remedy", why.code(), next.to_owned());
            }
        }
        for standing in health() {
            add("remedy", &standing.to_string(), standing.next().to_owned());
        }
        texts
    }

    #[test]
    fn an_emergency_stop_is_called_that_and_a_stop_never_is_in_any_language() {
        let emergency = [
            ("de", "Not-Halt"),
            ("es", "parada de emergencia"),
            ("fr", "arrêt d’urgence"),
            ("ja", "非常停止"),
            ("zh", "急停"),
        ];
        let forbidden =
            ["Notaus", "Not-Aus", "Notstopp", "Nothalt", "paro de emergencia", "緊急停止", "紧急停"];
        for (language, words) in emergency {
            let texts = table(language);
            for (key, english) in in_english() {
                let Some(text) = texts.get(&key) else { continue };
                let named = text.to_lowercase().contains(&words.to_lowercase());
                assert_eq!(
                    named,
                    english.to_lowercase().replace('-', " ").contains("emergency stop"),
                    "{language} {key}: {text}"
                );
                assert!(!forbidden.iter().any(|word| text.contains(word)), "{language} {key}: {text}");
            }
        }
        for key in ["stop.note", "stop.sent", "stop.received", "stop.failed", "token.note"] {
            assert!(
                OTHERS.iter().all(|language| table(language)[key].contains("STOP")),
                "{key}: STOP stays STOP"
            );
        }
    }
}
