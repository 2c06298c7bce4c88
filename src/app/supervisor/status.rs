//! The status: how all of it stands, in the words of the hall.

use std::time::Duration;

use jiff::Zoned;

use super::coded::{NextCode, StandingCode};
use super::features::Features;
use super::hall::{GoesOn, HallContext};
use super::readiness::CORRECT;
use super::seat_places::SeatPlaces;
use super::show::ProvedShow;
use super::standing::standing_words;
use super::{away, belts, film};
use crate::app::buttons::PadTable;
use crate::app::notify::NotifyTable;
use crate::app::{broadcasts, links};
use crate::config::Controller;
use crate::control::model::us;
use crate::control::{
    Coded, ControllerStatus, FORMAT, Health, Histogram, Percentiles, RealTimeStatus, RecordStatus, Status,
    Times, Warning,
};
use crate::rt::Row;
use crate::state::{Next, PlayMode, State};
use crate::sys::clock::zone_name;
use crate::time::{MonoTime, ShowTime};
use crate::tracker;

/// The least and the greatest bound of the buckets, µs.
const BOUNDS_US: [f64; 16] = [
    5.0,
    10.0,
    20.0,
    50.0,
    100.0,
    200.0,
    350.0,
    500.0,
    750.0,
    1_000.0,
    2_000.0,
    5_000.0,
    10_000.0,
    50_000.0,
    200_000.0,
    1_000_000.0,
];

/// So many seats are named that will not move.
const FEW: usize = 8;
/// Torque that was reported longer ago says nothing of now.
const FORCES: Duration = Duration::from_secs(3);

/// What the status is made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct StatusParts<'p> {
    pub(super) hall: &'p HallContext,
    pub(super) features: &'p Features,
    /// How recording stands, looked up once: its warnings are those of the troubles that are told.
    pub(super) record: &'p RecordStatus,
    /// When the program started.
    pub(super) began: MonoTime,
}

impl StatusParts<'_> {
    /// How all of it stands, with what a person should know besides.
    pub(super) fn status(&self, table: &[Row], warnings: Vec<Warning>) -> Status {
        let Self { hall, features, record, began } = *self;
        let (now, live, mirror) = (hall.now, &hall.live, &hall.mirror);
        let times = live.times();
        let moving = mirror.state.may_send_motion();
        let preflighted = &features.readiness.preflighted;
        let (next, next_coded) = self.next(table);
        Status {
            hall: hall.config.show.name.clone(),
            timezone: zone_name(&self.local_now()),
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            uptime_s: now.since(began).as_secs_f64(),
            state: mirror.state.into(),
            cause: self.cause(table),
            cause_coded: Coded::new(mirror.cause.code(), hall.whose()),
            next,
            next_coded,
            arm_homes: mirror.next == Next::ArmAndHome,
            may_clear: mirror.state.is_latched() || mirror.next == Next::Clear,
            since_s: now.since(mirror.since).as_secs_f64(),
            lapses_s: mirror.lapses(now),
            moving,
            job: hall.job.or_else(|| hall.aside.is_some().then_some("test")).map(str::to_owned),
            show: hall.cued.as_ref().map(|cued| cued.status(place(hall, cued), now)),
            playlist: features.onward.list.as_ref().map(|list| list.status(&Zoned::now())),
            film: hall.film.as_ref().map(|table| film::status(&table.read(), hall)),
            osc: hall.osc.as_ref().map(|counts| counts.by_word()),
            buttons: hall.buttons.as_ref().map(PadTable::status).unwrap_or_default(),
            notify: hall.notify.as_ref().map(NotifyTable::status).unwrap_or_default(),
            fleet: features.starts.status(hall),
            trim_ms: hall.settings.trim_ms,
            levels: hall.settings.levels.clone(),
            presets: hall.config.presets.iter().map(|preset| preset.name.clone()).collect(),
            ticks: live.beats(),
            missed_ticks: live.missed(),
            rate_hz: hall.config.show.rate_hz,
            lateness: counted(&times.lateness),
            ack_latency: counted(&times.acks),
            link_ack_latency: counted(&times.link_acks),
            realtime: RealTimeStatus {
                policy: hall.granted.policy.to_string(),
                priority: hall.granted.priority,
                memory_locked: hall.granted.memory_locked,
                refusals: hall.granted.refusals.clone(),
            },
            controllers: self.controllers(table),
            links: links::status(
                &hall.config,
                &hall.links,
                hall.cued.as_ref().map_or(&[], |cued| &cued.links),
            ),
            broadcasts: broadcasts::status(&hall.config.controllers, live),
            preflight: preflighted.as_ref().map(|it| it.status(now, |lane| hall.settings.is_on(lane))),
            warnings,
            test: features.seats.test.as_ref().map(|test| test.status.clone()),
            record: record.clone(),
            journal: features.records.newest(),
        }
    }

    /// Why the hall is in its state; of one that is parked also which seats that are on were read elsewhere, of one that is armed which of
    /// them will not move, of one that waits where the film is.
    fn cause(&self, table: &[Row]) -> String {
        let (hall, cause) = (self.hall, self.hall.cause());
        if hall.mirror.state == State::Playing(PlayMode::Waiting) {
            let outside = film::outside(hall);
            return outside
                .map_or(cause.clone(), |side| format!("{cause}: {side}; kinocue sync shows where"));
        }
        if hall.mirror.state == State::Parked && hall.lanes_on().next().is_none() {
            return format!("{cause}; no seat takes part");
        }
        if hall.mirror.state == State::Parked {
            return away::words(hall, table).map_or(cause.clone(), |away| format!("{cause}; {away}"));
        }
        let stays = |&lane: &usize| table.get(lane).is_some_and(|row| !row.standing.may_move());
        let word = |lane: usize| format!("{} {}", hall.config.controllers[lane].name, table[lane].standing);
        let stay: Vec<String> = hall.lanes_on().filter(stays).map(word).collect();
        if hall.mirror.state != State::Armed || stay.is_empty() {
            return cause;
        }
        let (on, named) = (hall.lanes_on().count(), stay.len().min(FEW));
        let more = if named < stay.len() { " ..." } else { "" };
        format!("{cause}, with {} of {on} seats: {}{more}", on - stay.len(), stay[..named].join(", "))
    }

    /// What a person does next: first about belts and seats.
    fn next(&self, table: &[Row]) -> (String, Coded) {
        let of_seats = belts::next_action(self.hall, table).or_else(|| away::next_action(self.hall, table));
        of_seats.unwrap_or_else(|| self.next_of_show())
    }

    /// The same of the show; where it was left in its midst, also how it goes on from there.
    fn next_of_show(&self) -> (String, Coded) {
        let next = match self.hall.mirror.next {
            // What the state machine does not know of.
            Next::Resume if self.hall.has_taken_over() && self.hall.goes_on().is_none() => Next::ParkOrHome,
            next => next,
        };
        let left = self.hall.cued.as_ref().and_then(|cued| cued.left(self.hall.now));
        let from = |code: NextCode, words: &str, film: ShowTime| {
            (
                format!("{next}; {words} {film}, where it was left"),
                Coded::new(code.word(), [film.to_string()]),
            )
        };
        match left {
            _ if next == Next::Preflight && self.features.readiness.has_failed(self.hall) => {
                (CORRECT.to_owned(), Coded::new(NextCode::Correct.word(), []))
            }
            Some(film) if next == Next::Go => from(NextCode::GoFrom, "or go from", film),
            Some(film) if next == Next::Arm => from(NextCode::ArmFrom, "it can go from", film),
            _ => (next.to_string(), Coded::new(next.code(), [])),
        }
    }

    fn local_now(&self) -> Zoned {
        self.features.onward.local_now()
    }

    fn controllers(&self, table: &[Row]) -> Vec<ControllerStatus> {
        let config = &self.hall.config;
        let present = config.controllers.iter().enumerate();
        let mut all: Vec<_> =
            present.map(|(index, one)| self.controller(index, one, table.get(index))).collect();
        for (index, one) in config.absent.iter().enumerate() {
            all.insert(one.after + index, absent(&one.controller));
        }
        all
    }

    fn controller(&self, index: usize, controller: &Controller, row: Option<&Row>) -> ControllerStatus {
        let Self { hall, features, .. } = *self;
        let now = hall.now;
        let counts = row.map(|row| row.counts).unwrap_or_default();
        let state = row.map(|row| row.state).unwrap_or_default();
        let ack = row.and_then(|row| row.ack_ns);
        let (why, why_coded) = row.map_or_else(
            || ("not polled yet".to_owned(), Coded::new(StandingCode::NotPolled.word(), [])),
            |row| standing_words(hall, index, row.why),
        );
        let SeatPlaces { positions_mm, commanded, measured } = SeatPlaces::of(controller, &state);
        ControllerStatus {
            enabled: hall.settings.is_on(index),
            health: row.map_or(Health::Unknown, |row| row.standing.into()),
            why: match hall.settings.out.get(hall.settings.group(index)) {
                Some(out) => format!("{}; {why}", out.words(&self.local_now())),
                None => why,
            },
            why_coded,
            heard_s: state.heard_at.map(|at| now.since(at).as_secs_f64()),
            ack_rate: features.figures.rates.of(index),
            ack_p50_us: ack.map(|ack| us(ack.p50)),
            ack_p99_us: ack.map(|ack| us(ack.p99)),
            frames: (&counts).into(),
            send_failed: counts.send_failed,
            clamps: hall.live.clamps(index),
            homed: row.and_then(|row| row.homed),
            emergency_stop: state.emergency_stop(),
            error: state.error.map(|heard| heard.value),
            servo_errors: state.servo_errors.map(|heard| heard.value.to_vec()),
            forces: state.forces.filter(|heard| heard.age(now) <= FORCES).map(|heard| heard.value.to_vec()),
            inputs: state.inputs.map(|heard| heard.value),
            belts_open: belts::open(controller, &state, now).map(belts::numbers),
            outputs: state.outputs.map(|heard| heard.value),
            left_on: row.is_some_and(|row| row.left_since.is_some()),
            positions_mm,
            commanded,
            measured,
            ..nameplate(controller)
        }
    }
}

/// What a controller is, and nothing of how it is.
fn nameplate(controller: &Controller) -> ControllerStatus {
    ControllerStatus {
        name: controller.name.clone(),
        row: controller.row.clone(),
        seat: controller.seat.name.clone(),
        address: controller.address(),
        group: controller.group.clone(),
        axis_offset: controller.axis_offset,
        rotary_axis: controller.seat.rotary_axis().map(|axis| axis + 1),
        ..ControllerStatus::default()
    }
}

/// A controller that is disabled in the configuration: nothing is known of it.
fn absent(controller: &Controller) -> ControllerStatus {
    ControllerStatus {
        health: Health::Out,
        why: "disabled in the configuration: enabled = false".to_owned(),
        why_coded: Coded::new(StandingCode::ConfiguredOut.word(), []),
        ..nameplate(controller)
    }
}

/// A histogram of nanoseconds as surfaces show it.
fn counted(times: &tracker::Histogram) -> Times {
    let mut counts = Vec::with_capacity(BOUNDS_US.len() + 1);
    let mut from = 0;
    for bound in BOUNDS_US {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a second")]
        let to = (bound * 1e3) as u64;
        counts.push(times.count_between(from, to));
        from = to + 1;
    }
    let counted: u64 = counts.iter().sum();
    counts.push(times.len().saturating_sub(counted));
    #[expect(clippy::cast_precision_loss, reason = "for a mean")]
    let sum_s = times.mean() * times.len() as f64 / 1e9;
    let histogram = Histogram { bounds_us: BOUNDS_US.to_vec(), counts, sum_s };
    Times { percentiles: Percentiles::of(times), histogram }
}

/// Where in its cue a show is.
fn place(hall: &HallContext, cued: &ProvedShow) -> ShowTime {
    match hall.goes_on() {
        _ if hall.mirror.state.may_send_motion() => hall.live.show(),
        // What was taken over is where its film is by now.
        Some(GoesOn::At(film)) => film,
        _ => hall.halted_at.unwrap_or(cued.start),
    }
}
