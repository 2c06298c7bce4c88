use std::fs::OpenOptions;
use std::io::{self, Write};
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;

use crate::app::film::{LtcSound, SAMPLES_PER_S, TimecodeSent, wav_header};
use crate::cli::{Exit, Failure, OrExit as _};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Generates timecode: LTC into a file, at once, or Art-Net or MIDI timecode in real time.
#[derive(Debug, clap::Args)]
#[command(
    group = clap::ArgGroup::new("kind").required(true),
    after_help = "Examples:\n  kinocue sync send --ltc --film-fps 25 --seconds 60 -o reel.wav\n  kinocue sync send --artnet 127.0.0.1"
)]
pub(in crate::cli) struct Args {
    /// Linear timecode, as a WAV file.
    #[arg(long, group = "kind")]
    ltc: bool,
    /// Art-Net timecode, to this address: IP or IP:PORT; the port is 6454 unless given.
    #[arg(long, value_name = "ADDR", group = "kind", value_parser = artnet_address)]
    artnet: Option<SocketAddrV4>,
    /// MIDI timecode, into a raw MIDI device or a FIFO.
    #[arg(long, value_name = "FILE", group = "kind")]
    mtc: Option<PathBuf>,
    /// The address that Art-Net is sent from, if the machine has several.
    #[arg(long, value_name = "IP", requires = "artnet")]
    from: Option<Ipv4Addr>,
    /// Frames a second: 23.976, 24, 25, 29.97 or 30.
    #[arg(long, value_name = "N", default_value = "25")]
    film_fps: String,
    /// The first timecode, HH:MM:SS:FF; HH:MM:SS;FF for drop frame.
    #[arg(long, value_name = "TIMECODE", default_value = "00:00:00:00")]
    tc_start: String,
    /// Duration in seconds.
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: u32,
    /// The file [default: stdout].
    #[arg(short, long, value_name = "FILE", conflicts_with_all = ["artnet", "mtc"])]
    output: Option<PathBuf>,
}

/// What is written at a time: 10 ms.
const BLOCK: u32 = SAMPLES_PER_S / 100;
const ARTNET_PORT: u16 = 6454;

fn artnet_address(text: &str) -> Result<SocketAddrV4, String> {
    let whole = text.parse().or_else(|_| text.parse().map(|ip| SocketAddrV4::new(ip, ARTNET_PORT)));
    whole.map_err(|_| format!("{text} is not an address; write for example 10.0.0.255 or 127.0.0.1:6454"))
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let made = TimecodeSent::new(&args.film_fps, &args.tc_start).or_exit(Exit::Usage)?;
    if let Some(to) = args.artnet {
        let socket = sender(args.from.unwrap_or(Ipv4Addr::UNSPECIFIED), to);
        let socket = socket.with_context(|| to.to_string()).or_system()?;
        return ended(
            pace(args.seconds, made.artnet(), |bytes| socket.send(bytes).map(drop)),
            &to.to_string(),
        );
    }
    if let Some(path) = &args.mtc {
        let name = path.display().to_string();
        let line = OpenOptions::new().write(true).open(path);
        let mut line = line.with_context(|| name.clone()).or_system()?;
        return ended(pace(args.seconds, made.mtc(), |bytes| line.write_all(bytes)), &name);
    }
    let mut sound = LtcSound::new(&args.film_fps, &args.tc_start).or_exit(Exit::Usage)?;
    if let Some(path) = &args.output {
        let samples = args.seconds * SAMPLES_PER_S;
        let octets: Vec<u8> =
            wav_header(Some(samples)).into_iter().chain(octets(&mut sound, samples)).collect();
        std::fs::write(path, octets).with_context(|| path.display().to_string()).or_exit(Exit::Io)?;
        return Ok(Exit::Done);
    }
    let mut out = io::stdout().lock();
    let blocks = (1..).map(|block| (Duration::from_millis(10) * block, octets(&mut sound, BLOCK)));
    let streamed = out
        .write_all(&wav_header(None))
        .and_then(|()| pace(args.seconds, blocks, |bytes| out.write_all(bytes).and_then(|()| out.flush())));
    ended(streamed, "stdout")
}

fn octets(sound: &mut LtcSound, samples: u32) -> Vec<u8> {
    sound.take(samples as usize).flat_map(i16::to_le_bytes).collect()
}

fn sender(from: Ipv4Addr, to: SocketAddrV4) -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind((from, 0))?;
    socket.set_broadcast(true)?;
    socket.connect(to)?;
    Ok(socket)
}

/// Gives each piece its turn when the film is there, for so many seconds.
fn pace(
    seconds: u32,
    pieces: impl Iterator<Item = (Duration, Vec<u8>)>,
    mut send: impl FnMut(&[u8]) -> io::Result<()>,
) -> io::Result<()> {
    let (begun, end) = (Monotonic.now(), Duration::from_secs(seconds.into()));
    for (after, bytes) in pieces.take_while(|(after, _)| *after <= end) {
        Monotonic.sleep_until(begun + after);
        match send(&bytes) {
            // A listener that has not begun yet, or has ended, is what a network is like.
            Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {}
            sent => sent?,
        }
    }
    Ok(())
}

fn ended(sent: io::Result<()>, place: &str) -> Result<Exit, Failure> {
    match sent {
        // Whoever listened has heard enough.
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context(place.to_owned()).or_exit(Exit::Io)
        }
        _ => Ok(Exit::Done),
    }
}
