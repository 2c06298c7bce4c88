//! The 16-bit words of registers, and the part after the header that all register messages share: first register,
//! count, words.

use super::bytes::{count, put_u16, u16_at};
use super::{MAX_LEN, WireError};

mod field {
    pub(super) const START: usize = 12; // u16, first register
    pub(super) const NUM: usize = 14; // u16, how many
    pub(super) const DATA: usize = 16; // num x u16
}

/// Bytes up to the words.
pub(super) const HEAD_LEN: usize = field::DATA;
/// The most words of one message: a whole table of registers.
pub(crate) const MAX_WORDS: usize = 256;

/// 16-bit words, borrowed from a message as it came or from whoever fills one; at most [`MAX_WORDS`] are sent.
#[derive(Clone, Copy)]
pub struct Words<'a>(WordSource<'a>);

#[derive(Clone, Copy)]
enum WordSource<'a> {
    Bytes(&'a [u8]),
    Native(&'a [u16]),
}

impl<'a> Words<'a> {
    /// No words.
    pub const EMPTY: Self = Self(WordSource::Native(&[]));

    /// How many there are.
    #[must_use]
    pub const fn len(self) -> usize {
        match self.0 {
            WordSource::Bytes(bytes) => bytes.len() / 2,
            WordSource::Native(words) => words.len(),
        }
    }

    /// True if there are none.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The word at `index`, where there is one.
    #[must_use]
    pub fn get(self, index: usize) -> Option<u16> {
        match self.0 {
            WordSource::Bytes(bytes) => (index < bytes.len() / 2).then(|| u16_at(bytes, 2 * index)),
            WordSource::Native(words) => words.get(index).copied(),
        }
    }

    /// The words in order.
    pub fn iter(self) -> impl ExactSizeIterator<Item = u16> + use<'a> {
        (0..self.len()).map(move |index| self.get(index).expect("the index is below the length"))
    }
}

impl<'a> From<&'a [u16]> for Words<'a> {
    fn from(words: &'a [u16]) -> Self {
        Self(WordSource::Native(words))
    }
}

impl PartialEq for Words<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl Eq for Words<'_> {}

impl std::fmt::Debug for Words<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

/// Writes first register and count after a header; returns the message.
pub(super) fn emit_ask(buf: &mut [u8; MAX_LEN], start: u16, num: u16) -> &[u8] {
    emit_some(buf, start, num, Words::EMPTY)
}

/// Writes first register, count and words after a header; returns the message.
pub(super) fn emit_all<'b>(buf: &'b mut [u8; MAX_LEN], start: u16, data: Words<'_>) -> &'b [u8] {
    emit_some(buf, start, count(data.len().min(MAX_WORDS)), data)
}

/// Writes first register, a count of its own and words after a header; returns the message.
pub(super) fn emit_some<'b>(buf: &'b mut [u8; MAX_LEN], start: u16, num: u16, data: Words<'_>) -> &'b [u8] {
    put_u16(buf, field::START, start);
    put_u16(buf, field::NUM, num);
    let sent = data.len().min(MAX_WORDS);
    for (index, word) in data.iter().take(sent).enumerate() {
        put_u16(buf, field::DATA + 2 * index, word);
    }
    &buf[..field::DATA + 2 * sent]
}

/// First register and count.
pub(super) fn ask(bytes: &[u8]) -> Result<(u16, u16), WireError> {
    if bytes.len() < HEAD_LEN {
        return Err(WireError::Length { len: bytes.len(), need: HEAD_LEN });
    }
    Ok((u16_at(bytes, field::START), u16_at(bytes, field::NUM)))
}

/// First register and as many words as the count says.
pub(super) fn all(bytes: &[u8]) -> Result<(u16, Words<'_>), WireError> {
    let (start, _, data) = answer(bytes)?;
    Ok((start, data))
}

/// First register, count and as many words as that says.
pub(super) fn answer(bytes: &[u8]) -> Result<(u16, u16, Words<'_>), WireError> {
    let (start, num) = ask(bytes)?;
    let words = usize::from(num);
    if words > MAX_WORDS {
        return Err(WireError::Count { at: field::NUM, found: num, max: count(MAX_WORDS) });
    }
    let need = field::DATA + 2 * words;
    let data = bytes.get(field::DATA..need).ok_or(WireError::Length { len: bytes.len(), need })?;
    Ok((start, num, Words(WordSource::Bytes(data))))
}

/// First register, count and the words there are, which may be fewer than the count.
pub(super) fn refusal(bytes: &[u8]) -> Result<(u16, u16, Words<'_>), WireError> {
    let (start, num) = ask(bytes)?;
    let there = (bytes.len() - field::DATA) / 2;
    let words = there.min(usize::from(num)).min(MAX_WORDS);
    Ok((start, num, Words(WordSource::Bytes(&bytes[field::DATA..field::DATA + 2 * words]))))
}
