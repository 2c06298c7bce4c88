//! What is on at a seat, by its own word: where nobody asks for it, it is off within a deadline.

use super::ether::Line;
use super::hall::Hall;
use super::judge::{Breach, How};
use super::seat::{MS, REGISTERS};
use kinocue::harness::state::{State, Transition};

/// A seat that answers is dark and still this long after nobody asks for what is on there any more, nothing is in the way of its datagrams,
/// and the loops of the program run.
const DEADLINE: u64 = 4_000 * MS;
/// Frames are no farther apart than this.
const FLOWS: u64 = 1_200 * MS;
/// What weather has done to a line is over by then.
const CALM: u64 = 1_000 * MS;
/// Where a program says that a group stands so, a person has to see to it first, and no frame may go there.
const LEFT_ALONE: [&str; 3] = ["Stopped", "Error", "Excluded"];

impl Hall<'_, '_> {
    /// Somebody stops the hall, and nothing befalls anybody for as long as what is on may take to go off.
    pub(super) fn comes_to_a_calm(&mut self) {
        self.ether.calm();
        self.ask(Transition::Stop);
        self.pass((CALM + DEADLINE) / MS + 2_000);
    }

    /// Judges what is on, by the word of the seats.
    pub(super) fn judge_what_is_on(&self, now: u64) {
        let table = self.runtime.live.table();
        let plays = matches!(self.state, State::Playing(_));
        let stands_still = self.stands_still(now);
        for (seat, line) in self.ether.world().lines.iter_mut().enumerate() {
            let row = table.get(seat);
            let is_alone = row.is_none_or(|row| LEFT_ALONE.contains(&format!("{:?}", row.standing).as_str()));
            let is_lost = row.is_none_or(|row| {
                let why = format!("{:?}", row.why);
                ["Outside", "Ambiguous"].iter().any(|one| why.starts_with(one))
            });
            line.judge_what_is_on(seat, now, (plays, stands_still, is_alone || is_lost));
        }
    }
}

impl Line {
    fn judge_what_is_on(&mut self, index: usize, now: u64, (plays, stands_still, alone): (bool, bool, bool)) {
        let is_asked = plays && now < self.newest + FLOWS;
        let calm = !self.is_troubled(now, CALM);
        let seat = &mut self.seat;
        let tells = !seat.settings.shy && !seat.settings.high_first && seat.settings.axes <= REGISTERS;
        // Where it is told, and nothing else moves it.
        let vibrates = seat.shakes && tells && seat.homed && !seat.stopped && !seat.is_moving() && !alone;
        let is_on = seat.outputs != 0 || vibrates;
        if !is_on || is_asked || !calm || stands_still || seat.is_away(now) {
            seat.on_since = None;
            return;
        }
        let since = *seat.on_since.get_or_insert(now);
        if now > since + DEADLINE {
            seat.on_since = Some(u64::MAX - DEADLINE);
            let (at_ns, axis, mm, ms, frame) = (now, 0, 0.0, (DEADLINE / MS) as f64, u32::from(seat.outputs));
            seat.breaches.push(Breach { at_ns, seat: index, axis, mm, ms, how: How::LeftOn, frame });
        }
    }
}
