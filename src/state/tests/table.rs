//! The table of docs/states.md, drawn from what the machine does.

use std::fmt::Write as _;

use super::*;

const EVENTS: [(&str, Event); 20] = [
    ("identified, at park", Event::Identified(PARKED)),
    ("identified, elsewhere", Event::Identified(Finding { at_park: false, ..PARKED })),
    ("rebooted", Event::Rebooted(0)),
    ("not ready", Event::Readiness(Readiness::NotProved)),
    ("homed", Event::Homed),
    ("join begun", Event::JoinBegun),
    ("joined", Event::Joined),
    ("late", Event::Late),
    ("film leads", Event::FilmLeads),
    ("film awaited", Event::FilmAwaited(HoldCause::Apart)),
    ("film over", Event::FilmOver(ParkCause::FilmEnded)),
    ("cue ended", Event::CueEnded),
    ("at rest", Event::AtRest),
    ("parked", Event::Parked),
    ("policy: pause", Event::Policy(Demand::Pause, 0)),
    ("policy: park", Event::Policy(Demand::Park, 0)),
    ("asleep for 3 s", Event::Slept(Duration::from_secs(3))),
    ("asleep for 6 min", Event::Slept(Duration::from_mins(6))),
    ("trouble", Event::Trouble(Trouble::Limiter)),
    ("emergency stop", Event::EmergencyStop(0)),
];

/// A cell: the state after a step, a dot where it stays, a dash where the step is refused.
fn cell(from: State, step: Step) -> String {
    let mut hall = hall(from);
    match take(&mut hall, step, s(1)) {
        Err(_) => "-".to_owned(),
        Ok(()) if hall.state() == from => "·".to_owned(),
        Ok(()) => hall.state().to_string(),
    }
}

fn lapse(from: State) -> String {
    let mut hall = hall(from);
    let Some(end) = hall.lapses() else { return "·".to_owned() };
    hall.tick(end);
    format!("{} after {} s", hall.state(), end.since(s(0)).as_secs())
}

fn table() -> String {
    let mut rows: Vec<(String, Vec<String>)> = Vec::new();
    let mut row = |head: String, cell: &dyn Fn(State) -> String| {
        rows.push((head, State::ALL.into_iter().map(cell).collect()));
    };
    for request in Transition::ALL {
        row(format!("**{request}**"), &|state| cell(state, Step::Command(request)));
    }
    for (name, event) in EVENTS {
        row(name.to_owned(), &|state| cell(state, Step::Tell(event)));
    }
    row("its time is over".to_owned(), &lapse);
    row("motion frames".to_owned(), &|state| if state.may_send_motion() { "yes" } else { "no" }.to_owned());

    let mut text = format!("|  | {} |\n", State::ALL.map(State::word).join(" | "));
    writeln!(text, "|{}", "---|".repeat(1 + State::ALL.len())).unwrap();
    for (head, cells) in rows {
        writeln!(text, "| {head} | {} |", cells.join(" | ")).unwrap();
    }
    text
}

#[test]
fn the_documented_table_is_what_the_machine_does() {
    let page = include_str!("../../../docs/states.md");
    let table = table();
    assert!(page.contains(&table), "docs/states.md should have this table:\n{table}");
}
