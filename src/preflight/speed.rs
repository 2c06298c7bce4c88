//! How fast a controller lets its axes move, against what the seat may do.

use super::{Check, Notes, Subject};
use crate::motion::AxisGeometry;

/// Axes with limits of their own (PA80 to PA85, PAa0 to PAb5).
const OWN_LIMITS: usize = 6;
/// A limit this much above the seat's own is told.
const MARGIN: f64 = 1.1;
/// Limits are whole turns a minute, so one just below the seat's is as good as equal.
const SLACK: f64 = 0.999;

/// The lowest limit of an axis.
struct SpeedLimit {
    axis: usize,
    rpm: f64,
    source: String,
}

impl SpeedLimit {
    /// What it is for the turns that the axis needs.
    fn share(&self, subject: &Subject<'_>) -> f64 {
        self.rpm / geometry(subject, self.axis).needed_rpm()
    }

    fn told(&self, subject: &Subject<'_>) -> String {
        let geometry = geometry(subject, self.axis);
        let (lead, unit) = (geometry.lead, geometry.unit.name());
        let speed = self.rpm * lead / 60.0;
        format!(
            "axis {} may turn {:.0} rpm ({}), {speed:.1} {unit}/s at a lead of {lead} {unit}; seat {} goes up to {} {unit}/s",
            self.axis + 1,
            self.rpm,
            self.source,
            subject.controller.seat.name,
            geometry.max_velocity
        )
    }
}

/// The axis as the seat type has it.
fn geometry<'a>(subject: &Subject<'a>, axis: usize) -> &'a AxisGeometry {
    &subject.controller.seat.each[axis]
}

pub(super) fn judge(subject: &Subject<'_>, notes: &mut Notes) {
    if subject.pa(0x07) == Some(0) {
        notes.add(
            Check::SpeedUnlimited,
            "PA07 = 0: no limit on speed",
            format!("set PA07 = {:.0} or less", needed_rpm(subject).ceil()),
        );
    }
    judge_axes_of_their_own(subject, notes);
    let mut limits: Vec<SpeedLimit> =
        (0..subject.working_axes()).filter_map(|axis| limit(subject, axis)).collect();
    limits.sort_by(|a, b| a.share(subject).total_cmp(&b.share(subject)));
    let needed = |limit: &SpeedLimit| geometry(subject, limit.axis).needed_rpm().ceil();
    if let Some(slowest) = limits.first().filter(|limit| limit.share(subject) < SLACK) {
        let unit = geometry(subject, slowest.axis).unit.name();
        let remedy =
            format!("allow {:.0} rpm, or lower max_velocity_{unit}_s of the seat type", needed(slowest));
        notes.add(Check::SpeedTooLow, slowest.told(subject), remedy);
    }
    if let Some(fastest) = limits.last().filter(|limit| limit.share(subject) > MARGIN) {
        let alone = fastest.axis < OWN_LIMITS && !turn_alike(subject);
        let registers =
            if alone { format!("PA8{}", fastest.axis) } else { "PA07 or PA80 to PA85".to_owned() };
        let remedy = format!("set {registers} to {:.0}", needed(fastest));
        notes.add(Check::SpeedTooHigh, fastest.told(subject), remedy);
    }
}

fn judge_axes_of_their_own(subject: &Subject<'_>, notes: &mut Notes) {
    let axes = 0..subject.working_axes().min(OWN_LIMITS);
    let open: Vec<_> = axes.filter(|axis| own(subject, 0x80, *axis) == Some(0)).collect();
    if open.is_empty() {
        return;
    }
    let registers: Vec<_> = open.iter().map(|axis| format!("PA8{axis}")).collect();
    let found = format!("{} = 0: no limit on the speed of these axes", registers.join(", "));
    let needed = |axis: &usize| geometry(subject, *axis).needed_rpm().ceil();
    let remedy = if turn_alike(subject) {
        format!("set them to {:.0}", needed_rpm(subject).ceil())
    } else {
        let each: Vec<_> = open.iter().map(|axis| format!("PA8{axis} to {:.0}", needed(axis))).collect();
        format!("set {}", each.join(", "))
    };
    notes.add(Check::AxisSpeedUnlimited, found, remedy);
}

/// True if all axes need as many turns a minute: a limit for a turntable would stop a cylinder.
fn turn_alike(subject: &Subject<'_>) -> bool {
    subject.controller.seat.own().windows(2).all(|pair| pair[0].needed_rpm() == pair[1].needed_rpm())
}

/// Turns a minute that the greatest speed of the seat's fastest axis takes.
fn needed_rpm(subject: &Subject<'_>) -> f64 {
    subject.controller.seat.own().iter().map(AxisGeometry::needed_rpm).fold(0.0, f64::max)
}

/// The lowest of PA07, PA80.. and PAa0.. times PAb0.. (SMC manual 5.10); those of 0 set none.
fn limit(subject: &Subject<'_>, axis: usize) -> Option<SpeedLimit> {
    let product =
        own(subject, 0xa0, axis).zip(own(subject, 0xb0, axis)).map(|(a, b)| u32::from(a) * u32::from(b));
    let limits = [
        (subject.pa(0x07).map(u32::from), "PA07".to_owned()),
        (own(subject, 0x80, axis).map(u32::from), format!("PA8{axis}")),
        (product, format!("PAa{axis} times PAb{axis}")),
    ];
    let set = limits.into_iter().filter_map(|(rpm, source)| Some((rpm.filter(|rpm| *rpm > 0)?, source)));
    let (rpm, source) = set.min_by_key(|(rpm, _)| *rpm)?;
    Some(SpeedLimit { axis, rpm: f64::from(rpm), source })
}

/// A register that each of the first six axes has.
fn own(subject: &Subject<'_>, first: u8, axis: usize) -> Option<u16> {
    let step = u8::try_from(axis).ok().filter(|_| axis < OWN_LIMITS)?;
    subject.pa(first + step)
}
