//! One hall as its surfaces see it: what they may ask, who asks, what the hall says of itself, and why it refuses. The HTTP
//! API, the client commands, OSC, the plain-text port and the console all speak these words. Control plane; no surface
//! touches the tick thread but by [`Handle::stop`], which sets a flag that is read every tick.

mod ask;
mod handle;
pub mod model;
mod places;
mod problem;
mod status;
mod who;

pub use crate::config::Role;
pub use ask::{Command, Levels, LevelsChange};
pub use handle::{Asked, Desired, FRESH, Handle, Inbox, Posted, StatusSource, handle, overtaken};
pub use model::{FrameCounts, Health, Histogram, Percentiles, Severity, Then, Times};
pub use places::{Place, Places, network};
pub use problem::{Code, Problem};
pub use status::{
    ControllerStatus, EntryStatus, FORMAT, FilmSourceStatus, FilmStatus, HallFacts, JournalLine,
    PlaylistStatus, PreflightStatus, RealTimeStatus, ShowStatus, Status, TestRow, TestStatus, Warning,
};
pub use who::{Surface, Who};
