//! Blocks of samples, as they are read, into observations.

use std::time::Duration;

use super::Label;
use super::decoder::{LtcDecoder, LtcFrame};
use crate::film::labels::LabelClock;
use crate::film::observation::{FilmWord, Observation};
use crate::film::samples::SampleClock;
use crate::film::timecode::FrameRate;
use crate::time::{MonoTime, ShowTime};

/// A line is silent after so many cells without an edge: 2 ms of a film at its speed.
const SILENT_CELLS: f64 = 4.0;
/// It is dirty after so many without a frame: four frames.
const DIRTY_CELLS: f64 = 320.0;
/// Deviation of the instant of a frame, seconds.
const FRAME_SIGMA_S: f64 = 0.000_05;

/// Reads one channel of sound as LTC.
#[derive(Debug, Clone)]
pub(crate) struct LtcReader {
    decoder: LtcDecoder,
    samples: SampleClock,
    labels: LabelClock,
    /// How long sound takes from the line to a block.
    latency: Duration,
    /// When the newest frame ended, samples.
    frame_end: f64,
    /// What was said of a line without frames.
    said: Option<FilmWord>,
}

impl LtcReader {
    /// A line of so many samples a second; a rate that is not configured is found.
    pub(crate) fn new(samples_per_s: u32, latency: Duration, rate: Option<FrameRate>, start: Label) -> Self {
        Self {
            decoder: LtcDecoder::new(samples_per_s),
            samples: SampleClock::new(samples_per_s),
            labels: LabelClock::new(rate, start, FRAME_SIGMA_S),
            latency,
            frame_end: 0.0,
            said: None,
        }
    }

    /// The height of the signal, of full scale.
    pub(crate) const fn level(&self) -> f32 {
        self.decoder.level()
    }

    /// Its labels.
    pub(crate) const fn labels(&self) -> &LabelClock {
        &self.labels
    }

    /// Takes a block that was read at an instant.
    #[expect(clippy::cast_precision_loss, reason = "exact for 5,000 years")]
    pub(crate) fn hear(&mut self, block: &[i16], at: MonoTime, out: &mut impl FnMut(Observation)) {
        // Before the frames of the block: its own time is the best that is known of them.
        self.samples.note((self.decoder.count() + block.len() as u64) as f64, at);
        for sample in block {
            if let Some(frame) = self.decoder.push(*sample) {
                self.on_frame(&frame, out);
            }
        }
        self.on_quiet(at, out);
    }

    fn on_frame(&mut self, frame: &LtcFrame, out: &mut impl FnMut(Observation)) {
        self.frame_end = frame.end;
        self.said = None;
        let Some(read) = self.samples.time_of(frame.end) else { return };
        // Seats go by when it sounded, not by when it was heard.
        let at = read.before(self.latency);
        if frame.stands {
            return out(Observation::new(at, FilmWord::Stop));
        }
        let media: Option<ShowTime> = self.labels.media(at, frame.label, frame.quarters(), None);
        if let Some(rate) = self.labels.rate() {
            self.decoder.set_rate(rate);
        }
        out(Observation::new(at, media.map_or(FilmWord::Unplaced, FilmWord::Position)));
    }

    /// Says once that the line carries no frames, and whether it carries anything.
    #[expect(clippy::cast_precision_loss, reason = "exact for 5,000 years")]
    fn on_quiet(&mut self, now: MonoTime, out: &mut impl FnMut(Observation)) {
        let Some(cells) = self.decoder.cells_without_an_edge() else { return };
        let since_frame = (self.decoder.count() as f64 - self.frame_end) / self.decoder.bit_samples();
        let word = if cells > SILENT_CELLS {
            FilmWord::Silence
        } else if since_frame > DIRTY_CELLS {
            FilmWord::Dirt
        } else {
            return;
        };
        if self.said != Some(word) {
            self.said = Some(word);
            out(Observation::new(now, word));
        }
    }
}
