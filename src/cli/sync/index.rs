use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};

use crate::app::film::{Indexed, index_film};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::film::sound::is_name;

const EXAMPLES: &str = "\
Examples:
  kinocue sync index storm.wav -o storm.kidx
  kinocue sync index storm.mkv -o storm.kidx --name 'The Storm'
  kinocue sync watch sound:alsa:hw:2,0,index=storm.kidx";

/// Makes the index of a film's sound, by which `sound:INPUT,index=FILE.kidx` finds the film from anywhere.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Args {
    /// The film, or its sound as a WAV file: 16 bits, all channels count; anything else is read by mpv.
    film: PathBuf,
    /// The index.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// What the film is called [default: as its file].
    #[arg(long)]
    name: Option<String>,
    /// Say what was made as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let name = args.name.clone().unwrap_or_else(|| name_of(&args.film));
    if !is_name(&name) {
        return Err(anyhow!("{name:?} is no name of a film; write 1 to 200 letters with --name"))
            .or_exit(Exit::Usage);
    }
    let film = || args.film.display().to_string();
    std::fs::metadata(&args.film).with_context(film).or_exit(Exit::NoInput)?;
    let (made, octets) = index_film(&args.film, &name).with_context(film).or_exit(Exit::BadCue)?;
    std::fs::write(&args.output, octets)
        .with_context(|| args.output.display().to_string())
        .or_exit(Exit::Io)?;
    if args.json {
        print::json(&made)?;
    } else {
        print::out(&text(&made, &args.output))?;
    }
    Ok(Exit::Done)
}

fn name_of(film: &Path) -> String {
    film.file_stem().unwrap_or(film.as_os_str()).to_string_lossy().into_owned()
}

fn text(made: &Indexed, output: &Path) -> String {
    let Indexed { name, seconds, landmarks, octets } = made;
    format!("{}: {name}, {seconds:.1} s, {landmarks} landmarks, {octets} octets\n", output.display())
}
