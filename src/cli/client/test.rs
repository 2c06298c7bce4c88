//! `kinocue test`: seats moved and effects switched one by one, with a table of how that was acked.

use std::io::IsTerminal as _;

use anyhow::{Context as _, anyhow};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use super::events::Events;
use super::http::block_on;
use super::rows::parse_rows;
use super::server::ServerArgs;
use super::view::us;
use crate::cli::ask::agreed;
use crate::cli::table::table;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::control::{Status, TestRow, TestStatus};

/// Tests empty seats and their effects.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kinocue test sweep --rows A-B")]
pub(in crate::cli) struct Args {
    #[command(subcommand)]
    what: TestedPart,
}

#[derive(Debug, clap::Subcommand)]
enum TestedPart {
    Sweep(TestSweep),
}

/// Slowly moves each axis of empty, armed seats in turn, switches each effect, and ends with a table of acks and latency.
///
/// The daemon keeps the table. Ctrl-C parks the seats.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue test sweep
  kinocue test sweep --rows A-B
  kinocue test sweep --rows A,B --seats-empty --json

Exit codes: 0 all passed, 1 something failed, 75 the hall is not armed")]
struct TestSweep {
    /// The rows to test: A, or A,C, or A-C [default: all].
    #[arg(long, value_name = "ROWS")]
    rows: Option<String>,
    /// Confirm that nobody sits on the seats and nothing lies on or under them; do not ask.
    #[arg(long)]
    seats_empty: bool,
    #[command(flatten)]
    server: ServerArgs,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let TestedPart::Sweep(TestSweep { rows, seats_empty, server }) = &args.what;
    let rows =
        rows.as_deref().map(parse_rows).transpose().map_err(anyhow::Error::msg).or_exit(Exit::Usage)?;
    let rows = rows.unwrap_or_default();
    let which =
        if rows.is_empty() { "All seats".to_owned() } else { format!("The seats of {}", rows.join(", ")) };
    let question =
        format!("{which} will move, one axis after the other. Are they empty, and is nobody near them?");
    if !agreed(&question, *seats_empty, "--seats-empty")? {
        print::tell("nothing was moved");
        return Ok(Exit::Done);
    }
    // The JSON is that of the result.
    let mut quiet = server.clone();
    quiet.json = false;
    let begun = quiet.post("/api/v1/test", &json!({ "rows": rows }))?;
    quiet.tell(&begun);
    let result = follow(&quiet, begun)?;
    if server.json {
        print::json_text(&result.json)?;
    } else {
        print::out(&text(&result.test))?;
    }
    let failed = result.test.rows.iter().filter(|row| !row.passed).count();
    let TestStatus { done, total, step, .. } = &result.test;
    print::tell(&format!("kinocue: test {step}: {done} of {total} axes and effects, {failed} failed"));
    Ok(if failed == 0 && done == total { Exit::Done } else { Exit::CheckFailed })
}

/// A test that is over.
struct TestOutcome {
    test: TestStatus,
    /// The same as the daemon wrote it.
    json: String,
}

/// Waits for the end of the test, with progress on a terminal.
fn follow(server: &ServerArgs, begun: Status) -> Result<TestOutcome, Failure> {
    let bar = std::io::stderr().is_terminal().then(|| {
        let style =
            ProgressStyle::with_template("{msg} [{wide_bar}] {pos} of {len}").expect("the template is fixed");
        ProgressBar::new(begun.test.map_or(0, |test| test.total as u64))
            .with_style(style.progress_chars("=> "))
    });
    let outcome = block_on(async {
        let ended = listen(server, bar.as_ref());
        tokio::pin!(ended);
        tokio::select! {
            outcome = &mut ended => outcome,
            Ok(()) = tokio::signal::ctrl_c() => {
                print::tell("kinocue: parking the seats; Ctrl-C again ends this command at once");
                server.post_now("/api/v1/show/park", &json!({})).await?;
                tokio::select! {
                    outcome = &mut ended => outcome,
                    Ok(()) = tokio::signal::ctrl_c() => Err(anyhow!("ended by Ctrl-C")).or_exit(Exit::Interrupted),
                }
            }
        }
    });
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    outcome
}

async fn listen(server: &ServerArgs, bar: Option<&ProgressBar>) -> Result<TestOutcome, Failure> {
    let mut events = Events::open(&server.socket()?).await?;
    loop {
        let gone = |why| anyhow!("the daemon is gone: {why}; check the seats, then `kinocue status`");
        // While it says nothing there is nothing to show; the test may well go on.
        let Some(data) = events.next().await.map_err(gone).or_exit(Exit::Unavailable)? else { continue };
        let Ok(status) = serde_json::from_str::<Status>(&data) else { continue };
        if status == Status::default() {
            continue;
        }
        let test = status.test.context("the daemon has no result of the test").or_exit(Exit::Internal)?;
        if !test.running {
            let whole: serde_json::Value = serde_json::from_str(&data).or_exit(Exit::Internal)?;
            return Ok(TestOutcome { test, json: whole["test"].to_string() });
        }
        if let Some(bar) = bar {
            bar.set_length(test.total as u64);
            bar.set_position(test.done as u64);
            bar.set_message(test.step);
        }
    }
}

fn text(test: &TestStatus) -> String {
    let row = |row: &TestRow| {
        let TestRow { controller, part, asked, acked, p50_us, p99_us, passed } = row;
        let passed = if *passed { "ok" } else { "FAIL" };
        [controller, part, &asked.to_string(), &acked.to_string(), &us(*p50_us), &us(*p99_us), passed]
            .map(String::from)
    };
    table(["controller", "part", "asked", "acked", "p50 µs", "p99 µs", ""], test.rows.iter().map(row))
}
