//! A start that waits for its instant. The tick thread alone decides when it is there, by its own clock and grid: nobody who is held up can
//! make it late, and no wall clock that is set can move it. Tick thread.

use std::time::Duration;

use crate::time::{MonoTime, ShowTime, Tick};

/// So long before the first frame seats are read for it, longer than a motion waits for those that do not answer.
const READS_AHEAD: Duration = Duration::from_millis(450);
/// A tick that wakes up later than this starts nothing.
const LATEST: Duration = Duration::from_millis(50);

/// Why no start came of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartOff {
    /// It was called off.
    Asked,
    /// The hall is not armed any more, or a film leads its show.
    NotArmed,
    /// The tick at which its first frame was due was not there in time, or what is loaded does not begin at a tick.
    Late,
}

/// What becomes of it in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StartTurn {
    /// None waits, or it is far.
    Waits,
    /// Its first frame is near: seats are read for it.
    Near,
    /// Its first frame is due at this tick.
    Due,
    /// It will not come.
    Off(StartOff),
}

/// The start that is held; none by default.
#[derive(Debug, Default)]
pub(super) struct TimedStart {
    /// When the film is at its beginning.
    film_zero: Option<MonoTime>,
}

impl TimedStart {
    pub(super) const NONE: Self = Self { film_zero: None };

    /// Holds one from now on.
    pub(super) const fn hold(&mut self, film_zero: MonoTime) {
        self.film_zero = Some(film_zero);
    }

    /// Drops it; says whether there was one.
    pub(super) const fn call_off(&mut self) -> bool {
        self.film_zero.take().is_some()
    }

    /// What becomes of it in a tick, where the film of what is loaded is at `film` in the first frame. It begins at the very tick that
    /// shows that of the film, or not at all: one that is overslept is never made up for.
    pub(super) fn turn(&mut self, tick: &Tick, film: ShowTime, is_armed: bool) -> StartTurn {
        let Some(film_zero) = self.film_zero else { return StartTurn::Waits };
        let begins = MonoTime::from_nanos(film_zero.as_nanos().saturating_add_signed(film.as_nanos()));
        if is_armed && tick.deadline < begins {
            let is_near = begins.since(tick.deadline) <= READS_AHEAD;
            return if is_near { StartTurn::Near } else { StartTurn::Waits };
        }
        self.film_zero = None;
        match tick.deadline == begins && tick.late <= LATEST {
            _ if !is_armed => StartTurn::Off(StartOff::NotArmed),
            true => StartTurn::Due,
            false => StartTurn::Off(StartOff::Late),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::harness::{Event, ORIGIN, Played, Virtual, swell};
    use crate::rt::News;
    use crate::state::Transition;
    use crate::time::{Rate, TickGrid};
    use crate::timeline::Hint;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// An armed hall whose show begins at the first tick from `film_zero` on.
    fn armed(hz: f64, leads: &[Duration], film_zero: MonoTime) -> (Virtual, u64) {
        let rate = Rate::from_hz(hz);
        let lead = leads.iter().max().copied().unwrap_or_default();
        let (index, first) = TickGrid::new(ORIGIN, rate).first_from(film_zero.before(lead));
        let start = ShowTime::ZERO + first.since(film_zero.before(lead));
        let show = Virtual::new(swell(3, 6, 60.0, 0.25)).at_rate(hz);
        let to = (0..leads.len().max(1)).map(|lane| format!("127.0.0.1:{}", 7408 + lane)).collect();
        (Virtual { start, armed: true, leads: leads.to_vec(), to, at_most: 20_000, ..show }, index)
    }

    fn came_of(played: &Played) -> Vec<Option<StartOff>> {
        let of = |news: &News| match news {
            News::Started => Some(None),
            News::CalledOff(why) => Some(Some(*why)),
            _ => None,
        };
        played.news.iter().filter_map(of).collect()
    }

    #[test]
    fn the_film_is_at_its_beginning_at_the_instant_and_the_seats_move_as_by_a_go() {
        for hz in [24.0, 60.0, 100.0, 1000.0] {
            for (offset_ns, leads) in [
                (1_000_000_000_u64, vec![]),
                (1_000_000_001, vec![]),
                (1_003_333_333, vec![]),
                (1_009_999_999, vec![ms(0), ms(130)]),
                (2_345_678_901, vec![ms(250), ms(0)]),
            ] {
                let film_zero = ORIGIN + Duration::from_nanos(offset_ns);
                let (show, index) = armed(hz, &leads, film_zero);
                let start = show.start;
                let played = show.with(3, Event::StartAt(film_zero)).play();
                assert_eq!(came_of(&played), [None], "{hz} Hz, {offset_ns}");
                let by_go = Virtual { armed: false, ..armed(hz, &leads, film_zero).0 }.play();
                let bytes = |played: &Played| -> Vec<_> {
                    played.frames.iter().map(|frame| (frame.lane, frame.bytes.clone())).collect()
                };
                assert!(bytes(&played) == bytes(&by_go), "{hz} Hz, {offset_ns}: frame by frame");
                let first = played.frames[0].at;
                assert_eq!(first, ORIGIN + played.rate.offset(index), "{hz} Hz, {offset_ns}");
                let lead = leads.iter().max().copied().unwrap_or_default();
                assert_eq!(first + lead, film_zero + Duration::from_nanos(start.as_nanos().unsigned_abs()));
                // A seat that is on the cue is where the film is when its frame ends, and so much later as it is led ahead.
                for lane in 0..leads.len().max(1) {
                    let ahead = leads.get(lane).copied().unwrap_or_default();
                    let (frames, mm) = (played.lane(lane).collect::<Vec<_>>(), played.positions_mm(lane, 0));
                    let on_cue = (frames.iter().zip(mm)).filter(|(frame, _)| {
                        let film_s = (frame.at + ahead).since(film_zero).as_secs_f64();
                        (3.0..5.0).contains(&film_s)
                    });
                    let mut seen = 0;
                    for (frame, mm) in on_cue {
                        let ends = frame.at + ms(frame.request.time_ms.into()) + ahead;
                        let pose = played
                            .timeline
                            .sample(ShowTime::ZERO + ends.since(film_zero), &mut Hint::default());
                        // Whole milliseconds of Time are up to half of one off the grid.
                        assert!((mm - 150.0 * pose[0]).abs() < 0.1, "{hz} Hz, {offset_ns}: {mm} mm");
                        seen += 1;
                    }
                    assert!(f64::from(seen) > hz, "{hz} Hz, {offset_ns}: {seen}");
                }
            }
        }
    }

    #[test]
    fn a_start_whose_instant_has_passed_is_called_off_and_never_made_up_for() {
        let film_zero = ORIGIN + ms(2_003);
        let (_, index) = armed(100.0, &[], film_zero);
        let play = |event: Event, at: u64| {
            let show = armed(100.0, &[], film_zero).0.with(3, Event::StartAt(film_zero));
            show.with(at, event).with(1_000, Event::Leave).play()
        };
        // Overslept by a tick, by many, and, though the tick is the one, by too much for any start.
        for late in [10, 15, 60, 700] {
            let played = play(Event::Late(ms(late)), index);
            assert_eq!(came_of(&played), [Some(StartOff::Late)], "{late} ms");
            assert!(played.frames.is_empty(), "{late} ms");
        }
        let played = play(Event::Late(ms(9)), index);
        assert_eq!((came_of(&played), played.frames.len() > 100), (vec![None], true), "late, but this tick");
        let played = play(Event::Late(ms(700)), index - 80);
        assert_eq!(came_of(&played), [None], "ticks that are missed before it change nothing");
        let slow = Tick { index: 4, deadline: ORIGIN, late: ms(51), missed: 0 };
        let mut held = TimedStart { film_zero: Some(ORIGIN) };
        assert_eq!(held.turn(&slow, ShowTime::ZERO, true), StartTurn::Off(StartOff::Late));
        let played = armed(100.0, &[], film_zero).0.with(index + 5, Event::StartAt(film_zero));
        let played = played.with(1_000, Event::Leave).play();
        assert_eq!((came_of(&played), played.frames.len()), (vec![Some(StartOff::Late)], 0));
    }

    #[test]
    fn a_hall_that_is_held_up_until_just_before_the_instant_starts_with_the_film_where_it_is() {
        let film_zero = ORIGIN + ms(2_003);
        let (_, index) = armed(100.0, &[], film_zero);
        let bytes = |late: Option<(u64, u64)>| -> Vec<_> {
            let show = armed(100.0, &[], film_zero).0.with(3, Event::StartAt(film_zero));
            let show = match late {
                Some((before, late)) => show.with(index - before, Event::Late(ms(late))),
                None => show,
            };
            let played = show.with(1_000, Event::Leave).play();
            assert_eq!(came_of(&played), [None], "{late:?}");
            played.frames.iter().map(|frame| frame.bytes.clone()).collect()
        };
        let undisturbed = bytes(None);
        // As much of the tick before it, of three, and of nine is slept through.
        for late in [(1, 12), (1, 19), (3, 31), (9, 95)] {
            assert!(bytes(Some(late)) == undisturbed, "{late:?}");
        }
    }

    #[test]
    fn whoever_takes_the_hall_out_of_armed_wins_and_so_does_a_person_who_lets_it_go() {
        let film_zero = ORIGIN + ms(2_003);
        let play = |event: Event| {
            // Up to the very tick of the start: what is asked is taken before it.
            let (_, index) = armed(100.0, &[], film_zero);
            [4, index - 1, index].map(|at| {
                let show = armed(100.0, &[], film_zero).0.with(3, Event::StartAt(film_zero));
                show.with(at, event).with(at + 500, Event::Leave).play()
            })
        };
        for ask in [Event::Stop, Event::Ask(Transition::Disarm), Event::Ask(Transition::Park)] {
            for played in play(ask) {
                assert_eq!(came_of(&played), [Some(StartOff::NotArmed)], "{ask:?}");
                assert!(played.frames.is_empty(), "{ask:?}");
            }
        }
        for played in play(Event::CallOff) {
            assert_eq!((came_of(&played), played.frames.len()), (vec![Some(StartOff::Asked)], 0));
        }
        for played in play(Event::Ask(Transition::Go)) {
            assert_eq!(came_of(&played), [Some(StartOff::NotArmed)]);
            assert!(played.frames.len() > 100 && played.frames[0].at <= film_zero + ms(10));
        }
    }

    #[test]
    fn a_show_that_does_not_begin_at_a_tick_is_not_started() {
        let film_zero = ORIGIN + ms(2_003);
        let mut show = armed(100.0, &[], film_zero).0;
        show.start += Duration::from_nanos(1);
        let played = show.with(3, Event::StartAt(film_zero)).with(1_000, Event::Leave).play();
        assert_eq!((came_of(&played), played.frames.len()), (vec![Some(StartOff::Late)], 0));
    }
}
