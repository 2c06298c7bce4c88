//! Seats in space, for viewers that draw scenes: each a cube with its name, which rises by the mean of its cylinders and turns with its
//! first rotary axis. A recording knows strokes and no places: seats stand in rows of eight, a metre apart.

use serde_json::{Value, json};

use super::chunk::{Chunk, Handed};
use super::flight::Entry;
use super::recording::{EntryMaker, Opening};
use super::schemas::schema;
use super::seat::RecordedSeat;
use crate::motion::AxisUnit;
use crate::time::MonoTime;

/// The topics of cubes, and of where they are.
const TOPICS: [&str; 2] = ["/scene", "/tf"];
/// Where seats are is told so often, ns.
const EACH_NS: u64 = 50_000_000;
/// Seats of a row, and how far seats and rows are apart, m.
const IN_ROW: usize = 8;
const APART_M: f64 = 1.0;

/// A scene that is being told.
#[derive(Debug)]
pub(super) struct SeatScene {
    /// The channel of its cubes; that of transforms is the next.
    channel: u16,
    /// What is said again of a seat that has no frame: how high it is, m, and how far it is turned, radians.
    places: Vec<(f64, f64)>,
    taken: Vec<bool>,
    last: Option<MonoTime>,
}

impl SeatScene {
    /// One of the seats that are taken, and the opening of its file.
    pub(super) fn of(opening: Opening, taken: &[bool]) -> (Self, Opening) {
        let [array, object] =
            [json!({"type": "array", "items": {"type": "object"}}), json!({"type": "object"})];
        let of_scene =
            schema("foxglove.SceneUpdate", &[("deletions", array.clone()), ("entities", array.clone())], &[]);
        let of_transforms =
            schema("foxglove.FrameTransforms", &[("transforms", array)], &[("timestamp", object)]);
        let (opening, channel) = opening.with_topics(&[(TOPICS[0], of_scene), (TOPICS[1], of_transforms)]);
        (Self { channel, places: vec![(0.0, 0.0); taken.len()], taken: taken.to_vec(), last: None }, opening)
    }

    /// Takes a tick that is told to be at `at`; gives what is to be written of it.
    pub(super) fn take(
        &mut self,
        chunk: &Chunk<'_>,
        seats: &[RecordedSeat],
        at: MonoTime,
        maker: EntryMaker,
    ) -> Vec<Entry> {
        for frame in chunk.frames().filter(|frame| frame.handed != Handed::Refused) {
            if let (Some(place), Some(seat)) = (self.places.get_mut(frame.lane), seats.get(frame.lane)) {
                *place = placed(seat, &seat.sent(&frame)).unwrap_or(*place);
            }
        }
        let is_due = self
            .last
            .is_none_or(|last| at.as_nanos().saturating_sub(last.as_nanos()) >= EACH_NS || at < last);
        let is_first = self.last.is_none();
        if !is_due {
            return Vec::new();
        }
        self.last = Some(at);
        let log_time = maker.wall(at);
        let stamp = json!({"sec": log_time / 1_000_000_000, "nsec": log_time % 1_000_000_000});
        let taken = || seats.iter().enumerate().filter(|(lane, _)| self.taken.get(*lane) == Some(&true));
        let transforms: Vec<Value> =
            taken().map(|(lane, seat)| self.transform(lane, &seat.name, &stamp)).collect();
        let mut told = vec![(self.channel + 1, json!({"timestamp": stamp, "transforms": transforms}))];
        if is_first {
            let cubes: Vec<Value> = taken().map(|(_, seat)| cube(&seat.name, &stamp)).collect();
            told.insert(0, (self.channel, json!({"deletions": [], "entities": cubes})));
        }
        told.into_iter()
            .map(|(channel, value)| Entry { channel, log_time, data: value.to_string().into_bytes() })
            .collect()
    }

    #[expect(clippy::cast_precision_loss, reason = "some hundred seats")]
    fn transform(&self, lane: usize, name: &str, stamp: &Value) -> Value {
        let (high, turned) = self.places[lane];
        let [x, y] = [lane / IN_ROW, lane % IN_ROW].map(|place| place as f64 * APART_M);
        json!({
            "timestamp": stamp,
            "parent_frame_id": "hall",
            "child_frame_id": frame_id(name),
            "translation": {"x": x, "y": y, "z": high},
            "rotation": {"x": 0.0, "y": 0.0, "z": (turned / 2.0).sin(), "w": (turned / 2.0).cos()},
        })
    }
}

fn frame_id(name: &str) -> String {
    format!("seat {name}")
}

/// How high a seat is, m, and how far it is turned, radians; `None` of a frame that says nothing of places.
#[expect(clippy::cast_precision_loss, reason = "twelve axes")]
fn placed(seat: &RecordedSeat, sent: &[f64]) -> Option<(f64, f64)> {
    let of = |unit| {
        seat.axes().iter().zip(sent).filter(move |(axis, _)| axis.unit == unit).map(|(_, place)| *place)
    };
    let count = of(AxisUnit::Millimetre).count().max(1) as f64;
    let high = of(AxisUnit::Millimetre).sum::<f64>() / count / 1e3;
    let turned = of(AxisUnit::Degree).next().unwrap_or_default().to_radians();
    (!sent.is_empty()).then_some((high, turned))
}

/// A seat that goes with its frame of reference.
fn cube(name: &str, stamp: &Value) -> Value {
    let at = |z: f64| json!({"position": {"x": 0.0, "y": 0.0, "z": z}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}});
    let colour = |level: f64| json!({"r": level, "g": level, "b": level, "a": 1.0});
    json!({
        "timestamp": stamp,
        "frame_id": frame_id(name),
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": true,
        "metadata": [], "arrows": [], "spheres": [], "cylinders": [], "lines": [], "triangles": [], "models": [],
        "cubes": [{"pose": at(0.25), "size": {"x": 0.6, "y": 0.6, "z": 0.5}, "color": colour(0.6)}],
        "texts": [{"pose": at(0.7), "billboard": true, "font_size": 0.2, "scale_invariant": false, "color": colour(0.9), "text": name}],
    })
}
