//! Histories by chance, recorded and judged again: books, observer and health of each say what they said the first time.

use kinocue::harness::recording::{Replayed, datagrams, nameless, replayed};

use super::bent::Bent;
use super::chance::{Keeps, live_through, setting};

/// Where the histories begin that are always the same.
const FIXED: u64 = 16_000_000;

/// Lives through so many histories, and gives what judging them again came to, with what differs in each.
fn judged_again(first: u64, count: u64) -> (Replayed, Vec<String>) {
    let bents =
        [None, Some(Bent::Master), Some(Bent::Mbox), Some(Bent::Reload), Some(Bent::Lie), Some(Bent::Deaf)];
    let (mut all, mut differs) = (Replayed::default(), Vec::new());
    for seed in first..first + count {
        let bent = bents[(seed % bents.len() as u64) as usize];
        for (hall, file) in
            live_through(seed, bent, u64::MAX, Keeps::Recordings).recordings.iter().enumerate()
        {
            let Replayed { frames, fates, standings, is_whole, differences } = replayed(file);
            all.frames += frames;
            all.fates += fates;
            all.standings += standings;
            let trouble =
                differences.first().cloned().or_else(|| (!is_whole).then(|| "not whole".to_owned()));
            differs.extend(trouble.map(|one| format!("seed {seed}, {bent:?}, hall {hall}: {one}")));
        }
    }
    (all, differs)
}

#[test]
fn a_history_that_was_recorded_is_judged_again_as_it_was() {
    let (first, count) = (setting("KINOCUE_SEED"), setting("KINOCUE_HISTORIES"));
    let count = count.unwrap_or(30);
    let (all, differs) = judged_again(first.unwrap_or(FIXED), count);
    println!("{count} histories: {} frames, {} replies, {} standings", all.frames, all.fates, all.standings);
    assert!(all.frames > 50 * count && all.fates > 20 * count && all.standings > 3 * count, "{all:?}");
    assert!(
        differs.is_empty(),
        "{} of {count} differ:\n{}",
        differs.len(),
        differs[..differs.len().min(10)].join("\n")
    );
}

#[test]
fn a_recording_without_names_is_judged_as_it_was_and_names_no_station_of_the_hall() {
    let first = setting("KINOCUE_SEED").unwrap_or(FIXED);
    let mut frames = 0;
    for seed in first..first + 5 {
        for file in live_through(seed, None, u64::MAX, Keeps::Recordings).recordings {
            let cut = nameless(&file);
            let (whole, again) = (replayed(&file), replayed(&cut));
            assert_eq!((&again.differences[..], again.is_whole), (&[][..], true), "seed {seed}");
            let counts = |all: &Replayed| (all.frames, all.fates, all.standings);
            assert_eq!(counts(&again), counts(&whole), "seed {seed}");
            for (lane, datagram, _) in datagrams(&cut) {
                assert_eq!(datagram[8..10], [64, lane as u8 + 1], "who accepts it is made up");
                frames += 1;
            }
            if let Ok(path) = std::env::var("KINOCUE_KEEP") {
                std::fs::write(format!("{path}-{seed}-{}.mcap", cut.len()), cut).expect("there is room");
            }
        }
    }
    assert!(frames > 100, "{frames}");
}
