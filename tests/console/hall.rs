//! A hall of real processes: `kinocue serve`, and `kinocue sim` for the controllers of each row.

use std::fmt::Write as _;
use std::fs;
use std::io::BufRead as _;
use std::net::SocketAddr;

use rustix::process::Signal;
use sha2::{Digest as _, Sha256};
use tempfile::TempDir;

use crate::process::{Guarded, Sim};
use crate::serving::{self, Serving};

/// What lets the page in; an engineer's, who alone may arm over TCP.
pub(crate) const TOKEN: &str = "booth-token";
/// One of somebody else, who may only look.
pub(crate) const VISITOR: &str = "visitor-token";
/// Controllers in each row.
const SEATS: usize = 2;

/// Two rows of two seats, each row by a simulator of its own.
pub(crate) struct Hall {
    dir: TempDir,
    sims: Vec<Option<Sim>>,
    serving: Option<Serving>,
    url: String,
    /// Virtual SilverMax units, and the folder with their line.
    drives: Option<(Guarded, TempDir)>,
}

impl Hall {
    /// Open, with the cue `swell` in its library, to nobody without a token.
    pub(crate) fn open() -> Self {
        Self::open_to("none")
    }

    /// The same, with that role for whoever comes without a token.
    pub(crate) fn open_to(role: &str) -> Self {
        Self::open_with(role, "")
    }

    /// The same, that follows a film by Art-Net timecode or by a device that is not there.
    pub(crate) fn open_to_a_film() -> Self {
        let (from, bind) = timecode();
        let sync = format!(
            "[sync]\nsources = [\"artnet\", \"mtc\"]\nfilm_fps = \"25\"\nstart = \"01:00:00:00\"\n\
             [sync.artnet]\nfrom = \"{from}\"\nbind = \"{bind}\"\n[sync.mtc]\ndevice = \"/nowhere/midi\"\n\n"
        );
        Self::open_with("none", &sync)
    }

    /// The same, with a seat on three SilverMax units, which nobody has homed, at a rate that is left on a busy machine.
    pub(crate) fn open_beside_drives() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let port = folder.path().join("stalls");
        let line = port.to_str().expect("text");
        let mut sim =
            Guarded::start(&["sim", "--dialect", "silvermax", "--tty", line, "--units", "16,17,18"]);
        let ready = sim.stderr().lines().map_while(Result::ok).any(|line| line.starts_with("ready "));
        assert!(ready, "the line is there");
        let drives = format!(
            "[link.stalls]\nport = \"{line}\"\nrate_hz = 25\n\
             [seat.lift]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 4000\nmax_velocity_mm_s = 160\n\
             max_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
             [seat.lift.drive]\ntorque = {{ hold = \"60%\", move = \"100%\", full = 20000 }}\n\
             home = {{ way = \"switch\", input = 1, toward = \"down\", travel_mm = 165, zero_mm = -2 }}\n\
             [[controller]]\nname = \"L1\"\nseat = \"lift\"\naddress = \"link:stalls\"\ndialect = \"silvermax\"\n\
             units = [16, 17, 18]\n\n"
        );
        Self { drives: Some((sim, folder)), ..Self::open_with("none", &drives) }
    }

    /// Pulls the plug of the line.
    pub(crate) fn unplug(&mut self) {
        let (sim, _folder) = self.drives.take().expect("it has drives");
        sim.signal(Signal::TERM);
        sim.finish();
    }

    fn open_with(role: &str, sync: &str) -> Self {
        let dir = tempfile::tempdir().expect("a folder");
        let sims: Vec<Sim> = (0..2).map(|_| Sim::start(SEATS, &["--safe"])).collect();
        let mut config = serving::hall(dir.path());
        write_api(&mut config, role);
        config.push_str(sync);
        for (row, sim) in ["A", "B"].iter().zip(&sims) {
            serving::write_row(&mut config, row, &sim.addresses);
        }
        fs::write(dir.path().join("hall.toml"), config).expect("it can be written");
        fs::create_dir(dir.path().join("cues")).expect("a folder");
        fs::write(dir.path().join("cues/swell.csv"), swell()).expect("it can be written");
        let serving = Serving::start(dir.path());
        let url = format!("http://{}/", address_of(&serving));
        Self { dir, sims: sims.into_iter().map(Some).collect(), serving: Some(serving), url, drives: None }
    }

    /// Where the console is.
    pub(crate) fn url(&self) -> &str {
        &self.url
    }

    /// Starts the server again, where the page looks for it.
    pub(crate) fn start_again(&mut self) {
        let path = self.dir.path().join("hall.toml");
        let config = fs::read_to_string(&path).expect("it was written");
        let address = self.url.trim_start_matches("http://").trim_end_matches('/');
        let config = config.replace("listen = [\"127.0.0.1:0\"]", &format!("listen = [\"{address}\"]"));
        fs::write(path, config).expect("it can be written");
        let serving = Serving::start(self.dir.path());
        address_of(&serving);
        self.serving = Some(serving);
    }

    /// Stops the server's process, which goes on by `Signal::CONT`.
    pub(crate) fn signal(&self, signal: Signal) {
        self.serving.as_ref().expect("it serves").signal(signal);
    }

    /// Kills the server, as a crash would.
    pub(crate) fn kill(&mut self) {
        self.serving = None;
    }

    /// Pulls the plugs of a row's controllers.
    pub(crate) fn pull(&mut self, row: usize) {
        self.sims[row] = None;
    }
}

/// Who sends timecode, and where it is heard: addresses of this machine that no other run of the tests has.
fn timecode() -> (String, String) {
    let [_, _, high, low] = std::process::id().to_be_bytes();
    let place = |net: u8| format!("127.{net}.{high}.{}", low.max(1));
    (place(60), format!("{}:6454", place(61)))
}

/// A film that runs from that label on, until it is dropped.
pub(crate) fn film(start: &str) -> Guarded {
    let (from, to) = timecode();
    let args = ["sync", "send", "--seconds", "600", "--artnet", &to, "--from", &from, "--tc-start", start];
    Guarded::start(&args)
}

/// Where it serves HTTP, once it does.
fn address_of(serving: &Serving) -> SocketAddr {
    serving.heard(|line| line.split("http://").nth(1)?.split('/').next()?.parse().ok())
}

/// A gentle cue, long enough for the slowest machine: three axes go up and down every ten seconds for two minutes.
fn swell() -> String {
    let mut cue = String::from("# kinocue-csv: 1\n# title: Swell\ntime_ms,a1,a2,a3,fx_air,fx_water\n");
    for half_second in 0..=240_u32 {
        let height = 0.25 - 0.25 * (std::f64::consts::TAU * f64::from(half_second) / 20.0).cos();
        writeln!(cue, "{},{height:.6},{height:.6},{height:.6},0,0", half_second * 500).expect("memory");
    }
    cue
}

fn write_api(config: &mut String, open_role: &str) {
    write!(config, "[api]\nlisten = [\"127.0.0.1:0\"]\nopen_role = \"{open_role}\"\n\n").expect("memory");
    for (name, role, token) in [("booth", "engineer", TOKEN), ("visitor", "view", VISITOR)] {
        let sha256: String = Sha256::digest(token).iter().map(|byte| format!("{byte:02x}")).collect();
        write!(config, "[[api.token]]\nname = \"{name}\"\nrole = \"{role}\"\nsha256 = \"{sha256}\"\n\n")
            .expect("memory");
    }
}
