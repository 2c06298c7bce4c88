//! Where the service keeps what it has, unless arguments say otherwise: where the package does for whoever may write there, elsewhere for
//! an ordinary user, in folders of their own.

use std::env;
use std::path::PathBuf;

use rustix::fs::{Access, access};

/// Folders of the package.
const STATE: &str = "/var/lib/kinocue";
const LINK_STATE: &str = "/var/lib/kinocue-link";
const RUNTIME: &str = "/run/kinocue";
/// Its folder among those of a user.
const NAME: &str = "kinocue";

/// The folder of settings, library, journal and recordings.
pub(super) fn state() -> PathBuf {
    let own =
        || of_user("XDG_STATE_HOME").or_else(|| home().map(|home| home.join(".local/state").join(NAME)));
    of_system("STATE_DIRECTORY", STATE).or_else(own).unwrap_or_else(|| PathBuf::from(STATE))
}

/// The folder of what the link of a fleet is fetching.
pub(super) fn link_state() -> PathBuf {
    let own = || home().map(|home| home.join(".local/state").join(NAME).join("link"));
    of_system("STATE_DIRECTORY", LINK_STATE).or_else(own).unwrap_or_else(|| PathBuf::from(LINK_STATE))
}

/// The control socket of a service that is started without arguments.
pub(super) fn control_socket() -> PathBuf {
    let folder = of_system("RUNTIME_DIRECTORY", RUNTIME).or_else(own_runtime);
    folder.unwrap_or_else(|| PathBuf::from(RUNTIME)).join("control.sock")
}

/// The control sockets of services that run here: that of the package first.
pub(super) fn control_sockets() -> Vec<PathBuf> {
    let all = [Some(PathBuf::from(RUNTIME)), own_runtime()].into_iter().flatten();
    all.map(|folder| folder.join("control.sock")).filter(|path| path.exists()).collect()
}

/// What the service manager says, or the folder of the package where it may be written to.
fn of_system(variable: &str, folder: &str) -> Option<PathBuf> {
    let given = path(variable);
    given.or_else(|| access(folder, Access::WRITE_OK).is_ok().then(|| PathBuf::from(folder)))
}

fn own_runtime() -> Option<PathBuf> {
    of_user("XDG_RUNTIME_DIR").or_else(|| home().map(|home| home.join(".local/state").join(NAME).join("run")))
}

fn of_user(variable: &str) -> Option<PathBuf> {
    path(variable).map(|folder| folder.join(NAME))
}

fn home() -> Option<PathBuf> {
    path("HOME")
}

/// The absolute path in a variable.
fn path(variable: &str) -> Option<PathBuf> {
    env::var_os(variable).map(PathBuf::from).filter(|path| path.is_absolute())
}
