//! The process of the player: how it is started, and that it ends.

use std::ffi::OsString;
use std::io;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use super::PlayerShared;
use crate::config::FilmPlayer;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// It opens its socket within that.
const OPENS: Duration = Duration::from_secs(10);
/// From one look for its socket to the next.
const LOOK: Duration = Duration::from_millis(50);
/// How it ends where there is no player to become, and where that is not allowed (`kinocue film-player`).
const NONE: i32 = 66;
const NOT_HERE: i32 = 74;

/// It waits for a film, shows nothing but that, heeds nobody but us, and reads and runs nothing else.
const ALWAYS: [&str; 27] = [
    "--no-config",
    "--idle=yes",
    "--pause=yes",
    "--keep-open=yes",
    "--force-window=yes",
    "--terminal=no",
    "--input-terminal=no",
    "--input-default-bindings=no",
    "--input-builtin-bindings=no",
    "--input-vo-keyboard=no",
    "--input-media-keys=no",
    "--input-cursor=no",
    "--cursor-autohide=always",
    "--osc=no",
    "--osd-level=0",
    "--osd-bar=no",
    "--load-scripts=no",
    "--ytdl=no",
    "--access-references=no",
    "--load-unsafe-playlists=no",
    "--resume-playback=no",
    "--save-position-on-quit=no",
    "--audio-file-auto=no",
    "--sub-auto=no",
    "--stop-screensaver=yes",
    "--audio-display=no",
    // Without a loudspeaker it shows the film in silence, by the same clock.
    "--audio-fallback-to-null=yes",
];

/// Starts the player, as often as that is needed.
#[derive(Debug)]
pub(super) struct Starter {
    program: PathBuf,
    args: Vec<OsString>,
    socket: PathBuf,
}

impl Starter {
    pub(super) fn new(config: &FilmPlayer, socket: &Path) -> io::Result<Self> {
        let named = |name: &str, value: Option<String>| {
            value.map(|value| OsString::from(format!("--{name}={value}")))
        };
        let screen = config.screen.map(|screen| screen.to_string());
        let own = [
            Some(if config.fullscreen { "--fullscreen=yes".into() } else { "--fullscreen=no".into() }),
            named("screen", screen.clone()),
            named("fs-screen", screen),
            named("audio-device", config.audio_device.clone()),
            named("vo", config.video_output.clone()),
        ];
        let mut at = OsString::from("--input-ipc-server=");
        at.push(socket);
        let args = ALWAYS.map(OsString::from).into_iter().chain(own.into_iter().flatten()).chain([at]);
        Ok(Self { program: std::env::current_exe()?, args: args.collect(), socket: socket.to_owned() })
    }

    /// Starts it. It ends with the thread that calls this, at the latest.
    pub(super) fn start(&self) -> io::Result<PlayerProcess> {
        // One that was killed has left it behind.
        let _ = std::fs::remove_file(&self.socket);
        let mut command = Command::new(&self.program);
        command.arg0("kinocue").args([
            "film-player",
            "--parent",
            &std::process::id().to_string(),
            "--",
            "mpv",
        ]);
        // What its libraries keep while they run goes with the folder of its socket.
        command.envs(self.socket.parent().map(|own| ("TMPDIR", own)));
        command.args(&self.args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        // What a terminal sends to end the service is not for it: first the seats park.
        command.process_group(0).spawn().map(PlayerProcess)
    }
}

/// The player at work; dropped, it is ended and waited for.
#[derive(Debug)]
pub(super) struct PlayerProcess(Child);

impl PlayerProcess {
    /// Waits until it takes commands; `None` once nobody needs it any more.
    ///
    /// # Errors
    /// Why it takes none, with what to do.
    pub(super) fn connect(
        &mut self,
        starter: &Starter,
        shared: &PlayerShared,
    ) -> Result<Option<UnixStream>, String> {
        let until = Monotonic.now() + OPENS;
        while Monotonic.now() < until && !shared.is_over() {
            if let Some(status) = self.ended() {
                return Err(why_none(status));
            }
            if let Ok(stream) = UnixStream::connect(&starter.socket) {
                return Ok(Some(stream));
            }
            Monotonic.sleep_until(Monotonic.now() + LOOK);
        }
        if shared.is_over() { Ok(None) } else { Err("mpv does not answer; see what blocks it".to_owned()) }
    }

    /// How it ended, where it has.
    pub(super) fn ended(&mut self) -> Option<ExitStatus> {
        self.0.try_wait().ok().flatten()
    }
}

impl Drop for PlayerProcess {
    fn drop(&mut self) {
        // One that has ended by itself cannot be ended any more.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn why_none(status: ExitStatus) -> String {
    match status.code() {
        Some(NONE) => {
            "mpv is not installed; install it (`apt-get install mpv`), and it starts by itself".to_owned()
        }
        Some(NOT_HERE) => {
            "mpv may not be started here; the service's sandbox keeps it out (docs/configuration.md, [film])"
                .to_owned()
        }
        _ => format!(
            "mpv ended at its start ({status}); try mpv as this user on this machine, and check screen and sound in [film]"
        ),
    }
}

/// How long a film is, as mpv finds it, seconds. Blocks until it has looked.
///
/// # Errors
/// Why it cannot be told, with what to do.
pub(crate) fn film_length_s(film: &Path) -> Result<f64, String> {
    let mut command = Command::new("mpv");
    command.args([
        "--no-config",
        "--vo=null",
        "--ao=null",
        "--length=0",
        "--quiet",
        "--input-terminal=no",
        "--ytdl=no",
    ]);
    command.arg("--term-playing-msg=length ${=duration}").arg("--").arg(film).stdin(Stdio::null());
    let output = command
        .output()
        .map_err(|error| format!("mpv cannot be started: {error}; install it (`apt-get install mpv`)"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let length = text.lines().find_map(|line| line.strip_prefix("length ")?.trim().parse::<f64>().ok());
    length
        .filter(|length| *length > 0.0)
        .ok_or_else(|| format!("mpv does not know how long {} is; give a film that it plays", film.display()))
}
