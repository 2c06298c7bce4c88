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

/// Makes the index of a film's sound, with which `sound:INPUT,index=FILE.kidx` finds any position in the film.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Args {
    /// The film's sound as a WAV file (16 bits, all channels are used), or any file that mpv can play.
    film: PathBuf,
    /// The index.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Name of the film [default: the name of its file].
    #[arg(long)]
    name: Option<String>,
    /// Print the result as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let name = args.name.clone().unwrap_or_else(|| name_of(&args.film));
    if !is_name(&name) {
        return Err(anyhow!("{name:?} cannot be a film's name; give 1 to 200 letters with --name"))
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
    format!("{}: {name}, {seconds:.1} s, {landmarks} landmarks, {octets} bytes\n", output.display())
}
