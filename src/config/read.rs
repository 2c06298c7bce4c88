//! From the text of a configuration file to a [`Config`]: section by section, noting every fault.

use std::io::Read as _;
use std::net::SocketAddrV4;
use std::path::{Path, PathBuf};

use toml::de::DeTable;

use crate::channel::{self, SWITCHES};
use crate::motion::MAX_AXES;
use crate::sys;

use super::accept::acceptances;
use super::acks::refuse_seldom_acks;
use super::api::api;
use super::broadcast::broadcast;
use super::buttons::buttons;
use super::drive::{DriveEntry, seat_drives};
use super::drive_controller::{
    Placed, drive_controller, find_twins, is_on_link, refuse_parted_groups, settle,
};
use super::effect_limits::effect_limits;
use super::fault::{ConfigFault, ConfigFaults, Faults, place};
use super::film::film;
use super::fleet::fleet;
use super::library::store;
use super::link::{LinkEntry, links};
use super::log::log;
use super::notify::notify;
use super::osc::osc;
use super::pair::pair;
use super::preset::presets;
use super::record::record;
use super::seat::seats;
use super::section::{Entry, Section, did_you_mean};
use super::site::{Site, inputs_up_to, seat_of};
use super::sync::{FilmSync, sync};
use super::text::text;
use super::{
    Absent, Accept, Api, Belts, Config, Connection, Controller, Dialect, Effect, FanOut, Log, LossPolicy,
    MAX_FILE_LEN, Record, Show, Station, Store, Timing, VibrationPort, check_effect_name, check_peer,
    check_window,
};

/// The text of a file of at most [`MAX_FILE_LEN`] bytes.
pub(super) fn file(path: &Path) -> Result<String, ConfigFaults> {
    let unreadable = |source| ConfigFaults::Unreadable { path: path.to_owned(), source };
    let file = sys::file::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(MAX_FILE_LEN + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    let bad = |at: usize, message: &str| {
        let (line, column) = place(&bytes, at);
        ConfigFaults::Bad(vec![ConfigFault {
            path: path.to_owned(),
            line,
            column,
            message: message.to_owned(),
        }])
    };
    if bytes.len() as u64 > MAX_FILE_LEN {
        return Err(bad(0, &format!("the file is longer than {MAX_FILE_LEN} bytes")));
    }
    match str::from_utf8(&bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) => Err(bad(error.valid_up_to(), "the file is not UTF-8")),
    }
}

/// Checks the text of the file at `path`.
pub(super) fn document(path: &Path, text: &str) -> Result<Config, ConfigFaults> {
    let mut faults = Faults::of(text);
    let (tree, errors) = DeTable::parse_recoverable(text);
    for error in errors {
        faults.note_syntax(&error);
    }
    let config = root(tree.get_ref(), &mut faults);
    match config {
        Some(config) if faults.is_empty() => Ok(config),
        _ => Err(ConfigFaults::Bad(faults.into_list(path))),
    }
}

fn root<'t>(table: &'t DeTable<'t>, faults: &mut Faults<'_>) -> Option<Config> {
    let mut section = not_a_playlist(table, faults)?;
    let [show_at, seat_at, effects_at, limits_at, controller_at] =
        ["show", "seat", "effects", "effect_limits", "controller"].map(|key| section.get(key));
    let [api_at, link_at, record_at, buttons_at, notify_at, fleet_at] =
        ["api", "link", "record", "buttons", "notify", "fleet"].map(|key| section.get(key));
    if controller_at.is_none() {
        section.faults.note_missing(0, "there is no [[controller]]; add at least one");
    }
    let [preset_at, library_at, log_at, osc_at, text_at, sync_at, film_at, pair_at, broadcast_at] =
        ["preset", "library", "log", "osc", "text", "sync", "film", "pair", "broadcast"]
            .map(|key| section.get(key));
    section.finish();
    let show = show_at.map_or_else(|| Some(Show::default()), |entry| show(entry, faults));
    let (seats, named) = seat_at.map_or_else(Default::default, |entry| seats(entry, faults));
    let effects = effects_at.map_or_else(Vec::new, |entry| effects(entry, faults));
    let effect_limits = limits_at.map_or_else(Vec::new, |entry| effect_limits(entry, &effects, faults));
    let presets = preset_at.map_or_else(Vec::new, |entry| presets(entry, &effects, faults));
    let library = show.as_ref().map(|show| show.library.clone()).unwrap_or_default();
    let store = library_at.map_or_else(|| Some(Store::default()), |entry| store(entry, &library, faults));
    let log = log_at.map_or_else(|| Some(Log::default()), |entry| log(entry, faults));
    let record = record_at.map_or_else(|| Some(Record::default()), |entry| record(entry, faults));
    let stated = Stated { seat: seat_at, controller: controller_at, link: link_at };
    let site = Site { seats: &seats, named: &named, effects: &effects };
    let (controllers, absent, links) = stated.controllers(&site, faults);
    refuse_seldom_acks(show_at.zip(show.as_ref()), !links.is_empty(), faults);
    let frame_port = show.as_ref().map_or(0, |show| show.bind.port());
    let broadcast =
        broadcast_at.and_then(|entry| broadcast(entry, &controllers, &absent, frame_port, faults));
    let api = api_at.map_or_else(|| Some(Api::default()), |entry| api(entry, faults));
    let osc = osc_at.and_then(|entry| osc(entry, faults));
    let text = text_at.and_then(|entry| text(entry, faults));
    let buttons = buttons_at.map_or_else(Vec::new, |entry| buttons(entry, faults));
    let notify = notify_at.and_then(|entry| notify(entry, faults));
    let fleet = fleet_at.and_then(|entry| fleet(entry, faults));
    let pair = pair_at.and_then(|entry| pair(entry, !links.is_empty(), faults));
    let film = film_at.and_then(|entry| film(entry, faults));
    // The player tells where its film is, whoever else does.
    let of_player = film.is_some().then(FilmSync::default);
    let sync = sync_at.and_then(|entry| sync(entry, faults)).or(of_player);
    Some(Config {
        show: show?,
        seats,
        effects,
        effect_limits,
        presets,
        store: store?,
        log: log?,
        record: record?,
        controllers,
        absent,
        links,
        broadcast,
        osc,
        text,
        buttons,
        notify,
        fleet,
        pair,
        api: api?,
        sync,
        film,
    })
}

/// The file as a section; none of a playlist, which is a fault.
fn not_a_playlist<'t, 'f, 'x>(
    table: &'t DeTable<'t>,
    faults: &'f mut Faults<'x>,
) -> Option<Section<'t, 'f, 'x>> {
    if table.contains_key("entry") && !table.contains_key("controller") {
        let told =
            "this is a playlist, not a configuration; a hall checks it when `kinocue playlist ID` loads it";
        faults.note(0, told);
        return None;
    }
    Some(Section::new("the file", 0, table, faults))
}

/// The sections that say together which controllers there are.
#[derive(Clone, Copy)]
struct Stated<'t> {
    seat: Option<Entry<'t>>,
    controller: Option<Entry<'t>>,
    link: Option<Entry<'t>>,
}

impl Stated<'_> {
    /// All controllers, those that are absent, and the links, each as it is used.
    fn controllers(
        self,
        site: &Site<'_>,
        faults: &mut Faults<'_>,
    ) -> (Vec<Controller>, Vec<Absent>, Vec<super::Link>) {
        let links = self.link.map_or_else(Vec::new, |entry| links(entry, faults));
        let drives = self.seat.map_or_else(Vec::new, |entry| seat_drives(entry, site.seats, faults));
        let controllers = |entry| controllers(entry, site, (&links, &drives), faults);
        let mut peers = self.controller.map_or_else(Peers::default, controllers);
        find_twins(&mut peers.placed);
        refuse_parted_groups(&peers.placed, &peers.by_udp(), faults);
        let links = settle(links, &peers.placed, faults);
        let (controllers, absent) = peers.into_lists();
        (controllers, absent, links)
    }
}

fn show(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Show> {
    let default = Show::default();
    let mut section = Section::new("[show]", entry.at, entry.table(faults)?, faults);
    let timing = [("relative", Timing::Relative), ("absolute", Timing::Absolute)];
    let policy =
        [("continue", LossPolicy::Continue), ("pause", LossPolicy::Pause), ("park", LossPolicy::Park)];
    let belts = [("shown", Belts::Shown), ("one", Belts::One), ("all", Belts::All)];
    let show = Show {
        name: section.text("name").unwrap_or(default.name),
        rate_hz: section.number_in("rate_hz", 1.0..=1000.0).unwrap_or(default.rate_hz),
        timing: section.choice("time", &timing).unwrap_or(default.timing),
        bind: section.address("bind").unwrap_or(default.bind),
        ack_every: section.whole_in("ack_every", 1..=1000).unwrap_or(default.ack_every),
        loss_policy: section.choice("loss_policy", &policy).unwrap_or(default.loss_policy),
        spin_us: section.whole_in("spin_us", 0..=900).unwrap_or(default.spin_us),
        library: section.text("library").map_or(default.library, PathBuf::from),
        belts: section.choice("belts", &belts).unwrap_or(default.belts),
        accept_findings: acceptances(&mut section),
    };
    section.finish();
    Some(show)
}

fn effects(entry: Entry<'_>, faults: &mut Faults<'_>) -> Vec<Effect> {
    let Some(table) = entry.table(faults) else { return Vec::new() };
    let mut effects = Vec::new();
    for (name, value) in table {
        if let Err(reason) = check_effect_name(name.get_ref()) {
            faults.note(name.span().start, format!("{:?}: {reason}", name.get_ref()));
        }
        let output = Entry::new(name.get_ref(), value).whole_in(1..=12, faults);
        // A name whose output is wrong still counts as known, so that one slip makes one fault.
        effects.push(Effect { name: name.get_ref().to_string(), output: output.unwrap_or(1) });
    }
    effects
}

/// The controllers of a file: those that take part, those that are out for good, and those on links, which are both.
#[derive(Default)]
struct Peers {
    present: Vec<Controller>,
    absent: Vec<Absent>,
    placed: Vec<Placed>,
}

fn controllers(
    entry: Entry<'_>,
    site: &Site<'_>,
    on_links: (&[LinkEntry<'_>], &[DriveEntry]),
    faults: &mut Faults<'_>,
) -> Peers {
    if entry.value.is_table() {
        entry.fault(faults, "write [[controller]], with two brackets, once for each controller");
        return Peers::default();
    }
    let Some(entries) = entry.array(faults) else { return Peers::default() };
    let (mut taken, mut at, mut peers) = (Vec::new(), Vec::new(), Peers::default());
    for entry in entries {
        let Some(table) = entry.table(faults) else { continue };
        if is_on_link(table) {
            peers.placed.extend(drive_controller(entry.at, table, site, on_links, faults));
        } else {
            match controller(entry.at, table, site, faults) {
                Some((controller, true)) => peers.present.push(controller),
                Some((controller, false)) => {
                    peers.absent.push(Absent { controller, after: peers.present.len() });
                    at.push(table.get("enabled").map_or(entry.at, |value| value.span().start));
                }
                None => {}
            }
        }
        for key in ["name", "address"].into_iter().filter(|key| *key == "name" || !is_on_link(table)) {
            if let Some(value) = table.get(key) {
                refuse_repeat(Entry::new(key, value), &mut taken, faults);
            }
        }
    }
    peers.absent.iter().zip(at).for_each(|(one, at)| refuse_parted(one, at, &peers.present, faults));
    let all_out = peers.placed.iter().all(|one| !one.enabled);
    if peers.present.is_empty() && all_out && peers.absent.len() + peers.placed.len() > 0 {
        faults.note_missing(entry.at, "enabled: every [[controller]] is disabled; enable at least one");
    }
    peers
}

impl Peers {
    fn by_udp(&self) -> Vec<&Controller> {
        self.present.iter().chain(self.absent.iter().map(|one| &one.controller)).collect()
    }

    /// The controllers that take part, those on links last, and those that are out for good.
    fn into_lists(self) -> (Vec<Controller>, Vec<Absent>) {
        let Self { mut present, mut absent, placed } = self;
        for Placed { controller, enabled, .. } in placed {
            if enabled {
                present.push(controller);
            } else {
                absent.push(Absent { controller, after: present.len() });
            }
        }
        (present, absent)
    }
}

/// Notes where a rigid seat is to move by only a part of its controllers.
fn refuse_parted(absent: &Absent, at: usize, present: &[Controller], faults: &mut Faults<'_>) {
    let Controller { name, group, .. } = &absent.controller;
    if let Some(other) = present.iter().find(|one| one.group == *group) {
        let (other, text) = (&other.name, "a rigid seat cannot move with only some of its controllers");
        faults.note(
            at,
            format!(
                "enabled: {name} shares the group {group} with {other}, and {text}; give {other} the same"
            ),
        );
    }
}

/// Notes a name or address that a controller before has too; `taken` holds key, value and place of each.
fn refuse_repeat<'t>(entry: Entry<'t>, taken: &mut Vec<(&'t str, String, usize)>, faults: &mut Faults<'_>) {
    let Some(text) = entry.value.as_str() else { return };
    // One address can be spelt in more than one way.
    let value = text.parse().map_or_else(|_| text.to_owned(), |address: SocketAddrV4| address.to_string());
    match taken.iter().find(|(key, before, _)| *key == entry.key && *before == value) {
        None => taken.push((entry.key, value, entry.at)),
        Some(&(_, _, first)) => {
            let line = faults.line(first);
            entry.fault(faults, &format!("{value} is also that of another controller, on line {line}"));
        }
    }
}

/// One controller, and whether it takes part.
fn controller<'t>(
    at: usize,
    table: &'t DeTable<'t>,
    site: &Site<'_>,
    faults: &mut Faults<'_>,
) -> Option<(Controller, bool)> {
    let mut section = Section::new("[[controller]]", at, table, faults);
    section.require(&["name", "seat", "address"]);
    let name = section.text("name");
    let row = section.text("row");
    let group = section.text("group");
    let seat = seat_of(&mut section, site);
    let axis_offset = section.whole_in("axis_offset", 0..=MAX_AXES - 1).unwrap_or(0);
    let fan_out = section.choice("fan_out", &[("slice", FanOut::Slice), ("shared", FanOut::Shared)]);
    let fan_out = fan_out.unwrap_or(FanOut::Slice);
    let station = station(&mut section, fan_out);
    let effects = effects_of(&mut section, site);
    let at_most = levels_of(&mut section);
    let (estop_inputs, belt_inputs) = named_inputs(&mut section);
    let accept_findings = acceptances(&mut section);
    let enabled = section.get("enabled").and_then(|entry| entry.switch(section.faults)).unwrap_or(true);
    section.finish();
    let (name, seat) = (name?, seat?);
    if let Err(reason) = check_window(axis_offset, seat.axes, fan_out) {
        faults.note(table.get("axis_offset").map_or(at, |value| value.span().start), reason);
    }
    let controller = Controller {
        group: group.unwrap_or_else(|| name.clone()),
        name,
        row,
        seat,
        connection: Connection::Udp(station?),
        axis_offset,
        effects,
        at_most,
        estop_inputs,
        belt_inputs,
        accept_findings,
    };
    Some((controller, enabled))
}

/// What only a controller on the network has.
fn station(section: &mut Section<'_, '_, '_>, fan_out: FanOut) -> Option<Station> {
    let address = section.address("address");
    if let (Some(address), Some(entry)) = (address, section.get("address"))
        && let Err(reason) = check_peer(address)
    {
        entry.fault(section.faults, &format!("{address}: {reason}"));
    }
    let dialect = dialect(section);
    let vibration_port = vibration_port(section, dialect).unwrap_or_default();
    let wide = section.get("wide_channel");
    let counts_axes = wide.and_then(|entry| entry.choice(&[("2", false), ("axes", true)], section.faults));
    let accept = accept(section).unwrap_or(Accept::All);
    Some(Station {
        address: address?,
        fan_out,
        dialect: dialect.unwrap_or(Dialect::Smc),
        vibration_port,
        counts_axes: counts_axes.unwrap_or(false),
        accept,
    })
}

/// The highest level of each output, as its name says it.
fn levels_of(section: &mut Section<'_, '_, '_>) -> [f64; SWITCHES] {
    let mut at_most = [0.0; SWITCHES];
    for ((_, _, name), most) in channel::switches().zip(&mut at_most) {
        *most = section.number_in(name, 0.0..=1.0).unwrap_or(0.0);
    }
    at_most
}

/// The inputs of an emergency stop, and those of belts.
fn named_inputs(section: &mut Section<'_, '_, '_>) -> (u16, u16) {
    let [estop, belts] = ["estop_inputs", "belt_inputs"].map(|key| inputs_up_to(section, key, 12));
    if let Some(entry) = section.get("belt_inputs").filter(|_| estop & belts != 0) {
        entry.fault(section.faults, "an input of estop_inputs cannot be that of a belt");
    }
    (estop, belts)
}

fn dialect(section: &mut Section<'_, '_, '_>) -> Option<Dialect> {
    let entry = section.get("dialect")?;
    if entry.value.as_str() == Some("imax") {
        entry.fault(section.faults, "an IMAX controller is \"mbox\" here");
        return None;
    }
    if let Some(drive @ ("silvermax" | "sixpack2")) = entry.value.as_str() {
        entry.fault(section.faults, &format!("{drive} is on a serial line; write address = \"link:NAME\""));
        return None;
    }
    entry.choice(&[("smc", Dialect::Smc), ("mbox", Dialect::Mbox)], section.faults)
}

/// Bytes of Port Out in vibration frames, which MBOX controllers do not have.
fn vibration_port(section: &mut Section<'_, '_, '_>, dialect: Option<Dialect>) -> Option<VibrationPort> {
    let entry = section.get("vibration_port_octets")?;
    if dialect == Some(Dialect::Mbox) {
        entry.fault(section.faults, "mbox controllers have no vibration frames; omit it");
    }
    let bytes: u8 = entry.whole_in(2..=4, section.faults)?;
    let port = VibrationPort::of_bytes(bytes);
    if port.is_none() {
        entry.fault(section.faults, &format!("{bytes} is neither 2 nor 4"));
    }
    port
}

fn accept(section: &mut Section<'_, '_, '_>) -> Option<Accept> {
    let entry = section.get("accept")?;
    let text = entry.text(section.faults)?;
    if text == "station" {
        return Some(Accept::Station);
    }
    match entry.code(section.faults)? {
        0xffff => Some(Accept::All),
        code => Some(Accept::Code(code)),
    }
}

fn effects_of(section: &mut Section<'_, '_, '_>, site: &Site<'_>) -> Option<Vec<String>> {
    let entries = section.get("effects")?.array(section.faults)?;
    let mut names = Vec::new();
    for entry in entries {
        let Some(name) = entry.text(section.faults) else { continue };
        if !site.effects.iter().any(|effect| effect.name == name) {
            let hint = did_you_mean(name, site.effects.iter().map(|effect| effect.name.as_str()));
            entry.fault(section.faults, &format!("{name} is not in [effects]{hint}"));
        }
        names.push(name.to_owned());
    }
    Some(names)
}
