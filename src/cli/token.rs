//! `kinocue token`.

use std::io;
use std::net::SocketAddr;

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::{Exit, Failure, OrExit as _, print};
use crate::control::Role;
use crate::sys::file::random;

/// 256 bits, which nobody guesses.
const BYTES: usize = 32;
/// The longest name.
const MAX_NAME: usize = 64;

/// Creates an access token for HTTP.
///
/// Prints the token on stdout, and the lines to add to the configuration on stderr.
///
/// The token is shown only once and stored nowhere: the configuration holds only its SHA-256. Treat
/// it like a key. To revoke it, remove its lines from the configuration and reload it.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue token tablet --role operate
  kinocue token booth --role engineer --json")]
pub(super) struct Args {
    /// The holder's name, as the journal shows it.
    #[arg(value_parser = parse_name)]
    name: String,
    /// What it permits. view: viewing; operate: also running shows; engineer: also homing, arming, clearing and the library.
    #[arg(long, value_enum)]
    role: RoleArg,
    /// Print both in one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum RoleArg {
    View,
    Operate,
    Engineer,
}

impl From<RoleArg> for Role {
    fn from(role: RoleArg) -> Self {
        match role {
            RoleArg::View => Self::View,
            RoleArg::Operate => Self::Operate,
            RoleArg::Engineer => Self::Engineer,
        }
    }
}

/// What was made.
#[derive(Debug, Serialize)]
pub(super) struct Token<'n> {
    name: &'n str,
    role: Role,
    pub(super) token: String,
    sha256: String,
    /// Its lines of the configuration.
    pub(super) config: String,
}

fn parse_name(name: &str) -> Result<String, String> {
    let plain = |c: char| !c.is_control() && c != '"' && c != '\\';
    if !name.trim().is_empty() && name.chars().count() <= MAX_NAME && name.chars().all(plain) {
        Ok(name.to_owned())
    } else {
        Err(format!("a name has 1 to {MAX_NAME} characters, and neither \" nor \\"))
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let token = Token::new(&args.name, args.role.into()).or_system()?;
    if args.json {
        print::json(&token)?;
    } else {
        print::tell(
            "For the configuration, after which `kinocue reload` takes it, while nothing is armed:\n",
        );
        print::tell(&token.config);
        print::tell("\nThe token, shown only this once:");
        print::out(&format!("{}\n", token.token))?;
    }
    Ok(Exit::Done)
}

/// The console with the token in the fragment, which no browser sends anywhere.
pub(super) fn link(address: SocketAddr, token: &str) -> String {
    format!("http://{address}/#token={token}")
}

impl<'n> Token<'n> {
    /// One that nobody guesses.
    ///
    /// # Errors
    /// If the kernel gives no chance.
    pub(super) fn new(name: &'n str, role: Role) -> io::Result<Self> {
        Ok(Self::of(name, role, &random()?))
    }

    fn of(name: &'n str, role: Role, bytes: &[u8; BYTES]) -> Self {
        let token = URL_SAFE_NO_PAD.encode(bytes);
        let sha256: String = Sha256::digest(&token).iter().map(|byte| format!("{byte:02x}")).collect();
        let config = format!("[[api.token]]\nname = \"{name}\"\nrole = \"{role}\"\nsha256 = \"{sha256}\"");
        Self { name, role, token, sha256, config }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_goes_to_its_owner_and_its_hash_into_the_configuration() {
        let token = Token::of("tablet", Role::Operate, &[0xff; BYTES]);
        assert_eq!(
            token.token,
            format!("{}8", "_".repeat(42)),
            "no characters that a header or a shell would mind"
        );
        assert!(token.config.contains("role = \"operate\"\nsha256 = \""), "{}", token.config);
        assert!(token.config.contains(&token.sha256) && !token.config.contains(&token.token));
    }

    #[test]
    fn no_two_are_alike() {
        assert_ne!(random::<BYTES>().unwrap(), random().unwrap());
    }

    #[test]
    fn a_name_cannot_break_out_of_its_line() {
        assert!(parse_name("tablet of row A").is_ok());
        for bad in ["", " ", "a\nb", "a\"b", "a\\b", &"a".repeat(65)] {
            assert!(parse_name(bad).is_err(), "{bad:?}");
        }
    }
}
