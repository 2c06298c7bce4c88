//! `kinocue record recover`.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::PathBuf;

use anyhow::{Context as _, anyhow};

use super::super::{Exit, Failure, OrExit as _, print};
use super::{beside, open, unread};
use crate::record::{self, RecoverError, Wanted, WantedFull, WantedSamples};

/// Repairs a recording that was cut short, is damaged, or is in another order: writes all its complete messages by time, with an index.
///
/// The new file is read back before it gets its name. The original stays. Exits with 1 if anything is lost, and prints how many messages and of
/// which times.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kinocue record recover ride.part.mcap")]
pub(in super::super) struct Args {
    /// The recording that was not closed.
    file: PathBuf,
    /// The file to write [default: the recording's name without .part].
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let output = args.output.clone().unwrap_or_else(|| {
        let named = beside(&args.file, ".mcap");
        if named == args.file { beside(&args.file, ".recovered.mcap") } else { named }
    });
    let taken = || anyhow!("{} exists; give another name with -o FILE", output.display());
    if output.try_exists().or_exit(Exit::Io)? {
        return Err(taken()).or_exit(Exit::Usage);
    }
    let part = output.with_extension("recovering");
    let name = || part.display().to_string();
    let out = File::create_new(&part).with_context(name).or_exit(Exit::Io)?;
    let result = written(args, out, &part);
    let recovered = match result {
        Ok(recovered) => recovered,
        Err(failure) => {
            let _ = fs::remove_file(&part); // what is told is why it is of no use
            return Err(failure);
        }
    };
    // Never over a file that came meanwhile.
    fs::hard_link(&part, &output).with_context(name).or_exit(Exit::Io)?;
    fs::remove_file(&part).with_context(name).or_exit(Exit::Io)?;
    let count: u64 = recovered.messages.values().sum();
    let (output, file, why) = (output.display(), args.file.display(), recovered.in_words());
    print::tell(&format!("{output}: {count} messages; {file} {why}"));
    Ok(if recovered.loses_nothing() { Exit::Done } else { Exit::CheckFailed })
}

/// Writes, and reads back what was written.
fn written(args: &Args, out: File, part: &std::path::Path) -> Result<record::Recovered, Failure> {
    let (recovered, out) =
        record::recover(open(&args.file)?, BufWriter::new(out)).map_err(|error| match error {
            RecoverError::Read(error) => unread(error, &args.file),
            RecoverError::Write(error) => Failure { exit: Exit::Io, error: error.into() },
        })?;
    if recovered.messages.is_empty() {
        let error =
            anyhow!("{}: no message of it is complete; it {}", args.file.display(), recovered.in_words());
        return Err(error).or_exit(Exit::BadCue);
    }
    out.into_inner().map_err(|error| error.into_error()).or_exit(Exit::Io)?.sync_all().or_exit(Exit::Io)?;
    let unwanted = Wanted { samples: WantedSamples::None, full: WantedFull::None, ..Wanted::ALL };
    let back = record::read(open(part)?, unwanted, &mut |_, _, _| ()).map_err(|error| unread(error, part))?;
    if back.trouble.is_some() || back.messages != recovered.messages {
        let error =
            anyhow!("{}: the written file does not read back; the disk may be failing", part.display());
        return Err(error).or_exit(Exit::Io);
    }
    Ok(recovered)
}
