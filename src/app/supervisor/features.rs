//! The features of the supervisor: each is told what happens, and all together know what is to be done with the result of a
//! job and at the end of a show.

use super::act::{Act, Feature, ShowBegun, SupervisorEvent};
use super::figures::Figures;
use super::fleet;
use super::gear::GearLimits;
use super::hall::{HallContext, ShowChange};
use super::homing::Homing;
use super::job::{Again, JobResult};
use super::lasting::Lasting;
use super::player::FilmShown;
use super::playlist::Onward;
use super::readiness::ReadinessCheck;
use super::record::ShowRecords;
use super::recorded::HallTeller;
use super::seat_testing::SeatTesting;
use super::show::LeftAt;
use super::starts::FleetStarts;
use crate::control::{Desired, Problem, Surface};
use crate::rt::News;
use crate::settings::LoadedShow;
use crate::time::ShowTime;

/// All of them.
#[derive(Debug)]
pub(super) struct Features {
    pub(super) onward: Onward,
    pub(super) homing: Homing,
    pub(super) seats: SeatTesting,
    pub(super) readiness: ReadinessCheck,
    pub(super) lasting: Lasting,
    pub(super) gear: GearLimits,
    pub(super) starts: FleetStarts,
    pub(super) records: ShowRecords,
    pub(super) figures: Figures,
    pub(super) shown: FilmShown,
    pub(super) teller: HallTeller,
}

impl Features {
    /// Those of a hall that has just opened.
    pub(super) fn new(records: ShowRecords, lasting: Lasting) -> Self {
        Self {
            onward: Onward::default(),
            homing: Homing::default(),
            seats: SeatTesting::default(),
            readiness: ReadinessCheck::default(),
            lasting,
            gear: GearLimits::default(),
            starts: FleetStarts::default(),
            records,
            figures: Figures::default(),
            shown: FilmShown::default(),
            teller: HallTeller::default(),
        }
    }

    /// Tells all of them what happens; gives what is to be done for it.
    pub(super) fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext) -> Vec<Act> {
        let Self {
            onward,
            homing,
            seats,
            lasting,
            gear,
            starts,
            records,
            figures,
            shown,
            teller,
            readiness: _,
        } = self;
        let all: [&mut dyn Feature; 10] =
            [onward, homing, seats, lasting, gear, starts, records, figures, shown, teller];
        let mut out = Vec::new();
        all.into_iter().for_each(|feature| feature.on(event, hall, &mut out));
        out
    }

    /// True if it may be done for whom it is asked for.
    ///
    /// # Errors
    /// Where it comes by the fleet and is not for it, or the hall has no such thing.
    pub(super) fn may_ask(&self, desired: &Desired, hall: &HallContext) -> Result<(), Problem> {
        fleet::may_ask(desired, hall)?;
        self.gear.may_ask(desired, hall)
    }

    /// Takes what a job has come to.
    ///
    /// # Errors
    /// Where it has come to nothing, or may not be taken up any more.
    pub(super) fn take(&mut self, result: JobResult, hall: &HallContext) -> Result<Vec<Act>, Problem> {
        match result {
            JobResult::Loaded(cued) => {
                let cued = cued?;
                hall.may("load").map(|()| vec![Act::Stage(ShowChange::Cue(cued, None))])
            }
            JobResult::Listed(listed) => self.onward.take_list(listed?, hall),
            JobResult::Entry(entry, cued) => self.onward.take_entry(entry, cued, hall),
            JobResult::Reached(entry) => Ok(self.onward.enter(entry, hall)),
            JobResult::Again(again) => Ok(self.take_again(again, hall)),
            JobResult::Tested(made, only) => self.seats.take(made?, only, hall),
            JobResult::Preflighted(preflighted) => {
                self.readiness.preflighted = Some(*preflighted);
                Ok(Vec::new())
            }
            JobResult::Homed(finding) => Ok(self.homing.take(finding, hall)),
        }
    }

    /// Takes up what was loaded before. A playlist that has gone leaves the cue.
    fn take_again(&mut self, again: Again, hall: &HallContext) -> Vec<Act> {
        let Some(((list, cued), before)) = self.lasting.take(again, hall) else { return Vec::new() };
        if hall.cued.is_some() {
            return Vec::new(); // a person has loaded another meanwhile
        }
        if let (Ok(cued), Some(before)) = (&cued, &before)
            && self.lasting.is_taken_over
            && before.sha256 != cued.sha256
        {
            return vec![Act::Note(another_file(before, &cued.sha256))];
        }
        let mut acts = Vec::new();
        match list {
            Some(Ok(list)) => self.onward.list = Some(*list),
            Some(Err(problem)) => acts.push(Act::Note(problem.to_string().replace('\n', "; "))),
            None => {}
        }
        acts.push(match cued {
            Ok(mut cued) => {
                // Nor is a place in another film one in this one: the playlist of another machine may say so.
                let is_taken_over = self.lasting.is_taken_over;
                let same = before.filter(|before| {
                    let led_by = (before.begins_ms, before.movie.clone());
                    before.sha256 == cued.sha256 && (!is_taken_over || led_by == cued.led_by())
                });
                let film = same.and_then(|before| before.film_ms).map(ShowTime::from_millis);
                // One that is shown from here was shown by the machine that is gone.
                let runs = self.lasting.ride.filter(|_| cued.movie.is_none());
                let runs_since = runs.and_then(|ride| ride.runs_since);
                cued.left_at = film.map(|film| LeftAt { film, runs_since });
                Act::Stage(ShowChange::Cue(cued, None))
            }
            Err(problem) => Act::Fail(problem),
        });
        acts
    }

    /// What is to be done for news of the tick thread about a start at an instant.
    pub(super) fn on_news(&mut self, news: News, hall: &HallContext) -> Vec<Act> {
        match news {
            News::Started => {
                let (who, counted) = self.starts.begun(hall);
                let place = self.onward.place(hall);
                vec![Act::Begin(Box::new(ShowBegun { who, surface: Surface::Fleet, counted, place }))]
            }
            News::CalledOff(why) => self.starts.called_off(why, hall),
            _ => Vec::new(),
        }
    }

    /// The engine is done, or rests for good: the next show needs another.
    pub(super) fn end_show(&mut self, hall: &mut HallContext) -> Vec<Act> {
        let played = self.records.is_under_way();
        self.records.end(hall);
        if hall.is_closing() {
            // There is no next show in this hall, and soon no tick thread to take it.
            return Vec::new();
        }
        if !played {
            // Seats were brought to park between shows: what is next stays as it is.
            return vec![Act::Stage(ShowChange::Again)];
        }
        if hall.aside.is_some() {
            let how = if hall.ended.completes() { "completed" } else { "stopped" };
            return vec![Act::EndTest(how), Act::Stage(ShowChange::Rewind)];
        }
        hall.keep_place();
        self.onward.on_show_over(hall)
    }
}

/// That a cue of the machine that led before is another one here.
fn another_file(before: &LoadedShow, sha256: &str) -> String {
    let short = |sha256: &str| sha256.get(..8).unwrap_or(sha256).to_owned();
    let place = before.film_ms.map(|ms| format!(", at {}", ShowTime::from_millis(ms))).unwrap_or_default();
    let LoadedShow { cue, sha256: theirs, .. } = before;
    format!(
        "{cue} is not loaded: the file here (SHA-256 {}) is another than the one that was played before{place} (SHA-256 {}); bring that file \
         here, or load {cue} as it is here",
        short(sha256),
        short(theirs)
    )
}
