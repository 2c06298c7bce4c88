//! Wiring: opens everything, starts and stops the threads, and sums up. Knows every room; no room knows it.

mod company;
pub(crate) mod film;
mod helpers;
mod play;
mod refused;
mod report;
mod run;
pub mod runtime;
mod script;
pub mod serve;
pub mod staged;
mod sum_up;
pub mod supervisor;
pub mod surfaces;

pub use play::Play;
pub use refused::PlayError;
pub use report::{ControllerReport, EventReport, RealTimeReport, Report, SpinReport, StateReport};
pub use run::Run;
pub use runtime::Control;
pub use script::PlayHandle;
pub use staged::StagedShow;
pub use sum_up::Played;
