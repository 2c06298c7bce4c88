//! `[film]`: the player that the service starts, and the folder of its films; without the table somebody else shows the film.

use std::path::{Component, Path, PathBuf};

use super::fault::Faults;
use super::section::{Entry, Section};

/// What becomes of the film when the seats are stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OnStop {
    /// It runs on, for those who watch.
    Keep,
    /// It is paused.
    Pause,
}

/// The player of a hall.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FilmPlayer {
    /// The folder of the films; what playlists name lies in it.
    pub(crate) folder: PathBuf,
    pub(crate) on_stop: OnStop,
    pub(crate) fullscreen: bool,
    /// The number of the screen that it shows the film on; none for the one it finds.
    pub(crate) screen: Option<u8>,
    /// The device of its sound, as `mpv --audio-device=help` lists them; none for the usual one.
    pub(crate) audio_device: Option<String>,
    /// How it shows pictures, as `mpv --vo=help` lists it; none for the best that it finds.
    pub(crate) video_output: Option<String>,
}

impl FilmPlayer {
    /// Where a film is that a playlist names. A link out of the folder counts as outside of it.
    ///
    /// # Errors
    /// Why it cannot be shown, for a person, with what to do.
    pub(crate) fn find(&self, movie: &str) -> Result<PathBuf, String> {
        let path = self.folder.join(movie);
        let missing = |error: std::io::Error| format!("the film {}: {error}; copy it there", path.display());
        let folder = self.folder.canonicalize().map_err(missing)?;
        let found = path.canonicalize().map_err(missing)?;
        if !found.starts_with(&folder) {
            return Err(format!(
                "the film {movie} is outside {}; copy it into that folder",
                self.folder.display()
            ));
        }
        if !found.is_file() {
            return Err(format!("the film {} is not a file; give a film", path.display()));
        }
        Ok(found)
    }
}

/// True if that names something below a folder, and nothing outside of it.
pub(crate) fn stays_below(movie: &str) -> bool {
    let mut parts = Path::new(movie).components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// Reads the table.
pub(super) fn film(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<FilmPlayer> {
    let mut section = Section::new("[film]", entry.at, entry.table(faults)?, faults);
    section.require(&["player", "folder"]);
    section.choice("player", &[("mpv", ())]);
    let folder = section.text("folder").map(PathBuf::from);
    let on_stop = section.choice("on_stop", &[("keep", OnStop::Keep), ("pause", OnStop::Pause)]);
    let fullscreen = section.get("fullscreen").and_then(|entry| entry.switch(section.faults));
    let screen = section.whole_in("screen", 0..=32);
    let audio_device = word(&mut section, "audio_device", "-_./:=,@");
    let video_output = word(&mut section, "video_output", "-_");
    section.finish();
    Some(FilmPlayer {
        folder: folder?,
        on_stop: on_stop.unwrap_or(OnStop::Pause),
        fullscreen: fullscreen.unwrap_or(true),
        screen,
        audio_device,
        video_output,
    })
}

/// A name of letters, digits and those: it goes to another program, which takes more than names.
fn word(section: &mut Section<'_, '_, '_>, key: &'static str, beside: &str) -> Option<String> {
    let entry = section.get(key)?;
    let text = entry.text(section.faults)?;
    if !text.chars().all(|one| one.is_ascii_alphanumeric() || beside.contains(one)) {
        let message = format!("{text:?} is no such name: letters, digits and {beside} are");
        entry.fault(section.faults, &message);
    }
    Some(text.to_owned())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;
    use crate::config::tests::{faults_of, hall_with};

    #[test]
    fn a_player_is_a_source_of_the_film_without_a_table_of_sources() {
        let hall = hall_with("[film]\nplayer = \"mpv\"\nfolder = \"/srv/films\"\nscreen = 1\n");
        let film = hall.film.unwrap();
        assert_eq!((film.on_stop, film.fullscreen, film.screen), (OnStop::Pause, true, Some(1)));
        assert!(hall.sync.is_some_and(|sync| sync.sources.is_empty() && !sync.leads));
        let hall = hall_with(
            "[film]\nplayer = \"mpv\"\nfolder = \"/srv/films\"\non_stop = \"keep\"\nfullscreen = false\n\
             audio_device = \"alsa/hdmi:CARD=PCH,DEV=0\"\nvideo_output = \"gpu-next\"\n[sync]\nsources = []\nslew = \"1.8%\"\n",
        );
        let film = hall.film.unwrap();
        assert_eq!((film.on_stop, film.fullscreen), (OnStop::Keep, false));
        assert!((hall.sync.unwrap().pace.slew - 0.018).abs() < 1e-9);
    }

    #[test]
    fn what_a_player_cannot_be_told_is_refused() {
        let wrong = [
            ("", "[film] has no folder, which is needed"),
            ("player = \"vlc\"\nfolder = \"/f\"", "player: \"vlc\""),
            ("player = \"mpv\"\nfolder = \"/f\"\nvideo_output = \"gpu --script=x\"", "is no such name"),
            ("player = \"mpv\"\nfolder = \"/f\"\nargs = [\"--script=x\"]", "args: unknown key in [film]"),
            ("player = \"mpv\"\nfolder = \"/f\"\non_stop = \"halt\"", "on_stop: \"halt\""),
        ];
        for (text, says) in wrong {
            let faults = faults_of(&format!("[film]\n{text}\n"));
            assert!(faults.iter().any(|fault| fault.contains(says)), "{text}: {faults:?}");
        }
    }

    #[test]
    fn a_film_lies_in_its_folder_and_nowhere_else() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("films");
        fs::create_dir_all(folder.join("reel")).unwrap();
        for name in ["outside.mkv", "films/a.mkv", "films/reel/b.mkv"] {
            fs::write(parent.path().join(name), "").unwrap();
        }
        symlink("../outside.mkv", folder.join("link.mkv")).unwrap();
        let film = hall_with(&format!("[film]\nplayer = \"mpv\"\nfolder = {folder:?}\n")).film.unwrap();
        assert!(film.find("a.mkv").is_ok() && film.find("reel/b.mkv").is_ok());
        for (movie, says) in [
            ("link.mkv", "is outside"),
            ("../outside.mkv", "is outside"),
            ("reel", "is not a file"),
            ("none.mkv", "copy it there"),
        ] {
            assert!(film.find(movie).unwrap_err().contains(says), "{movie}");
        }
        assert!(stays_below("reel/b.mkv"));
        assert!(["../a", "/a", "a/../b", ""].into_iter().all(|movie| !stays_below(movie)));
    }
}
