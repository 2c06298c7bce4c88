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
#![allow(
    rustdoc::private_intra_doc_links,
    reason = "what the documentation is built of includes what is private"
)]
#![cfg_attr(
    not(feature = "harness"),
    allow(
        dead_code,
        unreachable_pub,
        unused_imports,
        reason = "tests and benches reach them; with `harness`, nothing may be"
    )
)]

mod json;
mod kind;
mod motion;
mod plain;
mod published;
mod time;
pub mod wire;

mod channel;
mod container;
pub mod cue;
mod edit;
mod timeline;

mod checks;
mod config;
mod proof;

mod belief;
mod drive;
mod engine;
mod film;
mod limiter;
mod plan;
mod record;
mod rt;
mod state;

mod health;
mod net;
mod observe;
mod tracker;

mod device;
mod preflight;
mod replay;

mod control;
mod fleet;
mod journal;
mod library;
mod pair;
mod playlist;
mod settings;

mod api;
mod console;
mod log;
mod metrics;
mod osc;
mod sd;
mod text_port;

mod capture;
mod doctor;
mod latency;
mod plot;
mod sim;

#[cfg(feature = "harness")]
pub mod harness;

mod app;
pub mod cli;
mod sys;
