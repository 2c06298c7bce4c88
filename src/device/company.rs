//! Before a seat is moved, or what it holds is written: whether somebody else sends to it, by its count of datagrams (DP34), or by
//! that it moves.

use std::time::Duration;

use super::settings::Values;
use super::survey::told;
use super::talk::Link;
use super::{Address, Fault, Patience, Request, RequestOutcome, Talk, places, position_words_of, reads};
use crate::config::{Controller, Station};
use crate::motion::{AxisGeometry, Pulses};
use crate::time::Clock;
use crate::wire::{Dialect, position};

/// Datagrams that the controller received; SMC alone.
const PACKETS: Address = Address::Dp(0x34);
/// From the first count to the second: whoever asks at rest does so four times a second.
const BETWEEN: Duration = Duration::from_millis(800);
/// So often one that counts nothing is looked at again: in a show it may rest for a moment.
const AGAIN: usize = 4;
const PATIENCE: Patience = Patience { timeout: Duration::from_millis(200), tries: 3 };
/// A network may double one datagram.
const TOLERATED: u16 = 1;
/// So far, strokes, no servo wanders that holds its place.
const MOVES: f64 = 0.001;

/// What one controller shows of others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Company {
    /// Its place in the conversation.
    pub(crate) lane: usize,
    /// Datagrams that it received and that were not sent from here; 0 where it does not tell.
    pub(crate) packets: u16,
    /// Its seat was elsewhere at a later reading.
    pub(crate) moves: bool,
}

/// Looks at `lanes` for about a second, and for three where one of them counts nothing; nothing else is sent meanwhile. Gives what they
/// show, in their order. One that does not answer shows nothing.
///
/// # Panics
/// If a lane is not among `controllers`.
pub(crate) fn company<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    controllers: &[Controller<Station>],
    lanes: &[usize],
) -> Vec<Company> {
    let times = if lanes.iter().all(|lane| counts(&controllers[*lane])) { 1 } else { AGAIN };
    let first = look(talk, controllers, lanes);
    let mut found: Vec<_> = lanes.iter().map(|&lane| Company { lane, packets: 0, moves: false }).collect();
    for nth in 0..times {
        let until = talk.now() + BETWEEN;
        talk.wait(until, &mut |_, _, _| {});
        for ((one, first), again) in found.iter_mut().zip(&first).zip(look(talk, controllers, lanes)) {
            if nth == 0 {
                one.packets = first.surplus(&again);
            }
            one.moves |= first.differs(&again, &controllers[one.lane]);
        }
    }
    found
}

/// What one controller told at once.
#[derive(Debug, Clone, Default)]
struct Look {
    values: Values,
    /// Datagrams that went out for it, at most.
    sent: u16,
    /// Those among them that asked for the count, before all else.
    counting: u16,
}

impl Look {
    fn surplus(&self, later: &Self) -> u16 {
        let [first, second] = [self, later].map(|look| look.values.get(&PACKETS).copied());
        let Some(grown) = first.zip(second).map(|(first, second)| second.wrapping_sub(first)) else {
            return 0;
        };
        // The first count has counted what asked for it, the later one nothing of what came after it.
        let ours = self.sent.saturating_add(later.counting).saturating_sub(1);
        if grown > ours.saturating_add(TOLERATED) { grown - ours } else { 0 }
    }

    fn differs(&self, later: &Self, controller: &Controller<Station>) -> bool {
        let (seat, dialect) = (&controller.seat, controller.connection.dialect);
        let words = |look: &Self| position_words_of(&look.values, seat.axes);
        let Some((first, second)) = words(self).zip(words(later)) else { return false };
        let moved =
            first.into_iter().zip(second).map(|pair| <[_; 2]>::from(pair).map(|it| position(it, dialect)));
        let far = |([was, is], axis): ([Pulses; 2], &AxisGeometry)| {
            f64::from(was.0.abs_diff(is.0)) > MOVES * axis.stroke_pulses()
        };
        moved.zip(seat.own()).any(far)
    }
}

fn counts(controller: &Controller<Station>) -> bool {
    controller.connection.dialect == Dialect::Smc
}

fn look<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    controllers: &[Controller<Station>],
    lanes: &[usize],
) -> Vec<Look> {
    let mut requests: Vec<(usize, Request)> = Vec::new();
    for &lane in lanes {
        requests.extend(counts(&controllers[lane]).then(|| (lane, Request::read(PACKETS))));
        let places: Vec<_> = places(controllers[lane].seat.axes).collect();
        requests.extend(reads(&places).into_iter().map(|read| (lane, read)));
    }
    let mut found = vec![Look::default(); controllers.len()];
    for RequestOutcome { lane, request, result } in talk.ask(requests, PATIENCE) {
        let tries = match &result {
            Ok(answer) => answer.tries,
            Err(Fault::Silent { tries, .. }) => *tries,
            Err(_) => 1,
        };
        let tries = u16::try_from(tries).unwrap_or(u16::MAX);
        found[lane].sent = found[lane].sent.saturating_add(tries);
        if request == Request::read(PACKETS) {
            found[lane].counting = tries;
        }
        if let Ok(answer) = result {
            found[lane].values.extend(told(&request, &answer));
        }
    }
    lanes.iter().map(|lane| std::mem::take(&mut found[*lane])).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::config::from_to_args;
    use crate::device::testing::Rig;
    use crate::sim::Setup;

    fn controllers() -> Vec<Controller<Station>> {
        from_to_args(&["127.0.0.1:7408,axes=3".to_owned()], &[], 6).unwrap().stations()
    }

    /// What one shows whose answers are changed on the way.
    fn shown(change: impl FnMut(usize, Vec<u8>) -> Vec<Vec<u8>> + 'static) -> Company {
        let rig = Rig::of(vec![Setup::default()]);
        rig.filter(change);
        company(&mut rig.talk(), &controllers(), &[0])[0]
    }

    #[test]
    fn a_controller_that_is_alone_with_us_shows_nobody_also_where_answers_are_lost() {
        let alone = Company { lane: 0, packets: 0, moves: false };
        assert_eq!(shown(|_, reply| vec![reply]), alone);
        assert_eq!(shown(|nth, reply| if nth % 3 == 1 { vec![reply] } else { vec![] }), alone);
    }

    #[test]
    fn datagrams_beyond_ours_are_counted_and_a_doubled_one_is_not() {
        for (more, shown_of_it) in [(1, 0), (2, 2), (40, 40)] {
            let asked = Cell::new(0);
            let found = shown(move |_, mut reply| {
                // One word of DP34.
                if reply.len() == 18 {
                    asked.set(asked.get() + 1);
                    reply[17] += if asked.get() == 2 { more } else { 0 };
                }
                vec![reply]
            });
            assert_eq!(found.packets, shown_of_it, "{more}");
        }
    }

    #[test]
    fn one_that_counts_nothing_is_looked_at_long_enough_for_a_seat_that_rests_for_a_moment_of_its_show() {
        let mbox =
            from_to_args(&["127.0.0.1:7408,axes=3,dialect=mbox".to_owned()], &[], 6).unwrap().stations();
        for (moves_at, moves) in [(5, true), (99, false)] {
            let rig = Rig::of(vec![Setup { dialect: Dialect::Mbox, ..Setup::default() }]);
            let asked = Cell::new(0);
            rig.filter(move |_, mut reply| {
                asked.set(asked.get() + 1);
                // The upper word of its first axis, which comes first.
                reply[17] += if asked.get() >= moves_at { 40 } else { 0 };
                vec![reply]
            });
            assert_eq!(company(&mut rig.talk(), &mbox, &[0])[0].moves, moves, "{moves_at}");
        }
    }

    #[test]
    fn a_seat_that_moves_is_told_and_one_that_hunts_about_its_place_is_not() {
        // The lower word of its first axis, and the upper one.
        for (octet, moves) in [(17, false), (19, true)] {
            let asked = Cell::new(0);
            let found = shown(move |_, mut reply| {
                if reply.len() > 18 {
                    asked.set(asked.get() + 1);
                    reply[octet] += if asked.get() == 2 { 40 } else { 0 };
                }
                vec![reply]
            });
            assert_eq!(found.moves, moves);
        }
    }
}
