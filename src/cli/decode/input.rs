//! What shall be decoded: hex, a capture, or lines of hex.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufReader, Cursor, IsTerminal as _, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};

use crate::capture::{MAGIC_LEN, is_capture};
use crate::cli::{Exit, Failure, OrExit as _};

/// The most bytes a datagram can carry; more hex than that is none.
pub(super) const MAX_BYTES: usize = 65_507;

/// How messages open; in hex, such a word begins another message.
const OPENINGS: [&str; 2] = ["55aa0000", "33cc0000"];

/// Bytes that are read ahead.
const AHEAD: usize = 1 << 16;

/// Where messages are read from.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Input {
    /// Hex on the command line, a message each.
    Messages(Vec<Vec<u8>>),
    /// A capture, or lines of hex.
    File(PathBuf),
    /// The same on the standard input.
    Stdin,
}

impl Input {
    /// What the words of the command line mean.
    pub(super) fn of(words: &[OsString]) -> Result<Self, Failure> {
        match words {
            [] if io::stdin().is_terminal() => {
                Err(anyhow!("nothing to decode; give hex, a capture, or - for standard input"))
                    .or_exit(Exit::Usage)
            }
            [] => Ok(Self::Stdin),
            [word] if word == "-" => Ok(Self::Stdin),
            [word] if is_file(word) => Ok(Self::File(PathBuf::from(word))),
            _ => messages(words).map(Self::Messages).or_exit(Exit::Usage),
        }
    }
}

/// True if a word is meant as a file: no hex, and either there is one or it looks like its name.
fn is_file(word: &OsString) -> bool {
    let Some(text) = word.to_str() else { return true };
    bytes(text).is_err() && (text.contains(['.', '/']) || Path::new(word).exists())
}

fn messages(words: &[OsString]) -> anyhow::Result<Vec<Vec<u8>>> {
    let mut messages: Vec<String> = Vec::new();
    for word in words {
        let word = word.to_str().with_context(|| format!("{} is not hex", word.display()))?;
        let digits = digits_of(word).to_ascii_lowercase();
        match messages.last_mut() {
            Some(message) if !OPENINGS.iter().any(|opening| digits.starts_with(opening)) => {
                message.push(' ');
                message.push_str(word);
            }
            _ => messages.push(word.to_owned()),
        }
    }
    messages.iter().map(|message| bytes(message)).collect()
}

/// The bytes that hex digits mean.
pub(super) fn bytes(text: &str) -> anyhow::Result<Vec<u8>> {
    let mut digits = Vec::new();
    for word in text.split(|c: char| c.is_whitespace() || matches!(c, ':' | ',' | '-')) {
        for c in digits_of(word).chars() {
            let Some(digit) = c.to_digit(16).and_then(|digit| u8::try_from(digit).ok()) else {
                bail!(
                    "{c:?} after {} hex digits is not a hex digit; give the message as 0-9 and a-f",
                    digits.len()
                );
            };
            digits.push(digit);
        }
    }
    if digits.is_empty() || digits.len() % 2 != 0 {
        bail!("{} hex digits are not whole bytes; give two for each byte", digits.len());
    }
    if digits.len() > 2 * MAX_BYTES {
        bail!("{} bytes do not fit into a datagram; give at most {MAX_BYTES}", digits.len() / 2);
    }
    Ok(digits.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect())
}

fn digits_of(word: &str) -> &str {
    word.strip_prefix("0x").or_else(|| word.strip_prefix("0X")).unwrap_or(word)
}

/// A stream of messages, told by how it opens.
pub(super) enum MessageStream {
    Capture(Box<dyn Read>),
    Lines(BufReader<Box<dyn Read>>),
}

impl MessageStream {
    /// Opens a file.
    pub(super) fn open(path: &Path) -> Result<Self, Failure> {
        let opened = File::open(path).with_context(|| format!("cannot open {}", path.display()));
        let file = opened.or_exit(Exit::NoInput)?;
        if path.is_dir() {
            return Err(anyhow!("{} is a folder; give a capture", path.display())).or_exit(Exit::NoInput);
        }
        Self::of(file).with_context(|| format!("cannot read {}", path.display())).or_exit(Exit::Io)
    }

    /// Takes the standard input.
    pub(super) fn stdin() -> Result<Self, Failure> {
        Self::of(io::stdin()).context("cannot read the standard input").or_exit(Exit::Io)
    }

    fn of(input: impl Read + 'static) -> io::Result<Self> {
        let mut input = BufReader::with_capacity(AHEAD, input);
        let mut magic = Vec::with_capacity(MAGIC_LEN);
        input.by_ref().take(MAGIC_LEN as u64).read_to_end(&mut magic)?;
        let opening: Option<[u8; MAGIC_LEN]> = magic.as_slice().try_into().ok();
        let whole: Box<dyn Read> = Box::new(Cursor::new(magic).chain(input));
        Ok(match opening {
            Some(opening) if is_capture(opening) || !is_text(opening) => Self::Capture(whole),
            _ => Self::Lines(BufReader::with_capacity(AHEAD, whole)),
        })
    }
}

/// True if hex may open so; what is neither hex nor a capture is best refused as a capture.
fn is_text(opening: [u8; MAGIC_LEN]) -> bool {
    opening.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(words: &[&str]) -> Result<Input, String> {
        let words: Vec<OsString> = words.iter().map(Into::into).collect();
        Input::of(&words).map_err(|failure| failure.to_string())
    }

    #[test]
    fn hex_is_taken_however_it_is_spelt() {
        for text in ["55aa0001", "55 AA 00 01", "55:aa:00:01", "0x55 0xaa, 0x0001\n", "55-aa-00-01"] {
            assert_eq!(bytes(text).unwrap(), [0x55, 0xaa, 0, 1], "{text}");
        }
    }

    #[test]
    fn what_is_no_hex_is_named_with_its_place() {
        assert!(bytes("55 ag").unwrap_err().to_string().starts_with("'g' after 3 hex digits"));
        assert!(bytes("55a").unwrap_err().to_string().starts_with("3 hex digits"));
        assert!(bytes(" ").is_err());
    }

    #[test]
    fn words_are_one_message_until_one_opens_another() {
        let first = vec![0x55, 0xaa, 0, 0, 0x12];
        assert_eq!(of(&["55", "aa0000", "12"]), Ok(Input::Messages(vec![first.clone()])));
        let second = vec![0x33, 0xcc, 0, 0];
        assert_eq!(of(&["55aa000012", "0x33CC0000"]), Ok(Input::Messages(vec![first, second])));
    }

    #[test]
    fn one_word_that_is_no_hex_may_be_a_file() {
        assert_eq!(of(&["missing.pcap"]), Ok(Input::File("missing.pcap".into())));
        assert_eq!(of(&["./feed"]), Ok(Input::File("./feed".into())));
        assert_eq!(of(&["-"]), Ok(Input::Stdin));
        assert!(of(&["55zz"]).unwrap_err().starts_with("'z' after 2 hex digits"));
        assert!(of(&["55aa", "missing.pcap"]).is_err());
    }
}
