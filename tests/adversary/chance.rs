//! Histories by chance.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use kinocue::harness::state::LedBefore;
use kinocue::harness::sys::clock::wall_now_ns;

use super::bent::Bent;
use super::cues::KINDS;
use super::dice::Dice;
use super::ether::Ether;
use super::hall::{breaches, open, seats};
use super::judge::{Breach, How};
use super::person::{Close, Person};
use super::seat::MS;

/// Where the histories begin that are always the same.
const FIXED: u64 = 12_000_000;

/// One history in so many ends with a calm in which what is on has to go off.
const CALM: u64 = 8;

/// What is kept of a history beside what seats did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Keeps {
    /// Nothing.
    Nothing,
    /// What happened, in words.
    Diary,
    /// A recording of each hall.
    Recordings,
}

/// What came of a history.
#[derive(Debug)]
pub(crate) struct Past {
    pub(crate) seed: u64,
    pub(crate) breaches: Vec<Breach>,
    frames: u64,
    diary: Vec<String>,
    pub(crate) recordings: Vec<Vec<u8>>,
}

/// Lives through the history of a seed, with no more than so many deeds.
pub(crate) fn live_through(seed: u64, bent: Option<Bent>, deeds: u64, keeps: Keeps) -> Past {
    let told = keeps == Keeps::Diary;
    let mut dice = Dice::new(seed ^ 0xadde);
    let kinds = bent.map_or(&KINDS[..], |bent| bent.kinds(&mut dice));
    let mut kind = dice.pick(kinds);
    // The faster it sends, the shorter.
    let ms = dice.range(2_500, 4_500) * 50 / (kind.hz as u64).clamp(50, 100);
    let ms = if kind.hz > 500.0 { ms.min(1_500) } else { ms };
    let ether = Ether::new(&seats(&kind), seed);
    let mut person = Person::new(seed, deeds, ether.ns() + (ms + 800) * MS, bent);
    person.furnish(&ether);
    let crashed = dice.one_in(3);
    let (mut numbers, mut before) =
        (BTreeMap::new(), if crashed { LedBefore::Crashed } else { LedBefore::Ended });
    let mut diary = Vec::new();
    ether.world().recordings = (keeps == Keeps::Recordings).then(Vec::new);
    ether.world().frames = setting("KINOCUE_FRAMES").filter(|_| told).map(|_| Vec::new());
    if told {
        diary.push(format!("seed {seed}: {kind:?}"));
        let world = ether.world();
        for line in &world.lines {
            let place: Vec<i64> = line.seat.place(0).iter().map(|at| (at / 2_000.0) as i64).collect();
            diary.push(format!("{:?} at {place:?} mm", line.seat.settings));
        }
    }
    loop {
        let (close, next) = open(&ether, kind, before, &numbers, |hall| {
            hall.diary = told.then(|| std::mem::take(&mut diary));
            let close = person.lead(hall);
            if close == Close::Over && seed.is_multiple_of(CALM) {
                hall.comes_to_a_calm();
            }
            diary = hall.diary.take().unwrap_or_default();
            close
        });
        let Close::Again(again) = close else { break };
        ether.world().asked = false;
        ether.pass_to(ether.ns() + 50 * MS);
        (numbers, before) = (if again == LedBefore::Ended { next } else { BTreeMap::new() }, again);
        if bent.is_some_and(Bent::reloads) {
            kind = dice.pick(kinds);
            diary.push(format!("it opens anew: {kind:?}"));
        }
    }
    // What is on its way still arrives.
    ether.pass_to(ether.ns() + 1_000 * MS);
    diary.extend(ether.world().frames.take().into_iter().flatten());
    let frames = ether.world().lines.iter().map(|line| line.frames).sum();
    let recordings = ether.world().recordings.take().unwrap_or_default();
    Past { seed, breaches: breaches(&ether), frames, diary, recordings }
}

pub(crate) fn setting(name: &str) -> Option<u64> {
    std::env::var(name)
        .ok()
        .map(|value| value.parse().unwrap_or_else(|_| panic!("{name}={value} is no number")))
}

/// Lives through so many histories on two threads: those in which a seat did what no seat may.
fn histories(first: u64, count: u64, bent: Option<Bent>) -> Vec<Past> {
    let [next, frames] = [0; 2].map(AtomicU64::new);
    let work = || {
        let mut bad = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return bad;
            }
            let past = live_through(first + index, bent, u64::MAX, Keeps::Nothing);
            frames.fetch_add(past.frames, Ordering::Relaxed);
            if !past.breaches.is_empty() {
                bad.push(past);
            }
        }
    };
    let bad = thread::scope(|scope| {
        let threads = [scope.spawn(work), scope.spawn(work)];
        let mut bad: Vec<Past> =
            threads.into_iter().flat_map(|thread| thread.join().expect("no history panics")).collect();
        bad.sort_by_key(|past| past.seed);
        bad
    });
    let each = frames.into_inner() / count.max(1);
    println!("{each} frames in each");
    let least = match bent {
        None => 50,
        // Seats with axes that the hall knows nothing of are sent nothing.
        Some(Bent::Fewer) => 0,
        Some(_) => 25,
    };
    assert!(each >= least, "{each} frames in a history: nothing was played");
    bad
}

/// One history in full.
pub(crate) fn tell(seed: u64, bent: Option<Bent>) {
    let past = live_through(seed, bent, setting("KINOCUE_DEEDS").unwrap_or(u64::MAX), Keeps::Diary);
    past.diary.iter().for_each(|line| println!("{line}"));
    past.breaches.iter().for_each(|breach| println!("{breach}"));
    println!("{} frames", past.frames);
    assert!(past.breaches.is_empty(), "seed {seed}: {} moves that no seat may make", past.breaches.len());
}

/// No more than `most` of so many histories break the judge.
#[track_caller]
pub(crate) fn assert_at_most(most: usize, first: u64, count: u64, bent: Option<Bent>) {
    println!("{bent:?}: {count} histories from seed {first}");
    let bad = histories(first, count, bent);
    for past in bad.iter().take(20) {
        let worst = past.breaches.iter().max_by(|a, b| a.mm_s().total_cmp(&b.mm_s()));
        println!("seed {}: {} times, worst {}", past.seed, past.breaches.len(), worst.expect("there is one"));
    }
    let unasked = bad.iter().filter(|past| past.breaches.iter().any(|one| one.how == How::Unasked)).count();
    let farthest = bad.iter().flat_map(|past| &past.breaches).max_by(|a, b| a.mm.total_cmp(&b.mm));
    if let Some(farthest) = farthest {
        println!("{} of {count}, in {unasked} of them unasked; the farthest {farthest}", bad.len());
    }
    assert!(
        bad.len() <= most,
        "{bent:?}: {} of {count} histories, {most} are open; KINOCUE_HISTORIES=1 KINOCUE_SEED={} tells the first",
        bad.len(),
        bad[0].seed
    );
}

/// The share of histories of any seed that may be open yet: of 100,000 drawn for this none was.
const OPEN_SHARE: f64 = 0.000_02;

fn open_of(count: u64) -> usize {
    (OPEN_SHARE * count as f64) as usize
}

#[test]
fn no_history_moves_a_seat_faster_than_its_type_allows_or_unasked() {
    match (setting("KINOCUE_SEED"), setting("KINOCUE_HISTORIES").unwrap_or(5_000)) {
        (Some(seed), 1) => tell(seed, None),
        (Some(seed), count) => assert_at_most(open_of(count), seed, count, None),
        (None, count) => assert_at_most(if count > 5_000 { open_of(count) } else { 0 }, FIXED, count, None),
    }
}

#[test]
fn nor_do_any_of_five_thousand_that_were_drawn_anew() {
    let count = setting("KINOCUE_HISTORIES").unwrap_or(5_000);
    if setting("KINOCUE_SEED").is_some() {
        return; // the other one plays them
    }
    assert_at_most(open_of(count), wall_now_ns() / 1_000, count, None);
}
