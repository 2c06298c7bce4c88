//! All of the room together: sources that lie, stop, jump and go, and what the seats are allowed to do by them.

use std::sync::Arc;
use std::time::Duration;

use super::chase::{Chase, ChaseInput, ChaseRules, ChaseState, ChaseVerdict, FilmLeave};
use super::chooser::{Chooser, SourceView};
use super::follower::PaceLimits;
use super::follower::tests::tries;
use super::observation::{FilmWord, Observation};
use super::point::{ChasedFilm, PublishedPoint};
use super::tracker::{SourceGrade, SourceTracker};
use crate::harness::shown::{Luck, SOURCES, Told, TrueFilm, mono};
use crate::time::{ShowTime, Tick};

const HZ: f64 = 50.0;
const FRAME: Duration = Duration::from_millis(20);

/// From two sources to the verdict about the seats, as the program puts it together.
struct Chain {
    trackers: Vec<SourceTracker>,
    grades: Vec<SourceGrade>,
    chooser: Chooser,
    published: Arc<PublishedPoint>,
    clock: ChasedFilm,
    chase: Chase,
    ticks: u64,
    limits: PaceLimits,
    /// The last verdict, and the change of pace before it, per second.
    before: (ChaseVerdict, f64),
}

impl Chain {
    fn new(sources: &[Told]) -> Self {
        let (limits, published) = (PaceLimits::default(), Arc::default());
        let rules = ChaseRules::until(ShowTime::from_millis(100_000_000));
        Self {
            trackers: sources
                .iter()
                .map(|told| SourceTracker::new(told.kind, limits.band, mono(0.0)))
                .collect(),
            grades: vec![SourceGrade::default(); sources.len()],
            chooser: Chooser::default(),
            clock: ChasedFilm::new(Arc::clone(&published)),
            published,
            chase: Chase::new(rules, mono(0.0)),
            ticks: 0,
            limits,
            before: (ChaseVerdict::Wait, 0.0),
        }
    }

    fn now_s(&self) -> f64 {
        self.ticks as f64 / HZ
    }

    fn hear(&mut self, source: usize, told: &Observation) {
        self.trackers[source].hear(told);
    }

    /// One tick: what it allows the seats.
    fn tick(&mut self, may_lead: bool) -> ChaseVerdict {
        self.ticks += 1;
        let now = mono(self.now_s());
        let view = |(tracker, grade): (&mut SourceTracker, &mut SourceGrade)| {
            tracker.poll(now);
            let may_lead = grade.may_lead(tracker, false, now);
            SourceView { point: tracker.point(now), may_lead }
        };
        let views: Vec<SourceView> = self.trackers.iter_mut().zip(&mut self.grades).map(view).collect();
        self.published.publish(&self.chooser.choose(&views, None, now).point);
        let tick = Tick { index: self.ticks, deadline: now, late: Duration::ZERO, missed: 0 };
        let point = self.clock.at(&tick);
        let leave = if may_lead { FilmLeave::Lead } else { FilmLeave::Nothing };
        let verdict = self.chase.tick(&ChaseInput { tick: &tick, frame: FRAME, point, trim_ms: 0, leave });
        if let ChaseVerdict::Follow { .. } = verdict {
            let state = point.expect("somebody has told").state;
            assert!(may_lead && state.may_lead(), "followed what is {state:?}");
        }
        self.hold_against_the_last(verdict);
        verdict
    }

    /// Between two joins the playhead moves by its pace, and that changes gently.
    fn hold_against_the_last(&mut self, verdict: ChaseVerdict) {
        let (before, change) = self.before;
        self.before = (verdict, 0.0);
        let ChaseVerdict::Follow { join, playhead, pace } = verdict else { return };
        let (most, greatest) = (self.limits.most() - 1.0, self.limits.change_per_s());
        assert!((pace - 1.0).abs() <= most + 1e-12, "{pace}");
        let ChaseVerdict::Follow { join: joined, playhead: last, pace: its } = before else { return };
        if join != joined {
            return;
        }
        let moved = (playhead.as_nanos() - last.as_nanos()) as f64;
        assert!((moved / FRAME.as_nanos() as f64 - pace).abs() < 1e-6, "{moved} at {pace}");
        let changed = (pace - its) * HZ;
        assert!(changed.abs() <= greatest + 1e-9, "{changed}");
        assert!((changed - change).abs() * HZ <= 10.0 * greatest * 1.001 + 1e-6, "{changed} after {change}");
        self.before.1 = changed;
    }
}

/// A source, and what is wrong with it.
struct Faulty {
    told: Told,
    film: TrueFilm,
    fault: usize,
    next: f64,
}

impl Faulty {
    fn new(told: Told) -> Self {
        Self { told, film: TrueFilm::new(50.0, 1.0), fault: 0, next: 0.05 }
    }

    /// From now on something else is wrong, or nothing.
    fn turn(&mut self, t: f64, luck: &mut Luck) -> Option<Observation> {
        let film = std::mem::replace(&mut self.film, TrueFilm::new(0.0, 1.0));
        let rate = [1.0, 1.0, 1.001, 0.9, 1.5, -1.0, 0.0, 30.0][luck.below(8) * luck.below(2)];
        let step = [0.0, 0.0, 0.0, 0.02, 0.04, -0.04, 0.3, -5.0, 600.0][luck.below(9) * luck.below(2)];
        self.film = TrueFilm::new(0.0, 1.0).step_at(t, film.media_s(t) + step - t).rate_from(t, rate);
        self.fault = luck.below(16);
        let words = [
            FilmWord::Stop,
            FilmWord::Play,
            FilmWord::Play,
            FilmWord::Landed,
            FilmWord::Seek,
            FilmWord::Landed,
            FilmWord::Speed(luck.between(-2.0, 3.0)),
            FilmWord::End,
            FilmWord::Silence,
            FilmWord::Dirt,
            FilmWord::Gone,
            FilmWord::Unplaced,
            FilmWord::MayStop,
        ];
        luck.is(0.25).then(|| Observation::new(mono(t), words[luck.below(words.len())]))
    }

    /// What it tells up to an instant.
    fn until(&mut self, t: f64, luck: &mut Luck) -> Vec<Observation> {
        let mut all = Vec::new();
        while self.next <= t {
            let at = self.next;
            self.next += 1.0 / self.told.hz;
            let media = match self.fault {
                0 => continue,
                1 if luck.is(0.3) => continue,
                2 if luck.is(0.3) => luck.between(-1e5, 1e5),
                3 => self.film.media_s(at) + luck.between(-0.05, 0.05),
                4 => self.film.media_s(at).floor(),
                _ => self.film.media_s(at) + self.told.noise_s * luck.normal(),
            };
            let late = if self.fault == 5 { luck.between(0.0, 0.4) } else { self.told.late_s * luck.share() };
            all.push(Observation::new(mono(at + late), FilmWord::Position(ShowTime::from_secs_f64(media))));
        }
        all
    }
}

#[test]
fn whatever_is_wrong_with_the_sources_seats_follow_only_what_leads_and_as_gently_as_ever() {
    let (mut joins, mut followed, mut ticks, mut faults) = (0, 0_u32, 0_u32, 0);
    for seed in 0..tries(50) {
        let mut luck = Luck::new(u64::from(seed) ^ 0xf12);
        let mut sources: Vec<Faulty> =
            (0..1 + luck.below(2)).map(|_| Faulty::new(SOURCES[luck.below(5)].1)).collect();
        let kinds: Vec<Told> = sources.iter().map(|source| source.told).collect();
        let mut chain = Chain::new(&kinds);
        // As many faults as there are to be: ten thousand in all.
        for _ in 0..200 {
            faults += 1;
            let t = chain.now_s();
            let turned = luck.below(sources.len());
            if let Some(word) = sources[turned].turn(t, &mut luck) {
                chain.hear(turned, &word);
            }
            let may_lead = !luck.is(0.02);
            for _ in 0..8 + luck.below(30) {
                let now = chain.now_s() + 1.0 / HZ;
                for (index, source) in sources.iter_mut().enumerate() {
                    source.until(now, &mut luck).iter().for_each(|told| chain.hear(index, told));
                }
                let verdict = chain.tick(may_lead);
                ticks += 1;
                if let ChaseVerdict::Follow { join, .. } = verdict {
                    followed += 1;
                    joins = joins.max(join);
                }
            }
            if luck.is(0.3) {
                let now = mono(chain.now_s());
                chain.chase.let_join(now);
            }
        }
    }
    println!("{faults} faults, {ticks} ticks, {followed} of them following; most joins of a show {joins}");
    assert!(followed > ticks / 20 && joins > 5, "it is not all held: {followed} of {ticks}");
}

#[test]
fn a_told_pause_is_obeyed_in_the_next_tick_and_a_silent_line_half_a_second_after() {
    for (source, word, within) in
        [(1, FilmWord::Stop, 0.021), (0, FilmWord::Silence, 0.53), (1, FilmWord::Gone, 0.021)]
    {
        let told = SOURCES[source].1;
        let (mut chain, mut luck) = (Chain::new(&[told]), Luck::new(2));
        let film = TrueFilm::new(50.0, 1.0);
        let mut all = told.of(&film, (0.1, 10.0), &[], &mut luck).into_iter().peekable();
        while chain.now_s() < 10.0 {
            let now = mono(chain.now_s());
            while let Some(next) = all.next_if(|told| told.at <= now) {
                chain.hear(0, &next);
            }
            chain.tick(true);
        }
        assert_eq!(chain.chase.state(), ChaseState::Following);
        let stopped = chain.now_s();
        chain.hear(0, &Observation::new(mono(stopped), word));
        while chain.chase.state() == ChaseState::Following {
            chain.tick(true);
        }
        assert!(chain.now_s() - stopped <= within, "{word:?}: {} s", chain.now_s() - stopped);
    }
}

#[test]
fn a_long_film_that_is_300_ppm_off_does_not_drift_from_its_seats() {
    let told = SOURCES[1].1;
    let (mut chain, mut luck) = (Chain::new(&[told]), Luck::new(9));
    let film = TrueFilm::new(0.0, 1.0003);
    let (mut t, mut worst, minutes) = (0.0, 0.0_f64, 120.0);
    while t < minutes * 60.0 {
        t += 1.0 / told.hz;
        for told in told.of(&film, (t, t + 0.01), &[], &mut luck) {
            chain.hear(0, &told);
        }
        while chain.now_s() < t {
            let verdict = chain.tick(true);
            if let ChaseVerdict::Follow { playhead, .. } = verdict
                && t > 10.0
            {
                let end = chain.now_s() + 1.0 / HZ;
                worst = worst.max((playhead.as_secs_f64() - film.media_s(end)).abs());
            }
        }
    }
    println!("{minutes} min at 300 ppm: worst {:.3} ms", worst * 1e3);
    assert!(worst < 0.001, "{worst} s");
}
