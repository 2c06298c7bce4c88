//! Signals of the system: to end, and to reload the configuration, for which another hall is opened.

use std::error::Error as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::hall::HallContext;
use super::hall_settings::HallSettings;
use super::lasting::Lasting;
use super::notes::NoteBoard;
use crate::app::pair::TookOver;
use crate::config::{self, Api, Config};
use crate::control::{Asked, Code, Problem};
use crate::rt::Desk;
use crate::settings::{Kept, Settings};
use crate::state::State;

/// How the note of a configuration begins that the hall did not open with.
const NOT_OPENED: &str = "the hall does not open with the new configuration, and has the old one";

/// What goes over from a hall to the one that is opened with another configuration, or comes from before the start.
#[derive(Debug, Default)]
pub(crate) struct Carryover {
    /// What was set and loaded; `None` if nobody has set anything.
    pub(super) settings: Option<Settings>,
    pub(super) lasting: Lasting,
    /// What was latched: another configuration clears nothing.
    pub(super) latched: bool,
    /// What a person should know of the hall before.
    pub(super) notes: NoteBoard,
    /// What happened between the halls, and was not said yet.
    pub(super) untold: Vec<String>,
    /// The same of a machine that led before.
    pub(super) took_over: Option<TookOver>,
    /// Who asked for another configuration, and what came of it.
    pub(super) reloading: Option<(Asked, Result<(), Problem>)>,
}

impl Carryover {
    /// Of a program that has just started, and found that; of one that took over from another machine, with what to tell of that.
    #[must_use]
    pub(crate) fn of(kept: Kept, took_over: Option<TookOver>) -> Self {
        let came_back = kept.settings.as_ref().and_then(Settings::words);
        let lasting = Lasting::since_start(came_back, took_over.as_ref());
        Self { settings: kept.settings, lasting, untold: kept.said, took_over, ..Self::default() }
    }

    /// What is set goes to the desk of a hall before its first look at the controllers: nobody waits for a seat that is out.
    pub(crate) fn set_desk(&self, config: &Config, desk: &Desk) {
        self.settings(config).set(desk, &[]);
    }

    pub(super) fn settings(&self, config: &Config) -> HallSettings {
        self.settings
            .as_ref()
            .map_or_else(|| HallSettings::new(config), |before| HallSettings::with(config, before))
    }

    /// What happened before this hall, for a person.
    pub(crate) fn tell(&mut self, text: Option<String>) {
        self.untold.extend(text);
    }

    /// Another configuration was taken: what is said of those before that were not is over.
    pub(crate) fn forget_refusals(&mut self) {
        self.notes.forget(NOT_OPENED);
    }

    /// The hall did not open with another configuration: a person should know that, whoever asked for it first.
    pub(crate) fn refuse(&mut self, why: &str) {
        let why = format!("{NOT_OPENED}: {why}");
        if let Some((_, result)) = &mut self.reloading {
            *result = Err(Problem::new(Code::Check, why.clone(), "correct it, and reload again"));
        }
        self.untold.push(why);
    }
}

/// What the system asks of the program; set by signals.
#[derive(Debug, Clone, Default)]
pub(crate) struct SystemSignals {
    /// Park, and end.
    pub(crate) leave: Arc<AtomicBool>,
    /// Read the configuration anew.
    pub(crate) reload: Arc<AtomicBool>,
}

impl SystemSignals {
    /// True if the program is to end.
    #[must_use]
    pub(crate) fn is_leaving(&self) -> bool {
        self.leave.load(Ordering::Acquire)
    }
}

/// The tables of a configuration that surfaces were opened with, and that are others in the next one.
pub(super) fn not_taken(now: &Config, next: &Config) -> Vec<&'static str> {
    let api = Api { tokens: now.api.tokens.clone(), ..next.api.clone() };
    let changed = [
        ("[api], beside its tokens,", api != now.api),
        ("[osc]", next.osc != now.osc),
        ("[text]", next.text != now.text),
        ("[buttons]", next.buttons != now.buttons),
        ("[pair]", next.pair != now.pair),
        ("[notify]", next.notify != now.notify),
    ];
    changed.into_iter().filter(|(_, changed)| *changed).map(|(table, _)| table).collect()
}

/// Reads the configuration anew, to open the hall with it. The old one is kept where the new one is bad, and while anything is
/// armed.
///
/// # Errors
/// Why it is not read.
pub(super) fn reload(hall: &HallContext, path: &Path) -> Result<Arc<Config>, Problem> {
    let idle = matches!(
        hall.mirror.state,
        State::Boot | State::Recovering | State::Parked | State::Stopped | State::Fault
    );
    if !idle {
        let detail = format!("cannot reload the configuration while {}", hall.mirror.state);
        return Err(Problem::new(Code::State, detail, "park and disarm first"));
    }
    hall.is_free()?;
    let config = config::load(path).map_err(|faults| {
        let detail = format!("{} is bad; the old configuration is kept", path.display());
        let cause = faults.source().map_or_else(String::new, |cause| format!(": {cause}"));
        let faults = format!("{faults}{cause}").lines().map(str::to_owned).collect();
        Problem::new(Code::Check, detail, "correct it, and reload again").with(faults)
    })?;
    Ok(Arc::new(match &hall.config.store.kept_in {
        Some(state) => config.kept_in(state),
        None => config,
    }))
}
