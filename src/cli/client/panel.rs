//! The hall as a few lines of a terminal that are drawn over and over.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::view::{next_start, percent, time, us};
use crate::control::{ControllerStatus, Health, ShowStatus, Status, Warning};
use crate::plain;

/// Controllers and warnings that are shown one by one at the most.
const FEW: usize = 6;
/// How wide the film is drawn, columns.
const FILM: usize = 40;

/// The lines.
pub(super) struct WatchPanel {
    bar: ProgressBar,
    /// What was shown last.
    last: String,
}

impl WatchPanel {
    /// Takes over the lower end of the terminal on standard output.
    pub(super) fn new() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout());
        bar.set_style(ProgressStyle::with_template("{msg}").expect("the template is fixed"));
        Self { bar, last: String::new() }
    }

    /// Shows the hall as it is.
    pub(super) fn show(&mut self, status: &Status) {
        self.draw(&text(status));
    }

    /// Shows these lines.
    pub(super) fn draw(&mut self, text: &str) {
        self.last = plain::lines(text).into_owned();
        self.bar.set_message(self.last.clone());
        self.bar.tick();
    }

    /// Says that what is shown is what was.
    pub(super) fn gone(&mut self, why: &str) {
        self.bar.set_message(format!("!! {why}\n\nlast known:\n{}", self.last));
        self.bar.tick();
    }
}

/// What the panel says.
fn text(status: &Status) -> String {
    let mut lines = vec![
        format!("{}  {}", status.state.to_string().to_uppercase(), status.cause),
        format!("next: {}", status.next),
        status.show.as_ref().map_or_else(|| "nothing is loaded".to_owned(), film),
        status.mix(),
    ];
    lines.extend(next_start(status).map(|at| format!("starts by itself at {at}")));
    if let Some(test) = status.test.as_ref().filter(|test| test.running) {
        lines.push(format!("test: {} ({} of {})", test.step, test.done, test.total));
    }
    lines.push(format!(
        "{} ticks, {} missed; lateness p99 {} µs; acks p99 {} µs",
        status.ticks,
        status.missed_ticks,
        us(status.lateness.percentiles.p99_us),
        us(status.ack_latency.percentiles.p99_us)
    ));
    lines.extend(controllers(&status.controllers));
    lines.extend(few(status.warnings.iter().map(Warning::line).collect()));
    lines.join("\n")
}

fn film(show: &ShowStatus) -> String {
    let part = if show.length_s > 0.0 { (show.position_s / show.length_s).clamp(0.0, 1.0) } else { 0.0 };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is 0 to the width")]
    #[expect(clippy::cast_precision_loss, reason = "the width is small")]
    let done = (part * FILM as f64) as usize;
    let drawn = format!("{}{}", "=".repeat(done), " ".repeat(FILM - done));
    format!("{}  [{drawn}]  {} of {}", show.cue, time(show.position_s), time(show.length_s))
}

/// How many are well, and those that are not.
fn controllers(all: &[ControllerStatus]) -> Vec<String> {
    let is_well = |one: &&ControllerStatus| one.health == Health::Ok && one.enabled;
    let part = all.iter().filter(|one| !one.is_out_for_good()).count();
    let mut lines = vec![format!("{} of {part} controllers ok", all.iter().filter(is_well).count())];
    let ill = all.iter().filter(|one| !is_well(one)).map(|one| {
        let acks = one.ack_rate.map_or_else(String::new, |rate| format!(", acks {}", percent(rate)));
        format!("  {} {}{acks}  {}", one.name, one.stands(), one.why)
    });
    lines.extend(few(ill.collect()));
    lines
}

/// The first few, and how many more there are.
fn few(mut lines: Vec<String>) -> Vec<String> {
    let more = lines.len().saturating_sub(FEW);
    lines.truncate(FEW);
    if more > 0 {
        lines.push(format!("  and {more} more: kinocue status"));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_panel_names_who_is_not_well_and_no_more_than_a_few() {
        let lost = |n: u32| ControllerStatus {
            name: format!("A{n}"),
            health: Health::Lost,
            enabled: true,
            ..<_>::default()
        };
        let mut controllers: Vec<ControllerStatus> = (0..9).map(lost).collect();
        controllers.push(ControllerStatus {
            name: "B1".into(),
            health: Health::Ok,
            enabled: true,
            ..<_>::default()
        });
        let show = ShowStatus { cue: "c".into(), length_s: 100.0, position_s: 50.0, ..ShowStatus::default() };
        let text = text(&Status { controllers, show: Some(show), ..Status::default() });
        assert!(text.contains("1 of 10 controllers ok\n  A0 lost"), "{text}");
        assert!(text.ends_with("  and 3 more: kinocue status"), "{text}");
        assert!(text.contains(&format!("[{}{}]  00:50.000", "=".repeat(20), " ".repeat(20))), "{text}");
    }

    #[test]
    fn a_film_without_length_or_past_its_end_can_be_drawn() {
        for (length_s, position_s) in [(0.0, 5.0), (10.0, 50.0), (10.0, -5.0), (f64::NAN, 1.0)] {
            assert!(!film(&ShowStatus { length_s, position_s, ..ShowStatus::default() }).is_empty());
        }
    }
}
