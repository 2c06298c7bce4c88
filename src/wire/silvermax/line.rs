//! From octets to lines, at both ends.

use std::ops::RangeInclusive;

/// Octets of the longest line that is kept: no request of eight parameters has more, and replies are shorter.
pub(crate) const MAX_LINE: usize = 128;

const END: u8 = b'\r';

/// What octets make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Collected<'a> {
    /// A line from its opening on, without the carriage return at its end.
    Line(&'a [u8]),
    /// Octets that are no line: without an opening, cut short by the next opening, or too long.
    Stray(&'a [u8]),
}

/// Collects lines from octets. Holds no more than [`MAX_LINE`].
#[derive(Debug, Clone)]
pub(crate) struct LineCollector {
    openings: &'static [u8],
    octets: [u8; MAX_LINE],
    len: usize,
    /// The opening that cut the last line short.
    next: Option<u8>,
}

impl LineCollector {
    /// Collects what a host sends.
    pub(crate) const fn of_requests() -> Self {
        Self::new(b"@")
    }

    /// Collects what drives answer.
    pub(crate) const fn of_replies() -> Self {
        Self::new(b"*#!")
    }

    /// Collects both, where nobody knows which is which.
    pub(crate) const fn of_both() -> Self {
        Self::new(b"@*#!")
    }

    const fn new(openings: &'static [u8]) -> Self {
        Self { openings, octets: [0; MAX_LINE], len: 0, next: None }
    }

    /// Takes the next octet; says what is complete with it.
    pub(crate) fn push(&mut self, octet: u8) -> Option<Collected<'_>> {
        self.begin_next();
        if self.len > 0 && self.openings.contains(&octet) {
            self.next = Some(octet);
            return Some(Collected::Stray(self.take()));
        }
        if octet == END && self.is_open() {
            return Some(Collected::Line(self.take()));
        }
        self.octets[self.len] = octet;
        self.len += 1;
        let is_over = octet == END || self.len == MAX_LINE;
        is_over.then(|| Collected::Stray(self.take()))
    }

    /// Takes what has come of a line that nothing completes any more.
    pub(crate) fn rest(&mut self) -> &[u8] {
        self.begin_next();
        self.take()
    }

    /// True if nothing has come since the last line.
    pub(crate) const fn is_empty(&self) -> bool {
        self.len == 0 && self.next.is_none()
    }

    fn is_open(&self) -> bool {
        self.len > 0 && self.openings.contains(&self.octets[0])
    }

    fn begin_next(&mut self) {
        if let Some(opening) = self.next.take() {
            self.octets[0] = opening;
            self.len = 1;
        }
    }

    fn take(&mut self) -> &[u8] {
        let len = std::mem::take(&mut self.len);
        &self.octets[..len]
    }
}

/// Why a line is no message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum LineError {
    /// It opens like none.
    #[error("it begins neither like a request (@) nor like an answer (*, # or !)")]
    Opening,
    /// No number where one belongs.
    #[error("octet {at}: no {what}")]
    Number {
        /// Where, counted from 0.
        at: usize,
        /// What belongs there.
        what: &'static str,
    },
    /// A number that cannot be.
    #[error("octet {at}: {what} {found} is outside {}..={}", range.0, range.1)]
    Range {
        /// Where it begins.
        at: usize,
        /// What it is.
        what: &'static str,
        /// The number.
        found: i64,
        /// What it may be.
        range: (i64, i64),
    },
    /// More than fits.
    #[error("octet {at}: more than {most} {what}")]
    Many {
        /// Where the first that is too many begins.
        at: usize,
        /// What there is too much of.
        what: &'static str,
        /// How many there may be.
        most: usize,
    },
    /// The sum of a message in nine bits does not come out.
    #[error("the sum is {found:#04x} where 0 belongs")]
    Sum {
        /// What it is.
        found: u8,
    },
    /// A message in nine bits of another length than it says.
    #[error("{found} octets where it says {said}")]
    Length {
        /// What it has.
        found: usize,
        /// What it says.
        said: usize,
    },
}

/// A line read from the front, number by number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cursor<'a> {
    octets: &'a [u8],
    pub(super) at: usize,
}

impl<'a> Cursor<'a> {
    /// Behind the opening.
    pub(super) const fn after_opening(octets: &'a [u8]) -> Self {
        Self { octets, at: 1 }
    }

    pub(super) const fn is_done(&self) -> bool {
        self.at >= self.octets.len()
    }

    /// The one blank that stands before each number but the first of a request.
    pub(super) fn blank(&mut self) -> Result<(), LineError> {
        match self.octets.get(self.at) {
            Some(b' ') => {
                self.at += 1;
                Ok(())
            }
            _ => Err(LineError::Number { at: self.at, what: "blank" }),
        }
    }

    /// A signed decimal number.
    pub(super) fn decimal(
        &mut self,
        what: &'static str,
        range: RangeInclusive<i64>,
    ) -> Result<i64, LineError> {
        let rest = &self.octets[self.at.min(self.octets.len())..];
        let word = &rest[..rest.iter().position(|octet| *octet == b' ').unwrap_or(rest.len())];
        let digits = word.strip_prefix(b"-").unwrap_or(word);
        if digits.is_empty() || digits.len() > 10 || !digits.iter().all(u8::is_ascii_digit) {
            return Err(LineError::Number { at: self.at, what });
        }
        let size = digits.iter().fold(0, |size, digit| 10 * size + i64::from(digit - b'0'));
        let found = if word.len() == digits.len() { size } else { -size };
        if !range.contains(&found) {
            return Err(LineError::Range { at: self.at, what, found, range: range.into_inner() });
        }
        self.at += word.len();
        Ok(found)
    }

    /// A decimal number that is an octet, no less than `least`.
    pub(super) fn octet(&mut self, what: &'static str, least: u8) -> Result<u8, LineError> {
        let number = self.decimal(what, least.into()..=u8::MAX.into())?;
        u8::try_from(number).map_err(|_| LineError::Number { at: self.at, what })
    }

    /// So many hexadecimal digits.
    pub(super) fn hex(&mut self, what: &'static str, digits: usize) -> Result<u16, LineError> {
        let digit = |octet: &u8| char::from(*octet).to_digit(16).and_then(|digit| u16::try_from(digit).ok());
        let word = self.octets.get(self.at..self.at + digits).unwrap_or_default();
        let number = word.iter().map(digit).try_fold(0, |number, digit| Some(number << 4 | digit?));
        match number {
            Some(number) if !word.is_empty() => {
                self.at += digits;
                Ok(number)
            }
            _ => Err(LineError::Number { at: self.at, what }),
        }
    }

    /// Nothing may follow.
    pub(super) fn end(&self) -> Result<(), LineError> {
        if self.is_done() { Ok(()) } else { Err(LineError::Number { at: self.at, what: "end of the line" }) }
    }
}

/// Writes a line to the front of a buffer; what does not fit is not written, and nothing that we write is so long.
#[derive(Debug)]
pub(super) struct LineWriter<'b> {
    octets: &'b mut [u8; MAX_LINE],
    len: usize,
}

impl<'b> LineWriter<'b> {
    pub(super) const fn new(octets: &'b mut [u8; MAX_LINE]) -> Self {
        Self { octets, len: 0 }
    }

    /// With the carriage return.
    pub(super) fn end(mut self) -> &'b [u8] {
        self.put(END);
        let Self { octets, len } = self;
        &octets[..len]
    }

    fn put(&mut self, octet: u8) {
        if let Some(place) = self.octets.get_mut(self.len) {
            *place = octet;
            self.len += 1;
        }
    }
}

impl std::fmt::Write for LineWriter<'_> {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        text.bytes().for_each(|octet| self.put(octet));
        Ok(())
    }
}
