//! The JSON schemas of messages that viewers draw.

use serde_json::{Value, json};

use super::ack_record::standing_words;
use crate::state::State;

/// Viewers take one type a property, never null, arrays of scalars, and `oneOf` only to name numbers.
pub(super) fn schema(title: &str, always: &[(&str, Value)], at_times: &[(&str, Value)]) -> Value {
    let required: Vec<&str> = always.iter().map(|(name, _)| *name).collect();
    let all = always.iter().chain(at_times);
    let properties: serde_json::Map<String, Value> =
        all.map(|(name, kind)| ((*name).to_owned(), kind.clone())).collect();
    json!({"title": title, "type": "object", "required": required, "properties": properties})
}

pub(super) fn schema_of_seat() -> Value {
    let [number, count] = [json!({"type": "number"}), json!({"type": "integer"})];
    let places = json!({"type": "array", "items": {"type": "number"}});
    let standings =
        (0..).zip(standing_words()).map(|(at, word): (u8, _)| json!({"title": word, "const": at}));
    schema(
        "kinocue.seat",
        &[
            ("film_s", number.clone()),
            ("asked_mm", places.clone()),
            ("sent_mm", places.clone()),
            ("level", number.clone()),
            ("sent", count.clone()),
            ("unsent", count.clone()),
            ("clamps", count.clone()),
            ("measured_mm", places),
            ("acked", count.clone()),
            ("refused", count.clone()),
            ("lost", count),
        ],
        &[
            ("ack_us", number.clone()),
            ("ack_max_us", number),
            ("standing", json!({"type": "integer", "oneOf": standings.collect::<Vec<_>>()})),
        ],
    )
}

pub(super) fn schema_of_tick() -> Value {
    let [number, count] = [json!({"type": "number"}), json!({"type": "integer"})];
    schema(
        "kinocue.tick",
        &[
            ("film_s", number.clone()),
            ("late_us", number.clone()),
            ("late_max_us", number),
            ("ticks", count.clone()),
            ("missed", count.clone()),
            ("dropped", count),
        ],
        &[],
    )
}

/// A state by number.
pub(super) fn state_schema() -> Value {
    let named = State::ALL.map(|state| json!({"title": state.word(), "const": state_number(state)}));
    json!({"type": "integer", "oneOf": named})
}

/// A state as viewers have it: a number that the schema names.
pub(crate) fn state_number(state: State) -> usize {
    State::ALL.iter().position(|one| *one == state).unwrap_or_default()
}
