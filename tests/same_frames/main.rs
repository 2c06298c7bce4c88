//! Halls by chance, in virtual time: shows that are let go, chased, paused, sought in, parked and loaded anew, gaps, levels, trims,
//! seats that fall out and are found, a planner that is late or finds nothing. What leaves is, byte for byte, what left when the
//! digests in tests/data/same_frames.txt were taken; whoever changes that on purpose takes them anew and says why.
//!
//! `KINOCUE_SEQUENCES=0..1000000/1000 cargo test --release --test same_frames -- --nocapture` prints those of more, a line for each
//! thousand, to be compared between two trees.

mod hall;
mod stage;

use std::ops::Range;

use hall::Hall;
use stage::Stage;

/// Sequences to a line of what was taken.
const BLOCK: usize = 50;

/// FNV-1a, 64 bits: what a frame says and when, or what is made known.
#[derive(Clone, Copy)]
struct Digest(u64);

impl Digest {
    const NEW: Self = Self(0xcbf2_9ce4_8422_2325);

    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// What came of some sequences: the digest of what left, that of what was made known, that of where the film was, and how many
/// frames it was.
fn digests(stages: &[Stage], seeds: Range<u64>) -> String {
    let (mut all, mut count) = ([Digest::NEW; 3], 0);
    for seed in seeds.clone() {
        let seen = Hall::live(stages, seed);
        for (all, one) in all.iter_mut().zip([seen.frames, seen.words, seen.film]) {
            all.add(&one.0.to_le_bytes());
        }
        count += seen.count;
    }
    let [frames, words, film] = all.map(|digest| format!("{:016x}", digest.0));
    format!("{}..{} frames {frames} words {words} film {film} count {count}", seeds.start, seeds.end)
}

#[test]
#[expect(clippy::print_stdout, reason = "the digests are for who asks to see them")]
fn what_leaves_is_byte_for_byte_what_left_before() {
    let stages = stage::all();
    if let Ok(asked) = std::env::var("KINOCUE_SEQUENCES") {
        let numbers: Vec<u64> = asked.split(['.', '/']).filter_map(|number| number.parse().ok()).collect();
        let [from, to, block] = numbers[..] else {
            panic!("KINOCUE_SEQUENCES is {asked}, not like 0..1000/50")
        };
        let blocks = (from..to).step_by(usize::try_from(block).expect("it is small"));
        blocks.for_each(|first| println!("{}", digests(&stages, first..first + block)));
        return;
    }
    let taken = include_str!("../data/same_frames.txt");
    for (taken, first) in taken.lines().zip((0..).step_by(BLOCK)) {
        assert_eq!(digests(&stages, first..first + BLOCK as u64), taken);
    }
}
