//! `kinocue fleet init --migrate`: a desk of an earlier version, whose one key logged in at the engine and signed letters, gets a second
//! one for letters.

use std::path::Path;

use anyhow::{Context as _, anyhow};

use super::made::{LETTERS, put, seed};
use super::settings::LONGEST;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::fleet::new_letter_key;
use crate::sys::file;

/// Makes the key, has the settings name it, and prints what each hall needs of it.
pub(super) fn migrate(path: &Path) -> Result<Exit, Failure> {
    let name = path.display();
    let text =
        file::text(path, LONGEST).with_context(|| format!("cannot read {name}")).or_exit(Exit::NoInput)?;
    let with = with_letters(&text).map_err(|why| anyhow!("{name} {why}")).or_exit(Exit::Usage)?;
    let letters = new_letter_key();
    let folder = path.parent().unwrap_or(Path::new("."));
    put(&folder.join(LETTERS), &seed(&letters)?, 0o600)?;
    file::write_ours(path, with).with_context(|| format!("cannot write {name}")).or_exit(Exit::Io)?;
    print::out(&format!(
        "made {}, and {name} names it\n\n\
         In kinocue.toml of each hall, the [[fleet.key]] of this desk gets another public half; then reload or restart the hall:\n\
         public = \"{}\"\n\n\
         The engine stays as it is. What was wished for halls so far counts no more: push it again with --only\n",
        folder.join(LETTERS).display(),
        letters.public_key()
    ))?;
    Ok(Exit::Done)
}

/// The settings with the key for letters below the key that logs in; why they need none.
fn with_letters(text: &str) -> Result<String, &'static str> {
    let is_key = |line: &str, key| {
        let value = line.trim_start().strip_prefix(key).map(str::trim_start);
        value.is_some_and(|value| value.starts_with('='))
    };
    if text.lines().any(|line| is_key(line, "letters")) {
        return Err("has a key for letters already");
    }
    let mut with = String::new();
    let mut is_named = false;
    for line in text.lines() {
        with += line;
        with.push('\n');
        if is_key(line, "seed") && !is_named {
            with += &format!("letters = \"{LETTERS}\"\n");
            is_named = true;
        }
    }
    if is_named { Ok(with) } else { Err("has no line seed = \"…\": it is not the file of a desk") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_settings_of_a_desk_keep_all_that_they_have_and_name_the_second_key_once() {
        let old = "engine = [\"nats://127.0.0.1:4222\"]\nseed = \"desk.nk\"\nname = \"office\"\n[groups]\ntrio = []\n";
        let new = with_letters(old).unwrap();
        assert_eq!(new, old.replace("desk.nk\"\n", "desk.nk\"\nletters = \"letters.nk\"\n"));
        assert!(with_letters(&new).unwrap_err().contains("already"));
        assert!(with_letters("[api]\n").unwrap_err().contains("is not the file of a desk"));
    }
}
