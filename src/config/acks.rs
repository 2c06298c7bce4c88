//! How seldom acks may be requested.

use super::Show;
use super::fault::Faults;
use super::section::Entry;

/// How much later a loss may be seen since not each frame requests an ack, ms.
const MOST_UNASKED_MS: f64 = 50.0;

/// Notes acks that are requested so seldom that a loss would last for over 50 ms more before one is missed.
pub(super) fn refuse_late_losses(entry: Entry<'_>, show: &Show, faults: &mut Faults<'_>) {
    let apart_ms = f64::from(show.ack_every - 1) * 1_000.0 / show.rate_hz;
    let value = entry.value.as_table().and_then(|table| table.get("ack_every"));
    if let Some(value) = value.filter(|_| apart_ms > MOST_UNASKED_MS) {
        let most = 1.0 + (MOST_UNASKED_MS * show.rate_hz / 1_000.0).floor();
        let hz = show.rate_hz;
        Entry::new("ack_every", value).fault(
            faults,
            &format!(
                "a loss would be seen {apart_ms:.0} ms later, and the seat make up for it in one frame; {most} is the most at {hz} Hz"
            ),
        );
    }
}
