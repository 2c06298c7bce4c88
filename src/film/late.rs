//! What can only be late is late on the whole: of a line whose delay varies, the quickest samples say where the film is.

/// Residuals that are kept: 20 s at 24 a second. Fewer make the quantile jump about.
const KEPT: usize = 512;
/// The share of the residuals that is behind the envelope. Beyond it are those few that were early by mistake.
const ENVELOPE: f64 = 0.97;
/// The envelope is made anew after so many; at first, with each.
const EVERY: usize = 8;
const FEW: usize = 32;

/// How far the quickest samples of a source are ahead of its mean.
#[derive(Debug, Clone)]
pub(super) struct LateBias {
    residuals: [f32; KEPT],
    count: usize,
    bias_s: f64,
}

impl LateBias {
    pub(super) const fn new() -> Self {
        Self { residuals: [0.0; KEPT], count: 0, bias_s: 0.0 }
    }

    /// What is to be added to an estimate, seconds.
    pub(super) const fn bias_s(&self) -> f64 {
        self.bias_s
    }

    /// Notes how far a sample was ahead of the estimate, seconds.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "residuals of seconds, to a tenth of a microsecond; the index is below 512"
    )]
    pub(super) fn push(&mut self, residual_s: f64) {
        self.residuals[self.count % KEPT] = residual_s as f32;
        self.count += 1;
        if self.count > FEW && !self.count.is_multiple_of(EVERY) {
            return;
        }
        // A selection, not a sort: it is most of the work of a tracker.
        let mut sorted = self.residuals;
        let kept = &mut sorted[..self.count.min(KEPT)];
        // Late is behind: whose residual is high was quick, and said where the film really is.
        let index = ((kept.len() - 1) as f64 * ENVELOPE) as usize;
        let (_, envelope, _) = kept.select_nth_unstable_by(index, f32::total_cmp);
        // Below zero it would say that a sample came before it was sent.
        self.bias_s = f64::from(*envelope).max(0.0);
    }
}
