//! Cues, from files of all kinds.

use std::io::Cursor;
use std::path::Path;

use crate::channel::Sample;
use crate::cue::{self, Cue, CueFaults, Source, TrackStep};
use crate::motion::MAX_AXES;
use crate::time::ShowTime;
use crate::wire::Analogue;

const AGAIN: &str = "what was read can be written, and read again";

pub(super) fn read(name: &str, octets: &[u8], source: &Source) {
    assert_read(cue::read(Path::new(name), octets, source));
}

/// A cue that can be had back as it is from the file that is made of it; or faults that can be told.
pub fn assert_read(read: Result<Cue, CueFaults>) {
    match read {
        Ok(cue) => {
            assert_sound(&cue);
            let mut file = Cursor::new(Vec::new());
            cue::write_mcap(&cue, &mut file).expect(AGAIN);
            let again =
                cue::read(Path::new("t.mcap"), file.get_ref().as_slice(), &Source::Native).expect(AGAIN);
            assert_eq!((again.times(), again.positions()), (cue.times(), cue.positions()));
            assert_eq!((again.title(), again.tracks()), (cue.title(), cue.tracks()));
            let mut text = Vec::new();
            if cue::write_csv(&cue, &mut text).is_ok() {
                let again = cue::read(Path::new("t.csv"), text.as_slice(), &Source::Native).expect(AGAIN);
                assert_eq!((again.title(), again.positions()), (cue.title(), cue.positions()));
                assert_eq!(said(&again), said(&cue));
            }
        }
        Err(faults) => assert!(is_plain(&faults.to_string()), "{:?}", faults.to_string()),
    }
}

/// What a cue says of its effects. In a table each has a cell in the first row, 0 where nothing was said; of messages the first may be
/// later, and until then it is 0 as well.
fn said(cue: &Cue) -> Vec<(String, Vec<String>)> {
    const UNSAID: &str = "TrackStep { at: ShowTime(0), value: Sample([0.0, 0.0]) }";
    let told = cue.tracks().used().map(|(track, steps)| {
        let steps = steps.as_slice().iter().map(|step| format!("{step:?}"));
        (track.to_string(), steps.skip_while(|step| step == UNSAID).collect())
    });
    told.collect()
}

/// Whether a cue says in its file that all of its axes are in fractions of the stroke.
fn is_in_fractions(cue: &Cue) -> bool {
    let mut text = Vec::new();
    cue::write_csv(cue, &mut text)
        .is_ok_and(|()| String::from_utf8_lossy(&text).contains("# units: fraction\n"))
}

/// What every cue promises to those behind it.
fn assert_sound(cue: &Cue) {
    assert!(cue.rows() >= 2 && (1..=MAX_AXES).contains(&cue.axes()));
    assert_eq!((cue.times().len() * cue.axes(), cue.times()[0]), (cue.positions().len(), ShowTime::ZERO));
    assert!(cue.times().is_sorted_by(|a, b| a < b));
    // Whether a place below 0 is right is the seat's question: the zero of an axis in mm, degrees or pulses may be inside its range.
    let floor = if is_in_fractions(cue) { 0.0 } else { -f64::from(i32::MAX) };
    assert!(cue.positions().iter().all(|position| position.is_finite() && *position >= floor));
    for (track, steps) in cue.tracks().used() {
        let values = || steps.as_slice().iter().map(|TrackStep { value: Sample(values), .. }| *values);
        assert!(values().flatten().all(|value| value >= 0.0), "{track}");
        let mut extends = values().map(|levels| Analogue::from_levels(levels).extend());
        let is_analogue = track.to_string().contains("analogue");
        assert!(!is_analogue || extends.all(|extend| extend != 0x5678_abcd), "never sent");
    }
    assert!(cue.title().is_none_or(is_plain), "{:?}", cue.title());
    assert!(cue.markers().iter().all(|marker| marker.name.is_empty() || is_plain(&marker.name)));
}

/// Whether a text is one to show: short lines of characters that a terminal does not obey.
pub fn is_plain(text: &str) -> bool {
    let obeyed = |c: char| c.is_control() || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    !text.is_empty() && text.lines().all(|line| line.len() < 1_500 && !line.contains(obeyed))
}
