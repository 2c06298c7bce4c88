//! The HTTP API and the stop socket, served for real on a socket in a folder of their own and on a loopback port, before a
//! hall that is a double: a thread that takes what is asked, notes it, and answers.

mod access;
mod client;
mod cues;
mod events;
mod hall;
mod late;
mod limits;
mod replies;
mod routes;
