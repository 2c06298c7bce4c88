//! The outline of an MCAP file while its bytes go by: where each record begins, and whether what the file says of its own
//! layout can be so (mcap.dev/spec, "Records"). The `mcap` crate believes some of that unseen.

use mcap::records::op;

use super::{MAGIC, Trouble};

/// What a chunk may unpack to beside so many times its packed size: repeated rows pack well, up to some 50 times.
const SLACK: u64 = 16 << 20;
/// How many times its packed size a chunk may unpack to.
const MAX_RATIO: u64 = 200;
/// The same of all chunks together: many small ones that each unpack to as much as one may would be as dear as a large one.
const SLACK_OF_ALL: u64 = 4 * SLACK;
/// Bytes of opcode and length.
const HEAD: usize = 9;
/// Bytes of a chunk up to the name of its compression.
const CHUNK: usize = 32;
/// Bytes of a footer.
const FOOTER: usize = 20;
/// The longest name of a compression that is looked at; those that are known are shorter.
const MAX_NAME: usize = 32;

/// How far into a file it is.
#[derive(Debug)]
pub(super) struct Walk {
    /// Bytes that went by.
    at: u64,
    /// Where the record begins in which the last byte lies.
    record: u64,
    /// What was kept of that record: what has to be looked at.
    head: Vec<u8>,
    /// Bytes of the record that need no look.
    left: u64,
    /// Behind the footer there are no records.
    over: bool,
    /// What a chunk may unpack to at the most.
    most: u64,
    /// Bytes of all chunks so far, packed and unpacked.
    chunks: [u64; 2],
}

impl Walk {
    /// At the front of a file that may unpack to so much.
    pub(super) fn new(most: u64) -> Self {
        let left = MAGIC.len() as u64;
        Self { at: 0, record: 0, head: Vec::new(), left, over: false, most, chunks: [0; 2] }
    }

    /// Where the record begins that was gone by last.
    pub(super) const fn record(&self) -> u64 {
        self.record
    }

    /// Bytes that went by so far.
    pub(super) const fn bytes(&self) -> u64 {
        self.at
    }

    /// Goes by the next bytes.
    ///
    /// # Errors
    /// What cannot be so; [`Self::record`] is then where.
    pub(super) fn pass(&mut self, mut bytes: &[u8]) -> Result<(), Trouble> {
        while !bytes.is_empty() && !self.over {
            let room = if self.left > 0 { self.left } else { (self.wanted() - self.head.len()) as u64 };
            let (taken, rest) = bytes.split_at(usize::try_from(room).unwrap_or(usize::MAX).min(bytes.len()));
            if self.left > 0 {
                self.left -= taken.len() as u64;
            } else {
                self.keep(taken)?;
            }
            self.at += taken.len() as u64;
            bytes = rest;
        }
        self.at += bytes.len() as u64;
        Ok(())
    }

    /// Keeps the next bytes of a record's head, and looks at it once it is all there.
    fn keep(&mut self, bytes: &[u8]) -> Result<(), Trouble> {
        if self.head.is_empty() {
            self.record = self.at;
        }
        self.head.extend_from_slice(bytes);
        if self.head.len() < self.wanted() {
            return Ok(());
        }
        let looked = self.look();
        self.left = self.body().saturating_sub((self.head.len() - HEAD) as u64);
        self.head.clear();
        looked
    }

    /// How much of the record has to be looked at, as far as that is known by now.
    fn wanted(&self) -> usize {
        let Some(opcode) = self.head.first().filter(|_| self.head.len() >= HEAD) else { return HEAD };
        let inside = match *opcode {
            op::CHUNK if self.head.len() < HEAD + CHUNK => CHUNK,
            op::CHUNK => CHUNK + self.name_len() + 8,
            op::FOOTER => FOOTER,
            _ => 0,
        };
        HEAD + inside.min(usize::try_from(self.body()).unwrap_or(usize::MAX))
    }

    /// The length of the record's body, as it says.
    fn body(&self) -> u64 {
        self.u64(1)
    }

    fn name_len(&self) -> usize {
        let len = self
            .head
            .get(HEAD + 28..HEAD + 32)
            .map_or(0, |len| u32::from_le_bytes(len.try_into().unwrap_or_default()));
        usize::try_from(len).unwrap_or(MAX_NAME).min(MAX_NAME)
    }

    fn u64(&self, at: usize) -> u64 {
        self.head.get(at..at + 8).map_or(0, |value| u64::from_le_bytes(value.try_into().unwrap_or_default()))
    }

    /// What of a record cannot be so. One that is too short for what it should hold is left to the reader.
    fn look(&mut self) -> Result<(), Trouble> {
        let body = usize::try_from(self.body()).unwrap_or(usize::MAX);
        match self.head[0] {
            op::CHUNK if body >= CHUNK + self.name_len() + 8 => self.look_at_chunk(),
            op::FOOTER => {
                self.over = true;
                if body < FOOTER { Ok(()) } else { self.look_at_footer() }
            }
            _ => Ok(()),
        }
    }

    fn look_at_chunk(&mut self) -> Result<(), Trouble> {
        let name = self.name_len();
        let (unpacked, packed) = (self.u64(HEAD + 16), self.u64(HEAD + CHUNK + name));
        if [self.body(), unpacked, packed] == [u64::MAX; 3] {
            // So writers begin a chunk, and say how long it is once it is over.
            return Err(Trouble::CutShort);
        }
        let most = packed.saturating_mul(MAX_RATIO).saturating_add(SLACK).min(self.most);
        if unpacked > most {
            let what = format!("a chunk of {packed} bytes that unpacks to {unpacked}; the most is {most}");
            return Err(Trouble::Damaged(what));
        }
        let [all_packed, all_unpacked] = &mut self.chunks;
        *all_packed = all_packed.saturating_add(packed);
        *all_unpacked = all_unpacked.saturating_add(unpacked);
        let most = all_packed.saturating_mul(MAX_RATIO).saturating_add(SLACK_OF_ALL);
        if *all_unpacked > most {
            return Err(Trouble::Damaged(format!(
                "a chunk with which {all_packed} bytes unpack to {all_unpacked} in all; the most is {most}"
            )));
        }
        if name == 0 && packed != unpacked {
            let what = format!("a chunk that is not packed, of {packed} bytes where it says {unpacked}");
            return Err(Trouble::Damaged(what));
        }
        Ok(())
    }

    /// What the footer points to lies behind the messages and before itself.
    fn look_at_footer(&self) -> Result<(), Trouble> {
        for (what, at) in [("summary", self.u64(HEAD)), ("summary offsets", self.u64(HEAD + 8))] {
            if at != 0 && !(MAGIC.len() as u64..=self.record).contains(&at) {
                let footer = self.record;
                return Err(Trouble::Damaged(format!(
                    "a footer that looks for the {what} at byte {at}, and stands at {footer} itself"
                )));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_small_chunks_may_not_unpack_to_more_than_one_large_one_might() {
        let packed = 1_000_u64;
        let front =
            [&[0; 16], SLACK.to_le_bytes().as_slice(), &[0; 4], &4_u32.to_le_bytes(), b"zstd"].concat();
        let body = [&front, packed.to_le_bytes().as_slice(), &[0; 1_000]].concat();
        let chunk = [&[op::CHUNK], (body.len() as u64).to_le_bytes().as_slice(), &body].concat();
        let mut walk = Walk::new(u64::MAX);
        walk.pass(MAGIC).expect("so they begin");
        for _ in 0..4 {
            walk.pass(&chunk).expect("64 MiB and what 200 times their size comes to");
        }
        let told = walk.pass(&chunk).expect_err("80 MiB of 5 kB");
        let told = told.to_string();
        assert!(
            told.starts_with("is damaged: a chunk with which 5000 bytes unpack to 83886080 in all"),
            "{told}"
        );
    }
}
