//! What went over a serial line: logs with times and directions, hex, or raw octets; of any dialect.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read as _, Write};

use anyhow::Context as _;
use serde_json::{Map, Value, json};

use super::input::{Input, bytes};
use super::{Args, end};
use crate::cli::{Exit, Failure, OrExit as _};
use crate::wire::sixpack2::{CanFrame, SixpackFrame};

/// Bytes that are read ahead, and the longest line.
const AHEAD: usize = 1 << 16;

/// Which way octets went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    ToDrive,
    FromDrive,
}

/// Something of each direction of a line, and of octets whose direction nobody knows.
pub(super) struct EachWay<T> {
    pub(super) to_drive: T,
    pub(super) from_drive: T,
    pub(super) either: T,
}

impl<T> EachWay<T> {
    /// Every way that octets can have gone.
    pub(super) const WAYS: [Option<Direction>; 3] =
        [Some(Direction::ToDrive), Some(Direction::FromDrive), None];

    pub(super) const fn of(&mut self, direction: Option<Direction>) -> &mut T {
        match direction {
            Some(Direction::ToDrive) => &mut self.to_drive,
            Some(Direction::FromDrive) => &mut self.from_drive,
            None => &mut self.either,
        }
    }
}

/// One message, or octets that are none.
#[derive(Debug)]
pub(super) struct SerialSaid {
    /// Which way it went, if anybody knows.
    pub(super) direction: Option<Direction>,
    /// For a person.
    pub(super) text: String,
    /// For a program.
    pub(super) fields: Map<String, Value>,
    /// It is a message.
    pub(super) is_message: bool,
}

impl SerialSaid {
    /// Octets that are no message, and why.
    pub(super) fn stray(direction: Option<Direction>, octets: &[u8], why: &str) -> Self {
        let hex: Vec<String> = octets.iter().map(|octet| format!("{octet:02x}")).collect();
        let hex = hex.join(" ");
        let text = format!("  ?  {hex}: {why}");
        let named = [("kind", json!("stray")), ("octets", json!(hex)), ("why", json!(why))];
        let fields = named.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        Self { direction, text, fields, is_message: false }
    }
}

/// Makes messages of the octets of one dialect.
pub(super) trait SerialDecoder {
    /// Octets that came together; what is complete with them.
    fn take(&mut self, direction: Option<Direction>, octets: &[u8]) -> Vec<SerialSaid>;

    /// What nothing completes any more.
    fn rest(&mut self) -> Vec<SerialSaid>;
}

impl Direction {
    fn of(word: &str) -> Option<Self> {
        match word {
            ">" => Some(Self::ToDrive),
            "<" => Some(Self::FromDrive),
            _ => None,
        }
    }
}

/// Decodes what the arguments name.
pub(super) fn run(args: &Args, decoder: impl SerialDecoder) -> Result<Exit, Failure> {
    let mut printer =
        SerialPrinter { out: io::stdout().lock(), decoder, json: args.json, messages: 0, strays: 0 };
    let (name, mut input): (String, Box<dyn BufRead>) = match Input::of(&args.input)? {
        Input::Messages(messages) => {
            let written = printer.octets(None, None, &messages.concat());
            return end(written.and_then(|()| printer.rest()).map(|()| printer.strays == 0));
        }
        Input::File(path) => {
            let name = path.display().to_string();
            let opened = File::open(&path).with_context(|| format!("cannot open {name}"));
            (name, Box::new(BufReader::with_capacity(AHEAD, opened.or_exit(Exit::NoInput)?)))
        }
        Input::Stdin => ("standard input".to_owned(), Box::new(BufReader::with_capacity(AHEAD, io::stdin()))),
    };
    let read = Form::of(&mut *input).and_then(|form| printer.stream(form, &mut *input));
    match read {
        Ok(Ok(())) => end(printer.rest().and_then(|()| printer.summary()).map(|()| printer.strays == 0)),
        Ok(Err(unwritten)) => end(Err(unwritten)),
        Err(error) => Err(error).with_context(|| format!("cannot read {name}")).or_exit(Exit::Io),
    }
}

/// What a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// `seconds > hex` to the drive, `seconds < hex` from it; frames of a CAN bus.
    Log,
    /// Lines of hex.
    Hex,
    /// The octets themselves.
    Raw,
}

impl Form {
    /// Told by how it opens.
    fn of(input: &mut dyn BufRead) -> io::Result<Self> {
        let opening = input.fill_buf()?;
        let line = opening.split(|octet| *octet == b'\n').find(|line| !line.trim_ascii().is_empty());
        let Some(line) = line.and_then(|line| std::str::from_utf8(line).ok()) else { return Ok(Self::Raw) };
        Ok(if logged(line).or_else(|| dumped(line)).is_some() {
            Self::Log
        } else if bytes(line).is_ok() {
            Self::Hex
        } else {
            Self::Raw
        })
    }
}

/// Seconds and direction of a line of a log, and its hex.
fn logged(line: &str) -> Option<(f64, Direction, String)> {
    let (seconds, rest) = line.trim().split_once(' ')?;
    let (direction, hex) = rest.trim_start().split_once(' ').unwrap_or((rest, ""));
    Some((seconds.parse().ok()?, Direction::of(direction)?, hex.to_owned()))
}

/// The same of a frame on a CAN bus, as `candump -L` writes them: `(seconds) interface identifier#hex`.
fn dumped(line: &str) -> Option<(f64, Direction, String)> {
    let (seconds, rest) = line.trim().strip_prefix('(')?.split_once(')')?;
    let (id, hex) = rest.trim().split_once(' ')?.1.trim().split_once('#')?;
    let (id, octets) = (u16::from_str_radix(id, 16).ok()?, bytes(hex).ok()?.try_into().ok()?);
    let frame = SixpackFrame::try_from(CanFrame { id, octets }).ok()?;
    // No unit has the address that answers go to.
    let direction = if frame.address == u8::MAX { Direction::FromDrive } else { Direction::ToDrive };
    let hex = frame.octets().map(|octet| format!("{octet:02x}")).join(" ");
    Some((seconds.parse().ok()?, direction, hex))
}

struct SerialPrinter<W, D> {
    out: W,
    decoder: D,
    json: bool,
    messages: u64,
    strays: u64,
}

impl<W: Write, D: SerialDecoder> SerialPrinter<W, D> {
    /// All of a stream; an error outside is the input's, one inside the output's.
    fn stream(&mut self, form: Form, input: &mut dyn BufRead) -> io::Result<io::Result<()>> {
        let mut chunk = Vec::new();
        loop {
            chunk.clear();
            let count = match form {
                Form::Raw => {
                    chunk.extend_from_slice(input.fill_buf()?);
                    input.consume(chunk.len());
                    chunk.len()
                }
                Form::Log | Form::Hex => input.take(AHEAD as u64).read_until(b'\n', &mut chunk)?,
            };
            if count == 0 {
                return Ok(Ok(()));
            }
            let written = match form {
                Form::Raw => self.octets(None, None, &chunk),
                Form::Log | Form::Hex => self.line(form, &String::from_utf8_lossy(&chunk)),
            };
            if written.is_err() {
                return Ok(written);
            }
        }
    }

    fn line(&mut self, form: Form, line: &str) -> io::Result<()> {
        if line.trim().is_empty() {
            return Ok(());
        }
        let (at, direction, hex) = match logged(line).or_else(|| dumped(line)) {
            Some((at, direction, hex)) if form == Form::Log => (Some(at), Some(direction), hex),
            _ => (None, None, line.to_owned()),
        };
        match bytes(&hex) {
            Ok(octets) => self.octets(at, direction, &octets),
            Err(error) => {
                let fields = Map::from_iter([("not_hex".to_owned(), json!(error.to_string()))]);
                let text = format!("not hex: {error}");
                self.say(at, SerialSaid { direction, text, fields, is_message: false })
            }
        }
    }

    fn octets(&mut self, at: Option<f64>, direction: Option<Direction>, octets: &[u8]) -> io::Result<()> {
        let said = self.decoder.take(direction, octets);
        said.into_iter().try_for_each(|said| self.say(at, said))
    }

    fn rest(&mut self) -> io::Result<()> {
        let said = self.decoder.rest();
        said.into_iter().try_for_each(|said| self.say(None, said))
    }

    fn say(&mut self, at: Option<f64>, mut said: SerialSaid) -> io::Result<()> {
        *(if said.is_message { &mut self.messages } else { &mut self.strays }) += 1;
        if self.json {
            said.fields.insert("at_s".to_owned(), json!(at));
            let direction = said.direction.map(|direction| match direction {
                Direction::ToDrive => "to_drive",
                Direction::FromDrive => "from_drive",
            });
            said.fields.insert("direction".to_owned(), json!(direction));
            return writeln!(self.out, "{}", Value::Object(said.fields));
        }
        let arrow = said.direction.map_or("", |direction| match direction {
            Direction::ToDrive => "> ",
            Direction::FromDrive => "< ",
        });
        let at = at.map_or_else(String::new, |at| format!("{at:>12.6}  "));
        writeln!(self.out, "{at}{arrow}{}", crate::plain::lines(&said.text))
    }

    fn summary(&mut self) -> io::Result<()> {
        let Self { messages, strays, .. } = *self;
        if self.json {
            return writeln!(self.out, "{}", json!({ "messages": messages, "strays": strays }));
        }
        writeln!(self.out, "\n{messages} messages, {strays} times octets that are none")
    }
}
