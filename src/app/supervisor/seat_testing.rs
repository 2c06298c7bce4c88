//! Begins a test of empty seats, follows it, and ends it.

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::{HallContext, ShowChange};
use super::job::Job;
use super::seat_test::SeatTest;
use super::show::ProvedShow;
use crate::control::{Code, Problem, Surface};
use crate::state::{State, Transition};

/// The test of now, or the last one.
#[derive(Debug, Default)]
pub(super) struct SeatTesting {
    pub(super) test: Option<SeatTest>,
}

impl SeatTesting {
    /// Has one made for the seats of some rows, or all. The hall has to be armed: whoever armed it has seen that nobody sits there.
    ///
    /// # Errors
    /// Where it may not be made.
    pub(super) fn make(rows: &[String], hall: &HallContext) -> Result<Vec<Act>, Problem> {
        may_test(hall)?;
        if let Some(row) = rows.iter().find(|row| !hall.settings.levels.rows.contains_key(*row)) {
            let remedy = "`kinocue status` lists the rows";
            let known = hall.settings.levels.rows.keys().map(String::as_str);
            return Err(Problem::unknown("row", row, known, remedy));
        }
        hall.is_free()?;
        let only = (!rows.is_empty()).then(|| rows.iter().cloned().collect());
        Ok(vec![Act::Start(Job::Test(only))])
    }

    /// Takes up a test that was made, and lets it go, where the hall is still armed.
    ///
    /// # Errors
    /// Where it is not.
    pub(super) fn take(
        &mut self,
        (test, cued): (Box<SeatTest>, Box<ProvedShow>),
        only: Option<std::collections::BTreeSet<String>>,
        hall: &HallContext,
    ) -> Result<Vec<Act>, Problem> {
        may_test(hall)?;
        self.test = Some(*test);
        Ok(vec![
            Act::Otherwise(vec![Act::EndTest("did not begin"), Act::Stage(ShowChange::Again)]),
            Act::Stage(ShowChange::Test(cued, only)),
            Act::Go { by: Transition::Go, who: "a test of the seats".to_owned(), surface: Surface::Socket },
        ])
    }

    /// It is over.
    pub(super) fn end(&mut self, how: &str) {
        if let Some(test) = &mut self.test {
            test.status.running = false;
            test.status.step = how.to_owned();
        }
    }
}

impl Feature for SeatTesting {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, out: &mut Vec<Act>) {
        if let SupervisorEvent::Round(table) = event
            && let Some(test) = self.test.as_mut().filter(|test| test.status.running)
        {
            let lines = test.follow(hall.live.show(), table, &hall.config, |lane| hall.settings.is_on(lane));
            out.extend(lines.into_iter().map(Act::Record));
        }
    }
}

fn may_test(hall: &HallContext) -> Result<(), Problem> {
    if hall.mirror.state == State::Armed {
        return Ok(());
    }
    let detail = format!("cannot test while {}", hall.mirror.state);
    Err(Problem::new(Code::State, detail, "load any cue and arm, with nobody on the seats, then test"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{hall, row, told};
    use crate::time::ShowTime;

    #[test]
    fn seats_are_tested_in_an_armed_hall_alone_be_it_that_it_was_one_when_the_test_was_asked_for() {
        let mut hall = hall(State::Armed, "one");
        let row = ["A".to_owned()];
        assert!(matches!(&SeatTesting::make(&row, &hall).unwrap()[..], [Act::Start(Job::Test(Some(_)))]));
        let unknown = SeatTesting::make(&["Z".to_owned()], &hall).unwrap_err();
        assert_eq!(unknown.code, Code::Unknown);
        hall.mirror.state = State::Parked;
        assert_eq!(SeatTesting::make(&row, &hall).unwrap_err().code, Code::State);
        let mut testing = SeatTesting::default();
        let made = SeatTest::make(&hall.config).unwrap();
        assert_eq!(testing.take(made, None, &hall).unwrap_err().code, Code::State);
        assert!(testing.test.is_none());
    }

    #[test]
    fn a_test_that_does_not_begin_ends_and_leaves_the_cue_before_it() {
        let hall = hall(State::Armed, "one");
        let mut testing = SeatTesting::default();
        let acts = testing.take(SeatTest::make(&hall.config).unwrap(), None, &hall).unwrap();
        let [Act::Otherwise(instead), Act::Stage(ShowChange::Test(..)), Act::Go { .. }] = &acts[..] else {
            panic!("{acts:?}")
        };
        assert!(matches!(instead[..], [Act::EndTest(_), Act::Stage(ShowChange::Again)]), "{instead:?}");
        testing.end("did not begin");
        let status = testing.test.unwrap().status;
        assert_eq!((status.running, &*status.step), (false, "did not begin"));
    }

    #[test]
    fn each_part_that_is_over_has_a_line_for_each_seat_under_test() {
        let mut hall = hall(State::Armed, "one");
        hall.settings.only = Some(["B".to_owned()].into());
        let mut testing = SeatTesting::default();
        testing.take(SeatTest::make(&hall.config).unwrap(), None, &hall).unwrap();
        let table = |acked| {
            let mut row = row(hall.now);
            (row.counts.asked, row.counts.acked) = (acked, acked);
            [row, row]
        };
        let mut lines = |ms: i64, acked: u64| {
            hall.live.on_show(ShowTime::from_millis(ms));
            told(&mut testing, &SupervisorEvent::Round(&table(acked)), &hall)
        };
        assert!(lines(0, 0).is_empty() && lines(1_500, 10).is_empty());
        let told = lines(7_500, 50);
        let [Act::Record(line)] = &told[..] else { panic!("{told:?}") };
        assert_eq!(line, "B1 a1: 40 of 40 acked, p99 -");
        let status = testing.test.unwrap().status;
        assert_eq!((status.done, status.rows.len(), status.rows[0].passed), (1, 1, true));
    }
}
