//! The daemon as a house runs it: `kinocue serve` against the virtual controllers of `kinocue sim`, real processes both, led
//! by the client commands and over its sockets.

#![allow(
    unreachable_pub,
    clippy::unwrap_used,
    reason = "a program of its own; whatever fails here fails the test"
)]

#[path = "../common/http.rs"]
#[expect(dead_code, reason = "each test uses its own part")]
mod http;
#[path = "../common/printed.rs"]
mod printed;
#[path = "../common/process.rs"]
#[expect(dead_code, reason = "each test uses its own part")]
mod process;
#[path = "../common/programs.rs"]
mod programs;
#[path = "../common/serving.rs"]
mod serving;
#[path = "../common/statuses.rs"]
mod statuses;

#[path = "../common/wav.rs"]
mod wav;

mod begin;
mod buttons;
mod disks;
mod drives;
mod film;
mod hall;
mod lasting;
mod library;
mod mbox;
mod notify;
mod pages;
mod player;
mod playlist;
mod recordings;
mod remedies;
mod show;
mod signals;
mod surfaces;
mod trouble;
