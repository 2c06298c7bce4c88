//! `kinocue record cut`.

use std::io::{BufWriter, Write};
use std::net::SocketAddrV4;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};

use super::super::{Exit, Failure, OrExit as _, exit, print};
use super::{open, tell_flaws};
use crate::record::{Chunk, Contents, CutError, CutManner, Piece, RecordedSeat, Stretch, cut, each_tick};
use crate::sys::file;
use crate::time::{ShowTime, parse_time};

/// Cuts a stretch out of a full recording, with every tick as plain topics that any viewer can draw.
///
/// Exits with 1 if the recording is cut short or damaged: OUT then has only what precedes that.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinocue record cut ride.mcap --film 0:02..0:06 --seat c1 -o jerk.mcap
  kinocue record cut ride.mcap --film 0:02..0:06 --seat c1 --csv -o jerk.csv
  kinocue record cut ride.mcap --film 0:02..0:06 --pcap -o jerk.pcap
  kinocue record cut ride.mcap --film 0:02..0:06 --anonymous --whole -o case.mcap")]
pub(in super::super) struct Args {
    /// The recording.
    file: PathBuf,
    /// The stretch, in show time: 0:02..0:06 [default: all].
    #[arg(long, value_name = "FROM..TO", value_parser = stretch)]
    film: Option<(ShowTime, ShowTime)>,
    /// The seat [default: all].
    #[arg(long, value_name = "NAME")]
    seat: Option<String>,
    /// The file to write.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Write CSV, one row per frame.
    #[arg(long, conflicts_with_all = ["pcap", "film_time", "anonymous", "whole", "scene"])]
    csv: bool,
    /// Write the datagrams as a pcap capture.
    #[arg(long, conflicts_with_all = ["film_time", "anonymous", "whole", "scene"])]
    pcap: bool,
    #[command(flatten)]
    manner: CutManner,
    /// Overwrite OUT if it exists.
    #[arg(long)]
    force: bool,
}

fn stretch(text: &str) -> Result<(ShowTime, ShowTime), String> {
    let (from, to) = text.split_once("..").ok_or("a stretch is FROM..TO, such as 0:02..0:06")?;
    let (from, to) = (parse_time(from)?, parse_time(to)?);
    if from < to { Ok((from, to)) } else { Err(format!("{from} is not before {to}")) }
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    exit::refuse_to_replace(&args.output, args.force)?;
    exit::refuse_same(&args.file, &args.output)?;
    let (from, until) = args.film.unwrap_or((ShowTime::from_nanos(i64::MIN), ShowTime::from_nanos(i64::MAX)));
    let stretch = Stretch { from, until, seat: args.seat.clone() };
    let part = args.output.with_extension("cutting");
    let file = file::create_ours(&part).with_context(|| part.display().to_string()).or_exit(Exit::Io)?;
    let out = BufWriter::new(file);
    let result = if args.csv {
        csv(&args.file, &stretch, out)
    } else if args.pcap {
        pcap(&args.file, &stretch, out)
    } else {
        let input = open(&args.file);
        input.and_then(|input| {
            cut(input, &stretch, args.manner, out).map_err(|error| failure(error, &args.file))
        })
    };
    let written = result.and_then(|(out, contents)| {
        let file = out.into_inner().map_err(std::io::IntoInnerError::into_error).or_exit(Exit::Io)?;
        file.sync_all().or_exit(Exit::Io)?;
        std::fs::rename(&part, &args.output).or_exit(Exit::Io)?;
        Ok(contents)
    });
    if written.is_err() {
        let _ = std::fs::remove_file(&part); // why there is no more is told
    }
    let contents = written?;
    print::tell(&format!("{}", args.output.display()));
    Ok(tell_flaws(&args.file, &contents.flaws()))
}

fn failure(error: CutError, path: &Path) -> Failure {
    let exit = match &error {
        CutError::Seat(..) => Exit::NoInput,
        CutError::Nothing(..) | CutError::Sampled => Exit::Usage,
        CutError::Write(_) => Exit::Io,
        _ => Exit::BadCue,
    };
    Failure { exit, error: anyhow!(error).context(path.display().to_string()) }
}

/// Writes until something fails, and keeps that.
fn each<W: Write>(
    path: &Path,
    stretch: &Stretch,
    mut out: W,
    mut row: impl FnMut(&mut W, &Contents, &Chunk<'_>) -> std::io::Result<()>,
) -> Result<(W, Contents), Failure> {
    let mut result = Ok(());
    let contents = each_tick(open(path)?, stretch, &mut |contents, piece| {
        let Piece::Tick(chunk, _) = &piece else { return };
        if result.is_ok() {
            result = row(&mut out, contents, chunk);
        }
    })
    .map_err(|error| failure(error, path))?;
    result.or_exit(Exit::Io)?;
    Ok((out, contents))
}

fn csv<W: Write>(path: &Path, stretch: &Stretch, mut out: W) -> Result<(W, Contents), Failure> {
    let mut columns = None;
    out.write_all(b"film_s,deadline_ns,late_us,seat,handed_us").or_exit(Exit::Io)?;
    each(path, stretch, out, |out, Contents { seats, .. }, chunk| {
        let most = match columns {
            Some(most) => most,
            None => *columns.insert(columns_of(out, seats, stretch)?),
        };
        let head = chunk.head;
        for frame in chunk.frames() {
            let Some(seat) = seats.get(frame.lane).filter(|seat| stretch.has(seat)) else { continue };
            // A name is not ours: no cell of it breaks the row.
            let name = seat.name.replace(['"', ',', '\n', '\r'], "_");
            let after = frame.at.as_nanos().wrapping_sub(head.deadline.as_nanos()).cast_signed() / 1_000;
            write!(
                out,
                "{:.6},{},{},{name},{after}",
                head.film.as_secs_f64(),
                head.deadline.as_nanos(),
                head.late_ns / 1_000
            )?;
            for places in [seat.asked(&frame.asked), seat.sent(&frame)] {
                for axis in 0..most {
                    match places.get(axis) {
                        Some(place) => write!(out, ",{place:.4}")?,
                        None => write!(out, ",")?,
                    }
                }
            }
            writeln!(out, ",{:.4},{}", frame.asked.level, frame.asked.clamps)?;
        }
        Ok(())
    })
}

/// Writes the names of the columns of axes, and what is behind them; gives how many axes the seat with the most has.
fn columns_of(out: &mut impl Write, seats: &[RecordedSeat], stretch: &Stretch) -> std::io::Result<usize> {
    let axes = seats.iter().filter(|seat| stretch.has(seat)).map(|seat| seat.axes().len());
    let most = axes.max().unwrap_or(0);
    for what in ["asked", "sent"] {
        (1..=most).try_for_each(|axis| write!(out, ",{what}_{axis}"))?;
    }
    writeln!(out, ",level,clamps")?;
    Ok(most)
}

/// Datagrams as a capture of raw IPv4 (draft-ietf-opsawg-pcap, link type 101), times to the nanosecond.
fn pcap<W: Write>(path: &Path, stretch: &Stretch, mut out: W) -> Result<(W, Contents), Failure> {
    let head = [0xa1b2_3c4d_u32, 0x0004_0002, 0, 0, 65_535, 101];
    head.iter().try_for_each(|word| out.write_all(&word.to_le_bytes())).or_exit(Exit::Io)?;
    each(path, stretch, out, |out, contents, chunk| {
        for frame in chunk.frames() {
            let Some(seat) = contents.seats.get(frame.lane).filter(|seat| stretch.has(seat)) else {
                continue;
            };
            let Some(to) = seat.address.as_ref().and_then(|address| address.parse::<SocketAddrV4>().ok())
            else {
                continue;
            };
            let packet = packet(to, frame.datagram);
            let at = contents.wall(frame.at);
            let words = [at / 1_000_000_000, at % 1_000_000_000, packet.len() as u64, packet.len() as u64];
            for word in words {
                out.write_all(&u32::try_from(word).unwrap_or(u32::MAX).to_le_bytes())?;
            }
            out.write_all(&packet)?;
        }
        Ok(())
    })
}

/// A datagram in IPv4 (RFC 791) and UDP without a checksum (RFC 768), from this machine.
fn packet(to: SocketAddrV4, datagram: &[u8]) -> Vec<u8> {
    let len = |octets: usize| u16::try_from(octets).unwrap_or(u16::MAX).to_be_bytes();
    let mut packet = vec![0x45, 0, 0, 0, 0, 0, 0x40, 0, 64, 17, 0, 0, 127, 0, 0, 1];
    packet[2..4].copy_from_slice(&len(28 + datagram.len()));
    packet.extend(to.ip().octets());
    let sum: u32 = packet.chunks_exact(2).map(|pair| u32::from(pair[0]) << 8 | u32::from(pair[1])).sum();
    let folded = (sum & 0xffff) + (sum >> 16);
    let checksum = !u16::try_from((folded & 0xffff) + (folded >> 16)).unwrap_or_default();
    packet[10..12].copy_from_slice(&checksum.to_be_bytes());
    packet.extend(to.port().to_be_bytes());
    packet.extend(to.port().to_be_bytes());
    packet.extend(len(8 + datagram.len()));
    packet.extend([0, 0]);
    packet.extend(datagram);
    packet
}
