//! How seldom acks may be requested.

use super::Show;
use super::fault::Faults;
use super::section::Entry;

/// How much later a loss may be seen since not each frame requests an ack, ms.
const MOST_UNASKED_MS: f64 = 50.0;

/// Notes acks that are requested too seldom, where a configuration says how often.
pub(super) fn refuse_late_losses(entry: Entry<'_>, show: &Show, faults: &mut Faults<'_>) {
    let value = entry.value.as_table().and_then(|table| table.get("ack_every"));
    if let Some((value, why)) = value.zip(late_losses(show)) {
        Entry::new("ack_every", value).fault(faults, &why);
    }
}

/// Why acks are requested too seldom: a loss would last for over 50 ms more before one is missed; none where it would not.
pub(crate) fn late_losses(show: &Show) -> Option<String> {
    let hz = show.rate_hz;
    let apart_ms = f64::from(show.ack_every - 1) * 1_000.0 / hz;
    let most = 1.0 + (MOST_UNASKED_MS * hz / 1_000.0).floor();
    let why = || {
        format!(
            "a loss would be seen {apart_ms:.0} ms later, and the seat make up for it in one frame; {most} is the most at {hz} Hz"
        )
    };
    (apart_ms > MOST_UNASKED_MS).then(why)
}
