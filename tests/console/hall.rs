//! A hall of real processes: `kinocue serve`, and `kinocue sim` for the controllers of each row.

use std::fmt::Write as _;
use std::fs;
use std::io::BufRead as _;
use std::net::SocketAddr;
use std::path::Path;

use sha2::{Digest as _, Sha256};
use tempfile::TempDir;

use crate::process::{Guarded, Sim};

/// What lets the page in; an engineer's, who alone may arm over TCP.
pub(crate) const TOKEN: &str = "booth-token";
/// Controllers in each row.
const SEATS: usize = 2;

const CONFIG: &str = "\
[show]
name = \"Hall 1\"
rate_hz = 100
bind = \"127.0.0.1:0\"
library = \"cues\"

[log]
dir = \"log\"

[seat.bench3]
axes = 3
stroke_mm = 150.0
lead_mm = 5.0
pulses_per_rev = 10000
max_velocity_mm_s = 240.0
max_acceleration_mm_s2 = 3000.0
max_jerk_mm_s3 = 60000.0
park = [0.0, 0.0, 0.0]
neutral = [0.5, 0.5, 0.5]

[effects]
air = 1
water = 2
wind = 3
leg = 4
smoke = 5
light = 6

[preset.kids]
motion = \"60%\"
vibration = \"50%\"
effects = { water = false }
";

/// Two rows of two seats, each row by a simulator of its own.
pub(crate) struct Hall {
    dir: TempDir,
    sims: Vec<Option<Sim>>,
    serving: Option<Serving>,
    url: String,
}

impl Hall {
    /// Open, with the cue `swell` in its library, to nobody without a token.
    pub(crate) fn open() -> Self {
        Self::open_to("none")
    }

    /// The same, with that role for whoever comes without a token.
    pub(crate) fn open_to(role: &str) -> Self {
        let dir = tempfile::tempdir().expect("a folder");
        let sims: Vec<Sim> = (0..2).map(|_| Sim::start(SEATS, &["--safe"])).collect();
        let path = |text: &str| format!("\"{}/{text}\"", dir.path().display());
        let mut config = CONFIG.replace("\"cues\"", &path("cues")).replace("\"log\"", &path("log"));
        write_api(&mut config, role);
        for (row, sim) in ["A", "B"].iter().zip(&sims) {
            for (seat, address) in sim.addresses.iter().enumerate() {
                let name = format!("{row}{}", seat + 1);
                writeln!(
                    config,
                    "[[controller]]\nname = \"{name}\"\nrow = \"{row}\"\nseat = \"bench3\"\naddress = \"{address}\""
                )
                .expect("memory");
            }
        }
        fs::write(dir.path().join("hall.toml"), config).expect("it can be written");
        fs::create_dir(dir.path().join("cues")).expect("a folder");
        fs::write(dir.path().join("cues/swell.csv"), swell()).expect("it can be written");
        let serving = Serving::start(dir.path());
        let url = format!("http://{}/", serving.address);
        Self { dir, sims: sims.into_iter().map(Some).collect(), serving: Some(serving), url }
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
        self.serving = Some(Serving::start(self.dir.path()));
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
    let sha256: String = Sha256::digest(TOKEN).iter().map(|octet| format!("{octet:02x}")).collect();
    write!(
        config,
        "[api]\nlisten = [\"127.0.0.1:0\"]\nopen_role = \"{open_role}\"\n\n\
         [[api.token]]\nname = \"booth\"\nrole = \"engineer\"\nsha256 = \"{sha256}\"\n\n"
    )
    .expect("memory");
}

/// A `kinocue serve` at work; dropped, it is killed as by a crash.
struct Serving {
    _guarded: Guarded,
    /// Where it serves HTTP.
    address: SocketAddr,
}

impl Serving {
    /// Serves the hall of `hall.toml` in a folder, with its sockets and its state there, and waits until it listens.
    fn start(dir: &Path) -> Self {
        let path = |name: &str| dir.join(name).to_str().expect("text").to_owned();
        let (config, socket, state) = (path("hall.toml"), path("control.sock"), path("state"));
        let args = ["serve", "--config", &config, "--socket", &socket, "--state", &state];
        let mut guarded = Guarded::start(&args);
        let mut lines = guarded.stderr().lines().map_while(Result::ok);
        let mut said = Vec::new();
        let address = lines.by_ref().find_map(|line| {
            let address = line.split("http://").nth(1).and_then(|rest| rest.split('/').next()?.parse().ok());
            said.push(line);
            address
        });
        // Whatever else it says is taken, so that it never waits for us.
        std::thread::spawn(move || lines.for_each(drop));
        Self { _guarded: guarded, address: address.unwrap_or_else(|| panic!("it does not serve: {said:?}")) }
    }
}
