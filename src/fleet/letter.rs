//! Signed texts: nobody on the way can make one, or change one.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nkeys::KeyPair;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The longest id of an order.
const LONGEST_ID: usize = 64;

/// A text and the signature of its octets (Ed25519).
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
    /// Signs a text; `None` where the key has no secret half.
    #[must_use]
    pub(crate) fn sign(pair: &KeyPair, body: String) -> Option<Self> {
        let sig = STANDARD.encode(pair.sign(body.as_bytes()).ok()?);
        Some(Self { key: pair.public_key(), sig, body })
    }

    /// True if its key has signed its text. Whose key that is, and whether it counts for anything, the hall knows.
    #[must_use]
    pub(crate) fn is_signed(&self) -> bool {
        let Ok(pair) = KeyPair::from_public_key(&self.key) else { return false };
        STANDARD.decode(&self.sig).is_ok_and(|sig| pair.verify(self.body.as_bytes(), &sig).is_ok())
    }
}

impl Order {
    /// True if nothing is done for it, so that it may come again while it is new.
    #[must_use]
    pub(crate) fn only_reads(&self) -> bool {
        self.word == "pull"
    }

    /// The order of a letter; why it is none.
    pub(crate) fn of(letter: &Letter) -> Result<Self, String> {
        let order: Self = serde_json::from_str(&letter.body).map_err(|error| error.to_string())?;
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
        let pair = KeyPair::new_user();
        let body = r#"{"id":"1","to":"berlin.h3","word":"pause","args":{},"sent_ms":5}"#.to_owned();
        (Letter::sign(&pair, body).unwrap(), pair)
    }

    #[test]
    fn a_letter_is_signed_by_its_key_and_by_no_other_and_for_no_other_text() {
        let (letter, pair) = letter();
        assert!(letter.is_signed());
        let order = Order::of(&letter).unwrap();
        assert_eq!((order.word.as_str(), order.sent_ms), ("pause", 5));
        assert!(!Letter { key: KeyPair::new_user().public_key(), ..letter.clone() }.is_signed());
        assert!(!Letter { body: letter.body.replace("pause", "park"), ..letter.clone() }.is_signed());
        assert!(!Letter { sig: STANDARD.encode([0; 64]), ..letter.clone() }.is_signed());
        let public = KeyPair::from_public_key(&pair.public_key()).unwrap();
        assert_eq!(Letter::sign(&public, letter.body), None, "the public half signs nothing");
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
