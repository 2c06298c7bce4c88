//! Wiring: opens everything, starts and stops the threads, and sums up. Knows every room; no room knows it.

mod broadcasts;
pub(crate) mod buttons;
mod company;
pub(crate) mod film;
mod helpers;
mod links;
pub(crate) mod notify;
pub(crate) mod pair;
mod play;
pub(crate) mod player;
pub(crate) mod recorder;
pub(crate) mod recording;
mod refused;
mod report;
mod roll_call;
mod run;
pub(crate) mod runtime;
mod script;
pub(crate) mod serve;
pub(crate) mod staged;
mod sum_up;
pub(crate) mod supervisor;
pub(crate) mod surfaces;

pub use play::Play;
pub(crate) use refused::PlayError;
pub(crate) use report::PlayReport;
pub(crate) use roll_call::RollCall;
pub use runtime::Control;
pub use script::PlayHandle;
pub use staged::StagedShow;
pub use sum_up::Played;
