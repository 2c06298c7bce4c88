//! The protocols between threads that are made by hand, each tried in every order in which its threads may run, and with every value
//! that memory may show them by its rules (loom). The files of the program are compiled here a second time, with loom's atomics in
//! place of the standard library's and a pose of two axes: so what is tried is what runs, and the program has nothing of it.
//!
//! ARCHITECTURE.md has a table of all atomics, and why the others need no model.

#![allow(unreachable_pub, reason = "the files of the program are public where the program needs it")]

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

mod desk;
mod evidence;
mod published;
mod word_pairs;

/// The rooms as those files know them.
mod motion {
    /// Each axis more makes many times as many orders.
    pub(crate) const MAX_AXES: usize = 2;
    pub(crate) type Pose = [f64; MAX_AXES];
}
mod time {
    pub(crate) use kinocue::harness::time::MonoTime;
}
#[allow(dead_code, reason = "models need a part of it")]
#[path = "../../src/wire/frame_no.rs"]
mod frame_no;
mod wire {
    pub(crate) use crate::frame_no::FrameNo;
}
mod engine {
    pub(crate) use kinocue::harness::engine::Mix;
}

/// Tries a model in every order of its threads, and gives what came of it, once each: a model in which too little can come about proves
/// nothing, so each says what has to have come about.
///
/// The thread that writes is the model's own, which runs first, and those that read are spawned: loom then shows them every value that
/// may be shown. The other way round it tries a single order where the writer looks at a word before it writes that.
fn every_order<T: Ord + Send + 'static>(model: impl Fn() -> T + Sync + Send + 'static) -> BTreeSet<T> {
    let came = Arc::new(Mutex::new(BTreeSet::new()));
    let outcomes = Arc::clone(&came);
    loom::model(move || {
        let outcome = model();
        outcomes.lock().expect("nobody panics with it").insert(outcome);
    });
    std::mem::take(&mut *came.lock().expect("nobody panics with it"))
}
