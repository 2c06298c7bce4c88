//! kinocue plays motion cues to the seats of a theatre, in time with a film.
//!
//! ```text
//!  cues/*.csv *.mcap --> cue --> timeline             read, check, name the bad cell; then immutable
//!                                   | handed over whole
//!              +------------------- v ------------------------------+
//!              | tick thread, fixed rate, up to 1 kHz               |
//!              |   engine   clock -> tick -> playhead -> Pose       |
//!  control --> |   drive    Pose -> + axis offset -> bytes -> net  | --> controllers
//!              +--------------------|-------------------------------+          |
//!                                   v Sent, TickReport                        acks
//!       report, progress <----- tracker (latency, loss, silence) <---- net <---+
//! ```
//!
//! The rooms: first those that a motion value passes through, in their order, then what surrounds them. ARCHITECTURE.md walks
//! through each.

#![deny(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a closed pipe must not end a show: `cli::print`"
)]

pub mod motion;
pub mod plain;
pub mod time;
pub mod wire;

pub mod channel;
pub mod cue;
pub mod timeline;

pub mod checks;
pub mod config;
pub mod proof;

pub mod belief;
pub mod drive;
pub mod engine;
pub mod film;
pub mod limiter;
pub mod plan;
pub mod rt;
pub mod state;

pub mod health;
pub mod net;
pub mod observe;
pub mod tracker;

pub mod device;
pub mod preflight;

pub mod control;
pub mod journal;
pub mod library;
pub mod playlist;
pub mod settings;

pub mod api;
pub mod console;
pub mod log;
pub mod metrics;
pub mod osc;
pub mod sd;
pub mod text_port;

pub mod capture;
pub mod doctor;
pub mod latency;
pub mod sim;

#[cfg(feature = "harness")]
pub mod harness;

pub mod app;
pub mod cli;
pub mod sys;
