//! A play on one link, whatever its drives: the family is found out once, and homing is its own.

use std::time::Duration;

use rtrb::{Consumer, Producer};

use super::link::{
    LedPose, LinkPlay, LinkPort, LinkTalk as _, Stream, StreamEvent, StreamTerms, TalkTerms, canary,
};
use super::silvermax::{self, SilverMax};
use super::sixpack2::{self, Sixpack2};
use crate::config::drive::DriveFamily;
use crate::config::drive_controller::Motors;
use crate::config::{Controller, Drives, Link};

/// A play on one link. A variant for each family, matched and never boxed.
#[derive(Debug)]
pub(crate) enum LinkStream<P: LinkPort> {
    /// SilverMax units.
    SilverMax(Stream<SilverMax, P>),
    /// SIXpack 2 units.
    Sixpack2(Stream<Sixpack2, P>),
}

impl<P: LinkPort> LinkStream<P> {
    /// Over a port that is open, with lanes that are out until somebody has them looked at: the seats on that link that take part, and those
    /// that do not.
    ///
    /// # Errors
    /// Why its drives cannot be played to.
    pub(crate) fn new(
        port: P,
        (link, terms): (&Link, StreamTerms),
        (seats, absent): (&[&Controller], &[&Controller]),
        poses: Consumer<LedPose>,
        events: Producer<StreamEvent>,
    ) -> Result<Self, String> {
        let talk = TalkTerms::of(link);
        match link.family.ok_or(NO_DRIVES)? {
            DriveFamily::SilverMax => {
                let lanes = seats.iter().map(|seat| units_of(seat)).collect::<Option<Vec<_>>>();
                let (lanes, talk) = (lanes.ok_or(NO_DRIVES)?, silvermax::Talk::new(port, talk));
                let stream = Stream::new(talk, terms, &lanes, poses, events);
                stream.map(Self::SilverMax).map_err(|error| error.to_string())
            }
            DriveFamily::Sixpack2 => {
                let lanes =
                    seats.iter().map(|seat| motors_of(seat, terms.period)).collect::<Option<Vec<_>>>();
                let (lanes, talk) = (lanes.ok_or(NO_DRIVES)?, sixpack2::Talk::new(port, talk));
                let stream = Stream::<Sixpack2, P>::new(talk, terms, &lanes, poses, events);
                let mut stream = stream.map_err(|error| error.to_string())?;
                stream.stand_by(absent.iter().filter_map(|seat| motors_of(seat, terms.period)));
                Ok(Self::Sixpack2(stream))
            }
        }
    }

    /// What is asked of either.
    pub(crate) fn play(&mut self) -> &mut dyn LinkPlay {
        match self {
            Self::SilverMax(stream) => stream,
            Self::Sixpack2(stream) => stream,
        }
    }

    /// The port.
    pub(crate) fn port(&mut self) -> &mut P {
        match self {
            Self::SilverMax(stream) => stream.talk.port(),
            Self::Sixpack2(stream) => stream.talk.port(),
        }
    }

    /// Homes the seat of a lane while no lane moves, as long as it `goes_on`. Whatever came of it, the lane looks anew at its units.
    ///
    /// # Errors
    /// Why it is not home, with what to do.
    pub(crate) fn home(
        &mut self,
        lane: u16,
        (controller, terms): (&Controller, StreamTerms),
        goes_on: &dyn Fn() -> bool,
    ) -> Result<(), String> {
        let told = &mut |_| {};
        let homed = match self {
            Self::SilverMax(stream) => {
                let seat = units_of(controller).ok_or(NO_DRIVES)?;
                let canary = canary().map_err(|error| format!("no random number: {error}"))?;
                let homed =
                    silvermax::home(&mut stream.talk, seat, silvermax::Homing { canary, goes_on, told });
                homed.map(|canary| stream.rejoin(lane, canary)).map_err(|error| error.to_string())
            }
            Self::Sixpack2(stream) => {
                let seat = motors_of(controller, terms.period).ok_or(NO_DRIVES)?;
                let homed = stream.home_seat(lane, seat, sixpack2::Homing { goes_on, told });
                homed.map_err(|error| error.to_string())
            }
        };
        self.play().look(lane);
        homed
    }
}

const NO_DRIVES: &str = "it has no drives of that link";

/// The units that move a seat; none where others do.
pub(crate) fn units_of(controller: &Controller) -> Option<silvermax::SeatUnits<'_>> {
    let Drives { drive, motors: Motors::SilverMax(units), twins, .. } = controller.drives()? else {
        return None;
    };
    let silvermax = drive.silvermax.as_ref()?;
    let (name, seat) = (&controller.name, &controller.seat);
    Some(silvermax::SeatUnits { name, twins, seat, drive, silvermax, units })
}

/// The motors that move a seat, which are told something new in each period; none where others do.
pub(crate) fn motors_of(controller: &Controller, period: Duration) -> Option<sixpack2::SeatMotors<'_>> {
    let Drives { drive, motors: Motors::Sixpack2 { unit, motors }, twins, .. } = controller.drives()? else {
        return None;
    };
    let sixpack2 = drive.sixpack2.as_ref()?;
    let (name, seat) = (&controller.name, &controller.seat);
    Some(sixpack2::SeatMotors { name, twins, seat, drive, sixpack2, unit: *unit, motors, period })
}
