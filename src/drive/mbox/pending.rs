//! The reads of one controller that may still be answered: for what each was made, and when. Ack thread; pure: told the time; its
//! memory is made at the start.
//!
//! Answers do not say what they answer: each is taken for that to the oldest open request of its registers, and can be no older
//! than that.

use std::collections::VecDeque;
use std::time::Duration;

use super::reads::MonitorRead;
use crate::drive::Need;
use crate::time::MonoTime;

/// An answer that comes later than this is none; so long after an answer was repeated others may be.
pub(super) const ANSWERED_WITHIN: Duration = Duration::from_secs(1);
/// An answer is lost rather than late after this.
pub(super) const LATE: Duration = Duration::from_millis(300);
/// Requests of the same registers that may be open at a time; of more the older ones count.
const OPEN: usize = 8;

/// All that is open, by the place of each read among [`MonitorRead::ALL`].
#[derive(Debug)]
pub(in crate::drive) struct Pending([VecDeque<(Need, MonoTime)>; MonitorRead::ALL.len()]);

/// What an answer is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Claim {
    /// When it was made, at the earliest.
    pub(super) oldest: MonoTime,
    /// When its registers were last asked for.
    pub(super) newest: MonoTime,
    /// Somebody waits for the packet counter alone.
    pub(super) is_count: bool,
}

impl Pending {
    pub(super) fn new() -> Self {
        Self(std::array::from_fn(|_| VecDeque::with_capacity(OPEN)))
    }

    /// Notes that a controller is asked.
    pub(super) fn asked(&mut self, read: MonitorRead, need: Need, at: MonoTime) {
        let open = self.open(read, at);
        if open.len() < OPEN {
            open.push_back((need, at));
        }
    }

    /// What an answer is to; none where nobody waits for one any more.
    pub(super) fn answered(&mut self, read: MonitorRead, at: MonoTime) -> Option<Claim> {
        let open = self.open(read, at);
        let is_count = open.iter().any(|(need, _)| *need == Need::Count);
        let (_, newest) = *open.back()?;
        let (_, oldest) = open.pop_front()?;
        Some(Claim { oldest, newest, is_count })
    }

    /// True if a request for positions has been open for so long that its answer is lost rather than late. Another would be taken for
    /// the answer to it, and so would each after that: it is asked again once nothing is open any more.
    pub(super) fn is_behind(&mut self, now: MonoTime) -> bool {
        let is_late = |read| self.open(read, now).front().is_some_and(|(_, asked)| now.since(*asked) > LATE);
        MonitorRead::POSITIONS.into_iter().any(is_late)
    }

    /// True if no further request for positions finds a place, since answers are lost.
    pub(in crate::drive) fn is_full(&mut self, now: MonoTime) -> bool {
        MonitorRead::POSITIONS.into_iter().any(|read| self.open(read, now).len() == OPEN)
    }

    /// The requests to which an answer may still come, oldest first.
    fn open(&mut self, read: MonitorRead, at: MonoTime) -> &mut VecDeque<(Need, MonoTime)> {
        let open = &mut self.0[read as usize];
        while open.front().is_some_and(|(_, asked)| at.since(*asked) > ANSWERED_WITHIN) {
            open.pop_front();
        }
        open
    }
}

#[cfg(test)]
mod tests {
    use super::MonitorRead::{FirstPositions, MorePositions, Packets};
    use super::*;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    fn claim(oldest: u64, newest: u64) -> Option<Claim> {
        Some(Claim { oldest: ms(oldest), newest: ms(newest), is_count: false })
    }

    #[test]
    fn an_answer_is_no_older_than_the_oldest_request_that_is_open_whichever_it_answers() {
        let mut pending = Pending::new();
        let asked = |pending: &mut Pending, at| pending.asked(FirstPositions, Need::Position, ms(at));
        asked(&mut pending, 250); // held back on its way
        asked(&mut pending, 500);
        assert_eq!(pending.answered(FirstPositions, ms(501)), claim(250, 500));
        assert_eq!(pending.answered(MorePositions, ms(501)), None, "of other registers");
        assert_eq!(pending.answered(FirstPositions, ms(502)), claim(500, 500));
        assert_eq!(pending.answered(FirstPositions, ms(503)), None, "it was repeated on its way");
        // One is lost: after a second nobody waits for its answer.
        asked(&mut pending, 600);
        asked(&mut pending, 1_650);
        assert_eq!(pending.answered(FirstPositions, ms(1_651)), claim(1_650, 1_650));
    }

    #[test]
    fn after_an_outage_a_seat_is_asked_again_once_no_request_from_before_is_open() {
        let mut pending = Pending::new();
        let asked: Vec<u64> = (0..20)
            .map(|round| 200 * round)
            .filter(|at| {
                let asks = !pending.is_behind(ms(*at));
                if asks {
                    pending.asked(FirstPositions, Need::Identity, ms(*at));
                }
                asks
            })
            .collect();
        assert_eq!(asked, [0, 200, 1_400, 1_600, 2_800, 3_000]);
    }

    #[test]
    fn of_more_requests_than_find_a_place_the_older_ones_count() {
        let mut pending = Pending::new();
        (0..9).for_each(|at| pending.asked(MorePositions, Need::Position, ms(at)));
        assert!(pending.is_full(ms(9)) && !pending.is_full(ms(1_001)));
        assert_eq!(pending.answered(MorePositions, ms(1_007)), claim(7, 7));
    }

    #[test]
    fn a_counter_that_is_waited_for_alone_may_be_told_by_the_answer_to_another_request_for_it() {
        let mut pending = Pending::new();
        pending.asked(Packets, Need::Identity, ms(0));
        assert!(!pending.answered(Packets, ms(1)).unwrap().is_count);
        pending.asked(Packets, Need::Identity, ms(2));
        pending.asked(Packets, Need::Count, ms(3));
        assert!(pending.answered(Packets, ms(4)).unwrap().is_count);
    }
}
