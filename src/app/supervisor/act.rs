//! What the features of the supervisor are told, and the acts that they have done for it. They do nothing themselves: the
//! supervisor's loop does one act after the other, and one that the tick thread has to answer holds up those behind it.

use jiff::Zoned;

use super::hall::{Counted, HallContext, ShowChange};
use super::job::{Job, JobResult};
use crate::app::player::PlayerAsk;
use crate::control::{Desired, Problem, Surface};
use crate::journal::PlaylistPlace;
use crate::log::Line;
use crate::rt::{Command as TickCommand, Order, Row};
use crate::state::{State, Transition};

/// What happens to the hall.
#[derive(Debug)]
pub(super) enum SupervisorEvent<'e> {
    /// Somebody asks that, and it is about to be done.
    Asked(&'e Desired),
    /// It was done.
    Done(&'e Desired),
    /// The hall is in another state.
    Entered(State),
    /// A show has begun.
    Begun(&'e ShowBegun),
    /// How the controllers stand, ten times a second.
    Round(&'e [Row]),
    /// What the wall clock says, as often as anything happens.
    Clock(&'e Zoned),
    /// Somebody wants the program to end; told again until it has.
    Leaving,
}

/// A show that has begun.
#[derive(Debug)]
pub(super) struct ShowBegun {
    /// Who let it go.
    pub(super) who: String,
    /// By which surface.
    pub(super) surface: Surface,
    /// What was counted before.
    pub(super) counted: Counted,
    /// Where it is in the playlist, where it is of one.
    pub(super) place: Option<PlaylistPlace>,
}

/// What the supervisor's loop does for a feature. What is asked is answered once all acts for it are done.
#[derive(Debug)]
pub(super) enum Act {
    /// Gives the tick thread a command.
    Tick(TickCommand),
    /// Changes what is loaded or set, and has the tick thread take up the show made of it; what it does not take is changed back.
    Stage(ShowChange),
    /// Drops the cue.
    Unload,
    /// A failure from here on has these done.
    Otherwise(Vec<Self>),
    /// Fails.
    Fail(Problem),
    /// Says what all of it is, for the note of a failure.
    Name(String),
    /// Fails where somebody has to be buckled before the seats move.
    CheckBelts,
    /// Lets the show go, or go on that another machine led.
    Go {
        /// By a GO, or by RESUME.
        by: Transition,
        /// For whom.
        who: String,
        /// By which surface.
        surface: Surface,
    },
    /// The hall is armed for a start of that group by the fleet.
    ArmedFor(String),
    /// A start could not be given to the tick thread.
    DropStart,
    /// Has what is loaded begin at its beginning again, where it does not play.
    RewindStart,
    /// The show goes.
    Begin(Box<ShowBegun>),
    /// Tells the tick thread whether a show can be armed, where that has changed.
    TellReadiness,
    /// Waits until a stop is seen in the state.
    AwaitStop,
    /// Begins slow work. What was asked is answered when it is done.
    Start(Job),
    /// It is over: something else that is slow may begin.
    EndJob,
    /// Takes what it came to.
    Take(JobResult),
    /// Makes ready for the next show: the one before is over, or the seats were brought to park between shows.
    EndShow,
    /// A test of the seats is over, and why; what was loaded before is back.
    EndTest(&'static str),
    /// Asks it of the player, and waits for nothing.
    Player(PlayerAsk),
    /// Tells the ack thread.
    Order(Order),
    /// Has the hall opened with the configuration as it is now.
    Reload,
    /// Notes what no state says, for the log and the warnings.
    Note(String),
    /// The same of what is over once the next show has begun.
    Passing(String),
    /// Writes a line of the log.
    Log(Line),
    /// Adds to the record of the show that is under way.
    Record(String),
}

/// A part of the supervisor that owns what it has to know, and is told what happens.
pub(super) trait Feature {
    /// Takes an event, and adds what is to be done for it.
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, out: &mut Vec<Act>);
}
