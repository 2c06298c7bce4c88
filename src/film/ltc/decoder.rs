//! Samples into frames that are sure.

use super::cells::{LtcCell, LtcCells};
use super::edges::LtcEdges;
use super::word::{BITS, LtcWord, follows};
use super::{Label, Timecode};
use crate::film::timecode::FrameRate;

/// Frames that have to follow each other before a label is believed. A bit that noise turned is turned in one of them; that the
/// same one is turned in three does not happen.
const AGREEING: u32 = 3;
/// So many frames after a label that was sure the next may still be told from it, by the time that has passed.
const TOLD_BY_TIME: f64 = 60.0;
// Over 60 frames that is a length of a bit which is off by a third of a per cent.
/// How far from a whole number of frames that time may be, frames.
const OFF_GRID: f64 = 0.2;

/// A frame of which the label is sure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LtcFrame {
    pub(crate) label: Label,
    /// Whether the tape runs backwards.
    pub(crate) backwards: bool,
    /// Whether the frames before it have the same label: whoever sends it was paused.
    pub(crate) stands: bool,
    /// When its last bit ended, samples since the first.
    pub(crate) end: f64,
}

impl LtcFrame {
    /// Where the film is at the end of the frame: at the end of its picture, or at the begin of it if it ran backwards; in
    /// quarters of a frame after the begin of the one that the label names.
    pub(crate) const fn quarters(&self) -> i64 {
        if self.backwards { 0 } else { 4 }
    }
}

/// Reads LTC from samples.
#[derive(Debug, Clone)]
pub(crate) struct LtcDecoder {
    edges: LtcEdges,
    cells: LtcCells,
    word: LtcWord,
    /// Bits since the line was broken.
    bits: u32,
    /// The newest frame, and how many followed each other up to it.
    newest: Option<LtcFrame>,
    agreeing: u32,
    /// How many had the same label.
    standing: u32,
    /// The newest that was sure.
    sure: Option<LtcFrame>,
    rate: Option<FrameRate>,
}

impl LtcDecoder {
    /// A decoder for so many samples a second.
    #[expect(clippy::cast_precision_loss, reason = "audio rates")]
    pub(crate) fn new(samples_per_s: u32) -> Self {
        Self {
            edges: LtcEdges::new(samples_per_s as f32),
            cells: LtcCells::new(),
            word: LtcWord::default(),
            bits: 0,
            newest: None,
            agreeing: 0,
            standing: 0,
            sure: None,
            rate: None,
        }
    }

    /// How labels are counted, as soon as that is known: then a frame after a hole is told by the time that has passed.
    pub(crate) const fn set_rate(&mut self, rate: FrameRate) {
        self.rate = Some(rate);
    }

    /// Samples so far.
    pub(crate) const fn count(&self) -> u64 {
        self.edges.count()
    }

    /// The height of the signal, of full scale.
    pub(crate) const fn level(&self) -> f32 {
        self.edges.height()
    }

    /// The length of a bit, samples; 0 if it is not known.
    pub(crate) const fn bit_samples(&self) -> f64 {
        self.cells.length()
    }

    /// How many cells have passed since the last edge; `None` before there were any.
    #[expect(clippy::cast_precision_loss, reason = "exact for 5,000 years")]
    pub(crate) fn cells_without_an_edge(&self) -> Option<f64> {
        let length = self.cells.length();
        (length > 0.0).then(|| (self.edges.count() as f64 - self.cells.edge()) / length)
    }

    /// Takes a sample, of full scale; the frame that it makes sure of.
    pub(crate) fn push(&mut self, sample: i16) -> Option<LtcFrame> {
        let edge = self.edges.push(f32::from(sample) / 32_768.0)?;
        match self.cells.push(edge) {
            LtcCell::Open => None,
            LtcCell::Broken => {
                self.bits = 0;
                None
            }
            LtcCell::Bit(bit) => {
                self.word.push(bit);
                self.bits += 1;
                // A sync word that was put together across a break has bits of two frames before it.
                if self.bits < BITS {
                    return None;
                }
                let (label, backwards) = self.word.label()?;
                self.on_frame(LtcFrame { label, backwards, stands: false, end: edge })
            }
        }
    }

    /// A frame that was read; the same if it is sure.
    fn on_frame(&mut self, frame: LtcFrame) -> Option<LtcFrame> {
        let is_next = self.newest.is_some_and(|newest| self.is_next(&frame, &newest));
        self.agreeing = if is_next { self.agreeing.saturating_add(1) } else { 1 };
        let is_same = self.newest.is_some_and(|newest| self.is_again(&frame, &newest));
        self.standing = if is_same { self.standing.saturating_add(1) } else { 1 };
        self.newest = Some(frame);
        if self.standing >= AGREEING {
            // Time says nothing any more of the label that has to come.
            self.sure = None;
            return Some(LtcFrame { stands: true, ..frame });
        }
        let is_told = self.sure.is_some_and(|sure| self.is_told_by_time(&frame, &sure));
        if self.agreeing < AGREEING && !is_told {
            return None;
        }
        self.sure = Some(frame);
        Some(frame)
    }

    /// Frames between the ends of two, by the length of a cell.
    fn frames_between(&self, frame: &LtcFrame, before: &LtcFrame) -> f64 {
        (frame.end - before.end) / (f64::from(BITS) * self.cells.length())
    }

    /// Whether one comes right after another, the same way. Two that do so by their labels and not in time were cut together.
    fn is_adjacent(&self, frame: &LtcFrame, before: &LtcFrame) -> bool {
        let is_near = (self.frames_between(frame, before) - 1.0).abs() < OFF_GRID;
        is_near && frame.backwards == before.backwards
    }

    fn is_again(&self, frame: &LtcFrame, before: &LtcFrame) -> bool {
        frame.label == before.label && self.is_adjacent(frame, before)
    }

    fn is_next(&self, frame: &LtcFrame, before: &LtcFrame) -> bool {
        let (later, earlier) =
            if frame.backwards { (before.label, frame.label) } else { (frame.label, before.label) };
        self.is_adjacent(frame, before) && follows(later, earlier)
    }

    /// Whether a frame says what it has to, so long after one that was sure.
    #[expect(clippy::cast_possible_truncation, reason = "at most 60")]
    fn is_told_by_time(&self, frame: &LtcFrame, sure: &LtcFrame) -> bool {
        let passed = self.frames_between(frame, sure);
        let frames = passed.round();
        let is_near = frames <= TOLD_BY_TIME && (passed - frames).abs() < OFF_GRID;
        let Some(rate) = self.rate.filter(|_| is_near && frame.backwards == sure.backwards) else {
            return false;
        };
        let steps = if frame.backwards { -(frames as i64) } else { frames as i64 };
        let expected = Timecode::of(sure.label, rate).map(|sure| sure.plus(steps).label());
        expected == Ok(frame.label)
    }
}
