//! `kinocue record layout`.

use serde_json::json;

use super::super::{Exit, Failure, print};

/// Prints a Foxglove and Lichtblick layout for one seat: asked and sent positions, lateness and acks, what went wrong, states.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kinocue record layout --seat c1 > c1.json")]
pub(in super::super) struct Args {
    /// The seat.
    #[arg(long, value_name = "NAME")]
    seat: String,
    /// Number of its axes to draw.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=12))]
    axes: u8,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let seat = &args.seat;
    let topic = topic_of(seat);
    let path = |value: String| json!({"value": value, "enabled": true, "timestampMethod": "receiveTime"});
    let places =
        (0..args.axes).flat_map(|axis| ["asked", "sent"].map(|what| format!("{topic}.{what}_mm[{axis}]")));
    let plot = |title: String, paths: Vec<_>| {
        json!({
            "foxglovePanelTitle": title, "lichtblickPanelTitle": title, "paths": paths, "xAxisVal": "timestamp",
            "legendDisplay": "left", "sidebarDimension": 240,
        })
    };
    let of_seat = |what: &str| format!("{topic}.{what}");
    let late = ["/tick.late_max_us".to_owned(), of_seat("ack_max_us")];
    let wrong = ["clamps", "lost", "refused", "unsent"].map(of_seat);
    let states = ["/hall.state".to_owned(), of_seat("standing")]
        .map(|value| json!({"value": value, "timestampMethod": "receiveTime"}));
    print::json(&json!({
        "configById": {
            "Plot!p": plot(format!("{seat}, mm"), places.map(path).collect()),
            "Plot!t": plot("late, acks, µs".to_owned(), late.map(path).to_vec()),
            "Plot!w": plot("held back, lost, refused, not taken".to_owned(), wrong.map(path).to_vec()),
            "StateTransitions!s": {"paths": states},
        },
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {
            "direction": "column",
            "splitPercentage": 40,
            "first": "Plot!p",
            "second": {
                "direction": "column",
                "splitPercentage": 100.0 / 3.0,
                "first": "Plot!t",
                "second": {
                    "direction": "column",
                    "splitPercentage": 50,
                    "first": "Plot!w",
                    "second": "StateTransitions!s",
                },
            },
        },
    }))?;
    Ok(Exit::Done)
}

/// The topic of a seat as paths of viewers have it: quoted where its name has more than letters, digits, `-` and `_`.
fn topic_of(seat: &str) -> String {
    let topic = format!("/seat/{seat}");
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '/');
    if topic.chars().all(is_plain) {
        topic
    } else {
        format!("\"{}\"", topic.replace('\\', "\\\\").replace('"', "\\\""))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_no_path_can_have_is_quoted() {
        assert_eq!(topic_of("F4"), "/seat/F4");
        assert_eq!(topic_of("Row A.2"), r#""/seat/Row A.2""#);
        assert_eq!(topic_of(r#"a"b\c"#), r#""/seat/a\"b\\c""#);
    }
}
