//! What moves: axes, poses, seat types and how motion is measured. Pure; no file, no clock, no allocation in
//! anything that the tick thread calls.

mod axis;
mod brake;
mod halt;
mod measure;
mod seat;
mod window;

pub use axis::AxisGeometry;
pub(crate) use axis::{AxisUnit, PARKS_WITHIN_S};
pub(crate) use brake::{AxisState, Brake};
pub(crate) use halt::{Begun, Halt, Means};
pub use measure::{Measure, Spacing};
pub(crate) use measure::{MeasurePlaces, MeasureTimes, PoseReadings, Reading, Readings};
pub(crate) use seat::{FACTORY_INTERVAL_MS, PulseRange, in_stroke};
pub use seat::{Pulses, SeatAxis, SeatType};
pub(crate) use window::MAX_LEAD;
pub use window::{Limits, Slot, Window};

/// The most axes a cue, a frame or a controller can have (PA02, SMC manual 1.5).
pub const MAX_AXES: usize = 12;

/// All axes of a cue at an instant, axis 1 first, in the unit of whoever made it; axes past the last one are 0.
pub type Pose = [f64; MAX_AXES];
