//! Reads messages one after another and writes what they say.

use std::io::{self, BufRead, Read, Write};
use std::net::SocketAddrV4;

use serde_json::{Map, Value, json};

use super::Filter;
use super::input::{MAX_BYTES, bytes};
use super::message::{MessageReading, sheet};
use super::tally::MessageTally;
use crate::capture::{Capture, CaptureError, Content, Datagram, Fragment, Packet};
use crate::wire::VibrationPort;

/// The most bytes of a malformed message that are shown.
const SHOWN: usize = 64;
/// The longest line of hex: digits, separators and line end of the longest datagram.
const MAX_LINE: usize = 16 * MAX_BYTES;

/// How messages are written.
#[derive(Debug, Clone, Copy)]
pub(super) struct PrintManner {
    pub(super) reading: MessageReading,
    /// How vibration frames have Port Out.
    pub(super) port: VibrationPort,
    pub(super) json: bool,
    /// All fields rather than one line.
    pub(super) full: bool,
}

/// Writes messages, and counts them.
pub(super) struct Printer<W> {
    out: W,
    manner: PrintManner,
    tally: MessageTally,
    written: u64,
}

/// Where a message comes from.
#[derive(Debug, Clone, Copy)]
enum MessagePlace {
    Argument,
    Line(u64),
    Packet { number: u64, time_ns: Option<u64>, after_s: Option<f64>, source: SocketAddrV4, to: SocketAddrV4 },
}

impl MessagePlace {
    fn text(self) -> String {
        match self {
            Self::Argument => String::new(),
            Self::Line(number) => format!("line {number}"),
            Self::Packet { number, after_s: None, source, to, .. } => {
                format!("packet {number}  {source} -> {to}")
            }
            Self::Packet { after_s: Some(after_s), source, to, .. } => {
                format!("{after_s:>12.6}  {source} -> {to}")
            }
        }
    }

    fn put(self, object: &mut Map<String, Value>) {
        match self {
            Self::Argument => {}
            Self::Line(number) => {
                object.insert("line".to_owned(), number.into());
            }
            Self::Packet { number, time_ns, source, to, .. } => {
                object.insert("packet".to_owned(), number.into());
                object.insert("time_ns".to_owned(), time_ns.into());
                object.insert("source".to_owned(), source.to_string().into());
                object.insert("destination".to_owned(), to.to_string().into());
            }
        }
    }
}

impl<W: Write> Printer<W> {
    pub(super) fn new(out: W, manner: PrintManner) -> Self {
        Self { out, manner, tally: MessageTally::default(), written: 0 }
    }

    /// Decodes messages of the command line.
    pub(super) fn messages(&mut self, messages: &[Vec<u8>]) -> io::Result<()> {
        messages.iter().try_for_each(|bytes| self.message(MessagePlace::Argument, bytes))
    }

    /// Decodes lines of hex, a message each; empty lines are let pass, unless there is nothing else.
    pub(super) fn lines(&mut self, mut input: impl BufRead) -> Result<(), StreamEnd> {
        let mut line = Vec::new();
        let mut is_empty = true;
        for number in 1.. {
            line.clear();
            let read = input
                .by_ref()
                .take(MAX_LINE as u64)
                .read_until(b'\n', &mut line)
                .map_err(StreamEnd::Input)?;
            if read == 0 {
                break;
            }
            if read == MAX_LINE && !line.ends_with(b"\n") {
                skip_line(&mut input).map_err(StreamEnd::Input)?; // what there is holds more than a datagram already
            }
            let text = String::from_utf8_lossy(&line);
            if text.trim().is_empty() {
                continue;
            }
            is_empty = false;
            let place = MessagePlace::Line(number);
            match bytes(&text) {
                Ok(bytes) => self.message(place, &bytes)?,
                Err(error) => {
                    self.tally.not_hex += 1;
                    self.refuse(place, "not hex", json!({ "why": error.to_string() }), &error.to_string())?;
                }
            }
        }
        if is_empty { Err(StreamEnd::Empty) } else { Ok(()) }
    }

    /// Decodes the messages in a capture.
    pub(super) fn capture(&mut self, input: impl Read, filter: Filter<'_>) -> Result<(), StreamEnd> {
        let mut capture = Capture::open(input).map_err(StreamEnd::Capture)?;
        while let Some(packet) = capture.packet().map_err(StreamEnd::Capture)? {
            self.packet(&packet, filter)?;
        }
        Ok(())
    }

    /// Writes the counts.
    pub(super) fn summary(&mut self) -> io::Result<()> {
        if self.manner.json {
            return writeln!(self.out, "{}", self.tally.json());
        }
        let gap = if self.written > 0 { "\n" } else { "" };
        write!(self.out, "{gap}{}", self.tally.text())
    }

    /// Writes out what is held back; says whether every message could be read.
    pub(super) fn finish(mut self) -> io::Result<bool> {
        self.out.flush()?;
        Ok(self.tally.is_clean())
    }

    fn packet(&mut self, packet: &Packet<'_>, filter: Filter<'_>) -> io::Result<()> {
        let after_s = packet.at.map(|at| self.tally.time(at));
        let place = |source, to| MessagePlace::Packet {
            number: packet.number,
            time_ns: packet.at.and_then(|at| u64::try_from(at.as_nanos()).ok()),
            after_s,
            source,
            to,
        };
        match packet.content() {
            Content::Datagram(datagram) if filter.takes(&datagram) => {
                self.datagram(place(datagram.source, datagram.destination), &datagram)
            }
            Content::Datagram(_) => {
                self.tally.other_datagrams += 1;
                Ok(())
            }
            Content::Fragment(fragment) => {
                self.tally.fragments += 1;
                if !filter.takes_fragment(&fragment) {
                    return Ok(());
                }
                let (source, to) = ends(&fragment);
                let why = format!("from byte {} of it on; not reassembled", fragment.offset);
                self.refuse(place(source, to), "fragment", json!({ "offset": fragment.offset }), &why)
            }
            Content::Other => {
                self.tally.other_packets += 1;
                Ok(())
            }
            Content::UnknownLink(link) => {
                self.tally.unknown_link(link);
                Ok(())
            }
        }
    }

    fn datagram(&mut self, place: MessagePlace, datagram: &Datagram<'_>) -> io::Result<()> {
        if !datagram.is_cut() {
            return self.message(place, datagram.payload);
        }
        self.tally.cut += 1;
        let (kept, len) = (datagram.payload.len(), datagram.payload_len);
        let why = format!("the capture kept {kept} of {len} bytes");
        self.refuse(place, "cut", json!({ "kept": kept, "bytes": len }), &why)
    }

    fn message(&mut self, place: MessagePlace, bytes: &[u8]) -> io::Result<()> {
        match sheet(bytes, self.manner.reading, self.manner.port) {
            Ok(sheet) => {
                self.tally.message(&sheet);
                match self.manner {
                    PrintManner { json: true, .. } => self.object(place, sheet.into_object()),
                    PrintManner { full: true, .. } => self.block(place, &sheet.text()),
                    _ => self.line(place, &sheet.brief()),
                }
            }
            Err(error) => {
                self.tally.malformed += 1;
                let literal = self.manner.reading != MessageReading::Imax
                    && sheet(bytes, MessageReading::Imax, self.manner.port).is_ok();
                let hint = if literal { "; with --dialect imax it is one" } else { "" };
                let why = format!("{error}{hint}");
                let object = json!({ "byte": error.offset(), "why": why, "hex": hex(bytes) });
                self.refuse(place, "malformed", object, &format!("{why}: {}", shown(bytes)))
            }
        }
    }

    /// Tells what cannot be read.
    fn refuse(&mut self, place: MessagePlace, what: &str, object: Value, why: &str) -> io::Result<()> {
        if self.manner.json {
            return self.object(place, Map::from_iter([(what.to_owned(), object)]));
        }
        self.line(place, &format!("{what}: {why}"))
    }

    fn object(&mut self, place: MessagePlace, mut object: Map<String, Value>) -> io::Result<()> {
        place.put(&mut object);
        writeln!(self.out, "{}", Value::Object(object))
    }

    fn line(&mut self, place: MessagePlace, text: &str) -> io::Result<()> {
        self.written += 1;
        match place {
            MessagePlace::Argument => writeln!(self.out, "{text}"),
            place => writeln!(self.out, "{}  {text}", place.text()),
        }
    }

    /// Several lines, apart from what stands above.
    fn block(&mut self, place: MessagePlace, text: &str) -> io::Result<()> {
        if self.written > 0 {
            writeln!(self.out)?;
        }
        self.written += 1;
        match place {
            MessagePlace::Argument => {}
            place => writeln!(self.out, "{}", place.text())?,
        }
        self.out.write_all(text.as_bytes())
    }
}

/// What ends a stream before its end.
#[derive(Debug)]
pub(super) enum StreamEnd {
    /// The output cannot be written.
    Output(io::Error),
    /// The lines cannot be read.
    Input(io::Error),
    /// There are none.
    Empty,
    /// The capture cannot be read further.
    Capture(CaptureError),
}

impl From<io::Error> for StreamEnd {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

/// The ends of a fragment; the ports are 0 where it has none.
fn ends(fragment: &Fragment) -> (SocketAddrV4, SocketAddrV4) {
    let (source, destination) = fragment.ports.unwrap_or_default();
    (SocketAddrV4::new(fragment.source, source), SocketAddrV4::new(fragment.destination, destination))
}

/// Passes over the rest of a line.
fn skip_line(input: &mut impl BufRead) -> io::Result<()> {
    let mut rest = Vec::new();
    while input.by_ref().take(MAX_LINE as u64).read_until(b'\n', &mut rest)? > 0 && !rest.ends_with(b"\n") {
        rest.clear();
    }
    Ok(())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn shown(bytes: &[u8]) -> String {
    match bytes.get(..SHOWN) {
        Some(front) if bytes.len() > SHOWN => format!("{}...", hex(front)),
        _ => hex(bytes),
    }
}
