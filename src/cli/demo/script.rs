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
use crate::control::{Code, Command, Handle, Problem, Role, Severity, Status, Surface, Who};
use crate::state::State;

/// How long the virtual controllers have to tell that they are parked; they take a moment.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long virtual drives have to find their zeros.
const HOMING: Duration = Duration::from_secs(90);

/// By then they know their positions.
const ARM: Command = Command::Arm { seats_empty: false };

/// The thread.
pub(super) struct Script(JoinHandle<Result<(), Problem>>);

/// What is to be done.
pub(super) struct DemoShow {
    /// The seats have to be homed first.
    pub(super) needs_home: bool,
    /// What loads what is played.
    pub(super) load: Command,
}

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
        show: DemoShow,
    ) -> io::Result<Self> {
        let leave = Arc::clone(&signals.leave);
        let start = || {
            let runtime = runtime::Builder::new_current_thread().enable_time().build()?;
            let seen = handle.watch();
            let run = move || {
                runtime.block_on(async {
                    let led = lead(&handle, &signals, &screen, console.as_deref(), show);
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
    show: DemoShow,
) -> Result<(), Problem> {
    let led = ride(handle, screen, show).await;
    if signals.is_leaving() {
        // Whatever was not done, a person wanted the end.
        return Ok(());
    }
    match (console, led) {
        (Some(console), led) => {
            if let Err(problem) = led {
                screen.tell(&format!("kinocue: {problem}"));
            }
            screen.tell(&format!("the console stays up: arm and go again there; Ctrl-C ends: {console}"));
            Ok(())
        }
        (None, led) => {
            signals.leave.store(true, Ordering::Release);
            led
        }
    }
}

/// Has what that loads played, and waits until the seats rest again.
async fn ride(handle: &Handle, screen: &Screen, show: DemoShow) -> Result<(), Problem> {
    if show.needs_home && home(handle, screen).await?.is_none() {
        return Ok(());
    }
    if within(PATIENCE, handle, State::Parked).await?.is_none() {
        return Ok(());
    }
    for ask in [show.load, Command::Preflight, ARM, Command::Go] {
        handle.ask(demo(), ask).await.inspect_err(|_| tell_findings(&handle.status(), screen))?;
    }
    let resting = [State::Parked, State::Stopped, State::Fault, State::Recovering];
    let _ = reach(handle, |status| resting.iter().any(|state| status.state == *state)).await; // gone, it is at rest as well
    Ok(())
}

/// Whatever keeps the seats from being armed.
fn tell_findings(status: &Status, screen: &Screen) {
    let findings = status.preflight.iter().flat_map(|preflight| &preflight.findings);
    for finding in findings.filter(|finding| finding.severity == Severity::Error) {
        let who = finding.controller.as_deref().unwrap_or("hall");
        screen.tell(&format!("{who}: {}; {}", finding.text, finding.remedy));
    }
}

/// Homes the seats, as a person does; nothing where the hall is gone meanwhile.
async fn home(handle: &Handle, screen: &Screen) -> Result<Option<()>, Problem> {
    if within(PATIENCE, handle, State::Recovering).await?.is_none() {
        return Ok(None);
    }
    screen.tell(
        "drives do not know their position until they are homed. With real seats a person first makes sure that nobody sits on them, \
         then homes them; here the demo does both",
    );
    handle.ask(demo(), Command::Home).await?;
    within(HOMING, handle, State::Parked).await
}

fn demo() -> Who {
    Who { role: Role::Engineer, surface: Surface::Program, name: "demo".to_owned() }
}

/// Waits until the hall is in a state; nothing where it is gone meanwhile.
async fn within(patience: Duration, handle: &Handle, state: State) -> Result<Option<()>, Problem> {
    let over = [state, State::Fault];
    let reached = reach(handle, |status| over.iter().any(|state| status.state == *state));
    match tokio::time::timeout(patience, reached).await {
        Ok(Err(Gone)) => Ok(None),
        Ok(Ok(())) if handle.status().state == state => Ok(Some(())),
        _ => Err(late(patience, &handle.status(), state)),
    }
}

async fn reach(handle: &Handle, is_there: impl Fn(&Status) -> bool) -> Result<(), Gone> {
    handle.watch().wait_for(|status| is_there(status)).await.map(drop).map_err(|_| Gone)
}

fn late(patience: Duration, status: &Status, state: State) -> Problem {
    let detail = format!(
        "within {} s the hall is {}, not {state}: {}",
        patience.as_secs(),
        status.state,
        status.cause
    );
    Problem::new(Code::Timeout, detail, "is this machine under heavy load?")
}
