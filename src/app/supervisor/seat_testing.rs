//! Begins a test of empty seats, follows it, and ends it.

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::{HallContext, ShowChange};
use super::job::Job;
use super::seat_test::SeatTest;
use super::show::ProvedShow;
use crate::control::{Code, Problem, Surface};
use crate::state::State;

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
            let remedy = "the status names the rows";
            return Err(Problem::new(Code::Unknown, format!("there is no row {row}"), remedy));
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
            Act::Go { who: "a test of the seats".to_owned(), surface: Surface::Socket },
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
