//! kinocue plays motion cues to the seats of a theatre, in time with a film.
//!
//! ```text
//!  cues/*.csv *.mcap --> cue --> timeline             read, check, name the bad cell; then immutable
//!                                   | handed over whole
//!              +------------------- v ------------------------------+
//!              | tick thread, fixed rate, up to 1 kHz               |
//!              |   engine   clock -> tick -> playhead -> Pose       |
//!  control --> |   fanout   Pose -> + axis offset -> octets -> net  | --> controllers
//!              +--------------------|-------------------------------+          |
//!                                   v Sent, TickReport                        acks
//!       report, progress <----- tracker (latency, loss, silence) <---- net <---+
//! ```
//!
//! The rooms, in the order a motion value passes through them; ARCHITECTURE.md walks through each.

#![deny(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a closed pipe must not end a show: `cli::print`"
)]

pub mod time;

pub mod motion;

pub mod wire;

pub mod capture;

pub mod cue;
pub mod timeline;

pub mod plan;

pub mod engine;

pub mod state;

pub mod config;

pub mod fanout;
pub mod gate;
pub mod rt;

pub mod proof;

pub mod sim;

pub mod device;
pub mod preflight;

pub mod app;
pub mod doctor;
pub mod latency;

pub mod api;
pub mod hall;
pub mod health;
pub mod journal;
pub mod library;
pub mod log;
pub mod metrics;
pub mod net;
pub mod observe;
pub mod osc;
pub mod playlist;
pub mod sd;
pub mod text_port;
pub mod tracker;

pub mod sys;

pub mod cli;
pub mod console;
