//! Two show machines of one hall, the machine of its controllers and that of the engine: four network namespaces with real programs in
//! them, and what dies, stands still or is cut off among them. Judged by what the simulated controllers were sent: once the second machine
//! has asked them anything, no frame of the first comes any more. Nothing leaves the namespaces, and root is not needed.

#![allow(clippy::unwrap_used, reason = "a program of its own; whatever fails here fails the test")]

#[path = "../wires/net.rs"]
mod net;
#[path = "../common/process.rs"]
#[allow(dead_code, reason = "each test uses its own part")]
mod process;
#[path = "../common/programs.rs"]
mod programs;
#[path = "../common/serving.rs"]
#[allow(dead_code, reason = "each test uses its own part")]
mod serving;
#[path = "../common/statuses.rs"]
mod statuses;

mod asked;
mod house;
mod takeovers;
