//! Families of drives behind one seam: poses into datagrams (`Lane`, tick thread), what a running hall needs of a controller into
//! requests, and what it answers into evidence (`Peer`, ack thread). Pure: told the time, handed what came and given a way to
//! send; allocates nothing once the lanes are made.
//!
//! Whoever takes the evidence knows no register, and no family another one.

mod lane;
mod lanes;
pub(crate) mod link;
mod mbox;
pub(crate) mod rates;
mod rounds;
mod segments;
pub(crate) mod silvermax;
pub(crate) mod sixpack2;
mod stream;
pub(crate) mod terms;

pub use lane::Lane;
pub(crate) use lane::Stamped;
pub use lanes::Manner;
pub(crate) use lanes::lanes;
pub(crate) use rounds::{EVERY_LED, Rounds};
pub(crate) use segments::{
    DriveCourse, DriveUnits, Knots, LOOP, Lag, Middle, Middles, Motor, Segment, SegmentFit, Shaker, TICK_NS,
    TargetMaker,
};
pub(crate) use stream::{LinkStream, motors_of, units_of};

use std::sync::Arc;

use crate::belief::{Fall, Reading};
use crate::config::{ALL_OUTPUTS, Controller};
use crate::health::{Pushed, Sighting};
use crate::motion::Pulses;
use crate::observe::Look;
use crate::time::MonoTime;
use crate::wire::{FrameNo, FromController, PerAxis, ReplyCode};

/// The other end of a lane: one controller. A variant for each family, matched and never boxed.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "one for each controller, made once")]
pub(crate) enum Peer {
    /// SMC, IMAX and MBOX controllers.
    Mbox(mbox::MboxPeer),
    /// Drives on a serial link, whose thread asks them by itself.
    Link(link::LinkPeer),
}

/// What is wanted of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    /// What it is, whether it was reset, how it stands with an emergency stop; and where its seat is.
    Identity,
    /// How many datagrams it has received.
    Count,
    /// Where all of its axes are.
    Position,
    /// A sign of life, one thing of what it tells at a time; also whether it knows its zero where frames lead it.
    KeepAlive {
        /// Frames go there.
        is_led: bool,
    },
    /// That it is dark and still, and to be read so: outputs by a register, since no frame can switch them off that does not move it.
    Dark,
}

/// A frame on its way, as far as it leaves something on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SentFrame {
    /// Its number.
    pub(crate) frame: FrameNo,
    /// It switches outputs on.
    pub(crate) lights: bool,
    /// The greatest amplitude of vibration that it asks for, strokes.
    pub(crate) shakes: f64,
    /// The instant before it was sent.
    pub(crate) at: MonoTime,
}

/// What may be on at a controller, asked for or not. Unknown counts as on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LeftOn {
    /// Its outputs may be on.
    pub outputs: bool,
    /// Its outputs when it told them last, bit 0 = Y01; none where it never did.
    pub told: Option<u16>,
    /// The amplitude with which its seat may vibrate, strokes.
    pub(crate) shakes: f64,
    /// Something was sent, or told, that says so; else nobody knows.
    pub(crate) is_known: bool,
}

impl LeftOn {
    /// True if anything may be.
    #[must_use]
    pub(crate) fn is_any(&self) -> bool {
        self.outputs || self.vibrates()
    }

    /// The outputs that may be on, all where it did not say which; none where they are off.
    #[must_use]
    pub(crate) fn outputs_in_words(&self) -> Option<String> {
        let told = self.told.filter(|told| *told != 0).unwrap_or(ALL_OUTPUTS);
        let on = (0..12).filter(|bit| told >> bit & 1 == 1).map(|bit| format!("Y{:02}", bit + 1));
        let names =
            || if told == ALL_OUTPUTS { "Y01 to Y12".to_owned() } else { on.collect::<Vec<_>>().join(" ") };
        self.outputs.then(names)
    }

    /// True if its seat may vibrate.
    #[must_use]
    pub(crate) fn vibrates(&self) -> bool {
        self.shakes > 0.0
    }
}

/// A message of a controller that is no reply to a frame.
#[derive(Debug, Clone, Copy)]
pub struct Incoming<'a> {
    /// What it is.
    pub(crate) message: FromController<'a>,
    /// When the kernel received it.
    pub(crate) at: MonoTime,
    /// Another thread asks as well: it may be the answer to that.
    pub(crate) others_ask: bool,
}

/// What an answer of a controller says.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "the ack thread does not allocate")]
pub(crate) enum Evidence {
    /// It has answered something.
    Answered,
    /// It lives: it has answered what is asked for to know that.
    Alive,
    /// Its seat was read.
    Position(Whereabouts),
    /// Whether it knows its zero, asked for alone.
    Homed(bool),
    /// How many datagrams it has received, round after 65,535.
    Count(u16),
    /// The same, as part of a look: what was sent and acked until now is what that count is held against, whenever the rest has come.
    Counted,
    /// Its outputs, bit 0 = Y01.
    Outputs(u16),
    /// It speaks in a way that nobody here can read.
    Unreadable,
    /// It drives so many axes (PA02), which are not those that its frames lead.
    OtherAxes(u16),
    /// What it is.
    Seen(Seen),
    /// The reply code of its answer.
    Code(ReplyCode),
    /// What all of a look says of an emergency stop.
    Stop(Look),
    /// A drive let go of its motor: the axis, from 1, and by what.
    Killed {
        /// The axis, from 1.
        axis: usize,
        /// The bits of what killed.
        cause: u16,
    },
    /// It has restarted, or let go of its seat: it does not know its zero any more.
    LostZero,
    /// It stopped by itself, or is elsewhere than it was led: nothing leads it before it was looked at.
    Fell(Fall),
}

/// Evidence of one message; room for all of it is made at the start.
pub(crate) type EvidenceList = Vec<Evidence>;

/// The most that one message is evidence of.
pub(crate) const MOST_EVIDENCE: usize = 9;

/// Where the seat of a controller is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Whereabouts {
    /// All of it; none while an axis that tells its position has not.
    pub(crate) reading: Option<Reading>,
    /// What this answer tells by itself, of however many axes.
    pub(crate) passing: Option<Reading>,
    /// Its axes from the first on, as far as it told them.
    pub(crate) told: Option<PerAxis<Pulses>>,
    /// An axis, from 0, that is not inside its stroke, and where it says that it is.
    pub(crate) outside: Option<(usize, Pulses)>,
    /// An axis that something has pushed off where its drive holds it, too far to be led from there.
    pub(crate) pushed: Option<Pushed>,
    /// Its positions make two places of each, and nothing tells which is true.
    pub(crate) is_ambiguous: bool,
    /// It is read elsewhere than at park, by more than noise.
    pub(crate) is_off_park: bool,
}

/// A controller that was looked at, and its seat then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    /// What it is.
    pub(crate) sighting: Sighting,
    /// Its seat was found in the same place more than once.
    pub(crate) rests: bool,
    /// Its seat vibrates about one place, and does nothing else.
    pub(crate) sways: bool,
    /// It stands at park, to a pulse.
    pub(crate) at_park: bool,
}

impl Peer {
    /// The controller to which a lane sends.
    pub(crate) fn new(controller: &Controller, lane: &Lane) -> Self {
        match controller.on_network() {
            Some(station) => Self::Mbox(mbox::MboxPeer::new(&station, lane)),
            None => Self::Link(link::LinkPeer::new(controller, lane)),
        }
    }

    /// Asks for what is needed by `send`, which says whether the kernel took a datagram; gives how many it took.
    pub(crate) fn poll(&mut self, need: Need, now: MonoTime, send: &mut dyn FnMut(&[u8]) -> bool) -> u32 {
        match self {
            Self::Mbox(peer) => peer.poll(need, now, send),
            Self::Link(peer) => peer.poll(need, now),
        }
    }

    /// Takes a message: puts into `out` of what it is evidence, which is nothing where it answers nothing.
    pub(crate) fn receive(&mut self, arrival: Incoming<'_>, out: &mut EvidenceList) {
        match self {
            Self::Mbox(peer) => peer.receive(arrival, out),
            Self::Link(_) => {}
        }
    }

    /// Takes what the thread of its link tells; as [`Self::receive`].
    pub(crate) fn hear(&mut self, event: &link::StreamEvent, now: MonoTime, out: &mut EvidenceList) {
        match self {
            Self::Mbox(_) => {}
            Self::Link(peer) => peer.hear(event, now, out),
        }
    }

    /// What is wanted of it by that thread; none where there is none.
    pub(crate) fn wants(&self) -> Option<Arc<link::LaneWants>> {
        match self {
            Self::Mbox(_) => None,
            Self::Link(peer) => Some(peer.wants()),
        }
    }

    /// Takes the reply code of a frame; says whether it is a refusal of that frame, and not how the controller is.
    pub(crate) fn on_reply_code(&mut self, code: ReplyCode) -> bool {
        match self {
            Self::Mbox(peer) => peer.on_reply_code(code),
            Self::Link(_) => false,
        }
    }

    /// Takes what a controller reported unasked of where its axes are; none where its family has no such reports.
    pub(crate) fn on_report(
        &mut self,
        positions: &[Pulses],
        outputs: Option<u16>,
        at: MonoTime,
    ) -> Option<Whereabouts> {
        match self {
            Self::Mbox(peer) => Some(peer.on_report(positions, outputs, at)),
            Self::Link(_) => None,
        }
    }

    /// A frame went to it.
    pub(crate) fn on_sent(&mut self, sent: &SentFrame) {
        match self {
            Self::Mbox(peer) => peer.on_sent(sent),
            Self::Link(peer) => peer.on_sent(sent.at),
        }
    }

    /// It has acked a frame.
    pub(crate) fn on_ack(&mut self, acked: FrameNo) {
        if let Self::Mbox(peer) = self {
            peer.on_ack(acked);
        }
    }

    /// What may be on there. Drives on a link have no outputs, and vibrate by the poses alone that their thread is given.
    pub(crate) fn left_on(&self) -> LeftOn {
        match self {
            Self::Mbox(peer) => peer.on.left_on(),
            Self::Link(_) => LeftOn::default(),
        }
    }

    /// No frame goes to it any more, and its seat may vibrate on by so much, strokes.
    pub(crate) fn on_cut_off(&mut self, shakes: f64) {
        match self {
            Self::Mbox(peer) => peer.on_cut_off(shakes),
            Self::Link(_) => {}
        }
    }

    /// It is home, as it was asked to be.
    pub(crate) fn on_homed(&mut self) {
        match self {
            Self::Mbox(peer) => peer.position.on_homed(),
            Self::Link(_) => {}
        }
    }

    /// True if it leaves so much unanswered that it is not to be asked again yet while frames flow.
    pub(crate) fn is_behind(&mut self, now: MonoTime) -> bool {
        match self {
            Self::Mbox(peer) => peer.pending.is_full(now),
            Self::Link(_) => false,
        }
    }
}
