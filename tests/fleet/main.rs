//! Halls, their links, a desk and the real engine (nats-server), all of them real processes on loopback.

#![allow(
    unreachable_pub,
    clippy::unwrap_used,
    reason = "a program of its own; whatever fails here fails the test"
)]

#[path = "../console/browser.rs"]
#[allow(dead_code, reason = "each test uses its own part")]
mod browser;
#[path = "../daemon/hall.rs"]
#[allow(dead_code, reason = "each test uses its own part")]
mod hall;
#[path = "../common/http.rs"]
#[allow(dead_code, reason = "each test uses its own part")]
mod http;
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

mod cues;
mod cuts;
mod demo;
mod desk;
mod drops;
mod fleet;
mod forged;
mod keys;
mod lists;
mod log;
mod page;
mod pull;
mod relay;
mod rights;
mod socket;
mod start;
mod trouble;
