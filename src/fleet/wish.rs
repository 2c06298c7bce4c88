//! What a hall shall have in its library and among its playlists, as a desk wishes it.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::Letter;
use crate::json;

/// The longest wish as it is sent, signature and all, bytes.
pub(crate) const LONGEST_WISH: usize = 256 << 10;
/// Cues and playlists that it names at the most, those among them that shall go: what a hall has of each is told in one message.
pub(crate) const MOST_NAMED: usize = 1_000;
/// How far the rev of a wish may be ahead of the clock of a hall.
pub(crate) const AHEAD: Duration = Duration::from_secs(86_400);
/// Bytes of a cue in a message of the engine.
pub(crate) const CHUNK: u64 = 128 << 10;
/// Digits of a SHA-256.
pub(super) const DIGITS: usize = 64;

/// What a hall shall have: the text of a letter. It names all of it, each time.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wish {
    /// The hall that it is for, `SITE.HALL`.
    pub(crate) to: String,
    /// Rises with each wish for a hall: Unix milliseconds, or one more than the one before.
    pub(crate) rev: u64,
    /// Cues by their ids.
    pub(crate) cues: BTreeMap<String, WishedCue>,
    /// Playlists by their ids.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) playlists: BTreeMap<String, WishedPlaylist>,
    /// What shall go of what an earlier wish brought. What no wish names any more stays by itself: a wish that is lost, or another desk's,
    /// empties no library.
    #[serde(default, skip_serializing_if = "Drops::is_empty")]
    pub(crate) drops: Drops,
}

/// What shall go, by its ids.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Drops {
    /// Cues.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub(crate) cues: BTreeSet<String>,
    /// Playlists.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub(crate) playlists: BTreeSet<String>,
}

impl Drops {
    fn is_empty(&self) -> bool {
        self.cues.is_empty() && self.playlists.is_empty()
    }
}

/// The file of a playlist, which is so short that it is in the wish itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WishedPlaylist {
    /// All of it, TOML.
    pub(crate) text: String,
    /// From when on the hall shall have it, Unix milliseconds; 0 for at once. Until then it keeps what it has of that id.
    #[serde(default, skip_serializing_if = "is_at_once")]
    pub(crate) from_ms: u64,
}

fn is_at_once(from_ms: &u64) -> bool {
    *from_ms == 0
}

/// The file of a cue.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WishedCue {
    /// Its SHA-256, hexadecimal, small letters; the name of it at the engine.
    pub(crate) sha256: String,
    /// How long it is.
    pub(crate) bytes: u64,
}

/// A piece of a cue that a hall gives out, the reply to `pull`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct CuePiece {
    /// SHA-256 of the whole file, as the hall says.
    pub(crate) sha256: String,
    /// How long the whole file is, as the hall says.
    pub(crate) bytes: u64,
    /// True if it is MCAP; CSV if not.
    pub(crate) mcap: bool,
    /// The piece, base64: [`CHUNK`] bytes, but the last.
    pub(crate) data: String,
}

impl Wish {
    /// The wish of a letter, whoever has signed that; why it is none.
    pub(crate) fn of(letter: &Letter) -> Result<Self, String> {
        let wish: Self = json::from_slice(letter.body.as_bytes()).map_err(|error| error.to_string())?;
        wish.check_count()?;
        for (id, cue) in &wish.cues {
            if !cue.is_named() {
                let sha256 = &cue.sha256;
                return Err(format!("{sha256:?}, of {id:?}, is not {DIGITS} small hexadecimal digits"));
            }
            if cue.bytes == 0 {
                return Err(format!("{id:?} is empty"));
            }
        }
        let Drops { cues, playlists } = &wish.drops;
        let both = cues.iter().find(|id| wish.cues.contains_key(*id));
        match both.or_else(|| playlists.iter().find(|id| wish.playlists.contains_key(*id))) {
            Some(id) => Err(format!("{id:?} shall come and go")),
            None => Ok(wish),
        }
    }

    /// That it names no more than a hall answers for.
    pub(crate) fn check_count(&self) -> Result<(), String> {
        let Drops { cues, playlists } = &self.drops;
        match self.cues.len() + self.playlists.len() + cues.len() + playlists.len() {
            0..=MOST_NAMED => Ok(()),
            named => Err(format!("it names {named} cues and playlists, more than {MOST_NAMED}")),
        }
    }

    /// Wishes for a cue.
    pub(crate) fn want_cue(&mut self, id: &str, cue: &WishedCue) {
        self.drops.cues.remove(id);
        self.cues.insert(id.to_owned(), cue.clone());
    }

    /// Wishes for a playlist.
    pub(crate) fn want_playlist(&mut self, id: &str, playlist: &WishedPlaylist) {
        self.drops.playlists.remove(id);
        self.playlists.insert(id.to_owned(), playlist.clone());
    }

    /// Wishes a cue to go.
    pub(crate) fn drop_cue(&mut self, id: &str) {
        self.cues.remove(id);
        self.drops.cues.insert(id.to_owned());
    }

    /// Wishes a playlist to go.
    pub(crate) fn drop_playlist(&mut self, id: &str) {
        self.playlists.remove(id);
        self.drops.playlists.insert(id.to_owned());
    }
}

impl WishedPlaylist {
    /// Its file, by its digest.
    #[must_use]
    pub(crate) fn file(&self) -> WishedCue {
        let sha256 = Sha256::digest(&self.text).iter().map(|byte| format!("{byte:02x}")).collect();
        WishedCue { sha256, bytes: self.text.len() as u64 }
    }
}

impl WishedCue {
    /// True if its digest is one: it names files.
    #[must_use]
    pub(crate) fn is_named(&self) -> bool {
        let small = |digit: u8| digit.is_ascii_digit() || (b'a'..=b'f').contains(&digit);
        self.sha256.len() == DIGITS && self.sha256.bytes().all(small)
    }

    /// How many messages of the engine have it.
    #[must_use]
    pub(crate) fn chunks(&self) -> u64 {
        self.bytes.div_ceil(CHUNK)
    }

    /// How long the message of that number is, from 0.
    #[must_use]
    pub(crate) fn chunk_len(&self, n: u64) -> u64 {
        CHUNK.min(self.bytes.saturating_sub(n.saturating_mul(CHUNK)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::new_letter_key;
    use super::*;

    fn wish(cues: &str) -> Result<Wish, String> {
        let body = format!("{{\"to\":\"berlin.h3\",\"rev\":7,\"cues\":{cues}}}");
        Wish::of(&Letter::sign(&new_letter_key(), body).unwrap())
    }

    #[test]
    fn a_wish_names_files_by_their_digests_and_nothing_that_nobody_knows() {
        let sha256 = "0123456789abcdef".repeat(4);
        let one =
            |sha256: &str, more: &str| format!("{{\"storm\":{{\"sha256\":\"{sha256}\",\"bytes\":3{more}}}}}");
        let cue = &wish(&one(&sha256, "")).unwrap().cues["storm"];
        assert_eq!((cue.sha256.as_str(), cue.bytes, cue.chunks()), (sha256.as_str(), 3, 1));
        for wrong in [
            one(&sha256.to_uppercase(), ""),
            one(&sha256[1..], ""),
            one("../../etc/passwd", ""),
            one(&sha256, ",\"to\":\"/\""),
            one(&sha256, "").replace(":3", ":0"),
            one(&sha256, "").replace(":3", ":-3"),
            "[]".to_owned(),
            "{},\"levels\":{}".to_owned(),
        ] {
            assert!(wish(&wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_wish_of_cues_alone_is_as_it_was_before_there_were_playlists() {
        let mut wish = wish("{}").unwrap();
        assert_eq!(serde_json::to_string(&wish).unwrap(), r#"{"to":"berlin.h3","rev":7,"cues":{}}"#);
        let playlist = |from_ms| WishedPlaylist { text: "title = \"x\"".to_owned(), from_ms };
        wish.playlists.insert("at-once".to_owned(), playlist(0));
        wish.playlists.insert("later".to_owned(), playlist(5));
        let text = serde_json::to_string(&wish).unwrap();
        assert!(
            text.contains(
                r#""at-once":{"text":"title = \"x\""},"later":{"text":"title = \"x\"","from_ms":5}"#
            ),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<Wish>(&text).unwrap(), wish);
        assert_eq!(wish.playlists["later"].file().bytes, 11);
    }

    #[test]
    fn what_shall_come_shall_not_go_and_the_last_word_counts() {
        let mut wish = wish("{}").unwrap();
        wish.want_cue("storm", &WishedCue { sha256: "0".repeat(DIGITS), bytes: 1 });
        wish.want_playlist("today", &WishedPlaylist { text: String::new(), from_ms: 0 });
        wish.drop_cue("storm");
        wish.drop_playlist("today");
        let text = serde_json::to_string(&wish).unwrap();
        assert_eq!(
            text,
            r#"{"to":"berlin.h3","rev":7,"cues":{},"drops":{"cues":["storm"],"playlists":["today"]}}"#
        );
        let of = |body: &str| Wish::of(&Letter::sign(&new_letter_key(), body.to_owned()).unwrap());
        assert_eq!(of(&text).unwrap(), wish);
        let both = r#""playlists":{"today":{"text":""}},"drops""#;
        assert!(of(&text.replace(r#""drops""#, both)).unwrap_err().contains("shall come and go"));
        wish.want_cue("storm", &WishedCue { sha256: "0".repeat(DIGITS), bytes: 1 });
        wish.want_playlist("today", &WishedPlaylist { text: String::new(), from_ms: 0 });
        assert!(wish.drops.is_empty() && wish.cues.len() == 1 && wish.playlists.len() == 1);
    }

    #[test]
    fn an_order_is_no_wish_and_a_wish_is_no_order() {
        let pair = new_letter_key();
        let order = r#"{"id":"1","to":"a.b","word":"load","args":{},"sent_ms":5}"#;
        assert!(Wish::of(&Letter::sign(&pair, order.to_owned()).unwrap()).is_err());
        let wish = r#"{"to":"a.b","rev":5,"cues":{}}"#;
        assert!(super::super::Order::of(&Letter::sign(&pair, wish.to_owned()).unwrap()).is_err());
    }

    #[test]
    fn the_last_message_of_a_cue_is_as_long_as_what_is_left() {
        let of = |bytes| WishedCue { sha256: String::new(), bytes };
        assert_eq!([1, CHUNK, CHUNK + 1].map(|bytes| of(bytes).chunks()), [1, 1, 2]);
        assert_eq!([0, 1, 2].map(|n| of(CHUNK + 5).chunk_len(n)), [CHUNK, 5, 0]);
        assert_eq!(of(u64::MAX).chunk_len(u64::MAX), 0);
    }

    #[test]
    fn a_wish_names_no_more_than_a_hall_answers_for() {
        let drops = |count: usize| {
            let ids: Vec<_> = (0..count).map(|n| format!("\"{n}\"")).collect();
            wish(&format!("{{}},\"drops\":{{\"cues\":[{}]}}", ids.join(",")))
        };
        assert_eq!(drops(MOST_NAMED).unwrap().drops.cues.len(), MOST_NAMED);
        let why = drops(MOST_NAMED + 1).unwrap_err();
        assert_eq!(why, "it names 1001 cues and playlists, more than 1000");
    }

    proptest! {
        #[test]
        fn whatever_comes_for_a_wish_is_no_reason_to_end(body in ".{0,200}") {
            let letter = Letter { key: String::new(), sig: String::new(), body };
            let _ = Wish::of(&letter);
        }
    }
}
