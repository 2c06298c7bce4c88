//! `kinocue decode`.

use std::io::{Read as _, Write as _};

use anyhow::{Context as _, bail};

use super::{Exit, Failure, OrExit as _};

mod names;
mod sheet;

use sheet::Reading;

/// The most octets a datagram can carry; more hex than that is none.
const MAX_OCTETS: usize = 65_507;

/// Puts a message of the protocol in words.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue decode 55aa000012010002ffffffff000000010000
  kinocue decode 55:aa:00:00 12:01:00:02 ff:ff:ff:ff 00:00:00:01 00:00
  xxd -p frame.bin | kinocue decode - --json

Ends with 64 where the hex is none, with 65 where the octets are no message; the place and the reason are told.")]
pub(super) struct Args {
    /// The message as hex digits; spaces, colons and 0x are let pass, several words are joined, - reads them from
    /// the standard input
    #[arg(required = true, value_name = "HEX")]
    hex: Vec<String>,

    /// Which family's manual the message is read by: imax is the layout as its manual prints it, which no known
    /// program sends
    #[arg(long, value_enum, default_value_t = Reading::Smc)]
    dialect: Reading,

    /// One JSON object on the standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let text = gather(&args.hex)?;
    let octets = octets(&text).or_exit(Exit::Usage)?;
    match sheet::sheet(&octets, args.dialect) {
        Ok(sheet) if args.json => print(&format!("{}\n", sheet.json()))?,
        Ok(sheet) => print(&sheet.text())?,
        Err(error) => {
            if args.json {
                let place = serde_json::json!({ "octet": error.offset(), "why": error.to_string() });
                print(&format!("{}\n", serde_json::json!({ "malformed": place })))?;
            }
            let hint = match args.dialect {
                Reading::Imax => "",
                _ if sheet::sheet(&octets, Reading::Imax).is_ok() => "; with --dialect imax it is one",
                _ => "",
            };
            return Err(anyhow::anyhow!("not a message: {error}{hint}")).or_exit(Exit::BadCue);
        }
    }
    Ok(Exit::Done)
}

/// Writes to the standard output, which may have been closed.
fn print(text: &str) -> Result<(), Failure> {
    let written = std::io::stdout().write_all(text.as_bytes());
    written.context("cannot write to the standard output").or_exit(Exit::Io)
}

/// All hex there is, in the order of the arguments.
fn gather(words: &[String]) -> Result<String, Failure> {
    let mut all = String::new();
    for word in words {
        if word == "-" {
            let limit = 16 * MAX_OCTETS as u64; // digits, separators and line ends of the longest datagram
            let mut input = Vec::new();
            let read = std::io::stdin().lock().take(limit).read_to_end(&mut input);
            read.context("cannot read hex from the standard input").or_exit(Exit::Io)?;
            all.push_str(&String::from_utf8_lossy(&input));
        } else {
            all.push_str(word);
        }
        all.push(' ');
    }
    Ok(all)
}

/// The octets that hex digits mean.
fn octets(text: &str) -> anyhow::Result<Vec<u8>> {
    let mut digits = Vec::new();
    for word in text.split(|c: char| c.is_whitespace() || matches!(c, ':' | ',' | '-')) {
        let word = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X")).unwrap_or(word);
        for c in word.chars() {
            let Some(digit) = c.to_digit(16).and_then(|digit| u8::try_from(digit).ok()) else {
                bail!(
                    "{c:?} after {} hex digits is no hex digit; give the message as 0-9 and a-f",
                    digits.len()
                );
            };
            digits.push(digit);
        }
    }
    if digits.is_empty() || digits.len() % 2 != 0 {
        bail!("{} hex digits are no whole octets; give two for each octet", digits.len());
    }
    if digits.len() > 2 * MAX_OCTETS {
        bail!("{} octets are more than a datagram holds; give at most {MAX_OCTETS}", digits.len() / 2);
    }
    Ok(digits.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_is_taken_however_it_is_spelt() {
        for text in ["55aa0001", "55 AA 00 01", "55:aa:00:01", "0x55 0xaa, 0x0001\n", "55-aa-00-01"] {
            assert_eq!(octets(text).unwrap(), [0x55, 0xaa, 0, 1], "{text}");
        }
    }

    #[test]
    fn what_is_no_hex_is_named_with_its_place() {
        assert!(octets("55 ag").unwrap_err().to_string().starts_with("'g' after 3 hex digits"));
        assert!(octets("55a").unwrap_err().to_string().starts_with("3 hex digits"));
        assert!(octets(" ").is_err());
    }
}
