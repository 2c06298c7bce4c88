//! An adversary: whole halls in virtual time, with the real loops, virtual seats that execute what they are sent as the
//! manuals say, a network that loses, holds back, repeats and reorders, and a person who does whatever comes to mind. The
//! judge looks at nothing but where the axes of the seats went, how fast, and what is on there though nobody asks for it.
//!
//! `KINOCUE_HISTORIES=N` plays so many histories instead of the default; `KINOCUE_SEED=S` begins at that seed, and with
//! `KINOCUE_DEEDS=K` the person does no more than K things: `KINOCUE_HISTORIES=1 KINOCUE_SEED=S KINOCUE_DEEDS=K` is how a
//! history that was found is made shorter. A single history prints what happened in it, and with `KINOCUE_FRAMES=1` each
//! frame.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "pulses of a stroke and nanoseconds of a minute fit all of these"
)]

#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "../no_alloc/counting.rs"]
mod counting;
#[expect(dead_code, reason = "shared with tests that need more of it")]
#[allow(unreachable_pub, clippy::unwrap_used, reason = "whatever fails there fails the test")]
#[path = "../common/http.rs"]
mod http;
#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "../common/process.rs"]
mod process;
#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "../common/serving.rs"]
mod serving;

mod again;
mod anew;
mod bent;
mod chance;
mod cues;
mod dark;
mod dice;
mod ether;
mod fresh;
mod hall;
mod judge;
mod losses;
mod master;
mod named;
mod odd;
mod old;
mod on;
mod person;
mod plays;
mod processes;
mod rules;
mod seat;
mod seldom;
mod soak;
mod together;
mod town;
mod words;
