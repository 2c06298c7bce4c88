//! One hall as its surfaces see it: what they may ask, who asks, what the hall says of itself, and why it refuses. The HTTP
//! API, the client commands, OSC, the plain-text port and the console all speak these words. Control plane; no surface
//! touches the tick thread but by [`Handle::stop`], which sets a flag that is read every tick.

mod ask;
mod awaited;
mod broadcasts;
mod clock;
mod handle;
mod links;
pub(crate) mod model;
mod places;
mod posted;
mod problem;
mod recordings;
mod status;
mod who;

pub use crate::config::Role;
pub(crate) use ask::Levels;
pub use ask::StartOrder;
pub use ask::{Command, LevelsChange};
pub(crate) use awaited::AwaitedPorts;
pub(crate) use broadcasts::BroadcastStatus;
pub(crate) use clock::{ClockReading, SharedClock};
pub(crate) use handle::{Asked, asked_at, overtaken};
pub use handle::{Desired, Handle, Inbox, StatusSource, handle};
pub(crate) use links::{LinkAxisStatus, LinkStatus};
pub use model::Health;
pub(crate) use model::{Coded, Histogram, Percentiles, Severity, Then, Times};
pub(crate) use places::{Place, Places, network};
pub(crate) use posted::Posted;
pub use problem::{Code, Problem};
#[cfg(test)]
pub(crate) use problem::{NEEDS_ENGINEER, NOT_TAKEN};
pub(crate) use recordings::is_recording;
pub(crate) use status::{
    ArmedForStatus, ButtonsStatus, ClockStatus, EntryStatus, FORMAT, FilmDisagreement, FilmSourceStatus,
    FilmStatus, FleetStatus, HallFacts, MarginOf, MarginStatus, NotifyStatus, PlaylistStatus,
    PreflightStatus, RealTimeStatus, RecordStatus, ShowStatus, StartPhase, StartStatus, TestRow, TestStatus,
    Warning,
};
pub use status::{ControllerStatus, JournalLine, Status};
pub use who::{Surface, Who};
