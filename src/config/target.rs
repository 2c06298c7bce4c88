//! A configuration from the command line: `--to HOST:PORT[,key=value…]`, one for each controller.

use std::net::{SocketAddr, SocketAddrV4, ToSocketAddrs as _};
use std::sync::Arc;

use crate::channel::SWITCHES;
use crate::motion::{MAX_AXES, SeatType};

use super::section::did_you_mean;
use super::{
    Accept, Api, Config, Connection, Controller, Dialect, Effect, FanOut, Log, Record, Show, Station, Store,
    VibrationPort, check_effect_name, check_peer, check_window,
};

/// What the outputs of a controller on this machine mean unless told otherwise: Y01 to Y06.
const BENCH_EFFECTS: [&str; 6] = ["air", "water", "wind", "leg", "smoke", "light"];

const KEYS: [&str; 6] = ["name", "axes", "offset", "fan_out", "dialect", "vibration_port_octets"];

/// Why `--to` or `--effect` makes no configuration.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// No controller was named.
    #[error("no controller to play to; give --to HOST:PORT, or --config FILE")]
    None,
    /// The host has no IPv4 address, or cannot be looked up.
    #[error("--to {target}: cannot find an IPv4 address for it")]
    Host {
        /// The argument.
        target: String,
        /// What the system said, if anything.
        source: Option<std::io::Error>,
    },
    /// Part of an argument cannot be used.
    #[error("--to {target}: {reason}")]
    Target {
        /// The argument.
        target: String,
        /// What is wrong, with value and limit.
        reason: String,
    },
    /// Two controllers have one address or one name.
    #[error("--to {target}: {what} is also that of an earlier --to")]
    Twice {
        /// The later argument.
        target: String,
        /// What it shares.
        what: String,
    },
    /// An effect cannot be used.
    #[error("--effect {effect}: {reason}")]
    Effect {
        /// The argument.
        effect: String,
        /// What is wrong, with value and limit.
        reason: String,
    },
}

/// The configuration that `--to` and `--effect` arguments mean for a cue of `cue_axes` axes; its `show` is the
/// default one.
///
/// Host names are looked up, and may wait for the network. Controllers on this machine switch `air`, `water`,
/// `wind`, `leg`, `smoke` and `light` as outputs 1 to 6, those named by `effects` (`NAME=N`), and all bits of raw
/// output words; other controllers switch what `effects` names and nothing else, as nobody knows their wiring.
///
/// # Errors
/// A [`TargetError`] for the first argument that cannot be used; two of one address are such.
pub fn from_to_args(tos: &[String], effects: &[String], cue_axes: usize) -> Result<Config, TargetError> {
    if tos.is_empty() {
        return Err(TargetError::None);
    }
    let named = parse_effects(effects)?;
    let names: Vec<String> = named.iter().map(|effect| effect.name.clone()).collect();
    let mut controllers: Vec<Controller> = Vec::new();
    for (index, to) in tos.iter().enumerate() {
        let mut controller = parse_target(to, index, cue_axes)?;
        refuse_twin(to, &controller, &controllers)?;
        // Nobody knows the wiring of one that is not of this machine.
        let bench = controller.station().is_some_and(|station| station.address.ip().is_loopback());
        controller.effects = (!bench).then(|| names.clone());
        controller.at_most = [if bench { 1.0 } else { 0.0 }; SWITCHES];
        controllers.push(controller);
    }
    let seats = distinct_seats(&controllers);
    Ok(Config {
        show: Show::default(),
        seats,
        effects: with_bench_effects(named),
        effect_limits: Vec::new(),
        presets: Vec::new(),
        store: Store::default(),
        log: Log::default(),
        record: Record::default(),
        controllers,
        absent: Vec::new(),
        links: Vec::new(),
        broadcast: None,
        osc: None,
        text: None,
        buttons: Vec::new(),
        notify: None,
        fleet: None,
        pair: None,
        api: Api::default(),
        sync: None,
        film: None,
    })
}

impl Config {
    /// The controllers to which every effect stays off, and what a person can do about it.
    pub(crate) fn without_effects(&self) -> impl Iterator<Item = (&Controller, &'static str)> {
        let what = |controller: &Controller| match controller.drives() {
            Some(_) => "drives have no outputs",
            None => "name its outputs with --effect NAME=N or [effects]",
        };
        let dark = self.controllers.iter().filter(|controller| self.allowed_outputs(controller) == 0);
        dark.map(move |controller| (controller, what(controller)))
    }
}

fn with_bench_effects(mut effects: Vec<Effect>) -> Vec<Effect> {
    for (name, output) in BENCH_EFFECTS.into_iter().zip(1..) {
        if !effects.iter().any(|effect| effect.name == name) {
            effects.push(Effect { name: name.to_owned(), output });
        }
    }
    effects
}

fn distinct_seats(controllers: &[Controller]) -> Vec<Arc<SeatType>> {
    let mut seats: Vec<Arc<SeatType>> = Vec::new();
    for controller in controllers {
        if !seats.contains(&controller.seat) {
            seats.push(Arc::clone(&controller.seat));
        }
    }
    seats
}

fn refuse_twin(target: &str, controller: &Controller, others: &[Controller]) -> Result<(), TargetError> {
    let twice = |what: String| TargetError::Twice { target: target.to_owned(), what };
    if others.iter().any(|other| other.address() == controller.address()) {
        return Err(twice(format!("the address {}", controller.address())));
    }
    if others.iter().any(|other| other.name == controller.name) {
        return Err(twice(format!("the name {}", controller.name)));
    }
    Ok(())
}

fn parse_effects(arguments: &[String]) -> Result<Vec<Effect>, TargetError> {
    let mut effects: Vec<Effect> = Vec::new();
    for argument in arguments {
        let effect = parse_effect(argument)?;
        if effects.iter().any(|before| before.name == effect.name) {
            let reason = format!("{} is named by an earlier --effect", effect.name);
            return Err(TargetError::Effect { effect: argument.clone(), reason });
        }
        effects.push(effect);
    }
    Ok(effects)
}

fn parse_effect(argument: &str) -> Result<Effect, TargetError> {
    let refuse =
        |reason: &str| TargetError::Effect { effect: argument.to_owned(), reason: reason.to_owned() };
    let (name, output) = argument.split_once('=').ok_or_else(|| refuse("write NAME=N, such as air=1"))?;
    check_effect_name(name).map_err(refuse)?;
    match output.parse() {
        Ok(output @ 1..=12) => Ok(Effect { name: name.to_owned(), output }),
        _ => Err(refuse("the output has to be 1 to 12")),
    }
}

/// Where and what `target` is; which effects it switches is left open.
fn parse_target(target: &str, index: usize, cue_axes: usize) -> Result<Controller, TargetError> {
    let refuse = |reason: String| TargetError::Target { target: target.to_owned(), reason };
    let mut parts = target.split(',');
    let host = parts.next().unwrap_or_default();
    let mut options = TargetOptions { name: format!("c{}", index + 1), ..TargetOptions::default() };
    for part in parts {
        options.set(part).map_err(refuse)?;
    }
    if options.offset >= cue_axes {
        return Err(refuse(format!("offset {} is past the cue's {cue_axes} axes", options.offset)));
    }
    let axes = options.axes.unwrap_or(cue_axes - options.offset);
    check_window(options.offset, axes, options.fan_out).map_err(refuse)?;
    let address = resolve(target, host)?;
    check_peer(address).map_err(|reason| {
        // A host that is an address has just been named.
        let is_named = host == address.to_string();
        refuse(if is_named { reason.to_owned() } else { format!("{address}: {reason}") })
    })?;
    Ok(Controller {
        group: options.name.clone(),
        name: options.name,
        row: None,
        seat: Arc::new(SeatType::bench3(axes)),
        connection: Connection::Udp(Station {
            address,
            fan_out: options.fan_out,
            dialect: options.dialect,
            vibration_port: options.vibration_port,
            counts_axes: false,
            accept: Accept::All,
        }),
        axis_offset: options.offset,
        effects: None,
        at_most: [0.0; SWITCHES],
        estop_inputs: 0,
        belt_inputs: 0,
        accept_findings: Vec::new(),
    })
}

fn resolve(target: &str, host: &str) -> Result<SocketAddrV4, TargetError> {
    if !host.contains(':') {
        let reason = "the port is missing; controllers listen on :7408 unless PA14 says otherwise".to_owned();
        return Err(TargetError::Target { target: target.to_owned(), reason });
    }
    let unknown = |source| TargetError::Host { target: target.to_owned(), source };
    let mut found = host.to_socket_addrs().map_err(|error| unknown(Some(error)))?;
    let v4 = found.find_map(|address| match address {
        SocketAddr::V4(address) => Some(address),
        SocketAddr::V6(_) => None,
    });
    v4.ok_or_else(|| unknown(None))
}

/// The part of `--to` after the address.
struct TargetOptions {
    name: String,
    axes: Option<usize>,
    offset: usize,
    fan_out: FanOut,
    dialect: Dialect,
    vibration_port: VibrationPort,
}

impl Default for TargetOptions {
    fn default() -> Self {
        Self {
            name: String::new(),
            axes: None,
            offset: 0,
            fan_out: FanOut::Slice,
            dialect: Dialect::Smc,
            vibration_port: VibrationPort::Two,
        }
    }
}

impl TargetOptions {
    fn set(&mut self, part: &str) -> Result<(), String> {
        let (key, value) = part.split_once('=').ok_or_else(|| format!("{part:?} is not key=value"))?;
        let refuse = |wanted: &str| format!("{key}={value} is not one of {wanted}");
        match key {
            "name" if !value.is_empty() => value.clone_into(&mut self.name),
            "name" => return Err("name= has no name".to_owned()),
            "axes" => {
                let axes = whole(value).filter(|axes| (1..=MAX_AXES).contains(axes));
                self.axes = Some(axes.ok_or_else(|| refuse("1..=12"))?);
            }
            "offset" => {
                let offset = whole(value).filter(|&offset| offset < MAX_AXES);
                self.offset = offset.ok_or_else(|| refuse("0..=11"))?;
            }
            "fan_out" => {
                self.fan_out = match value {
                    "slice" => FanOut::Slice,
                    "shared" => FanOut::Shared,
                    _ => return Err(refuse("slice, shared")),
                }
            }
            "dialect" => {
                self.dialect = match value {
                    "smc" => Dialect::Smc,
                    "mbox" => Dialect::Mbox,
                    _ => return Err(refuse("smc, mbox (for IMAX too)")),
                }
            }
            "vibration_port_octets" => {
                let port = value.parse().ok().and_then(VibrationPort::of_bytes);
                self.vibration_port = port.ok_or_else(|| refuse("2, 4"))?;
            }
            _ => {
                let hint = did_you_mean(key, KEYS.into_iter());
                return Err(format!("unknown key {key}; the keys are {}{hint}", KEYS.join(", ")));
            }
        }
        Ok(())
    }
}

fn whole(text: &str) -> Option<usize> {
    text.parse().ok()
}
