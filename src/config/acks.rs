//! How seldom acks may be requested.

use super::Show;
use super::fault::Faults;
use super::section::Entry;

/// How much later a loss may be seen since not each frame requests an ack, ms.
const MOST_UNASKED_MS: f64 = 50.0;

/// Why acks are requested too seldom, if they are.
pub(crate) fn too_seldom(show: &Show, has_drives: bool) -> Option<String> {
    if has_drives && show.ack_every > 1 {
        return Some(
            "drives answer each segment, and an unanswered one is in doubt; leave it at 1".to_owned(),
        );
    }
    let (hz, apart_ms) = (show.rate_hz, f64::from(show.ack_every - 1) * 1_000.0 / show.rate_hz);
    let most = 1.0 + (MOST_UNASKED_MS * hz / 1_000.0).floor();
    (apart_ms > MOST_UNASKED_MS).then(|| {
        format!(
            "a loss would be seen {apart_ms:.0} ms later, and the seat make up for it in one frame; {most} is the most at {hz} Hz"
        )
    })
}

/// Notes that in a file, where its `[show]` stands there.
pub(super) fn refuse_seldom_acks(
    stated: Option<(Entry<'_>, &Show)>,
    has_drives: bool,
    faults: &mut Faults<'_>,
) {
    let Some((entry, show)) = stated else { return };
    let value = entry.value.as_table().and_then(|table| table.get("ack_every"));
    if let Some((value, why)) = value.zip(too_seldom(show, has_drives)) {
        Entry::new("ack_every", value).fault(faults, &why);
    }
}
