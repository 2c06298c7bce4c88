//! The HTTP API and the stop socket, served for real on a socket in a folder of their own and on a loopback port, before a
//! hall that is a double: a thread that takes what is asked, notes it, and answers.

#![allow(
    unreachable_pub,
    clippy::unwrap_used,
    reason = "a program of its own; whatever fails here fails the test"
)]

mod access;
#[path = "../common/http.rs"]
mod client;
mod cues;
mod events;
mod hall;
mod late;
mod limits;
mod live;
#[path = "../common/programs.rs"]
mod programs;
mod replies;
mod routes;
#[path = "../common/script.rs"]
mod script;
