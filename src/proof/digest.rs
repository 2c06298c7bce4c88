//! Which cue a proof is about: a digest of everything in it that moves, shakes or switches something.

use std::fmt;

use sha2::{Digest as _, Sha256};

use crate::channel::{ChannelId, Sample, TrackId};
use crate::cue::{Cue, Effects, Steps};
use crate::time::ShowTime;

/// Bytes that are hashed at once.
const CHUNK: usize = 1 << 16;

/// The SHA-256 of what a cue does: rows, units, interpolation, channels and effects, as they are in memory. Title, markers
/// and the format of the file do not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Digest(pub [u8; 32]);

impl Digest {
    /// The digest of a cue.
    #[must_use]
    pub fn of(cue: &Cue) -> Self {
        let mut sink = Sink { hash: Sha256::new(), buffer: Vec::with_capacity(CHUNK + 8) };
        // Each text and list with its length first: without it two cues could run together to the same bytes.
        sink.text(&cue.unit_words());
        sink.text(cue.interpolation().name());
        sink.count(cue.axes());
        sink.count(cue.rows());
        cue.times().iter().for_each(|time| sink.time(*time));
        cue.positions().iter().for_each(|position| sink.bytes(position.to_le_bytes()));
        (0..cue.axes()).for_each(|axis| sink.track(cue, ChannelId::Vibration.on(axis)));
        match cue.effects() {
            Effects::Named { names, steps } => {
                sink.count(names.len());
                names.iter().for_each(|name| sink.text(name));
                sink.steps(steps, |sink, on| sink.bytes(u64::from(on).to_le_bytes()));
            }
            Effects::Words(steps) => {
                sink.count(usize::MAX); // unlike any count of names
                sink.steps(steps, |sink, word| sink.bytes(u64::from(word).to_le_bytes()));
            }
        }
        // What came after the first release counts where a cue has it: the others keep the digest that they had.
        for (track, _) in cue.tracks().used().filter(|(track, _)| track.channel != ChannelId::Vibration) {
            sink.text(track.channel.row().topic);
            sink.count(track.axis);
            sink.track(cue, track);
        }
        sink.hash.update(&sink.buffer);
        Self(sink.hash.finalize().into())
    }
}

impl fmt::Display for Digest {
    /// 64 hex digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Gathers small values, so that they are hashed many at once.
struct Sink {
    hash: Sha256,
    buffer: Vec<u8>,
}

impl Sink {
    fn bytes(&mut self, bytes: [u8; 8]) {
        self.buffer.extend_from_slice(&bytes);
        if self.buffer.len() >= CHUNK {
            self.hash.update(&self.buffer);
            self.buffer.clear();
        }
    }

    fn count(&mut self, count: usize) {
        self.bytes((count as u64).to_le_bytes());
    }

    fn time(&mut self, time: ShowTime) {
        self.bytes(time.as_nanos().to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.buffer.extend_from_slice(text.as_bytes());
    }

    fn track(&mut self, cue: &Cue, track: TrackId) {
        let parts = track.channel.row().parts.len();
        self.steps(cue.tracks().of(track), |sink, Sample(values)| {
            values[..parts].iter().for_each(|value| sink.bytes(value.to_le_bytes()));
        });
    }

    fn steps<T: Copy + PartialEq + Default>(&mut self, steps: &Steps<T>, value: impl Fn(&mut Self, T)) {
        self.count(steps.as_slice().len());
        for step in steps.as_slice() {
            self.time(step.at);
            value(self, step.value);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cue::{Source, read};

    fn digest(text: &str) -> Digest {
        Digest::of(&read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
    }

    #[test]
    fn what_moves_shakes_or_switches_counts_and_nothing_else() {
        let cue = "time_ms,a1,v1_hz,v1_amp,fx_air\n0,0.5,20,0.01,1\n10,0.6,20,0.01,0\n";
        let same = digest(cue);
        assert_eq!(digest(&format!("# title: another\n{cue}")), same);
        for (from, to) in
            [("0.6", "0.7"), ("10,", "11,"), ("0.01,0", "0.02,0"), ("0.01,0", "0.01,1"), ("air", "wind")]
        {
            assert_ne!(digest(&cue.replace(from, to)), same, "{from} to {to}");
        }
        assert_ne!(digest(&format!("# interpolation: linear\n{cue}")), same);
        assert_eq!(same.to_string().len(), 64);
    }
}
