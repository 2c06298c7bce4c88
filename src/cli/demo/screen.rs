//! What is seen of the demo: the lines of the daemon's log, and on a terminal a bar beneath them.

use std::io::IsTerminal as _;
use std::sync::Arc;

use indicatif::{ProgressBar, ProgressStyle};
use tokio::sync::watch;

use crate::cli::print;
use crate::control::Status;
use crate::time::ShowTime;

/// Where it is seen. Clones share it.
#[derive(Debug, Clone)]
pub(super) struct Screen {
    /// `None` if the standard error output is no terminal.
    bar: Option<ProgressBar>,
}

impl Screen {
    /// The standard error output.
    pub(super) fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{msg} [{wide_bar}]\n{prefix}");
            let style = style.expect("the template is fixed").progress_chars("=> ");
            ProgressBar::new(1).with_style(style)
        });
        Self { bar }
    }

    /// Writes a line.
    pub(super) fn tell(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| print::tell(line)),
            None => print::tell(line),
        }
    }

    /// Shows each status as it comes, until there are no more.
    pub(super) async fn follow(&self, mut statuses: watch::Receiver<Arc<Status>>) {
        let Some(bar) = &self.bar else { return };
        while statuses.changed().await.is_ok() {
            let status = Arc::clone(&statuses.borrow_and_update());
            draw(bar, &status);
        }
        bar.finish_and_clear();
    }
}

fn draw(bar: &ProgressBar, status: &Status) {
    let Some(show) = &status.show else { return };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cue is never below 0, and hours long"
    )]
    let ms = |seconds: f64| (seconds.max(0.0) * 1e3) as u64;
    bar.set_length(ms(show.length_s));
    bar.set_position(ms(show.position_s).min(ms(show.length_s)));
    let time = |seconds: f64| ShowTime::from_secs_f64(seconds.min(show.length_s));
    bar.set_message(format!("{}: {} / {}", status.state, time(show.position_s), time(show.length_s)));
    bar.set_prefix(format!("next: {}; Ctrl-C parks, and ends", status.next));
}
