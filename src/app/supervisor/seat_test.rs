//! The test of empty seats: each axis in turn moves slowly there and back, then each effect is on for a second. It is a cue
//! like any other, made here, proved and joined like any other.

use super::show::ProvedShow;
use crate::config::{Config, cue_axes};
use crate::control::model::us;
use crate::control::{Code, Problem, TestRow, TestStatus};
use crate::cue::CueBuilder;
use crate::motion::{AxisGeometry, AxisUnit};
use crate::rt::Row;
use crate::time::ShowTime;
use crate::timeline::Timeline;

/// How far an axis moves from park, of its stroke.
const REACH: f64 = 0.2;
/// How far an axis that turns does, degrees: a fifth of a whole turn would throw what lies on it.
const TURN_DEG: f64 = 20.0;
/// How long one axis takes, there, a rest, and back, ms.
const AXIS_MS: u32 = 6_000;
/// How long an effect is given, half of it on, ms.
const EFFECT_MS: u32 = 2_000;
/// What comes before the first, ms.
const LEAD_MS: u32 = 1_000;

/// A test that is under way, or was.
#[derive(Debug)]
pub(super) struct SeatTest {
    parts: Vec<TestPart>,
    /// The part that is under way, with what was counted when it began.
    now: Option<(usize, Vec<Row>)>,
    pub(super) status: TestStatus,
}

/// One thing that is tested.
#[derive(Debug, Clone, PartialEq)]
struct TestPart {
    name: String,
    from: ShowTime,
    to: ShowTime,
    /// The axis, from 0; none for an effect.
    axis: Option<usize>,
}

/// The parts of a test of a hall, and its cue.
fn script(config: &Config) -> (Vec<TestPart>, CueBuilder) {
    let axes = cue_axes(&config.controllers);
    let effects: Vec<String> = config.effects.iter().map(|effect| effect.name.clone()).collect();
    let park: Vec<f64> = (0..axes).map(|axis| park_of(config, axis)).collect();
    let reach: Vec<f64> = (0..axes).map(|axis| reach_of(config, axis)).collect();
    let away = |park: f64, reach: f64| if park + reach <= 1.0 { park + reach } else { park - reach };
    let mut cue = CueBuilder::new("test", axes).curved("test of empty seats", effects.clone());
    let time = |ms: u32| ShowTime::from_millis(i64::from(ms));
    let mut row = |at_ms: u32, moved: Option<usize>, on: Option<usize>| {
        let place =
            |(axis, park): (usize, &f64)| if moved == Some(axis) { away(*park, reach[axis]) } else { *park };
        cue.row(time(at_ms), park.iter().enumerate().map(place), on);
    };
    let (mut parts, mut at) = (Vec::new(), LEAD_MS);
    row(0, None, None);
    for axis in 0..axes {
        row(at, None, None);
        row(at + AXIS_MS * 5 / 12, Some(axis), None);
        row(at + AXIS_MS * 7 / 12, Some(axis), None);
        parts.push(TestPart {
            name: format!("a{}", axis + 1),
            from: time(at),
            to: time(at + AXIS_MS),
            axis: Some(axis),
        });
        at += AXIS_MS;
    }
    for (effect, name) in effects.iter().enumerate() {
        row(at, None, Some(effect));
        row(at + EFFECT_MS / 2, None, None);
        parts.push(TestPart { name: name.clone(), from: time(at), to: time(at + EFFECT_MS), axis: None });
        at += EFFECT_MS;
    }
    // It ends at rest: the last axis comes back before that.
    if effects.is_empty() {
        row(at, None, None);
    }
    row(at + LEAD_MS, None, None);
    (parts, cue)
}

/// The first seat that takes an axis of the cue says what it is.
fn geometry_of(config: &Config, axis: usize) -> Option<&AxisGeometry> {
    let taker = config.controllers.iter().find(|one| one.takes(axis))?;
    taker.seat.each.get(axis - taker.axis_offset)
}

/// Where it rests.
fn park_of(config: &Config, axis: usize) -> f64 {
    geometry_of(config, axis).map_or(0.0, |axis| axis.park)
}

/// How far it moves, of its range: the same way for a short range of turns as for a stroke.
fn reach_of(config: &Config, axis: usize) -> f64 {
    let turns = geometry_of(config, axis).filter(|axis| axis.unit == AxisUnit::Degree);
    turns.map_or(REACH, |axis| REACH.min(TURN_DEG / axis.stroke()))
}

impl SeatTest {
    /// Makes one for a hall, and the cue for it.
    ///
    /// # Errors
    /// Where no such cue fits its seats.
    pub(super) fn make(config: &Config) -> Result<(Box<Self>, Box<ProvedShow>), Problem> {
        let (parts, cue) = script(config);
        let cue = cue.build().map_err(|faults| {
            Problem::new(Code::Check, "no test fits these seats", "check their park poses")
                .with(faults.to_string().lines().map(str::to_owned).collect())
        })?;
        let cued = ProvedShow::prove("test".to_owned(), config, Timeline::new(cue), String::new())?;
        let (step, total) = ("begins".to_owned(), parts.len());
        let status = TestStatus { running: true, step, done: 0, total, rows: Vec::new() };
        Ok((Box::new(Self { parts, now: None, status }), Box::new(cued)))
    }

    /// The film is there, and so much is counted: judges the part that is over, of the lanes that are tested; a line for each of
    /// its rows.
    pub(super) fn follow(
        &mut self,
        film: ShowTime,
        table: &[Row],
        config: &Config,
        is_on: impl Fn(usize) -> bool,
    ) -> Vec<String> {
        let part = self.parts.iter().position(|part| (part.from..part.to).contains(&film));
        if self.now.as_ref().map(|(part, _)| *part) == part {
            return Vec::new();
        }
        let mut lines = Vec::new();
        if let Some((done, before)) = self.now.take() {
            let part = &self.parts[done];
            let tested = config
                .controllers
                .iter()
                .enumerate()
                .filter(|(lane, one)| is_on(*lane) && part.axis.is_none_or(|axis| one.takes(axis)));
            for (lane, controller) in tested {
                let (Some(now), Some(then)) = (table.get(lane), before.get(lane)) else { continue };
                let row = row_of(&controller.name, &part.name, then, now);
                let TestRow { asked, acked, .. } = row;
                let p99 = row.p99_us.map_or_else(|| "-".to_owned(), |us| format!("{us} µs"));
                lines.push(format!("{} {}: {acked} of {asked} acked, p99 {p99}", controller.name, part.name));
                self.status.rows.push(row);
            }
            self.status.done = done + 1;
        }
        if let Some(part) = part {
            self.status.step.clone_from(&self.parts[part].name);
            self.now = Some((part, table.to_vec()));
        }
        lines
    }
}

fn row_of(controller: &str, part: &str, then: &Row, now: &Row) -> TestRow {
    let asked = now.counts.asked - then.counts.asked;
    let acked = now.counts.acked - then.counts.acked;
    TestRow {
        controller: controller.to_owned(),
        part: part.to_owned(),
        asked,
        acked,
        p50_us: now.ack_ns.map(|ack| us(ack.p50)),
        p99_us: now.ack_ns.map(|ack| us(ack.p99)),
        // What was asked in the last moment may still be on its way.
        passed: asked > 0 && acked + now.counts.in_flight() >= asked && now.standing.may_move(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turntable_turns_by_twenty_degrees_and_other_axes_by_a_fifth_of_their_stroke() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("hall.toml");
        let text = "[seat.s]\naxes = 2\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
            max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
            [seat.s.axis2]\nunit = \"deg\"\nrange = [-180, 180]\npulses_per_rev = 36000\n\
            max_velocity_deg_s = 60\nmax_acceleration_deg_s2 = 120\nmax_jerk_deg_s3 = 600\npark = 0\n\
            [[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"127.0.0.1:9\"\n";
        std::fs::write(&file, text).unwrap();
        let (_, cue) = script(&crate::config::load(&file).unwrap());
        let cue = cue.build().unwrap();
        let reach = |axis: usize, park: f64| {
            (0..cue.rows()).map(|row| (cue.row(row)[axis] - park).abs()).fold(0.0, f64::max)
        };
        assert!((reach(0, 0.0) - 0.2).abs() < 1e-9);
        assert!((360.0 * reach(1, 0.5) - 20.0).abs() < 1e-9);
    }
}
