//! Wiring: opens everything, starts and stops the threads, and sums up. Knows every room; no room knows it.

mod company;
pub mod film;
mod helpers;
mod play;
mod prepare;
mod report;
mod run;
pub mod runtime;
pub mod serve;
mod stage;
pub mod staged;
mod sum_up;
pub mod supervisor;
pub mod surfaces;

pub use play::{Control, Play, PlayError, PlayHandle, Played};
pub use report::{ControllerReport, EventReport, RealTimeReport, Report, SpinReport, StateReport};
pub use run::Run;
pub use staged::StagedShow;
