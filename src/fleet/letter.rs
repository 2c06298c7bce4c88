//! Signed texts: nobody on the way can make one, or change one.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nkeys::{KeyPair, KeyPairType};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::json;

/// The beginning of all that is signed, before the text: a signature that was made for another protocol is none of a letter.
const DOMAIN: &[u8] = b"kinocue letter 1\n";
/// The longest id of an order.
const LONGEST_ID: usize = 64;

/// A new key for letters. It is of another type than those that log in at the engine: a client signs whatever the engine sends it as a
/// challenge, so that an engine that is none could have such a key sign a letter.
#[must_use]
pub(crate) fn new_letter_key() -> KeyPair {
    KeyPair::new_service()
}

/// True of a key whose signature a letter may have.
#[must_use]
fn is_letter_key(pair: &KeyPair) -> bool {
    pair.key_pair_type() == KeyPairType::Service
}

/// A text and its signature (Ed25519).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Letter {
    /// The public half of the key that it was signed with.
    pub(crate) key: String,
    /// The signature, base64.
    pub(crate) sig: String,
    /// The text: JSON.
    pub(crate) body: String,
}

/// What somebody asks of one hall, the text of a letter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Order {
    /// Like no other: what comes twice is done once.
    pub(crate) id: String,
    /// The hall that it is for, `SITE.HALL`.
    pub(crate) to: String,
    /// What, in the word of the command.
    pub(crate) word: String,
    /// With what.
    #[serde(default)]
    pub(crate) args: Value,
    /// When it was asked, Unix milliseconds by the clock of whoever did.
    pub(crate) sent_ms: i64,
}

impl Letter {
    /// Signs a text; `None` where the key is none for letters, or has no secret half.
    #[must_use]
    pub(crate) fn sign(pair: &KeyPair, body: String) -> Option<Self> {
        let sig = pair.sign(&signed_octets(&body)).ok().filter(|_| is_letter_key(pair))?;
        let sig = STANDARD.encode(sig);
        Some(Self { key: pair.public_key(), sig, body })
    }

    /// True if its key has signed its text. Whose key that is, and whether it counts for anything, the hall knows.
    #[must_use]
    pub(crate) fn is_signed(&self) -> bool {
        let Ok(pair) = KeyPair::from_public_key(&self.key) else { return false };
        let signed = || signed_octets(&self.body);
        is_letter_key(&pair)
            && STANDARD.decode(&self.sig).is_ok_and(|sig| pair.verify(&signed(), &sig).is_ok())
    }
}

fn signed_octets(body: &str) -> Vec<u8> {
    [DOMAIN, body.as_bytes()].concat()
}

impl Order {
    /// True if nothing is done for it, so that it may come again while it is new.
    #[must_use]
    pub(crate) fn only_reads(&self) -> bool {
        self.word == "pull"
    }

    /// The order of a letter; why it is none.
    pub(crate) fn of(letter: &Letter) -> Result<Self, String> {
        let order: Self = json::from_slice(letter.body.as_bytes()).map_err(|error| error.to_string())?;
        let id = &order.id;
        if id.is_empty() || id.len() > LONGEST_ID || !id.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Err(format!("{id:?} is not an id of 1 to {LONGEST_ID} characters of ASCII"));
        }
        Ok(order)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn letter() -> (Letter, KeyPair) {
        let pair = new_letter_key();
        let body = r#"{"id":"1","to":"berlin.h3","word":"pause","args":{},"sent_ms":5}"#.to_owned();
        (Letter::sign(&pair, body).unwrap(), pair)
    }

    #[test]
    fn a_letter_is_signed_by_its_key_and_by_no_other_and_for_no_other_text() {
        let (letter, pair) = letter();
        assert!(letter.is_signed());
        let order = Order::of(&letter).unwrap();
        assert_eq!((order.word.as_str(), order.sent_ms), ("pause", 5));
        assert!(!Letter { key: new_letter_key().public_key(), ..letter.clone() }.is_signed());
        assert!(!Letter { body: letter.body.replace("pause", "park"), ..letter.clone() }.is_signed());
        assert!(!Letter { sig: STANDARD.encode([0; 64]), ..letter.clone() }.is_signed());
        let public = KeyPair::from_public_key(&pair.public_key()).unwrap();
        assert_eq!(Letter::sign(&public, letter.body), None, "the public half signs nothing");
    }

    #[test]
    fn a_key_that_logs_in_at_an_engine_signs_no_letter_whatever_it_was_given_as_a_challenge() {
        let (letter, body) = (letter().0, letter().0.body);
        let login = KeyPair::new_user();
        assert_eq!(Letter::sign(&login, body.clone()), None);
        let prefixed = signed_octets(&body);
        for challenge in [body.as_bytes(), &prefixed] {
            let sig = STANDARD.encode(login.sign(challenge).unwrap());
            assert!(!Letter { key: login.public_key(), sig, body: body.clone() }.is_signed());
        }
        let letters = new_letter_key();
        let sig = STANDARD.encode(letters.sign(body.as_bytes()).unwrap());
        assert!(
            !Letter { key: letters.public_key(), sig, ..letter }.is_signed(),
            "signed for another protocol"
        );
    }

    #[test]
    fn an_order_has_an_id_and_nothing_that_nobody_knows() {
        let (letter, _) = letter();
        let of = |body: &str| Order::of(&Letter { body: body.to_owned(), ..letter.clone() });
        for wrong in [
            "",
            "{}",
            r#"{"id":"","to":"a.b","word":"pause","sent_ms":5}"#,
            r#"{"id":"a b","to":"a.b","word":"pause","sent_ms":5}"#,
            r#"{"id":"1","to":"a.b","word":"pause","sent_ms":5,"as":"engineer"}"#,
            r#"{"id":"1","to":"a.b","word":"pause","sent_ms":5.5}"#,
        ] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
        assert_eq!(of(r#"{"id":"1","to":"a.b","word":"pause","sent_ms":5}"#).unwrap().args, Value::Null);
    }

    proptest! {
        #[test]
        fn whatever_comes_for_a_letter_is_no_reason_to_end(key in ".{0,80}", sig in ".{0,100}", body in ".{0,100}") {
            let letter = Letter { key, sig, body };
            prop_assert!(!letter.is_signed());
            let _ = Order::of(&letter);
        }
    }
}
