//! A file whose bytes are hashed as they are read, so that it is never in memory whole.

use std::io::{self, Read};

use sha2::{Digest as _, Sha256};

use super::hex;

/// As many of the first bytes are kept: enough to tell one form of file from another.
const FRONT: usize = 16;

/// What is read through this is hashed.
#[derive(Debug)]
pub(crate) struct Hashed<R> {
    input: R,
    hash: Sha256,
    front: Vec<u8>,
}

impl<R: Read> Hashed<R> {
    /// Nothing is read yet.
    pub(crate) fn new(input: R) -> Self {
        Self { input, hash: Sha256::new(), front: Vec::new() }
    }

    /// Its first bytes, 16 at the most, of those that were read.
    #[must_use]
    pub(crate) fn front(&self) -> &[u8] {
        &self.front
    }

    /// SHA-256 of all of it, hexadecimal: what was not read yet is read now.
    ///
    /// # Errors
    /// If it cannot be read to its end.
    pub(crate) fn finish(mut self) -> io::Result<String> {
        io::copy(&mut self, &mut io::sink())?;
        Ok(hex(&self.hash.finalize()))
    }
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        let bytes = self.input.read(buf)?;
        self.hash.update(&buf[..bytes]);
        let wanted = FRONT.saturating_sub(self.front.len()).min(bytes);
        self.front.extend_from_slice(&buf[..wanted]);
        Ok(bytes)
    }
}
