//! Wiring: opens everything, starts and stops the threads, and sums up. Knows every room; no room knows it.

mod prepare;
mod play;
mod report;

pub use play::{Play, PlayError, Played};
pub use report::{ControllerReport, LatencyReport, RealTimeReport, Report};
