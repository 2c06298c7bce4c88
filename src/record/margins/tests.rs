//! What is measured of frames, held against the definition.

use proptest::prelude::*;

use super::*;
use crate::motion::{Pulses, SeatType, Slot, Window};
use crate::record::chunk::ChunkWriter;
use crate::record::{Asked, FrameKind};
use crate::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, VibrationPort};

/// What befalls a seat in a tick.
#[derive(Debug, Clone, Copy)]
enum Sent {
    /// A frame of that Time goes somewhere.
    There(u32),
    /// The kernel takes none.
    Refused,
    /// No tick asked for it.
    Unasked,
    Nothing,
}

fn seat(axes: usize) -> RecordedSeat {
    let seat = SeatType::bench3(axes);
    let window = Window::new((0..axes).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect());
    RecordedSeat::new("A1", &window, FrameKind::Datagram(VibrationPort::Two))
}

fn sent() -> impl Strategy<Value = Sent> {
    prop_oneof![
        40 => Just(Sent::There(10)),
        6 => (1..40_u32).prop_map(Sent::There),
        1 => Just(Sent::Refused),
        1 => Just(Sent::Unasked),
        2 => Just(Sent::Nothing),
    ]
}

/// So many ticks dropped before it, how long after the one before, and what each of three seats is sent.
fn tick() -> impl Strategy<Value = (u32, u64, [Sent; 3])> {
    let apart = prop_oneof![40 => Just(10_u64), 4 => 1..60_u64, 1 => 400..700_u64];
    (prop_oneof![60 => Just(0_u32), 1 => 1..9_u32], apart, [sent(), sent(), sent()])
}

/// Where an axis is sent then.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    reason = "a few minutes, and few pulses"
)]
fn pulses(ms: u64, lane: usize, axis: usize, phase: f64) -> Pulses {
    let turn = phase + 0.002 * ms as f64 * (1.0 + axis as f64 / 5.0) + lane as f64;
    Pulses((150_000.0 + 90_000.0 * turn.sin()) as i32)
}

/// The divided difference of poses, newest first.
fn divided(poses: &[(f64, f64)]) -> f64 {
    let [(from, _), .., (to, _)] = poses else { return poses[0].1 };
    (divided(&poses[..poses.len() - 1]) - divided(&poses[1..])) / (from - to)
}

/// The most of each quantity, by the definition: of each stretch that hangs together, newest pose first.
fn slowly(spacing: Spacing, stretches: &[Vec<(f64, f64)>]) -> [f64; 3] {
    let mut most = [0.0_f64; 3];
    for stretch in stretches {
        let newest_first: Vec<(f64, f64)> = stretch.iter().rev().copied().collect();
        for from in 0..newest_first.len() {
            let poses = &newest_first[from..];
            let of = |apart: usize, count: usize, factor: f64| {
                let taken: Vec<_> = poses.iter().step_by(apart).take(count).copied().collect();
                if taken.len() == count { factor * divided(&taken).abs() } else { 0.0 }
            };
            let [n, m] = [spacing.n, spacing.m];
            let shown = [of(1, 2, 1.0), of(n, 3, 2.0).max(of(m, 3, 2.0)), of(n, 4, 6.0).max(of(m, 4, 6.0))];
            most.iter_mut().zip(shown).for_each(|(most, shown)| *most = most.max(shown));
        }
    }
    most
}

proptest! {
    #[test]
    fn what_any_seats_are_sent_is_measured_as_the_differences_say(
        ticks in prop::collection::vec(tick(), 1..160),
        axes in [3..13_usize, 3..13_usize, 3..13_usize],
        rate in prop_oneof![Just(20.0), Just(50.0), Just(100.0), Just(200.0)],
        absolute: bool,
        phase in 0.0..6.0_f64,
    ) {
        let seats = axes.map(seat);
        let mut margins = Margins::new(&seats, Rate::from_hz(rate));
        let spacing = Spacing::at_rate(rate);
        let room = seats.iter().map(RecordedSeat::longest_frame).sum();
        let mut writer = ChunkWriter::with_room(room);
        let (mut ms, mut stamps, mut reached, mut last) = (1_000_u64, [0_u32; 3], [0.0_f64; 3], [None::<u64>; 3]);
        let mut stretches = [const { Vec::<Vec<(f64, [f64; MAX_AXES])>>::new() }; 3];
        for (number, (dropped, apart, sent)) in (0_u64..).zip(&ticks) {
            ms += apart;
            if *dropped > 0 {
                last = [None; 3];
            }
            writer.clear();
            for (lane, sent) in sent.iter().enumerate() {
                let lasts = if let Sent::There(ms) = sent { *ms } else { 10 };
                let pulses: Vec<Pulses> = (0..axes[lane]).map(|axis| pulses(ms, lane, axis, phase)).collect();
                let stamp = if absolute { stamps[lane] + lasts } else { lasts };
                let motion = Motion {
                    timing: if absolute { Timing::Absolute } else { Timing::Relative },
                    channel: u16::try_from(axes[lane]).expect("few"),
                    accept: Code(0xffff),
                    reply: Code::NONE,
                    frame: FrameNo(1),
                    time_ms: stamp,
                    positions: &pulses,
                    outputs: 0,
                    analogue: Analogue::default(),
                    vibration: None,
                };
                let mut buf = [0; MAX_LEN];
                let datagram = motion.emit(&mut buf);
                let (handed, slots) = match sent {
                    Sent::There(_) => (Handed::Taken, axes[lane]),
                    Sent::Refused => (Handed::Refused, axes[lane]),
                    Sent::Unasked => (Handed::Taken, 0),
                    Sent::Nothing => continue,
                };
                let asked = Asked { pose: [0.0; MAX_AXES], slots, level: 1.0, clamps: 0 };
                writer.frame(&SentFrame { lane, at: MonoTime::from_nanos(ms * 1_000_000), handed, asked, datagram });
                match sent {
                    Sent::There(_) => {
                        let goes_on = last[lane].replace(ms).is_some_and(|before| ms - before < 500);
                        let takes = if absolute { stamp - stamps[lane] } else { stamp };
                        stamps[lane] = stamp;
                        reached[lane] += f64::from(takes.max(1)) / 1e3;
                        if !goes_on {
                            stretches[lane].push(Vec::new());
                        }
                        let mut places = [0.0; MAX_AXES];
                        places.iter_mut().zip(&pulses).for_each(|(place, pulse)| *place = f64::from(pulse.0) * seats[lane].axes()[0].pulse);
                        stretches[lane].last_mut().expect("it has begun").push((reached[lane], places));
                    }
                    Sent::Unasked => last[lane] = None,
                    Sent::Refused | Sent::Nothing => {}
                }
            }
            let head = TickHead::of(number, MonoTime::from_nanos(ms * 1_000_000));
            let octets = writer.close(&head, *dropped).expect("it has room").to_vec();
            let (chunk, _) = Chunk::parse(&octets).expect("it is whole");
            margins.take(&chunk, &seats, &mut |_, _, _| ());
        }
        let mut most = margins.most(&seats).into_iter();
        for lane in 0..3 {
            for axis in 0..axes[lane] {
                let poses: Vec<Vec<(f64, f64)>> =
                    stretches[lane].iter().map(|one| one.iter().map(|(at, places)| (*at, places[axis])).collect()).collect();
                for wanted in slowly(spacing, &poses) {
                    let seen = most.next().expect("one of each").value;
                    prop_assert!((seen - wanted).abs() <= 1e-5 * wanted.max(1.0), "seat {} axis {}: {}, not {}", lane, axis, seen, wanted);
                }
            }
        }
    }
}

#[test]
fn the_greatest_of_each_axis_is_kept_also_where_all_show_it_in_one_tick() {
    let mut lane = LaneMargins::new(Spacing::at_rate(100.0));
    let mut wanted = [[0.0_f64; 2]; 3];
    for tick in 0..40 {
        let at = ShowTime::from_millis(10 * (tick + 1));
        let there = if tick < 20 { [0.0; 2] } else { [1.0, -3.0] };
        lane.times.push(at);
        let shown = lane.places.push(&lane.times, &there);
        lane.keep(&shown, at, at);
        for axis in 0..2 {
            for (most, seen) in wanted.iter_mut().zip(of_quantities(&shown.of(axis))) {
                most[axis] = most[axis].max(seen.value.abs());
            }
        }
    }
    assert_eq!(lane.most.map(|most| [most[0], most[1]]), wanted);
    assert!(lane.most.iter().all(|most| most[0] > 0.0 && most[2..] == [0.0; MAX_AXES - 2]));
}
