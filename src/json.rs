//! JSON from outside. What asks for something is read strictly: an object that has a key twice says two things, of which a reader that
//! takes the last one knows one. What somebody tells of itself is clipped where it enters.

use std::collections::HashSet;
use std::fmt;

use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::Value;

use crate::plain;

/// Reads a text.
///
/// # Errors
/// As `serde_json::from_slice`, and where an object in it, at any depth, has a key twice.
pub(crate) fn from_slice<T: DeserializeOwned>(text: &[u8]) -> serde_json::Result<T> {
    let mut read = serde_json::Deserializer::from_slice(text);
    KeysOnce.deserialize(&mut read)?;
    serde_json::from_slice(text)
}

/// The value with each of its texts as one plain line of at most `text` bytes, and each list and object with its first `items` at most.
#[must_use]
pub(crate) fn clipped(value: Value, text: usize, items: usize) -> Value {
    let plain = |line: &str| plain::escaped(line, text).into_owned();
    match value {
        Value::String(line) => Value::String(plain(&line)),
        Value::Array(all) => all.into_iter().take(items).map(|one| clipped(one, text, items)).collect(),
        Value::Object(all) => {
            let some = all.into_iter().take(items);
            some.map(|(key, one)| (plain(&key), clipped(one, text, items))).collect()
        }
        other => other,
    }
}

/// A value of any kind, each object of which has each of its keys once.
#[derive(Debug, Clone, Copy)]
struct KeysOnce;

impl<'de> DeserializeSeed<'de> for KeysOnce {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, of: D) -> Result<(), D::Error> {
        of.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for KeysOnce {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<(), M::Error> {
        let mut keys = HashSet::new();
        while let Some(key) = map.next_key::<String>()? {
            map.next_value_seed(self)?;
            if let Some(key) = keys.replace(key) {
                return Err(M::Error::custom(format_args!("the key {key:?} is there twice")));
            }
        }
        Ok(())
    }

    fn visit_seq<S: SeqAccess<'de>>(self, mut seq: S) -> Result<(), S::Error> {
        while seq.next_element_seed(self)?.is_some() {}
        Ok(())
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_u64<E>(self, _: u64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    #[test]
    fn an_object_with_a_key_twice_is_refused_at_any_depth_and_however_the_key_is_spelt() {
        for text in [
            r#"{"A":0.5,"A":0.2}"#,
            r#"{"rows":{"A":0.5,"B":1,"A":0.5}}"#,
            r#"[1,[{"A":null,"\u0041":true}]]"#,
            r#"{"":1,"":1}"#,
        ] {
            let error = from_slice::<Value>(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains("is there twice"), "{text}: {error}");
        }
        let text = br#"{"A":{"A":[1,-2,0.5,"A","A",true,null,{"A":0}]},"a":{}}"#;
        let value = json!({ "A": { "A": [1, -2, 0.5, "A", "A", true, null, { "A": 0 }] }, "a": {} });
        assert_eq!(from_slice::<Value>(text).unwrap(), value);
    }

    #[test]
    fn what_is_told_is_short_and_plain_at_any_depth() {
        let long = "x".repeat(100);
        let told = json!({ "a": [long, "\x1b[2J", { "b\n": "ok\nforged" }], "n": [1, 2, 3, 4, null, true] });
        let clipped = clipped(told, 20, 4);
        let short = format!("{}…", "x".repeat(20));
        let plain = json!({ "a": [short, "\\u{1b}[2J", { "b\\n": "ok\\nforged" }], "n": [1, 2, 3, 4] });
        assert_eq!(clipped, plain);
    }

    proptest! {
        #[test]
        fn all_else_is_read_as_ever_and_nothing_panics(text in r#"[\[\]{}:,"0-9a-c .eu\\-]{0,40}"#) {
            let (ours, theirs) = (from_slice::<Value>(text.as_bytes()), serde_json::from_str::<Value>(&text));
            match ours {
                Ok(ours) => prop_assert_eq!(ours, theirs.unwrap()),
                Err(error) => prop_assert!(theirs.is_err() || error.to_string().contains("twice")),
            }
        }
    }
}
