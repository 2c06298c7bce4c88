//! Who runs the demo: asks of the hall what an operator would, as any surface asks it, and sees the ride to its end. A thread
//! of its own.

use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use tokio::runtime;

use super::screen::Screen;
use crate::app::supervisor::SystemSignals;
use crate::control::{Code, Command, Handle, Problem, Role, Status, Surface, Who};
use crate::state::State;

/// How long the virtual controllers have to tell that they are parked; they take a moment.
const PATIENCE: Duration = Duration::from_secs(20);

/// Controllers of its own know their positions.
const ARM: Command = Command::Arm { seats_empty: false };

/// The thread.
pub(super) struct Script(JoinHandle<Result<(), Problem>>);

/// The hall is no more.
struct Gone;

impl Script {
    /// Begins. With a console to go on with, the hall stays when the ride is over; else it ends then, by `signals`.
    ///
    /// # Errors
    /// If the system starts no further thread; the hall ends then.
    pub(super) fn start(
        handle: Handle,
        signals: SystemSignals,
        screen: Screen,
        console: Option<String>,
        load: Command,
    ) -> io::Result<Self> {
        let leave = Arc::clone(&signals.leave);
        let start = || {
            let runtime = runtime::Builder::new_current_thread().enable_time().build()?;
            let seen = handle.watch();
            let run = move || {
                runtime.block_on(async {
                    let led = lead(&handle, &signals, &screen, console.as_deref(), load);
                    tokio::join!(led, screen.follow(seen)).0
                })
            };
            Builder::new().name("script".to_owned()).spawn(run)
        };
        // Nobody would end it.
        start().map(Self).inspect_err(|_| leave.store(true, Ordering::Release))
    }

    /// Waits until it has seen the end of the hall, and says what was not done.
    pub(super) fn finish(self) -> Result<(), Problem> {
        self.0.join().expect("the script does not panic")
    }
}

async fn lead(
    handle: &Handle,
    signals: &SystemSignals,
    screen: &Screen,
    console: Option<&str>,
    load: Command,
) -> Result<(), Problem> {
    let led = ride(handle, load).await;
    if signals.is_leaving() {
        // Whatever was not done, a person wanted the end.
        return Ok(());
    }
    match (console, led) {
        (Some(console), led) => {
            if let Err(problem) = led {
                screen.tell(&format!("kinocue: {problem}"));
            }
            screen.tell(&format!("the console stays up; arm and go again there, Ctrl-C ends: {console}"));
            Ok(())
        }
        (None, led) => {
            signals.leave.store(true, Ordering::Release);
            led
        }
    }
}

/// Has what that loads played, and waits until the seats rest again.
async fn ride(handle: &Handle, load: Command) -> Result<(), Problem> {
    let who = Who { role: Role::Operate, surface: Surface::Program, name: "demo".to_owned() };
    let parked = reach(handle, |status| status.state == State::Parked);
    match tokio::time::timeout(PATIENCE, parked).await {
        Ok(Ok(())) => {}
        Ok(Err(Gone)) => return Ok(()),
        Err(_) => return Err(not_parked(&handle.status())),
    }
    for ask in [load, Command::Preflight, ARM, Command::Go] {
        handle.ask(who.clone(), ask).await?;
    }
    let resting = [State::Parked, State::Stopped, State::Fault, State::Recovering];
    let _ = reach(handle, |status| resting.iter().any(|state| status.state == *state)).await; // gone, it is at rest as well
    Ok(())
}

async fn reach(handle: &Handle, is_there: impl Fn(&Status) -> bool) -> Result<(), Gone> {
    handle.watch().wait_for(|status| is_there(status)).await.map(drop).map_err(|_| Gone)
}

fn not_parked(status: &Status) -> Problem {
    let detail =
        format!("after {} s the hall is {}, not parked: {}", PATIENCE.as_secs(), status.state, status.cause);
    Problem::new(Code::Timeout, detail, "is this machine under heavy load?")
}
