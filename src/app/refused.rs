//! Why a play does not begin, in words.

use std::path::{Path, PathBuf};

use super::runtime::RuntimeError;
use crate::config::Misfit;
use crate::cue::{CueFaults, Place};
use crate::plain;
use crate::plan::PlanError;
use crate::proof::Violation;

/// Why nothing was played. Nothing has moved then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlayError {
    /// The hall cannot do what the cue asks; each with its place in the file.
    #[error("{}", list(cue, misfits))]
    Misfit {
        /// The cue's file.
        cue: PathBuf,
        /// Where the file asks for what.
        misfits: Vec<(Place, Misfit)>,
    },
    /// The cue leaves the stroke of some seats.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Stroke(Vec<CueFaults>),
    /// The cue breaks limits of the seats, the effects or the controllers.
    #[error("{}", broken(cue, violations, *more, *chases))]
    Limits {
        /// The cue's file.
        cue: PathBuf,
        /// What is broken, each with its place in the file.
        violations: Vec<Violation>,
        /// How many more there are.
        more: u64,
        /// At the paces that a film may ask for.
        chases: bool,
    },
    /// No move leads onto the cue.
    #[error(transparent)]
    Plan(PlanError),
    /// The frame port cannot be had, or no thread.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// These controllers answer nothing: all there are, or some of a play that needs all.
    #[error(
        "{}: nobody answers, so nothing is played; check address, power, cable, PA15 and PA20 to PA24, of drives baud and number, \
         and ask `kinocue preflight`. Controllers that cannot answer are played to with --no-acks",
        .0.join(", ")
    )]
    Silent(Vec<String>),
    /// Somebody else sends to these controllers, so many datagrams within about a second.
    #[error("{}; end the other sender: another kinocue, player or tool", others(.0))]
    OtherMaster(Vec<(String, u16)>),
    /// Seats that were to be held did not all tell, just before the first frame, that they stand where they are held.
    #[error("{}: cannot be held, as no reading confirmed that the seat is still where it was; try again", .0.join(", "))]
    Unsure(Vec<String>),
    /// Seats that move though nothing was sent to them from here.
    #[error(
        "{}: moves, though nothing was sent to it from here: another machine drives it, or it is being homed; nothing was sent",
        .0.join(", ")
    )]
    Moving(Vec<String>),
    /// Controllers that drive other axes than their seats have: name, what they drive, what the seat has.
    #[error("{}; nothing was sent", axes(.0))]
    Axes(Vec<(String, u16, usize)>),
    /// Controllers that answer in another layout than that of our frames.
    #[error(
        "{}: answers as the IMAX manual prints (registers of 32 bits), and would take each frame for another position and time; nothing \
         was sent. Leave it out, and send a capture (`kinocue decode --dialect imax`) to the maintainers of this program",
        .0.join(", ")
    )]
    Foreign(Vec<String>),
    /// Seats that do not tell where all of their axes are, and cannot be known to have come to park.
    #[error(
        "{}: does not report the positions of all its axes, and cannot be brought to park for certain: it does not ack, or its longest \
         Time (PA0b, max_interval_ms) is too short for the stroke; home it, and try again",
        .0.join(", ")
    )]
    Unplaced(Vec<String>),
    /// Seats whose drives do not tell that they are home.
    #[error(
        "{}: does not report that it is home; nothing was sent. `kinocue home` homes it once the seat is empty, and `kinocue preflight` \
         says what else is wrong",
        .0.join(", ")
    )]
    NotHome(Vec<String>),
    /// Seats with a rotary axis that do not tell where it is: a frame that is slow enough from anywhere there is not.
    #[error(
        "{}: has a rotary axis, and does not report the positions of all its axes; nothing was sent, as no frame is slow enough from \
         anywhere. Play with acks to a controller that answers",
        .0.join(", ")
    )]
    UnknownTurn(Vec<String>),
}

fn others(found: &[(String, u16)]) -> String {
    let one = |(name, more): &(String, u16)| {
        format!("{name} got {more} datagrams (DP34) that were not sent from here")
    };
    found.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn axes(found: &[(String, u16, usize)]) -> String {
    let one = |(name, drives, axes): &(String, u16, usize)| {
        format!(
            "{name} works with {drives} axes (PA02), but its seat here has {axes}: give it axes={drives} and a cue for as many (--to), \
             a seat type of {drives} (--config), or set PA02 = {axes} if it has the motors"
        )
    };
    found.iter().map(one).collect::<Vec<_>>().join("\n")
}

fn list(cue: &Path, misfits: &[(Place, Misfit)]) -> String {
    let line = |(place, misfit): &(Place, Misfit)| format!("{}:{place}{misfit}", plain::path(cue));
    misfits.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn broken(cue: &Path, violations: &[Violation], more: u64, chases: bool) -> String {
    let chase = if chases { " --chase" } else { "" };
    let (cue, shell) = (plain::path(cue), plain::shell(cue));
    let mut text: String = violations.iter().map(|violation| format!("{cue}:{violation}\n")).collect();
    if more > 0 {
        text += &format!("{cue}: and {more} more\n");
    }
    text + &format!(
        "the limits proof failed, so nothing is played; `kinocue fit {shell} -o OUT{chase}` makes a cue that keeps the limits"
    )
}
