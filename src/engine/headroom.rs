//! What the cue's motion leaves of the limits, tenth of a second by tenth: how much faster than the film it may run, and
//! how quickly a level may change.

use std::ops::RangeInclusive;
use std::time::Duration;

use super::fader::{GATHER, RATE};
use super::slew::{MAX_SPEED_UP, Slewing};
use crate::motion::{Limits, Slot, Spacing, Window};
use crate::proof::{HURRY, Loads, shakes};
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;

/// Show time of one entry, nanoseconds.
const SPAN: i64 = 100_000_000;
// At a fifth of the limits any pace fits and, on seats like the bench seat, any fade (section 7).
/// What is below this share of a limit is not measured closely: it leaves all that is ever asked.
const LIGHT: f64 = 0.2;
/// The same where an axis vibrates, which leaves its motion less: as `proof::shake` has it.
const SHAKEN_LIGHT: f64 = 0.01;
/// What a vibration leaves of a limit at the least, as a share: none may be divided by.
const LEAST_LEFT: f64 = 1e-6;
/// How long a change that is under way takes to end: a tenth of a second from the greatest pace, a quarter from the greatest rate of a
/// level.
const ENDS_WITHIN: Duration = Duration::from_millis(250);
const _: () = assert!(1.0 + MAX_SPEED_UP <= HURRY, "the end of a cue is proved for the greatest pace");

/// What each tenth of a second of the cue asks, at full level; built once, then only read.
#[derive(Debug, Clone)]
pub struct Headroom {
    /// Of lanes that do not shake, and of those that do.
    loads: [Box<[Load]>; 2],
    /// The greatest share of any limit of motion anywhere.
    greatest: f64,
    /// The jerk that the measure sees where an acceleration of 1 becomes one of -1, per second.
    turn: f64,
    /// How many entries before and behind the present one a change meets that is made now.
    reach: [usize; 2],
    /// What a film that leads may ask for, where the cue was proved for that.
    led: Option<Slewing>,
}

impl Headroom {
    /// Measures the cue at full level on every different slot of the windows, as its proof does: however the frames fall on
    /// it, at the show's own rate. One phase alone may show a tenth less than the one that is met next.
    #[must_use]
    pub(crate) fn measure(windows: &[Window], timeline: &Timeline, rate: Rate) -> Self {
        let spans = usize::try_from(timeline.duration().as_nanos().max(0) / SPAN).unwrap_or(0) + 1;
        let mut loads = [(); 2].map(|()| vec![Load::default(); spans].into_boxed_slice());
        let mut greatest = 0.0_f64;
        for (lead, axis, slot) in &different_slots(windows) {
            let light = if timeline.vibrates(*axis) { SHAKEN_LIGHT } else { LIGHT };
            let met = Loads::of(timeline, *axis, slot, rate, SPAN, light);
            let shaken = shakes(timeline, *axis, slot, rate, SPAN);
            for index in 0..spans {
                // Past its end a lane that is led ahead is still moved by its level.
                for met_in in spans_seen(index, *lead).map(|span| span.min(spans - 1)) {
                    let motion =
                        [&met.velocity, &met.acceleration, &met.jerk].map(|met| f64::from(met[met_in]));
                    greatest = greatest.max(greatest_share(motion, slot.limits));
                    for (loads, shaken) in loads.iter_mut().zip([[0.0; 2], shaken[met_in]]) {
                        loads[index].note(motion, beside(slot, shaken));
                    }
                }
            }
        }
        Self { loads, greatest, turn: turn(rate), reach: reach(rate), led: None }
    }

    /// The same of a cue that was proved for what is left of its seats' limits so ([`Slewing::leaves`]).
    #[must_use]
    pub(crate) fn led(self, slewing: Slewing) -> Self {
        Self { led: Some(slewing), ..self }
    }

    /// How its pace may change.
    #[must_use]
    pub(crate) fn slewing(&self) -> Slewing {
        self.led.unwrap_or(Slewing::OWN)
    }

    /// The greatest speed-up from `at` on, with motion at `level`; `shakes` where any lane may vibrate. Never allocates.
    #[must_use]
    pub(crate) fn pace(&self, at: ShowTime, level: f64, shakes: bool) -> f64 {
        // What it was proved for it gets: seats that were let run slower would fall behind the film, and have to join it.
        if let Some(led) = self.led {
            return led.most;
        }
        let leaves = self.ahead(at, shakes).iter().map(|load| load.leaves_pace(level, self.turn));
        leaves.fold(MAX_SPEED_UP, f64::min)
    }

    /// What of the greatest rates of a level may be used from `at` on, 0 to 1; `shakes` where the lane may vibrate. Never allocates.
    #[must_use]
    pub(crate) fn fade(&self, at: ShowTime, level: f64, shakes: bool) -> f64 {
        // A film that leads may have taken the pace that it was proved for, which no level may need as well.
        let level = self.led.map_or(level, |led| level * (1.0 + led.most).powi(3));
        let leaves = self.ahead(at, shakes).iter().map(|load| load.leaves_fade(level, self.turn));
        leaves.fold(1.0, f64::min).max(0.0)
    }

    /// The greatest level at which the cue keeps the limits, and can still change its level; 1 at the most.
    #[must_use]
    pub(crate) fn greatest_level(&self) -> f64 {
        // Two per cent of a limit are for the change: nobody could take back a level that leaves none.
        (0.98 / self.greatest).min(1.0)
    }

    fn ahead(&self, at: ShowTime, shakes: bool) -> &[Load] {
        let loads = &self.loads[usize::from(shakes)];
        let [before, behind] = self.reach;
        let first = usize::try_from(at.as_nanos().max(0) / SPAN).unwrap_or(usize::MAX).min(loads.len());
        let last = (first + 1 + behind).min(loads.len());
        &loads[first.saturating_sub(before)..last]
    }
}

/// How many entries before and behind the present one a change meets that is made now: readings stand under the middle of their poses,
/// half of which are behind, so that those of before see it too, and those to come until it has ended.
fn reach(rate: Rate) -> [usize; 2] {
    let half_a_window = rate.offset(3 * Spacing::at_rate(rate.hz()).m as u64) / 2;
    let entries = |time: Duration| time.as_nanos().div_ceil(u128::from(SPAN.unsigned_abs()));
    [half_a_window, half_a_window + ENDS_WITHIN]
        .map(|time| usize::try_from(entries(time)).unwrap_or(usize::MAX))
}

/// The jerk that the measure sees of an acceleration that turns from 1 to -1 at once.
#[expect(clippy::cast_precision_loss, reason = "1 to 20 periods")]
fn turn(rate: Rate) -> f64 {
    let n = Spacing::at_rate(rate.hz()).n;
    // A pace is constant within a frame, hence the weights of frames and not of a curve (docs/limiter.md, section 2).
    // In whole milliseconds, as Times are: some arrangement of them is up to one shorter than n periods.
    let shortest_s = (n as f64 / rate.hz() * 1e3).floor() * 1e-3;
    // The greatest weight of one frame in a third difference is 1 over a distance of one period; over longer
    // ones 7/9 of the frame's share, met at three periods. Twice, as it turns from one side to the other.
    2.0 * if n == 1 { 1.0 } else { 7.0 / 9.0 } / shortest_s
}

/// The spans of the cue that a lane is in while the hall is in one: its own, and where it is led ahead those that lie so much later; in
/// the first also those before, since show time begins below 0 for such a lane.
fn spans_seen(index: usize, lead: Duration) -> RangeInclusive<usize> {
    let span = u128::from(SPAN.unsigned_abs());
    let [whole, begun] = [lead.as_nanos() / span, lead.as_nanos().div_ceil(span)]
        .map(|ahead| index.saturating_add(usize::try_from(ahead).unwrap_or(usize::MAX)));
    if index == 0 { 0..=begun } else { whole..=begun }
}

/// What motion may do beside a vibration of that velocity and acceleration: its own limits, and what is left of those of both together,
/// whose sum is what the proof holds against them (`proof::shake`).
fn beside(slot: &Slot, shaken: [f64; 2]) -> Limits {
    // At its full level, to which operators may raise it at any time, and at any pace: it swings by the controller's clock, not the film's.
    let left = |limit: f64, of: usize| limit.min((slot.most_shaken[of] - shaken[of]).max(LEAST_LEFT * limit));
    let Limits { velocity, acceleration, jerk } = slot.limits;
    Limits { velocity: left(velocity, 0), acceleration: left(acceleration, 1), jerk }
}

fn different_slots(windows: &[Window]) -> Vec<(Duration, usize, Slot)> {
    let mut slots: Vec<(Duration, usize, Slot)> = Vec::new();
    for (lead, slot) in
        windows.iter().flat_map(|window| window.moving().map(|(_, slot)| (window.lead(), slot)))
    {
        let slot = slot.at_level(1.0);
        let Some(axis) = slot.axis else { continue };
        if !slots.contains(&(lead, axis, slot)) {
            slots.push((lead, axis, slot));
        }
    }
    slots
}

/// The greatest share of what a tenth of a second has of each limit for motion, and what changes of pace or level multiply.
#[derive(Debug, Clone, Copy, Default)]
struct Load {
    velocity: f32,
    acceleration: f32,
    jerk: f32,
    /// A stroke over the limits of velocity, acceleration and jerk.
    stroke: [f32; 3],
    /// Velocity over the limits of acceleration, seconds, and of jerk, seconds squared.
    velocity_by_acceleration: f32,
    velocity_by_jerk: f32,
    /// Acceleration over the limit of jerk, seconds.
    acceleration_by_jerk: f32,
}

impl Load {
    /// Keeps what is more than before.
    fn note(&mut self, [velocity, acceleration, jerk]: [f64; 3], limits: Limits) {
        raise(&mut self.velocity, velocity, limits.velocity);
        raise(&mut self.velocity_by_acceleration, velocity, limits.acceleration);
        raise(&mut self.velocity_by_jerk, velocity, limits.jerk);
        raise(&mut self.acceleration, acceleration, limits.acceleration);
        raise(&mut self.acceleration_by_jerk, acceleration, limits.jerk);
        raise(&mut self.jerk, jerk, limits.jerk);
        // What a level adds does not hang on how much of its own limits a slot uses, so the weakest counts.
        for (stroke, limit) in self.stroke.iter_mut().zip([limits.velocity, limits.acceleration, limits.jerk])
        {
            raise(stroke, 1.0, limit);
        }
    }

    /// How much faster time may run: speed grows with the pace, acceleration with its square, jerk with its cube, and
    /// changing the pace adds to both.
    fn leaves_pace(&self, level: f64, turn: f64) -> f64 {
        // Derivatives of x(s(t)) with s' the pace (docs/limiter.md, section 6).
        let at_level = |share: f32| level * f64::from(share);
        let change = Slewing::OWN.change_per_s;
        let added = change * at_level(self.velocity_by_acceleration);
        // By the greatest pace instead of the one looked for, which would be a cubic to be solved each tick.
        let bends = 3.0 * (1.0 + MAX_SPEED_UP) * at_level(self.acceleration_by_jerk);
        let jerk_added = change * (turn * at_level(self.velocity_by_jerk) + bends);
        // Where the change alone takes all, nothing is left, though motion at a steady pace would take nothing.
        let left = |added: f64, share: f32| (1.0 - added).max(0.0) / at_level(share).max(f64::MIN_POSITIVE);
        let paces = [
            left(0.0, self.velocity),
            left(added, self.acceleration).sqrt(),
            left(jerk_added, self.jerk).cbrt(),
        ];
        (paces.into_iter().fold(1.0 + MAX_SPEED_UP, f64::min) - 1.0).max(0.0)
    }

    /// What of the greatest rates of a level fits: with x = neutral + level (cue - neutral), the product rule says what
    /// they add, the cue being a stroke away from neutral at the most.
    fn leaves_fade(&self, level: f64, turn: f64) -> f64 {
        // Derivatives of a product (docs/limiter.md, section 6).
        let left = |share: f32| 1.0 - level * f64::from(share);
        let [by_velocity, by_acceleration, by_jerk] = self.stroke.map(f64::from);
        let adds = [
            RATE * by_velocity,
            2.0 * RATE * f64::from(self.velocity_by_acceleration) + GATHER * by_acceleration,
            3.0 * RATE * f64::from(self.acceleration_by_jerk)
                + 3.0 * GATHER * f64::from(self.velocity_by_jerk)
                + GATHER * turn * by_jerk,
        ];
        // One share for both rates, so that each sum grows in proportion to it, and what is left divides.
        let lefts = [left(self.velocity), left(self.acceleration), left(self.jerk)];
        lefts.into_iter().zip(adds).map(|(left, adds)| left / adds).fold(1.0, f64::min)
    }
}

impl Slewing {
    /// What of a seat's limits of velocity, acceleration and jerk, in any unit of length, is left for a cue that is to keep them at any
    /// such pace, and at any such change of it.
    #[must_use]
    pub(crate) fn leaves(self, rate: Rate, [velocity, acceleration, jerk]: [f64; 3]) -> [f64; 3] {
        // The sums of `Load::leaves_pace`, solved for what the cue may do (docs/limiter.md, section 6).
        let (pace, change) = (1.0 + self.most, self.change_per_s);
        let velocity = velocity / pace;
        let acceleration = (acceleration - change * velocity) / pace.powi(2);
        let jerk = (jerk - change * (turn(rate) * velocity + 3.0 * pace * acceleration)) / pace.powi(3);
        [velocity, acceleration, jerk]
    }
}

fn greatest_share([velocity, acceleration, jerk]: [f64; 3], limits: Limits) -> f64 {
    (velocity / limits.velocity).max(acceleration / limits.acceleration).max(jerk / limits.jerk)
}

#[expect(clippy::cast_possible_truncation, reason = "single precision is some 1e-7 of it")]
fn raise(kept: &mut f32, value: f64, over: f64) {
    *kept = kept.max((value.abs() / over) as f32);
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::fmt::Write as _;
    use std::path::Path;
    use std::sync::Arc;
    use std::time::Duration;

    use proptest::prelude::*;

    use super::super::slew::Slew;
    use super::*;
    use crate::cue::{self, Source};
    use crate::motion::{AxisGeometry, Measure, Readings, SeatType, Spacing};
    use crate::timeline::Hint;

    fn timeline(text: &str) -> Timeline {
        Timeline::new(cue::read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
    }

    /// Ten seconds of rest, then ten at a steady share of the seat's greatest speed, back and forth.
    fn headroom(share: f64) -> Headroom {
        let free = |axis: &mut AxisGeometry| (axis.max_acceleration, axis.max_jerk) = (1e9, 1e12);
        let seat = SeatType::bench3(1).with_each(free);
        let window = Window::new(vec![Slot::new(&seat, 0, Some(0), 1.0)]);
        let mut text = "# interpolation: linear\ntime_s,a1\n0,0\n".to_owned();
        let stroke_s = 1.0 / (1.6 * share);
        for (turn, place) in (0..16).zip([0.0, 1.0].into_iter().cycle()) {
            writeln!(text, "{},{place}", 10.0 + stroke_s * f64::from(turn)).unwrap();
        }
        Headroom::measure(&[window], &timeline(&text), Rate::from_hz(100.0))
    }

    #[test]
    fn a_cue_at_the_limit_leaves_nothing_and_one_at_rest_all() {
        let headroom = headroom(1.0);
        assert_eq!(headroom.pace(ShowTime::from_millis(5_000), 1.0, true), MAX_SPEED_UP);
        assert_eq!(headroom.pace(ShowTime::from_millis(15_000), 1.0, true), 0.0);
    }

    #[test]
    fn a_cue_at_the_limit_holds_its_level_and_at_half_level_both_may_change() {
        let headroom = headroom(1.0);
        assert_eq!(headroom.fade(ShowTime::from_millis(15_000), 1.0, true), 0.0);
        assert!(headroom.fade(ShowTime::from_millis(15_000), 0.5, true) > 0.5);
        assert_eq!(headroom.pace(ShowTime::from_millis(15_000), 0.5, true), MAX_SPEED_UP);
        assert!((headroom.greatest_level() - 0.98).abs() < 1e-6);
    }

    #[test]
    fn the_limit_is_seen_coming() {
        assert_eq!(headroom(1.0).pace(ShowTime::from_millis(9_750), 1.0, true), 0.0);
    }

    #[test]
    fn what_only_one_phase_of_the_grid_shows_is_no_room() {
        // A bump between two frames of a grid that begins with the cue.
        let text = "# interpolation: linear\ntime_ms,a1\n0,0.5\n1000,0.5\n1005,0.502\n1010,0.5\n2000,0.5\n";
        let (timeline, rate, seat) = (timeline(text), Rate::from_hz(100.0), SeatType::bench3(1));
        let window = Window::new(vec![Slot::new(&seat, 0, Some(0), 1.0)]);
        let room = Headroom::measure(&[window], &timeline, rate);
        let digest = crate::proof::Digest::of(timeline.cue());
        let terms = crate::proof::Terms::of_seat(std::sync::Arc::new(seat), 1, digest, rate, 1.0);
        let jerk = crate::proof::prove(&timeline, terms).axes[0].jerk;
        assert!(
            room.greatest >= 0.98 * jerk.value / jerk.limit && jerk.value > 0.0,
            "{} {jerk:?}",
            room.greatest
        );
        assert_eq!(room.pace(ShowTime::from_millis(1_000), 1.0, true), 0.0);
    }

    #[test]
    fn a_cue_one_per_cent_below_the_limit_leaves_one_per_cent() {
        let left = headroom(1.0 / 1.01).pace(ShowTime::from_millis(15_000), 1.0, true);
        assert!((left - 0.01).abs() < 2e-4, "{left}");
    }

    /// Limits of which the cue uses these shares of velocity, acceleration and jerk, and of the sums of the first two with what it
    /// shakes, mm/s and mm/s², all.
    fn just_enough(timeline: &Timeline, rate: Rate, shares: [f64; 3], shaken: [f64; 2]) -> SeatType {
        let set = |to: [f64; 3], sums: [f64; 2]| {
            move |axis: &mut AxisGeometry| {
                [axis.max_velocity, axis.max_acceleration, axis.max_jerk] = to;
                [axis.max_shaken_velocity, axis.max_shaken_acceleration] = sums.map(Some);
                axis.max_rpm = Some(u32::MAX);
            }
        };
        let free = SeatType::bench3(1).with_each(set([1e9, 1e9, 1e12], [1e9; 2]));
        let digest = crate::proof::Digest::of(timeline.cue());
        let terms = crate::proof::Terms::of_seat(std::sync::Arc::new(free.clone()), 1, digest, rate, 1.0);
        let axis = &crate::proof::prove(timeline, terms).axes[0];
        let most = [axis.velocity.value, axis.acceleration.value, axis.jerk.value];
        let sums = std::array::from_fn(|place| most[place] + shaken[place]);
        free.with_each(set(std::array::from_fn(|place| most[place] / shares[place]), sums))
    }

    /// The worst share of a limit that is met while a show that owes its film more and more, so many seconds after so many, is slewed as
    /// the headroom lets it be; with vibration of that velocity and acceleration, strokes, throughout.
    fn worst_slewed(
        timeline: &Timeline,
        window: &Window,
        rate: Rate,
        owed: Vec<(f64, f64)>,
        shaken: [f64; 2],
    ) -> f64 {
        let slot = window.slots()[0];
        let headroom = Headroom::measure(std::slice::from_ref(window), timeline, rate);
        let (mut slew, mut hint) = (Slew::new(rate, Slewing::OWN), Hint::default());
        let mut measure = Measure::new(Spacing::at_rate(rate.hz()));
        let (mut playhead, mut sent, mut frame) = (ShowTime::ZERO, ShowTime::ZERO, 0);
        let mut owed = owed.into_iter();
        let (mut next_s, mut owed_s, mut worst) = (0.0, 0.0, 0.0_f64);
        while playhead < timeline.duration() - Duration::from_millis(290) {
            if sent.as_secs_f64() >= next_s
                && let Some((wait, seconds)) = owed.next()
            {
                next_s += wait;
                owed_s += seconds;
            }
            let time = Duration::from_millis(rate.time_ms(frame).into());
            (frame, sent) = (frame + 1, sent + time);
            let passed = slew.advance(time, headroom.pace(playhead, 1.0, true), owed_s, 0.0);
            playhead += passed;
            owed_s -= passed.as_secs_f64() - time.as_secs_f64();
            let at = slot.place(timeline.sample(playhead, &mut hint)[0]);
            worst = worst.max(worst_of(&slot, measure.push(sent, at), shaken));
        }
        worst
    }

    #[test]
    fn where_a_change_of_pace_alone_takes_all_jerk_none_is_made() {
        // 3733 mm/s³, of 3000.
        let seat = SeatType::bench3(1).with_each(|axis| axis.max_jerk = 3_000.0);
        let timeline = timeline("# units: mm\n# interpolation: linear\ntime_s,a1\n0,0\n0.6,144\n");
        let rate = Rate::from_hz(100.0);
        let unit = timeline.unit(0).slot(&Arc::new(seat), 0, Some(0));
        let window = Window::new(vec![unit]);
        let headroom = Headroom::measure(std::slice::from_ref(&window), &timeline, rate);
        assert_eq!(headroom.pace(ShowTime::from_millis(300), 1.0, true), 0.0);
        assert!(worst_slewed(&timeline, &window, rate, vec![(0.2, 0.0), (9.0, 0.02)], [0.0; 2]) < 1.001);
    }

    #[test]
    fn a_vibration_that_fills_the_limit_with_the_motion_leaves_no_pace_and_no_fade_and_beside_it_both_are_left()
     {
        let text = "# units: mm\n# interpolation: linear\ntime_s,a1,v1_hz,v1_amp\n\
                    0,10,0,0\n1,30,0,0\n2,50,10,0.5\n3,70,0,0\n4,90,0,0\n";
        // 0.5 mm ten times a second on 20 mm/s.
        let seat = SeatType::bench3(1).with_each(|axis| axis.max_shaken_velocity = Some(20.0 + 5.0 * TAU));
        let (timeline, rate) = (timeline(text), Rate::from_hz(100.0));
        let window = Window::new(vec![timeline.unit(0).slot(&Arc::new(seat), 0, Some(0))]);
        let headroom = Headroom::measure(&[window], &timeline, rate);
        for (ms, leaves) in [(1_500, true), (2_500, false), (3_500, true)] {
            let at = ShowTime::from_millis(ms);
            assert_eq!(headroom.pace(at, 1.0, true) == MAX_SPEED_UP, leaves, "{ms} ms");
            assert_eq!(headroom.fade(at, 1.0, true) > 0.5, leaves, "{ms} ms");
            assert!(headroom.pace(at, 1.0, false) == MAX_SPEED_UP && headroom.fade(at, 1.0, false) > 0.5);
        }
        assert!(headroom.pace(ShowTime::from_millis(2_500), 1.0, true) < 1e-3);
    }

    fn worst_of(slot: &Slot, readings: Readings, shaken: [f64; 2]) -> f64 {
        let Readings { velocity, acceleration, jerk, .. } = readings;
        let [velocity, acceleration, jerk] =
            [velocity, acceleration, jerk].map(|reading| reading.value.abs());
        (velocity / slot.limits.velocity)
            .max(acceleration / slot.limits.acceleration)
            .max(jerk / slot.limits.jerk)
            .max((velocity + shaken[0]) / slot.most_shaken[0])
            .max((acceleration + shaken[1]) / slot.most_shaken[1])
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn however_the_pace_changes_within_what_a_cue_leaves_the_limits_are_kept(
            hz in prop::sample::select(vec![10.0, 25.0, 30.0, 50.0, 60.0, 72.0, 100.0, 240.0, 1000.0]),
            waves in [(0.3..4.0_f64, 0.3..1.0_f64), (0.3..4.0, 0.0..0.5)],
            shares in [0.85..1.0_f64, 0.85..1.0, 0.85..1.0],
            owed in prop::collection::vec((0.02..0.6_f64, -0.004..0.004_f64), 10..40),
            amplitude in prop_oneof![Just(0.0), 0.0001..0.05_f64],
        ) {
            let rate = Rate::from_hz(hz);
            let wave = |at: f64| -> f64 { waves.iter().map(|(hz, part)| part * (TAU * hz * at).sin()).sum() };
            let most: f64 = waves.iter().map(|wave| wave.1).sum::<f64>() + 1e-3;
            // 20 Hz is a period of whole eighths of a millisecond.
            let mut text = "time_ms,a1,v1_hz,v1_amp\n".to_owned();
            for ms in (0..8_000).step_by(10) {
                let at = 0.5 + 0.4 * wave(f64::from(ms) * 1e-3) / most;
                writeln!(text, "{ms},{at},20,{amplitude}").unwrap();
            }
            let timeline = timeline(&text);
            let shaken = [20.0 * TAU, (20.0 * TAU).powi(2)].map(|turns| amplitude * turns);
            let seat = just_enough(&timeline, rate, shares, shaken.map(|strokes| 150.0 * strokes));
            let window = Window::new(vec![Slot::new(&seat, 0, Some(0), 1.0)]);
            let worst = worst_slewed(&timeline, &window, rate, owed, shaken);
            prop_assert!(worst <= 1.001, "{hz} Hz: {worst}");
        }
    }
}
