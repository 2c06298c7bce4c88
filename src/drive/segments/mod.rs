//! From the poses of an axis to what a serial drive is sent, and to what it makes of that. Pure; allocates nothing.
//!
//! Poses come tick by tick, as to every controller; [`Middles`] makes of them what the axis does in the middle of each slice of
//! the link's grid, [`SegmentFit`] segments of that for a SilverMax, and [`TargetMaker`] targets for a SIXpack 2. What the drive makes of
//! those, [`DriveCourse`] and [`Motor`] know. A proof and a play run the same code.

mod fit;
mod knots;
mod middles;
mod model;
mod segment;
mod sixpack;
mod vibration;

pub(crate) use fit::SegmentFit;
pub(crate) use knots::Knots;
pub(crate) use middles::{Middle, Middles};
pub(crate) use model::{DriveCourse, DriveUnits, TICK_NS};
pub(crate) use segment::Segment;
pub(crate) use sixpack::{LOOP, Lag, Motor, TargetMaker};
pub(crate) use vibration::Shaker;
