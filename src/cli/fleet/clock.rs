//! How far the clock of this machine is off the site's time server: eight questions each 16 s, of which the quickest answer counts. It only
//! looks; what sets the clock is chrony. On a thread of its own: while one waits for an answer, the link goes on.

use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::net::{ToSocketAddrs as _, UdpSocket};
use std::thread;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use serde_json::{Value, json};
use tokio::sync::watch;

use crate::fleet::{ClockSample, NTP_LEN, ntp_answer, ntp_question};
use crate::sys::clock::{Monotonic, wall_at};
use crate::time::{Clock as _, MonoTime};

/// Questions of one round, and how long one round is after the other.
const QUESTIONS: usize = 8;
const ROUND: Duration = Duration::from_secs(16);
/// How long an answer may take.
const PATIENCE: Duration = Duration::from_millis(200);
/// Two readings of both clocks that differ by more show that one was set between them, ns.
const SET_NS: u128 = 1_000_000;
/// Where time servers listen.
const PORT: u16 = 123;

/// What a round came to, and when; why it came to nothing.
pub(super) type Round = Result<(ClockSample, MonoTime), String>;
/// The newest round.
pub(super) type Rounds = watch::Receiver<Option<Round>>;

/// Asks that server again and again; what each round came to is there to be seen.
pub(super) fn watch_server(server: &str) -> anyhow::Result<Rounds> {
    let (tell, told) = watch::channel(None);
    let server = server.to_owned();
    let ask = move || {
        while !tell.is_closed() {
            let began = Monotonic.now();
            tell.send_replace(Some(round(&server).map_err(|error| format!("{error:#}"))));
            Monotonic.sleep_until(began + ROUND);
        }
    };
    thread::Builder::new().name("clock".to_owned()).spawn(ask).context("no thread could be started")?;
    Ok(told)
}

/// What the hall is told of it.
pub(super) fn told(server: &str, (sample, at): &(ClockSample, MonoTime)) -> Value {
    let age_ms = u64::try_from(Monotonic.now().since(*at).as_millis()).unwrap_or(u64::MAX);
    json!({ "server": server, "offset_ns": sample.offset_ns, "trip_ns": sample.trip_ns, "age_ms": age_ms })
}

/// The server and its port, as people write it.
fn with_port(server: &str) -> String {
    let is_bare_v6 = server.parse::<std::net::Ipv6Addr>().is_ok();
    match server.rsplit_once(':') {
        Some((_, port)) if !is_bare_v6 && port.parse::<u16>().is_ok() => server.to_owned(),
        _ if is_bare_v6 => format!("[{server}]:{PORT}"),
        _ => format!("{server}:{PORT}"),
    }
}

/// The best of some questions; why there is none.
fn round(server: &str) -> anyhow::Result<(ClockSample, MonoTime)> {
    let mut addresses =
        with_port(server).to_socket_addrs().with_context(|| format!("{server} is not found"))?;
    let address = addresses.next().ok_or_else(|| anyhow!("{server} has no address"))?;
    let local = if address.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
    let socket = UdpSocket::bind(local).context("no port to ask from")?;
    // Of what comes from elsewhere nothing is heard.
    socket.connect(address).with_context(|| format!("{address} cannot be reached"))?;
    let mut best: Option<(ClockSample, MonoTime)> = None;
    for _ in 0..QUESTIONS {
        let (sample, at) = ask(&socket).with_context(|| format!("{server} ({address})"))?;
        if best.is_none_or(|(best, _)| sample.trip_ns < best.trip_ns) {
            best = Some((sample, at));
        }
    }
    best.ok_or_else(|| anyhow!("{server} was not asked"))
}

/// One question, and its answer. What answers another one is not heard, for as long as an answer may take.
fn ask(socket: &UdpSocket) -> anyhow::Result<(ClockSample, MonoTime)> {
    // Keys that the system made by chance: nobody who does not see the question can make its answer.
    let nonce = RandomState::new().build_hasher().finish();
    let asked = wall_at();
    socket.send(&ntp_question(nonce)).context("it cannot be asked")?;
    let mut buf = [0; 4 * NTP_LEN];
    let mut why = anyhow!("no answer within {} ms", PATIENCE.as_millis());
    loop {
        let left = (asked.at + PATIENCE).since(Monotonic.now());
        if left.is_zero() {
            return Err(why);
        }
        socket.set_read_timeout(Some(left)).context("its answer cannot be waited for")?;
        let Ok(len) = socket.recv(&mut buf) else { return Err(why) };
        let took = Monotonic.now().since(asked.at);
        let heard = wall_at();
        if heard.epoch_ns().abs_diff(asked.epoch_ns()) > SET_NS {
            return Err(anyhow!("the clock of this machine was set meanwhile"));
        }
        match ntp_answer(&buf[..len], nonce, asked.wall_ns, took) {
            Ok(sample) => return Ok((sample, asked.at)),
            Err(error) => why = anyhow!(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A server that answers each question as that says, on loopback.
    fn server(reply: impl Fn(&mut [u8; NTP_LEN], u64) + Send + 'static) -> String {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = socket.local_addr().unwrap().to_string();
        thread::spawn(move || {
            let mut buf = [0; NTP_LEN];
            while let Ok((_, from)) = socket.recv_from(&mut buf) {
                let mut packet = [0; NTP_LEN];
                (packet[0], packet[1]) = (0x24, 2);
                packet[24..32].copy_from_slice(&buf[40..48]);
                let seconds = wall_at().wall_ns / 1_000_000_000 + 2_208_988_800;
                let parts = ((wall_at().wall_ns % 1_000_000_000) << 32) / 1_000_000_000;
                let now = (seconds << 32) + parts;
                reply(&mut packet, now);
                let _ = socket.send_to(&packet, from);
            }
        });
        address
    }

    fn tells(packet: &mut [u8; NTP_LEN], time: u64) {
        packet[32..40].copy_from_slice(&time.to_be_bytes());
        packet[40..48].copy_from_slice(&time.to_be_bytes());
    }

    #[test]
    fn the_clock_of_a_server_is_compared_with_our_own() {
        let (sample, at) = round(&server(tells)).unwrap();
        assert!(sample.offset_ns.unsigned_abs() <= sample.trip_ns / 2 + 1_000, "{sample:?}");
        assert!(Monotonic.now().since(at) < Duration::from_secs(8));
        let (sample, _) = round(&server(|packet, now| tells(packet, now - (3 << 32)))).unwrap();
        assert!(sample.offset_ns.abs_diff(3_000_000_000) <= sample.trip_ns / 2 + 1_000, "{sample:?}");
        let told = told("10.0.0.1", &(sample, at));
        assert_eq!((&told["server"], &told["trip_ns"]), (&"10.0.0.1".into(), &sample.trip_ns.into()));
    }

    #[test]
    fn a_server_that_does_not_know_or_is_not_there_tells_nothing_and_says_so() {
        let why = |server: &str| format!("{:#}", round(server).unwrap_err());
        let leap = server(|packet, now| {
            tells(packet, now);
            packet[0] |= 3 << 6;
        });
        assert!(why(&leap).ends_with("the server does not know the time itself"), "{}", why(&leap));
        let other = server(|packet, now| {
            tells(packet, now);
            packet[24..32].fill(9);
        });
        assert!(why(&other).ends_with("it answers another question"), "{}", why(&other));
        let nobody = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        assert!(why(&nobody).starts_with(&nobody), "{}", why(&nobody));
    }

    #[test]
    fn a_server_is_written_with_or_without_its_port() {
        for (text, address) in [
            ("10.0.0.1", "10.0.0.1:123"),
            ("10.0.0.1:1123", "10.0.0.1:1123"),
            ("ntp.example", "ntp.example:123"),
            ("::1", "[::1]:123"),
            ("[::1]:1123", "[::1]:1123"),
        ] {
            assert_eq!(with_port(text), address);
        }
    }
}
