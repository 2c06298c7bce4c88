//! Indexes of films' sound: made of a WAV file, or of any film by way of mpv; and read for a show.

use std::fs::FileType;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;

use serde::Serialize;

use super::riff::{Channels, HEADER, RiffFault, SampleStream, is_wav};
use super::{FilmError, WantedFile};
use crate::film::sound::{IndexFault, IndexMaker, MOST_OCTETS, SoundIndex};
use crate::sys::file;

/// What of a film is read at a time.
const CHUNK: usize = 64 * 1024;
/// A film that is shorter is not found in time.
const LEAST_S: f64 = 5.0;

const INDEX: WantedFile = WantedFile {
    is_one: FileType::is_file,
    other: "it is not a file",
    remedy: "make the index with `kinocue sync index FILM -o FILE.kidx`",
};

/// Why a film cannot be indexed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum IndexingError {
    /// It cannot be read.
    #[error("it cannot be read")]
    Read(#[from] io::Error),
    /// Its sound cannot.
    #[error("its sound cannot be read")]
    Sound(#[from] RiffFault),
    /// There is no player that reads what is no WAV file.
    #[error(
        "only WAV files of 16 bits are read without mpv, which cannot be started; install it, or make a WAV file of the sound"
    )]
    NoPlayer(#[source] io::Error),
    /// The player gave up.
    #[error("mpv does not play it ({0}); see what `mpv --no-video` reports")]
    Player(std::process::ExitStatus),
    /// There is not enough to be heard.
    #[error(
        "it has {0:.1} s of sound, but {LEAST_S} s are needed; make sure that it is the film, with its sound"
    )]
    Short(f64),
    /// All of it is silence.
    #[error("it is silent; make sure that it has the sound of the film")]
    Silent,
}

/// An index that was made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Indexed {
    /// What the film is called.
    pub(crate) name: String,
    /// How long it is.
    pub(crate) seconds: f64,
    /// By how many landmarks it is found.
    pub(crate) landmarks: usize,
    /// How long the file is.
    pub(crate) octets: usize,
}

/// Makes the index of a film, as it is to be written, under a name.
///
/// # Errors
/// [`IndexingError`].
pub(crate) fn index_film(film: &Path, name: &str) -> Result<(Indexed, Vec<u8>), IndexingError> {
    let made = match index_wav(film, name)? {
        Some(made) => made,
        None => index_by_mpv(film, name)?,
    };
    let seconds = made.seconds();
    if seconds < LEAST_S {
        return Err(IndexingError::Short(seconds));
    }
    if made.landmarks.is_empty() {
        return Err(IndexingError::Silent);
    }
    let octets = made.to_octets();
    let told = Indexed { name: made.name, seconds, landmarks: made.landmarks.len(), octets: octets.len() };
    Ok((told, octets))
}

/// The index of a WAV file; none where it is something that a player has to read.
fn index_wav(film: &Path, name: &str) -> Result<Option<SoundIndex>, IndexingError> {
    let mut begin = Vec::new();
    file::open(film)?.take(HEADER as u64).read_to_end(&mut begin)?;
    if !is_wav(&begin) {
        return Ok(None);
    }
    match index_stream(file::open(film)?, name) {
        Err(IndexingError::Sound(RiffFault::Format(_) | RiffFault::NoFormat)) => Ok(None),
        made => made.map(Some),
    }
}

fn index_by_mpv(film: &Path, name: &str) -> Result<SoundIndex, IndexingError> {
    let mut mpv = Command::new("mpv");
    mpv.args(["--no-config", "--no-terminal", "--no-video", "--ytdl=no", "--load-scripts=no", "--ao=pcm"]);
    mpv.args(["--ao-pcm-file=/dev/stdout", "--audio-format=s16", "--audio-channels=mono", "--"]).arg(film);
    mpv.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut running = mpv.spawn().map_err(IndexingError::NoPlayer)?;
    let output = running.stdout.take().ok_or_else(|| io::Error::from(io::ErrorKind::BrokenPipe))?;
    let made = index_stream(output, name);
    if made.is_err() {
        let _ = running.kill(); // one that has ended cannot be
    }
    let ended = running.wait()?;
    match made {
        // One that was ended here has no code; what a player says of itself comes before what was heard of it.
        Ok(_) | Err(IndexingError::Short(_)) if ended.code().is_some_and(|code| code != 0) => {
            Err(IndexingError::Player(ended))
        }
        made => made,
    }
}

fn index_stream(mut stream: impl Read, name: &str) -> Result<SoundIndex, IndexingError> {
    let (mut samples, mut octets) = (SampleStream::of(Channels::Mixed), vec![0; CHUNK]);
    let (mut block, mut sound, mut maker) = (Vec::new(), Vec::new(), None);
    loop {
        let count = stream.read(&mut octets)?;
        if count == 0 {
            let maker: IndexMaker = maker.ok_or(IndexingError::Short(0.0))?;
            return Ok(maker.finish(name));
        }
        block.clear();
        samples.push(&octets[..count], &mut block)?;
        let Some(per_s) = samples.samples_per_s() else { continue };
        sound.clear();
        sound.extend(block.iter().map(|sample| f32::from(*sample) / 32_768.0));
        maker.get_or_insert_with(|| IndexMaker::new(per_s)).push(&sound);
    }
}

/// Reads the indexes of a source, the show's film first.
pub(super) fn read_all(paths: &[PathBuf]) -> Result<Arc<[SoundIndex]>, FilmError> {
    paths.iter().map(|path| read(path)).collect()
}

fn read(path: &Path) -> Result<SoundIndex, FilmError> {
    INDEX.check(path)?;
    let failed = |source| FilmError::Open { what: path.display().to_string(), source };
    let mut octets = Vec::new();
    file::open(path).and_then(|file| file.take(MOST_OCTETS + 1).read_to_end(&mut octets)).map_err(failed)?;
    let read = if octets.len() as u64 > MOST_OCTETS {
        Err(IndexFault::Long)
    } else {
        SoundIndex::of_octets(&octets)
    };
    read.map_err(|source| FilmError::Index { path: path.to_path_buf(), source })
}
