//! What shows that a heartbeat is of the other machine: HMAC with SHA-256 (RFC 2104), by a key that both machines have.

use sha2::{Digest as _, Sha256};
use subtle::ConstantTimeEq as _;

/// The block of SHA-256.
const BLOCK: usize = 64;
/// The octets of a code.
pub(crate) const CODE: usize = 32;

/// The key of a pair: 32 octets that nobody else knows.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct PairKey([u8; CODE]);

impl std::fmt::Debug for PairKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("PairKey")
    }
}

impl PairKey {
    /// Of 64 hexadecimal digits; `None` where the text is none of that.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if text.len() != 2 * CODE || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return None;
        }
        let mut key = [0; CODE];
        for (octet, at) in key.iter_mut().zip((0..).step_by(2)) {
            *octet = u8::from_str_radix(text.get(at..at + 2)?, 16).ok()?;
        }
        Some(Self(key))
    }

    /// The code of a text.
    pub(crate) fn code(&self, text: &[u8]) -> [u8; CODE] {
        hmac(&self.0, text)
    }

    /// True if that is the code of a text; takes as long for any other.
    pub(crate) fn is_code_of(&self, code: &[u8], text: &[u8]) -> bool {
        self.code(text).as_slice().ct_eq(code).into()
    }
}

/// HMAC of a text by a key that is not longer than a block.
fn hmac(key: &[u8], text: &[u8]) -> [u8; CODE] {
    let mut block = [0; BLOCK];
    block[..key.len()].copy_from_slice(key);
    let padded = |pad: u8| block.map(|octet| octet ^ pad);
    let inner = Sha256::new().chain_update(padded(0x36)).chain_update(text).finalize();
    Sha256::new().chain_update(padded(0x5c)).chain_update(inner).finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hex(octets: &[u8]) -> String {
        octets.iter().map(|octet| format!("{octet:02x}")).collect()
    }

    #[test]
    fn codes_are_those_of_the_standard() {
        // RFC 4231, test cases 1 to 3.
        let cases: [(Vec<u8>, Vec<u8>, &str); 3] = [
            (
                vec![0x0b; 20],
                b"Hi There".to_vec(),
                "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7",
            ),
            (
                b"Jefe".to_vec(),
                b"what do ya want for nothing?".to_vec(),
                "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843",
            ),
            (
                vec![0xaa; 20],
                vec![0xdd; 50],
                "773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe",
            ),
        ];
        for (key, text, code) in cases {
            assert_eq!(hex(&hmac(&key, &text)), code);
        }
    }

    #[test]
    fn a_key_is_64_hexadecimal_digits_and_its_code_is_that_of_one_text() {
        let text = "00112233445566778899aabbccddeeff00112233445566778899aabbccddeeff";
        let key = PairKey::parse(&format!("{text}\n")).unwrap();
        let code = key.code(b"beat");
        assert!(key.is_code_of(&code, b"beat"));
        assert!(!key.is_code_of(&code, b"beau") && !key.is_code_of(&code[..31], b"beat"));
        assert!(!PairKey::parse(&text.replace("00", "01")).unwrap().is_code_of(&code, b"beat"));
        for wrong in ["", &text[1..], &text.replace("00", "0x"), &text.replace("00", "é")] {
            assert_eq!(PairKey::parse(wrong), None, "{wrong}");
        }
        assert_eq!(format!("{key:?}"), "PairKey");
    }
}
