//! Asking the person at the terminal.

use std::io::{self, IsTerminal as _, Write as _};

use anyhow::anyhow;

use super::{Exit, Failure, OrExit as _};
use crate::plain;

/// True if the person agrees: by the option `flag`, else by a word on the terminal. Without either it is wrong use.
pub(super) fn agreed(question: &str, given: bool, flag: &str) -> Result<bool, Failure> {
    if given {
        return Ok(true);
    }
    somebody(question, flag)?;
    let mut asked = io::stderr().lock();
    write!(asked, "{} [yes/no] ", plain::lines(question)).and_then(|()| asked.flush()).or_exit(Exit::Io)?;
    let mut answer = String::new();
    io::stdin().read_line(&mut answer).or_exit(Exit::Io)?;
    Ok(matches!(answer.trim().to_lowercase().as_str(), "y" | "yes"))
}

/// Wrong use where there is nobody to ask and `flag`, which would answer, was not given.
pub(super) fn somebody(question: &str, flag: &str) -> Result<(), Failure> {
    if io::stdin().is_terminal() && io::stderr().is_terminal() {
        return Ok(());
    }
    Err(anyhow!("{question} Nobody can be asked here; {flag} answers yes")).or_exit(Exit::Usage)
}
