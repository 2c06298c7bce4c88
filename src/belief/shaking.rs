//! What of the vibration that frames ask for may be on at a seat: nothing but a frame without any ends it.

use crate::wire::FrameNo;

#[derive(Debug, Clone, Default)]
pub(super) struct Shaking {
    /// The greatest amplitude, strokes, of the frames since the last that is known to have arrived without any.
    amplitude: f64,
    /// The first of the frames without any that no other follows.
    still_from: Option<FrameNo>,
}

impl Shaking {
    /// A frame was sent that asks for that amplitude at the most.
    #[inline]
    pub(super) fn on_frame(&mut self, frame: FrameNo, amplitude: f64) {
        if amplitude > 0.0 {
            *self = Self { amplitude: self.amplitude.max(amplitude), still_from: None };
        } else {
            self.still_from.get_or_insert(frame);
        }
    }

    /// A frame is known to have arrived.
    pub(super) fn on_ack(&mut self, acked: FrameNo) {
        if self.still_from.is_some_and(|still| acked.since(still) >= 0) {
            self.amplitude = 0.0;
        }
    }

    /// All frames have arrived, as far as that can be known.
    pub(super) const fn on_all_taken(&mut self) {
        if self.still_from.is_some() {
            self.amplitude = 0.0;
        }
    }

    pub(super) const fn amplitude(&self) -> f64 {
        self.amplitude
    }
}
