//! Disks that fail as disks do: recordings on a file system of their own, in a mount namespace of the service, that errors set
//! read-only, that answers everything with an error, or that answers no write at all.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use rustix::process::Signal;
use serde_json::Value;

use crate::hall::Hall;
use crate::process::Guarded;
use crate::serving::Serving;

/// Mounts an image on a folder, then becomes a program.
const MOUNTED: &str = "mount -t ext4 -o loop \"$1\" \"$2\" && shift 2 && exec \"$@\"";

/// Shuts a file system down: whatever is asked of it from then on is answered with EIO (`EXT4_IOC_SHUTDOWN`, without a flush).
const SHUT_DOWN: &str = "import fcntl, os, struct, sys; \
    fcntl.ioctl(os.open(sys.argv[1], os.O_RDONLY), 0x8004587D, struct.pack('I', 2))";

/// A hall whose service has its recordings on an image in a file.
struct Disk {
    hall: Hall,
    pid: u32,
}

impl Disk {
    /// Serving and parked; `None`, said so, where the system mounts none.
    fn open() -> Option<Self> {
        let mut hall = Hall::closed(&[], |config| format!("{config}[record]\nmin_free_gib = 0.0\n"));
        let (image, folder) = (hall.path("disk.img"), hall.path("state/recordings"));
        std::fs::create_dir_all(&folder).expect("a folder");
        let probe = "mkfs.ext4 -q -F \"$1\" 64M && command -v nsenter python3 fsfreeze && mount -t ext4 -o loop \"$1\" \"$2\"";
        let tried = own_namespace(probe, &image, &folder).output();
        if !tried.as_ref().is_ok_and(|one| one.status.success()) {
            // Straight to the standard error: the test harness keeps what a passed test prints.
            let _ = writeln!(std::io::stderr(), "skipped: no file system can be mounted here ({tried:?})");
            return None;
        }
        let start = |args: &[&str]| {
            let mut command = own_namespace(MOUNTED, &image, &folder);
            Guarded::start_command(command.arg(env!("CARGO_BIN_EXE_kinocue")).args(args))
        };
        let serving = Serving::start_by(hall.folder(), start);
        let pid = serving.pid();
        hall.serves_by(serving);
        hall.comes_to("parked");
        Some(Self { hall, pid })
    }

    fn folder(&self) -> PathBuf {
        self.hall.path("state/recordings")
    }

    /// Runs a program where the service sees its files.
    fn inside(&self, args: &[&str]) {
        let pid = self.pid.to_string();
        let run = Command::new("nsenter").args(["-t", &pid, "-m"]).args(args).arg(self.folder()).output();
        assert!(run.as_ref().is_ok_and(|run| run.status.success()), "{args:?} {run:?}");
    }

    /// What comes of a disk that breaks so in mid show.
    fn breaks(&self, how: impl FnOnce(&Self), says: &str) {
        let hall = &self.hall;
        hall.play("night");
        hall.wait(|status| status["record"]["recording"].is_string());
        hall.rises(0);
        how(self);
        let broken = hall.status();
        assert_eq!(broken["state"], "playing");
        let told = hall.wait(|status| status["record"]["troubles"]["show"].is_string());
        let ticks = |status: &Value| status["ticks"].as_u64().expect("a count");
        assert!(
            ticks(&told) - ticks(&broken) <= 500,
            "it was told {} ticks of 10 ms later",
            ticks(&told) - ticks(&broken)
        );
        let trouble = told["record"]["troubles"]["show"].as_str().expect("text");
        assert!(
            trouble.contains(says) && trouble.contains("free space on that disk, or set [record] dir"),
            "{trouble}"
        );
        let warnings = told["warnings"].as_array().expect("a list");
        assert!(warnings.iter().any(|one| one["id"] == "record-show"), "{warnings:?}");
        assert!(
            told["record"]["flight_s"].as_f64() > Some(0.0) && told["record"]["recording"].is_null(),
            "{told}"
        );
        // The show goes on as if nothing were.
        assert_eq!(hall.lives_on(200)["state"], "playing");
        hall.done(&["park"]);
        hall.parks_in_time();
    }
}

/// A disk that answers no write until this is dropped.
struct StandsStill<'d>(&'d Disk);

impl<'d> StandsStill<'d> {
    fn begin(disk: &'d Disk) -> Self {
        disk.inside(&["fsfreeze", "--freeze"]);
        Self(disk)
    }
}

impl Drop for StandsStill<'_> {
    fn drop(&mut self) {
        self.0.inside(&["fsfreeze", "--unfreeze"]);
    }
}

fn own_namespace(script: &str, image: &Path, folder: &Path) -> Command {
    let mut command = Command::new("unshare");
    command.args(["--mount", "sh", "-c", script, "sh"]).args([image, folder]);
    command
}

#[test]
fn a_disk_that_errors_set_read_only_in_mid_show_is_told_in_five_seconds_and_the_show_goes_on() {
    let Some(disk) = Disk::open() else { return };
    disk.breaks(|disk| disk.inside(&["mount", "-o", "remount,abort"]), "Read-only file system");
}

#[test]
fn a_disk_that_answers_with_errors_in_mid_show_is_told_in_five_seconds_and_the_show_goes_on() {
    let Some(disk) = Disk::open() else { return };
    disk.breaks(|disk| disk.inside(&["python3", "-c", SHUT_DOWN]), "Input/output error");
}

#[test]
fn a_disk_that_stands_still_in_mid_show_is_told_in_five_seconds_and_holds_up_neither_the_show_nor_a_reload() {
    let Some(disk) = Disk::open() else { return };
    let hall = &disk.hall;
    hall.play("night");
    hall.wait(|status| status["record"]["recording"].is_string());
    hall.rises(0);
    let still = StandsStill::begin(&disk);
    let began = hall.status();
    let told = hall.wait(|status| status["record"]["troubles"]["show"].is_string());
    let ticks = |status: &Value| status["ticks"].as_u64().expect("a count");
    assert!(ticks(&told) - ticks(&began) <= 500, "{} ticks of 10 ms later", ticks(&told) - ticks(&began));
    let trouble = told["record"]["troubles"]["show"].as_str().expect("text");
    assert!(trouble.contains("state/recordings: the disk answers no write"), "{trouble}");
    let warnings = told["warnings"].as_array().expect("a list");
    assert!(warnings.iter().any(|one| one["id"] == "record-show"), "{warnings:?}");
    hall.done(&["park"]);
    hall.parks_in_time();
    // The hall is opened anew, with a recorder of its own; the one before still waits.
    hall.serving().signal(Signal::HUP);
    hall.wait(|status| status["ticks"].as_u64() < Some(ticks(&told)) && status["state"] == "parked");
    drop(still);
    let names = || {
        let all = std::fs::read_dir(format!("/proc/{}/root{}", disk.pid, disk.folder().display()));
        let name = |entry: std::fs::DirEntry| entry.file_name().into_string().expect("text");
        all.expect("it is there")
            .flatten()
            .map(name)
            .filter(|name| name.contains("-show-"))
            .collect::<Vec<_>>()
    };
    hall.wait(|_| matches!(&names()[..], [one] if one.ends_with("-show-night.mcap")));
}
