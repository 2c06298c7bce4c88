//! What people have set, on both machines: whoever leads tells it, the other one keeps it where it will look for it once it leads.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::{PairError, PairShared, thread};
use crate::log::Priority;
use crate::pair::{LONGEST, Role};
use crate::settings::{self, Settings};
use crate::sys::clock::Monotonic;
use crate::sys::lock::lock;
use crate::time::Clock as _;

/// How often it is looked at.
const LOOK: Duration = Duration::from_millis(500);

/// Starts the thread, which alone waits for the disk.
pub(super) fn start(shared: &Arc<PairShared>, state: PathBuf) -> Result<(), PairError> {
    let shared = Arc::clone(shared);
    thread("pair-keeps", move || {
        let mut is_told = false;
        let mut next = Monotonic.now();
        loop {
            Monotonic.sleep_until(next);
            next = Monotonic.now() + LOOK;
            if !matches!(shared.act(|claim, now| claim.role(now)), Role::Leads { .. }) {
                continue;
            }
            // What cannot be read is told where it is kept.
            let Ok(Some(text)) = settings::text_of(&state) else { continue };
            if text.len() > LONGEST && !std::mem::replace(&mut is_told, true) {
                let text = format!(
                    "what people have set takes {} bytes, more than {LONGEST}: {} does not get it",
                    text.len(),
                    shared.other
                );
                shared.say(Priority::Warning, text);
            }
            *lock(&shared.settings) = Some(text);
        }
    })
}

/// Keeps what the machine that led has told last, with where its show would be now if it moved. Without a word of it, or where it is no
/// settings, what was kept here stays.
pub(super) fn keep(shared: &PairShared, state: &Path) {
    let (Some(heard), Some(text)) = (lock(&shared.heard).clone(), lock(&shared.settings).clone()) else {
        return;
    };
    let kept = Settings::parse(&text).and_then(|mut settings| {
        if let Some(show) = settings.show.as_mut().filter(|_| heard.carried.moves) {
            let since = Monotonic.now().since(heard.at).as_millis();
            show.film_ms = Some(heard.carried.film_ms + i64::try_from(since).unwrap_or_default());
        }
        settings::keep(state, &settings).map_err(|error| error.to_string())
    });
    if let Err(why) = kept {
        shared.say(
            Priority::Warning,
            format!("what people have set at {} is not taken over: {why}", shared.other),
        );
    }
}
