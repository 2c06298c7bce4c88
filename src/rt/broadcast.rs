//! The network whose controllers may get one datagram together: who is in it, whether that may be now, and how often it was. The ack
//! thread permits it and takes it back, the tick thread asks before each datagram, and whoever looks reads; nobody waits. A permit is as
//! old as the question that it rests on: it is none for what began after that, nor for longer than [`FRESH`], whoever has stopped asking.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::config::Config;
use crate::published::SharedWord;
use crate::time::MonoTime;
use crate::wire::Code;

/// How long who answered a question is taken for who is there.
pub(crate) const FRESH: Duration = Duration::from_secs(10);

/// The network.
#[derive(Debug)]
pub struct Broadcast {
    /// Its name.
    pub(crate) name: String,
    /// The lanes of its controllers, all of which take part at least in the configuration.
    pub(crate) lanes: Box<[usize]>,
    /// Whether a lane is one of them.
    members: Box<[bool]>,
    /// Who takes what goes to all, and answers where it asks.
    pub(crate) code: Code,
    permit: SharedWord,
    /// When the question went out that the newest permit rests on, ns.
    asked: SharedWord,
    /// When frames were last not to leave as one, because the hall was not on the cue or a lane was out, ns. Tick thread.
    rested: SharedWord,
    /// Ticks whose frames left as one datagram, and as one for each.
    together: AtomicU64,
    apart: AtomicU64,
    /// Why they were apart last.
    why: SharedWord,
}

/// Whether one datagram may go to all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Permit {
    /// Nobody has looked who answers.
    #[default]
    Unasked,
    /// All and nobody else answered when that was asked last, each once, and take part since.
    Given,
    /// That controller does not take part.
    Out(usize),
    /// That controller did not answer.
    Silent(usize),
    /// That controller is none of the network, and answered: for good.
    Foreign(usize),
    /// Somebody else did: for good.
    Stranger(SocketAddrV4),
    /// Two answered as that controller: for good.
    Twice(usize),
    /// A controller of the network is out for good, and would take frames all the same.
    Absent,
    /// No frame asks for a reply, so that nobody would know who takes it.
    NoAcks,
}

/// Why the frames of a tick left one by one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Apart {
    /// The permit is missing, or older than what it would be for.
    NoPermit(Permit),
    /// No frame of this tick goes to that lane, or one of its own.
    Out(usize),
    /// That lane's frame is not the others'.
    Differs(usize),
}

const KIND: u32 = 48;
/// Above the kind of a permit.
const WHY: u32 = 56;

impl Permit {
    fn word(self) -> u64 {
        let of = |kind: u64, who: u64| kind << KIND | who;
        match self {
            Self::Unasked => 0,
            Self::Given => of(1, 0),
            Self::Out(lane) => of(2, lane as u64),
            Self::Silent(lane) => of(3, lane as u64),
            Self::Foreign(lane) => of(4, lane as u64),
            Self::Stranger(at) => of(5, u64::from(at.ip().to_bits()) << 16 | u64::from(at.port())),
            Self::Absent => of(6, 0),
            Self::NoAcks => of(7, 0),
            Self::Twice(lane) => of(8, lane as u64),
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "what was put together is taken apart")]
    fn of_word(word: u64) -> Self {
        let who = word & ((1 << KIND) - 1);
        let lane = who as usize;
        match word >> KIND {
            1 => Self::Given,
            2 => Self::Out(lane),
            3 => Self::Silent(lane),
            4 => Self::Foreign(lane),
            5 => Self::Stranger(SocketAddrV4::new(Ipv4Addr::from_bits((who >> 16) as u32), who as u16)),
            6 => Self::Absent,
            7 => Self::NoAcks,
            8 => Self::Twice(lane),
            _ => Self::Unasked,
        }
    }

    /// True if nothing changes it any more.
    pub(crate) const fn is_final(self) -> bool {
        matches!(self, Self::Foreign(_) | Self::Stranger(_) | Self::Twice(_) | Self::Absent | Self::NoAcks)
    }
}

impl Broadcast {
    /// That of a configuration; none where it has none. `silent` says that no frame asks for a reply.
    pub(crate) fn of(config: &Config, silent: bool) -> Option<Self> {
        let network = config.broadcast.as_ref()?;
        let place = |name: &String| config.controllers.iter().position(|one| one.name == *name);
        let lanes: Box<[usize]> = network.members.iter().filter_map(place).collect();
        let permit = SharedWord::default();
        if lanes.len() < network.members.len() {
            permit.put(Permit::Absent.word());
        } else if silent {
            permit.put(Permit::NoAcks.word());
        }
        Some(Self {
            name: network.name.clone(),
            members: (0..config.controllers.len()).map(|lane| lanes.contains(&lane)).collect(),
            lanes,
            code: network.accept,
            permit,
            asked: SharedWord::default(),
            rested: SharedWord::default(),
            together: AtomicU64::default(),
            apart: AtomicU64::default(),
            why: SharedWord::default(),
        })
    }

    /// That of all controllers of that configuration, by a code of its own, which may get one datagram whoever answers.
    #[must_use]
    #[cfg(feature = "harness")]
    pub(crate) fn permitted(mut config: Config) -> Option<Self> {
        let names: Vec<_> = config.controllers.iter().map(|one| one.name.as_str()).collect();
        config.broadcast = Some(crate::config::BroadcastNetwork::of_loopback(&names));
        let one = Self::of(&config, false)?;
        one.give(MonoTime::from_nanos(u64::MAX));
        Some(one)
    }

    /// Whether one datagram may go to all.
    #[must_use]
    #[cfg(feature = "harness")]
    pub fn is_permitted(&self) -> bool {
        self.permit() == Permit::Given
    }

    /// Whether a lane is one of it.
    pub(crate) fn has(&self, lane: usize) -> bool {
        self.members.get(lane).is_some_and(|has| *has)
    }

    /// Whether one datagram may go to all now.
    pub(crate) fn permit(&self) -> Permit {
        Permit::of_word(self.permit.get())
    }

    /// Whether one datagram may go to all in the tick that woke up then.
    pub(super) fn permits(&self, tick: MonoTime) -> bool {
        let rests = self.rested.get() >= tick.as_nanos();
        self.permit() == Permit::Given && !rests && !self.is_stale() && tick.since(self.asked()) <= FRESH
    }

    /// Whether the permit is older than what it would be for.
    pub(super) fn is_stale(&self) -> bool {
        self.asked.get() <= self.rested.get()
    }

    fn asked(&self) -> MonoTime {
        MonoTime::from_nanos(self.asked.get())
    }

    /// Frames are not to leave as one in the tick that woke up then, nor later before all have answered anew. Tick thread alone.
    pub(super) fn rest(&self, tick: MonoTime) {
        self.rested.put(tick.as_nanos());
    }

    /// Permits it, by who answered what was asked then. Ack thread alone.
    pub(super) fn give(&self, asked: MonoTime) {
        self.asked.put(asked.as_nanos());
        self.set(Permit::Given);
    }

    /// Takes the permit back, or says why there is none. What is final stays. Ack thread alone.
    pub(super) fn set(&self, permit: Permit) {
        if !self.permit().is_final() {
            self.permit.put(permit.word());
        }
    }

    /// Notes a tick whose frames left as one.
    pub(crate) fn on_together(&self) {
        self.together.fetch_add(1, Ordering::Relaxed);
    }

    /// Notes a tick whose frames left one by one.
    pub(crate) fn on_apart(&self, why: Apart) {
        self.apart.fetch_add(1, Ordering::Relaxed);
        let (kind, what) = match why {
            Apart::NoPermit(permit) => (1, permit.word()),
            Apart::Out(lane) => (2, lane as u64),
            Apart::Differs(lane) => (3, lane as u64),
        };
        self.why.put(kind << WHY | what);
    }

    /// Ticks whose frames left as one datagram, and as one for each.
    #[must_use]
    pub fn ticks(&self) -> [u64; 2] {
        [&self.together, &self.apart].map(|count| count.load(Ordering::Relaxed))
    }

    /// Why they were apart last; none where they never were.
    fn why_apart(&self) -> Option<Apart> {
        let word = self.why.get();
        let what = word & ((1 << WHY) - 1);
        let lane = what as usize;
        match word >> WHY {
            1 => Some(Apart::NoPermit(Permit::of_word(what))),
            2 => Some(Apart::Out(lane)),
            3 => Some(Apart::Differs(lane)),
            _ => None,
        }
    }

    /// Why frames left one by one last, in words; none where they never did. `name` has the names of lanes.
    pub(crate) fn last_apart(&self, name: impl Fn(usize) -> String) -> Option<String> {
        Some(match self.why_apart()? {
            Apart::NoPermit(permit) => {
                permit.words(name).unwrap_or_else(|| "who answers had not been asked since".to_owned())
            }
            Apart::Out(lane) => format!("{} got no frame, or one of its own", name(lane)),
            Apart::Differs(lane) => {
                format!("the frame of {} was another one than that of the others", name(lane))
            }
        })
    }
}

impl Permit {
    /// Why one datagram may not go to all, in words; none where it may. `name` has the names of lanes.
    pub(crate) fn words(self, name: impl Fn(usize) -> String) -> Option<String> {
        Some(match self {
            Self::Given => return None,
            Self::Unasked => "nobody has looked yet who answers a broadcast".to_owned(),
            Self::Out(lane) => format!("{} does not take part", name(lane)),
            Self::Silent(lane) => format!("{} does not answer a broadcast", name(lane)),
            Self::Foreign(lane) => {
                format!("{} is not of this network, and answers its broadcasts", name(lane))
            }
            Self::Stranger(at) => {
                format!("{at} is no controller that this hall plays, and answers its broadcasts")
            }
            Self::Twice(lane) => {
                format!("two answer as {}, or the network repeats what it carries", name(lane))
            }
            Self::Absent => "a controller of the network is disabled, or left out".to_owned(),
            Self::NoAcks => "no frame asks for an ack".to_owned(),
        })
    }

    /// What a person does about it; none where nothing is to be done.
    pub(crate) const fn remedy(self) -> Option<&'static str> {
        match self {
            Self::Foreign(_) | Self::Stranger(_) => Some(
                "it may move with the frames of others: find it, take it off this network or set its accept code (PA12, PA13) apart, and \
                 restart the service; until then each seat gets its own frames",
            ),
            Self::Twice(_) => Some(
                "two controllers with one address move as one: find the second, or what repeats datagrams, and restart the service; until \
                 then each seat gets its own frames",
            ),
            Self::Silent(_) => Some(
                "check that its mask is that of the network in [broadcast], its PA12 and PA13 its address, and PA15 not 0; until then \
                 each seat gets its own frames",
            ),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::from_to_args;

    /// Two controllers in a network that has as many as that.
    fn two(members: &[&str], silent: bool) -> Broadcast {
        let tos = ["127.0.0.1:7408".to_owned(), "127.0.0.2:7408".to_owned()];
        let mut config = from_to_args(&tos, &[], 3).unwrap();
        config.broadcast = Some(crate::config::BroadcastNetwork::of_loopback(members));
        Broadcast::of(&config, silent).unwrap()
    }

    #[test]
    fn every_permit_and_every_reason_is_read_as_it_was_written() {
        let stranger = "192.168.15.77:65535".parse().unwrap();
        for permit in [
            Permit::Unasked,
            Permit::Given,
            Permit::Out(3),
            Permit::Silent(399),
            Permit::Foreign(0),
            Permit::Stranger(stranger),
            Permit::Twice(7),
            Permit::Absent,
            Permit::NoAcks,
        ] {
            assert_eq!(Permit::of_word(permit.word()), permit);
        }
        let one = two(&["c1", "c2"], false);
        assert_eq!((one.ticks(), one.why_apart()), ([0, 0], None));
        for why in [Apart::NoPermit(Permit::Stranger(stranger)), Apart::Out(0), Apart::Differs(1)] {
            one.on_apart(why);
            assert_eq!(one.why_apart(), Some(why));
        }
        one.on_together();
        assert_eq!(one.ticks(), [1, 3]);
    }

    const fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn nothing_permits_again_what_somebody_else_or_two_with_one_address_have_answered() {
        for found in
            [Permit::Foreign(1), Permit::Twice(0), Permit::Stranger("10.0.0.9:7408".parse().unwrap())]
        {
            let one = two(&["c1", "c2"], false);
            one.give(ms(1));
            assert!(one.permits(ms(2)));
            one.set(found);
            one.give(ms(3));
            assert_eq!((one.permit(), one.permits(ms(4))), (found, false));
        }
    }

    #[test]
    fn a_permit_is_none_for_what_began_after_its_question_nor_once_that_is_ten_seconds_ago() {
        let one = two(&["c1", "c2"], false);
        assert!(!one.permits(ms(1)), "nobody was asked");
        one.give(ms(1_000));
        assert!(one.permits(ms(1_500)) && one.permits(ms(11_000)));
        assert!(!one.permits(ms(11_001)), "too long ago");
        one.rest(ms(2_000));
        assert!(!one.permits(ms(2_001)) && one.is_stale(), "it rested since");
        one.give(ms(2_500));
        assert!(one.permits(ms(3_000)) && !one.is_stale());
        one.rest(ms(3_000));
        assert!(!one.permits(ms(3_000)), "it rests in this very tick");
    }

    #[test]
    fn a_network_of_which_one_is_left_out_or_that_is_not_asked_for_acks_never_gets_one_datagram() {
        for (members, silent, permit) in
            [(&["c1", "c2", "c3"][..], false, Permit::Absent), (&["c1", "c2"], true, Permit::NoAcks)]
        {
            let one = two(members, silent);
            one.give(ms(1));
            assert_eq!(one.permit(), permit);
        }
        assert!(Broadcast::of(&from_to_args(&["127.0.0.1:1".to_owned()], &[], 3).unwrap(), false).is_none());
    }
}
