//! The configuration: a TOML file or `--to` arguments in, checked values out, every fault with its line.
//! Control thread.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::channel;
use crate::checks::Check;
use crate::motion::{MAX_AXES, SeatType};

mod accept;
mod acks;
mod api;
mod axis;
mod broadcast;
mod buttons;
mod controller;
pub(crate) mod drive;
pub(crate) mod drive_controller;
mod effect_limits;
mod fault;
mod film;
mod fit;
mod fleet;
mod gear;
mod keys;
mod level;
mod library;
pub(crate) mod line_load;
pub(crate) mod link;
mod log;
mod notify;
mod osc;
mod pair;
mod preset;
mod read;
mod record;
mod seat;
mod section;
mod site;
mod sync;
mod syntax;
mod target;
#[cfg(test)]
mod tests;
mod text;

pub(crate) use crate::wire::{Dialect, Timing, VibrationPort};
pub(crate) use acks::late_losses;
pub(crate) use api::api;
pub use api::{Api, ApiToken, Role};
pub use broadcast::BroadcastNetwork;
pub(crate) use buttons::{ButtonPad, PadDevice, PadLamp, PadWord};
pub(crate) use controller::{Accept, Connection, FanOut, FansOut, cue_axes};
pub use controller::{Controller, Station};
pub(crate) use drive_controller::Drives;
pub(crate) use effect_limits::EffectLimit;
pub(crate) use fault::{ConfigFault, ConfigFaults, Faults};
pub(crate) use film::{FilmPlayer, OnStop, stays_below};
pub(crate) use fit::{HallStroke, Misfit};
pub(crate) use fleet::{Fleet, FleetKey, FleetWord, is_fleet_id};
pub(crate) use gear::GearWord;
pub(crate) use keys::{key_name, lamp_name};
pub(crate) use level::{level, no_level, parse_level, switches, trim};
pub(crate) use library::{ONE_FOLDER, Store};
pub(crate) use link::Link;
pub(crate) use log::{Log, journal_in};
pub(crate) use notify::{Mail, Notify, WebHook};
pub(crate) use osc::OscPort;
pub(crate) use pair::Pair;
pub(crate) use preset::Preset;
pub(crate) use record::{Record, RecordMode};
pub(crate) use section::{Entry, Section, did_you_mean, there_is_no};
pub(crate) use sync::FilmSync;
pub use target::from_to_args;
pub(crate) use text::TextPort;

/// The outputs a controller has, Y01 to Y12 as bits 0 to 11 (SMC manual 2.2.2.5).
pub(crate) const ALL_OUTPUTS: u16 = 0x0fff;

/// The largest configuration file that is read, bytes.
pub(crate) const MAX_FILE_LEN: u64 = 1 << 20;

/// A hall: how it is played, what its seats are, and where its controllers are.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// How cues are played.
    pub show: Show,
    /// The seat types, by name.
    pub seats: Vec<Arc<SeatType>>,
    /// The site's wiring. Two names may mean one output.
    pub(crate) effects: Vec<Effect>,
    /// How long, and how much of the time, effects may be on; at most one entry for each name.
    pub(crate) effect_limits: Vec<EffectLimit>,
    /// Levels and effects by name, in the order of the names.
    pub(crate) presets: Vec<Preset>,
    /// What the library and the playlists are kept in.
    pub(crate) store: Store,
    /// Where the journal is kept, and how much of it.
    pub(crate) log: Log,
    /// What is recorded, and how much of it is kept.
    pub(crate) record: Record,
    /// The controllers that take part, at least one: those on the network in the order of the file, then those on links likewise. A
    /// lane has the place of its controller.
    pub controllers: Vec<Controller>,
    /// Those that are out for good, in the order of the file.
    pub(crate) absent: Vec<Absent>,
    /// The serial lines and buses that drives share, in the order of their names.
    pub(crate) links: Vec<Link>,
    /// The network whose controllers may get one datagram together, where there is one.
    pub broadcast: Option<BroadcastNetwork>,
    /// The port that takes OSC, where there is one.
    pub(crate) osc: Option<OscPort>,
    /// The port that takes lines of text, where there is one.
    pub(crate) text: Option<TextPort>,
    /// Pads whose keys ask something, in the order of their names.
    pub(crate) buttons: Vec<ButtonPad>,
    /// Who is told of alarms, if anybody.
    pub(crate) notify: Option<Notify>,
    /// The fleet that the hall belongs to, if it does.
    pub(crate) fleet: Option<Fleet>,
    /// The two show machines of the hall, where it has two.
    pub(crate) pair: Option<Pair>,
    /// HTTP over TCP.
    pub(crate) api: Api,
    /// The film that leads the shows, where one does.
    pub(crate) sync: Option<FilmSync>,
    /// Its player, where the service starts one.
    pub(crate) film: Option<FilmPlayer>,
}

/// How cues are played.
#[derive(Debug, Clone, PartialEq)]
pub struct Show {
    /// What the hall is called.
    pub(crate) name: String,
    /// Frames a second to every controller, 1 to 1,000.
    pub rate_hz: f64,
    /// What the Time field of a frame means.
    pub timing: Timing,
    /// The address the controllers answer to (PA20 to PA24); port 0 takes any.
    pub bind: SocketAddrV4,
    /// A reply is asked for in each frame of this many, 1 to 1,000.
    pub ack_every: u32,
    /// What the hall does when a group of controllers is lost.
    pub loss_policy: LossPolicy,
    /// How long before a deadline the tick thread stops sleeping and spins, µs, 0 to 900.
    pub(crate) spin_us: u32,
    /// The folder with the cues of the daemon.
    pub(crate) library: PathBuf,
    /// Whose belts GO waits for.
    pub(crate) belts: Belts,
    /// Findings of preflight that are accepted for good, of whichever controller.
    pub(crate) accept_findings: Vec<Acceptance>,
}

impl Default for Show {
    fn default() -> Self {
        Self {
            name: "hall".to_owned(),
            rate_hz: 100.0,
            timing: Timing::Relative,
            bind: SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 8410),
            ack_every: 1,
            loss_policy: LossPolicy::Continue,
            spin_us: 0,
            library: PathBuf::from("/var/lib/kinocue/cues"),
            belts: Belts::Shown,
            accept_findings: Vec::new(),
        }
    }
}

/// Whose belts GO waits for, of the controllers that have `belt_inputs` and take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Belts {
    /// Nobody's: it is only shown which ones are open.
    Shown,
    /// At least one belt of each rigid seat.
    One,
    /// All.
    All,
}

/// What the hall does when a group of controllers is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LossPolicy {
    /// The others play on.
    Continue,
    /// All hold.
    Pause,
    /// All park.
    Park,
}

/// One name of an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Effect {
    /// What cues call it.
    pub(crate) name: String,
    /// The output, 1 to 12 for Y01 to Y12.
    pub(crate) output: u8,
}

impl Effect {
    /// The output as a bit of the Port Out word: bit 0 is Y01 (SMC manual 2.2.2.5).
    #[must_use]
    pub(crate) fn word(&self) -> u16 {
        1_u16.checked_shl(u32::from(self.output).wrapping_sub(1)).unwrap_or(0) & ALL_OUTPUTS
    }
}

/// A controller that is out for good (`enabled = false`): no frame goes to it, nobody waits for it, and nothing is asked of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Absent {
    /// What the configuration says of it.
    pub(crate) controller: Controller,
    /// How many of those that take part stand before it in the file.
    pub(crate) after: usize,
}

/// A finding of preflight that the site lives with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Acceptance {
    /// What is accepted.
    pub(crate) check: Check,
    /// Why, in the words of whoever answers for it; not empty.
    pub(crate) why: String,
}

impl Config {
    /// What the effect called `name` adds to the output word of `controller`: 0 where that controller does not
    /// switch it, `None` where no output has that name.
    #[must_use]
    pub(crate) fn effect_outputs<C>(&self, controller: &Controller<C>, name: &str) -> Option<u16> {
        let effect = self.effects.iter().find(|effect| effect.name == name)?;
        Some(if controller.switches(name) { effect.word() } else { 0 })
    }

    /// The bits of a raw output word that reach `controller`.
    #[must_use]
    pub(crate) fn allowed_outputs<C>(&self, controller: &Controller<C>) -> u16 {
        match &controller.effects {
            None => ALL_OUTPUTS,
            Some(_) => {
                let switched = self.effects.iter().filter(|effect| controller.switches(&effect.name));
                switched.fold(0, |word, effect| word | effect.word())
            }
        }
    }

    /// What operators may switch here: the effects, and the outputs of the table that a controller has.
    pub(crate) fn switch_names(&self) -> impl Iterator<Item = &str> {
        let there = |place: usize| self.named().any(|controller| controller.at_most[place] > 0.0);
        let outputs = channel::switches().enumerate().filter(move |(place, _)| there(*place));
        self.effects.iter().map(|effect| effect.name.as_str()).chain(outputs.map(|(_, (_, _, name))| name))
    }

    /// Every controller that the file names: those that take part, and those that are out for good.
    pub(crate) fn named(&self) -> impl Iterator<Item = &Controller> {
        self.controllers.iter().chain(self.absent.iter().map(|one| &one.controller))
    }

    /// The axes of a cue of `cue_axes` axes that are no controller's, also of none that is out for good, counted from 1.
    #[must_use]
    pub(crate) fn untaken_axes(&self, cue_axes: usize) -> Vec<usize> {
        (1..=cue_axes).filter(|&axis| !self.named().any(|one| one.takes(axis - 1))).collect()
    }

    /// The controllers on the network, which come first: each has its own place among all.
    pub fn stations(&self) -> Vec<Controller<Station>> {
        self.controllers.iter().filter_map(Controller::on_network).collect()
    }

    /// The controllers on links.
    pub(crate) fn on_links(&self) -> impl Iterator<Item = &Controller> {
        self.controllers.iter().filter(|one| one.drives().is_some())
    }

    /// Checks that no seat of the hall has drives, for what asks controllers on the network alone.
    ///
    /// # Errors
    /// [`OnLinks`] with the names of those that have.
    pub(crate) fn without_drives(&self) -> Result<(), OnLinks> {
        let names: Vec<_> = self.on_links().map(|one| one.name.as_str()).collect();
        if names.is_empty() { Ok(()) } else { Err(OnLinks(names.join(", "))) }
    }

    /// The folder with the playlists: the one of the configuration, else `playlists` beside the library.
    #[must_use]
    pub(crate) fn playlists(&self) -> PathBuf {
        let beside = || self.show.library.with_file_name("playlists");
        self.store.playlists.clone().unwrap_or_else(beside)
    }

    /// The same with library, playlists and journal in the folder of what the service keeps, but for those that it names itself.
    #[must_use]
    pub(crate) fn kept_in(mut self, state: &Path) -> Self {
        if self.show.library == Show::default().library {
            self.show.library = state.join("cues");
        }
        if self.log.dir == Log::default().dir {
            self.log.dir = journal_in(state);
        }
        self.store.kept_in = Some(state.to_owned());
        self
    }

    /// The preset called `name`.
    #[must_use]
    pub(crate) fn preset(&self, name: &str) -> Option<&Preset> {
        self.presets.iter().find(|preset| preset.name == name)
    }

    /// The seat type called `name`.
    #[must_use]
    pub(crate) fn seat(&self, name: &str) -> Option<&Arc<SeatType>> {
        self.seats.iter().find(|seat| seat.name == name)
    }
}

/// Seats on serial links, for a command that reaches controllers on the network alone.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0} on serial links, which this does not reach: how soon drives answer is told by `kinocue preflight`, what they hold by \
     `kinocue register read`, and `kinocue home` alone writes to them; name other controllers, or take these out of the file"
)]
pub(crate) struct OnLinks(String);

/// Reads and checks a configuration file.
///
/// # Errors
/// [`ConfigFaults::Unreadable`] if there is no such file; else [`ConfigFaults::Bad`] with every fault of it.
pub fn load(path: &Path) -> Result<Config, ConfigFaults> {
    let text = read::file(path)?;
    read::document(path, &text)
}

/// Reads a configuration from its text; `path` names it in faults.
#[cfg(feature = "harness")]
pub(crate) fn parse(path: &Path, text: &str) -> Result<Config, ConfigFaults> {
    read::document(path, text)
}

/// True if a window of `axes` axes from `offset` on can be one of a cue; the reason if not.
fn check_window(offset: usize, axes: usize, fan_out: FanOut) -> Result<(), String> {
    if fan_out == FanOut::Shared && offset + axes > MAX_AXES {
        let last = offset + axes;
        return Err(format!(
            "axes {} to {last} reach past axis {MAX_AXES}, the last that a shared frame can carry; lower axis_offset, \
             or use fan_out = \"slice\"",
            offset + 1
        ));
    }
    Ok(())
}

/// True if datagrams can be sent to one controller at `address`; the reason if not.
fn check_peer(address: SocketAddrV4) -> Result<(), &'static str> {
    let ip = address.ip();
    if address.port() == 0 {
        Err("port 0 is not a destination; controllers listen on 7408 unless PA14 says otherwise")
    } else if ip.is_broadcast() || ip.is_multicast() {
        Err("is not the address of one controller; frames are sent to each by itself")
    } else if ip.is_unspecified() {
        Err("is not a destination; give the controller's own address (PA10 to PA13)")
    } else {
        Ok(())
    }
}

/// True if cues can use `name` for an effect; the reason if not.
fn check_effect_name(name: &str) -> Result<(), &'static str> {
    let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if channel::is_switch(name) {
        return Err("is the name of an output in cues; call the effect otherwise");
    }
    if !name.is_empty() && name.chars().all(fits) {
        Ok(())
    } else {
        Err("an effect's name is made of a to z, 0 to 9 and _")
    }
}
