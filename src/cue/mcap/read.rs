//! From an MCAP file to a cue.

use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::marker::PhantomData;
use std::path::Path;

use mcap::records::op;
use serde::Deserialize;
use serde::de::DeserializeSeed;

use super::super::declared::is_alike;
use super::super::fault::{Collector, CueFaults, Place};
use super::super::header::is_effect_name;
use super::super::limits::{
    MAX_EFFECTS, MAX_FILE, MAX_LINE, MAX_MARKER_NAME, MAX_MARKERS, MAX_ROWS, MAX_TIME,
};
use super::super::problem::Problem;
use super::super::unit::DeclaredUnits;
use super::super::{Cue, Effects, Marker, Origin, Steps, title_of, value};
use super::{METADATA, RECORDING, Topic, VERSION, message};
use crate::channel::{ChannelId, Sample};
use crate::container::{self, ChannelRecord, Trouble};
use crate::motion::MAX_AXES;
use crate::plain::escaped;
use crate::time::ShowTime;

/// How much is told of why a message is none, bytes.
const REASON_TOLD: usize = 200;

/// Reads an MCAP cue; `path` names it in faults.
pub(in crate::cue) fn read(path: &Path, input: impl Read) -> Result<Cue, CueFaults> {
    let mut reading = McapReading::new(path);
    let read = container::each(input, MAX_FILE, |opcode, body| reading.take(opcode, body));
    if let Err((place, problem)) = read.map_err(placed) {
        reading.faults.add(place, None, problem);
    }
    reading.finish()
}

/// Reads what is complete in an MCAP cue that is cut short or damaged: every message before that place. Says with it
/// why the rest is lost; nothing where the file is whole.
///
/// # Errors
/// Where what is complete makes no cue.
pub fn recover(path: &Path, input: impl Read) -> Result<(Cue, Option<Problem>), CueFaults> {
    let mut reading = McapReading::new(path);
    let read = container::each_sound(input, MAX_FILE, |opcode, body| reading.take(opcode, body));
    let lost = match read.map_err(placed) {
        Ok(()) => None,
        Err((_, problem @ (Problem::CutShort | Problem::Damaged(_)))) => Some(problem),
        Err((place, problem)) => {
            reading.faults.add(place, None, problem);
            None
        }
    };
    let mut cue = reading.finish()?;
    cue.shrink();
    Ok((cue, lost))
}

/// What is wrong with the file, and where.
fn placed((at, problem): (u64, Problem)) -> (Place, Problem) {
    let place = if matches!(problem, Problem::Damaged(_)) { Place::Byte(at) } else { Place::File };
    (place, problem)
}

impl From<Trouble> for Problem {
    fn from(trouble: Trouble) -> Self {
        match trouble {
            Trouble::Empty => Self::Empty,
            Trouble::CutShort => Self::CutShort,
            Trouble::Foreign(why) => Self::Foreign(why),
            Trouble::Damaged(what) => Self::Damaged(what),
            Trouble::TooLarge => Self::FileTooLarge,
            Trouble::Unread(why) => Self::Unread(why),
        }
    }
}

/// A message's topic, number in its topic, and log time.
#[derive(Debug, Clone, Copy)]
struct At {
    topic: Topic,
    number: u64,
    log_time: u64,
}

impl At {
    const fn place(self) -> Place {
        Place::Message { topic: self.topic.name(), number: self.number, log_time: self.log_time }
    }

    /// Right for times up to [`MAX_TIME`], to which every message was held.
    fn time(self) -> ShowTime {
        ShowTime::from_nanos(i64::try_from(self.log_time).unwrap_or(i64::MAX))
    }
}

/// A file while it is read. Units may be declared behind the messages, so values are checked at the end.
struct McapReading {
    faults: Collector,
    schemas: HashSet<u16>,
    channels: HashMap<u16, Option<Topic>>,
    /// Messages so far and last log time, by topic.
    seen: HashMap<Topic, (u64, u64)>,
    units: Option<DeclaredUnits>,
    cue: Cue,
    samples: Vec<(At, ChannelId, message::TrackMessage)>,
    switched: u32,
}

impl McapReading {
    fn new(path: &Path) -> Self {
        Self {
            faults: Collector::default(),
            schemas: HashSet::new(),
            channels: HashMap::new(),
            seen: HashMap::new(),
            units: None,
            cue: Cue { origin: Origin::Messages, ..Cue::blank(path) },
            samples: Vec::new(),
            switched: 0,
        }
    }

    /// Takes one record. An error ends the reading; faults that do not are gathered.
    fn take(&mut self, opcode: u8, body: &[u8]) -> Result<(), Problem> {
        let broken = |what: &str| Problem::Damaged(format!("a {what} record is too short"));
        match opcode {
            op::SCHEMA => {
                self.schemas.insert(container::schema(body).ok_or_else(|| broken("schema"))?);
            }
            op::CHANNEL => {
                self.channel(&ChannelRecord::parse(body).ok_or_else(|| broken("channel"))?)?;
            }
            op::METADATA => {
                let (name, entries) = container::metadata(body).ok_or_else(|| broken("metadata"))?;
                if name == METADATA {
                    if entries.get("kind") == Some(&"recording") {
                        return Err(Problem::Foreign(RECORDING.to_owned()));
                    }
                    self.declare(&entries);
                }
            }
            op::MESSAGE => {
                let (channel, log_time, data) = container::message(body).ok_or_else(|| broken("message"))?;
                if let Some(Some(topic)) = self.channels.get(&channel).copied() {
                    let (number, before) = self.seen.get(&topic).copied().unwrap_or_default();
                    let at = At { topic, number: number + 1, log_time };
                    self.seen.insert(topic, (at.number, log_time));
                    return self.message(at, before, data);
                }
            }
            // Zeros would be read as one record after another.
            0 => return Err(Problem::Damaged("a record has opcode 0, which is invalid".to_owned())),
            _ => {}
        }
        Ok(())
    }

    /// Topics that are not below `/cue/` belong to someone else and are passed over.
    fn channel(&mut self, channel: &ChannelRecord<'_>) -> Result<(), Problem> {
        let ChannelRecord { id, schema, topic: name, encoding } = *channel;
        if self.channels.contains_key(&id) {
            return Ok(()); // repeated in the summary
        }
        let topic = Topic::all().find(|topic| topic.name() == name);
        if topic.is_none() && name.starts_with("/cue/") {
            let problem = Problem::UnknownTopic { name: value::shortened(name), known: Topic::known() };
            self.faults.add(Place::File, None, problem);
        }
        if topic.is_some() && encoding != "json" {
            let problem = Problem::Foreign(format!(
                "{name} is encoded as {:?}, not as json",
                value::shortened(encoding)
            ));
            self.faults.add(Place::File, None, problem);
        }
        if topic.is_some() && schema != 0 && !self.schemas.contains(&schema) {
            return Err(Problem::Damaged(format!(
                "{name} has schema {schema}, which does not come before it"
            )));
        }
        self.channels.insert(id, topic);
        Ok(())
    }

    fn declare(&mut self, entries: &std::collections::BTreeMap<&str, &str>) {
        let entry = |key| entries.get(key).copied().unwrap_or("");
        let known = ["version", "title", "units", "interpolation"];
        for key in entries.keys().filter(|key| !known.contains(key)) {
            if let Some(near) = known.into_iter().find(|near| is_alike(key, near)) {
                self.faults.add(Place::File, Some(key), Problem::NearKey(near));
            }
        }
        let mut refuse = |key: &str, value: &str, allowed: String| {
            let problem = Problem::Declaration { value: value::shortened(value), allowed };
            self.faults.add(Place::File, Some(key), problem);
        };
        if entry("version") != VERSION {
            refuse("version", entry("version"), format!("this program reads version {VERSION}"));
        }
        let units = entry("units").parse::<DeclaredUnits>();
        let interpolation = entries.get("interpolation").copied().map(|text| (text, text.parse()));
        match &units {
            Err(error) => refuse("units", entry("units"), error.to_string()),
            Ok(units) => self.cue.units = units.units(),
        }
        match interpolation {
            Some((text, Err(error))) => {
                refuse("interpolation", text, super::super::UnknownInterpolation::to_string(&error))
            }
            Some((_, Ok(interpolation))) => self.cue.interpolation = interpolation,
            None => {}
        }
        if self.units.is_some() {
            self.faults.add(Place::File, Some(METADATA), Problem::DeclaredTwice);
        }
        self.units = Some(units.unwrap_or_default());
        self.cue.title = entries.get("title").filter(|title| !title.is_empty()).map(|title| title_of(title));
    }

    fn message(&mut self, at: At, before: u64, data: &[u8]) -> Result<(), Problem> {
        let taken = if data.len() > MAX_LINE {
            Err(Problem::TooLong)
        } else if at.log_time > MAX_TIME.as_nanos().unsigned_abs() {
            Err(Problem::TimeTooLate(format!("{} ns", at.log_time)))
        } else {
            match at.topic {
                Topic::Axes => self.axes(at, before, data),
                _ if at.log_time < before => Err(Problem::TimeGoesBack { early_ns: before - at.log_time }),
                Topic::Channel(id) => parsed_by(message::MessageOf(id.row()), data)
                    .map(|parts| self.samples.push((at, id, parts))),
                Topic::Io => parsed(data).and_then(|io| self.io(at, io)),
                Topic::Marker => parsed(data).and_then(|marker| self.marker(at, marker)),
            }
        };
        match taken {
            Err(problem @ (Problem::TooManyRows | Problem::TooManyMarkers)) => Err(problem),
            Err(problem) => {
                self.faults.add(at.place(), None, problem);
                Ok(())
            }
            Ok(()) if self.samples.len() > MAX_ROWS => Err(Problem::TooManyRows),
            Ok(()) => Ok(()),
        }
    }

    fn axes(&mut self, at: At, before: u64, data: &[u8]) -> Result<(), Problem> {
        let axes = parsed::<message::Axes>(data)?.a;
        let cue = &mut self.cue;
        if at.number == 1 {
            if !(1..=MAX_AXES).contains(&axes.len()) {
                return Err(Problem::Axes(axes.len()));
            }
            if at.log_time != 0 {
                return Err(Problem::TimeNotZero(format!("{} ns", at.log_time)));
            }
            cue.axes = axes.len();
        } else if axes.len() != cue.axes && cue.axes != 0 {
            return Err(Problem::AxesChange { here: axes.len(), first: cue.axes });
        } else if at.log_time <= before {
            let before = At { log_time: before, ..at }.time();
            return Err(Problem::TimeNotIncreasing { time: at.time().to_string(), before });
        }
        if cue.times.len() == MAX_ROWS {
            return Err(Problem::TooManyRows);
        }
        cue.times.push(at.time());
        cue.positions.extend(axes);
        Ok(())
    }

    fn io(&mut self, at: At, io: message::IoMessage) -> Result<(), Problem> {
        let begun = self.seen.get(&Topic::Io).is_some_and(|(count, _)| *count > 1);
        match (io.effects, io.word, &mut self.cue.effects) {
            (None, Some(word), Effects::Words(steps)) => steps.push(at.time(), value::outputs(word)?),
            (None, Some(word), Effects::Named { .. }) if !begun => {
                let mut steps = Steps::default();
                steps.push(at.time(), value::outputs(word)?);
                self.cue.effects = Effects::Words(steps);
            }
            (Some(switches), None, Effects::Named { names, steps }) => {
                for (name, on) in switches.0 {
                    let bit = effect(names, name)?;
                    let on = value::switch(&on.to_string())?;
                    self.switched = self.switched & !(1 << bit) | u32::from(on) << bit;
                }
                steps.push(at.time(), self.switched);
            }
            (None, None, _) => return Err(Problem::Message("neither effects nor word".to_owned())),
            _ => return Err(Problem::WordAndEffects),
        }
        Ok(())
    }

    fn marker(&mut self, at: At, marker: message::MarkerMessage) -> Result<(), Problem> {
        if self.cue.markers.len() == MAX_MARKERS {
            return Err(Problem::TooManyMarkers);
        }
        if marker.name.len() > MAX_MARKER_NAME {
            return Err(Problem::MarkerName(marker.name.len()));
        }
        self.cue.markers.push(Marker { at: at.time(), name: escaped(&marker.name, usize::MAX).into_owned() });
        Ok(())
    }

    /// The cue, once every value is known to be right in its unit.
    fn finish(mut self) -> Result<Cue, CueFaults> {
        let units = self.units.unwrap_or_default();
        if self.faults.is_empty() {
            if self.units.is_none() {
                let problem = Problem::Foreign(format!("it has no metadata record {METADATA:?}"));
                self.faults.add(Place::File, None, problem);
            } else if self.cue.rows() < 2 {
                self.faults.add(Place::File, None, Problem::TooFewRows(self.cue.rows()));
            } else if let Some(problem) = units.misfit(self.cue.axes) {
                self.faults.add(Place::File, Some("units"), problem);
            } else {
                self.check_positions(&units);
                self.build_tracks(&units);
            }
        }
        let Self { faults, cue, .. } = self;
        match faults.into_faults(cue.path()) {
            Some(faults) => Err(faults),
            None => Ok(cue),
        }
    }

    fn check_positions(&mut self, units: &DeclaredUnits) {
        let (axes, times) = (self.cue.axes, &self.cue.times);
        for (index, position) in self.cue.positions.iter_mut().enumerate() {
            match value::position(*position, units.of(index % axes)) {
                Ok(value) => *position = value,
                Err(problem) => {
                    let (row, axis) = (index / axes, index % axes);
                    let log_time = times[row].as_nanos().unsigned_abs();
                    let at = At { topic: Topic::Axes, number: row as u64 + 1, log_time };
                    self.faults.add(at.place(), Some(&format!("a{}", axis + 1)), problem);
                }
            }
        }
    }

    fn build_tracks(&mut self, units: &DeclaredUnits) {
        for (at, id, parts) in std::mem::take(&mut self.samples) {
            if let Err((name, problem)) = self.keep(at, id, parts, units) {
                self.faults.add(at.place(), name, problem);
            }
        }
    }

    fn keep(
        &mut self,
        at: At,
        id: ChannelId,
        message::TrackMessage { axis, sample }: message::TrackMessage,
        units: &DeclaredUnits,
    ) -> Result<(), (Option<&'static str>, Problem)> {
        let (channel, axes) = (id.row(), self.cue.axes);
        let track = axis.checked_sub(1).and_then(|axis| channel.tracks(axes).nth(axis));
        let track = track.ok_or((Some("axis"), Problem::NoSuchAxis { axis, axes }))?;
        let mut kept = Sample::default();
        let mut wrong = None;
        for (part, known) in channel.parts.iter().enumerate() {
            match value::part(sample.0[part], track, part, units.of(track.axis)) {
                Ok(value) => kept.0[part] = value,
                Err(problem) => {
                    if let Some((name, before)) = wrong.replace((Some(known.name), problem)) {
                        self.faults.add(at.place(), name, before);
                    }
                }
            }
        }
        wrong.map_or(Ok(()), Err)?;
        (channel.check)(kept).map_err(|problem| (None, Problem::Refused(problem)))?;
        self.cue.tracks.of_mut(track).push(at.time(), kept);
        Ok(())
    }
}

/// The bit of an effect; a new one where the name is new.
fn effect(names: &mut Vec<String>, name: String) -> Result<usize, Problem> {
    if let Some(bit) = names.iter().position(|known| *known == name) {
        return Ok(bit);
    }
    if !is_effect_name(&name) {
        return Err(Problem::EffectName);
    }
    if names.len() == MAX_EFFECTS {
        return Err(Problem::TooManyEffects);
    }
    names.push(name);
    Ok(names.len() - 1)
}

fn parsed<'a, T: Deserialize<'a>>(data: &'a [u8]) -> Result<T, Problem> {
    parsed_by(PhantomData, data)
}

fn parsed_by<'a, S: DeserializeSeed<'a>>(seed: S, data: &'a [u8]) -> Result<S::Value, Problem> {
    let mut json = serde_json::Deserializer::from_slice(data);
    let parsed = seed.deserialize(&mut json).and_then(|value| json.end().map(|()| value));
    // It names what it met in the file as it stands there.
    parsed.map_err(|error| Problem::Message(escaped(&error.to_string(), REASON_TOLD).into_owned()))
}
