//! `kinocue decode`.

use std::ffi::OsString;
use std::io::{self, BufWriter, Write};

use anyhow::{Context as _, anyhow};

use super::{Exit, Failure, OrExit as _, vibration_port};
use crate::capture::{CaptureError, Datagram, Fragment};
use crate::wire::VibrationPort;

mod input;
mod message;
mod names;
mod printer;
mod serial;
mod sheet;
mod silvermax;
mod sixpack2;
mod tally;

use input::{Input, MessageStream};
use message::MessageReading;
use printer::{PrintManner, Printer, StreamEnd};
use silvermax::SilverDecoder;
use sixpack2::SixpackDecoder;

/// Where controllers (PA14) and hosts (PA24) listen.
const PORTS: [u16; 2] = [7408, 8410];

/// Decodes protocol messages.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue decode 55aa000012010002ffffffff000000010000
  kinocue decode 55:aa:00:00 12:01:00:02 ff:ff:ff:ff 00:00:00:01 00:00
  kinocue decode show.pcapng --verbose
  kinocue decode show.pcapng --port 7402 --json
  tcpdump -i eth0 -w - udp port 7408 | kinocue decode
  xxd -p -c 256 frame.bin | kinocue decode -
  kinocue decode --dialect silvermax 40 31 36 20 31 32 20 31 0d
  printf '@16 0\\r# 10 0000 2000\\r' | kinocue decode --dialect silvermax
  printf '0.5 > 40 31 36 20 30 0d\\n0.6 < 2a 20 31 30 0d\\n' | kinocue decode --dialect silvermax -
  kinocue decode --dialect sixpack2 01 24 00 40 1f 00 00 00 00

Exit codes: 0 everything was read, 64 not hex, 65 a message is malformed or cut short, or
the file is neither hex nor a capture, 66 no such file")]
pub(super) struct Args {
    /// Hex, a capture, or - for standard input
    ///
    /// Hex digits with or without spaces, colons and 0x. Words are joined; a word that starts with 55aa0000 or
    /// 33cc0000 begins another message. A file, or standard input, is a pcap or pcapng capture, or lines of hex, one
    /// message per line.
    #[arg(value_name = "HEX|FILE")]
    input: Vec<OsString>,

    /// Family whose manual the messages follow; imax is the layout as its manual prints it, which no known
    /// program sends. For serial drives, a file or standard input holds raw bytes, lines of hex, or a log of lines
    /// "seconds > hex" to the drive and "seconds < hex" from it, or one that candump -L wrote on a CAN bus.
    #[arg(long, value_enum, default_value_t = MessageReading::Smc)]
    dialect: MessageReading,

    /// Bytes of Port Out in frames with vibration, and of the inputs in the answers: 2 or 4.
    #[arg(long, value_name = "N", default_value = "2", value_parser = vibration_port)]
    vibration_port_octets: VibrationPort,

    /// In a capture, read the datagrams from or to this port instead of 7408 and 8410; repeatable.
    #[arg(long, value_name = "N", conflicts_with = "all")]
    port: Vec<u16>,

    /// In a capture, read every datagram that begins like a message, on any port.
    #[arg(long)]
    all: bool,

    /// Print all fields of each message of a file or of standard input, instead of one line.
    #[arg(short, long)]
    verbose: bool,

    /// Print one JSON object per line on stdout; after a file or standard input, one with the counts.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let is_serial = matches!(args.dialect, MessageReading::Silvermax | MessageReading::Sixpack2);
    if is_serial && (args.all || args.verbose || !args.port.is_empty()) {
        return Err(anyhow!(
            "--port, --all and --verbose are for datagrams; omit them with a serial dialect"
        ))
        .or_exit(Exit::Usage);
    }
    match args.dialect {
        MessageReading::Silvermax => serial::run(args, SilverDecoder::default()),
        MessageReading::Sixpack2 => serial::run(args, SixpackDecoder::default()),
        _ => datagrams(args),
    }
}

fn datagrams(args: &Args) -> Result<Exit, Failure> {
    let port = args.vibration_port_octets;
    let manner = PrintManner { reading: args.dialect, port, json: args.json, full: args.verbose };
    match Input::of(&args.input)? {
        Input::Messages(messages) => {
            let mut printer = Printer::new(io::stdout().lock(), PrintManner { full: true, ..manner });
            let written = printer.messages(&messages);
            end(written.and_then(|()| printer.finish()))
        }
        Input::File(path) => {
            let printer = Printer::new(BufWriter::new(io::stdout().lock()), manner);
            stream(printer, MessageStream::open(&path)?, args, &path.display().to_string())
        }
        // Unlike a file it may come slowly, so that each line is written at once.
        Input::Stdin => {
            stream(Printer::new(io::stdout().lock(), manner), MessageStream::stdin()?, args, "standard input")
        }
    }
}

fn stream(
    mut printer: Printer<impl Write>,
    stream: MessageStream,
    args: &Args,
    name: &str,
) -> Result<Exit, Failure> {
    let filter = Filter { ports: if args.port.is_empty() { &PORTS } else { &args.port }, all: args.all };
    let halted = match stream {
        MessageStream::Capture(input) => printer.capture(input, filter),
        MessageStream::Lines(input) => printer.lines(input),
    };
    let halted = match halted {
        Err(StreamEnd::Output(error)) => return end(Err(error)),
        Err(StreamEnd::Input(error)) | Err(StreamEnd::Capture(CaptureError::Io(error))) => {
            Err(error).with_context(|| format!("cannot read {name}")).or_exit(Exit::Io)
        }
        Err(StreamEnd::Empty) => Err(anyhow!("{name}: neither hex nor a capture")).or_exit(Exit::BadCue),
        Err(StreamEnd::Capture(error)) => Err(anyhow!("{name}: {error}")).or_exit(Exit::BadCue),
        Ok(()) => Ok(()),
    };
    let exit = end(printer.summary().and_then(|()| printer.finish()))?;
    halted.map(|()| exit)
}

/// The end of the program, by whether all was written and every message could be read. A reader that went away has
/// seen what it wanted.
fn end(written: io::Result<bool>) -> Result<Exit, Failure> {
    match written {
        Ok(true) => Ok(Exit::Done),
        Ok(false) => Ok(Exit::BadCue),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(Exit::Done),
        Err(error) => Err(error).context("cannot write to the standard output").or_exit(Exit::Io),
    }
}

/// Which datagrams of a capture are read.
#[derive(Debug, Clone, Copy)]
struct Filter<'a> {
    ports: &'a [u16],
    all: bool,
}

impl Filter<'_> {
    fn takes(self, datagram: &Datagram<'_>) -> bool {
        let opens_like_a_message =
            matches!(datagram.payload, [0x55, 0xaa, 0, 0, ..] | [0x33, 0xcc, 0, 0, ..]);
        self.has(datagram.source.port(), datagram.destination.port()) || self.all && opens_like_a_message
    }

    fn takes_fragment(self, fragment: &Fragment) -> bool {
        self.all || fragment.ports.is_some_and(|(source, destination)| self.has(source, destination))
    }

    fn has(self, source: u16, destination: u16) -> bool {
        self.ports.contains(&source) || self.ports.contains(&destination)
    }
}
