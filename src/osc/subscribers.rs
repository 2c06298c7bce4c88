//! Who gets feedback, and for how long.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use super::feedback::Said;
use super::order::OscFault;
use crate::time::MonoTime;

/// Receivers at the most.
const MOST: usize = 16;

/// A receiver of feedback.
#[derive(Debug)]
pub(super) struct Subscriber {
    pub(super) to: SocketAddrV4,
    /// What it has been told.
    pub(super) said: Said,
    until: MonoTime,
}

/// All of them.
#[derive(Debug, Default)]
pub(super) struct Subscribers(Vec<Subscriber>);

impl Subscribers {
    /// Takes one in, or renews it, for so many seconds; 0 takes it out.
    pub(super) fn subscribe(
        &mut self,
        to: SocketAddrV4,
        seconds: u16,
        now: MonoTime,
    ) -> Result<(), OscFault> {
        let until = now + Duration::from_secs(u64::from(seconds));
        self.lapse(now);
        if seconds == 0 {
            self.0.retain(|one| one.to != to);
        } else if let Some(one) = self.0.iter_mut().find(|one| one.to == to) {
            one.until = until;
        } else if self.0.len() == MOST {
            return Err(OscFault::Crowded(MOST));
        } else {
            self.0.push(Subscriber { to, said: Said::default(), until });
        }
        Ok(())
    }

    /// Those whose time has not run out.
    pub(super) fn present(&mut self, now: MonoTime) -> impl Iterator<Item = &mut Subscriber> {
        self.lapse(now);
        self.0.iter_mut()
    }

    /// Where those of a machine listen.
    pub(super) fn of(&self, ip: Ipv4Addr) -> Vec<SocketAddrV4> {
        self.0.iter().map(|one| one.to).filter(|to| *to.ip() == ip).collect()
    }

    fn lapse(&mut self, now: MonoTime) {
        self.0.retain(|one| one.until > now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: u64) -> MonoTime {
        MonoTime::from_nanos(seconds * 1_000_000_000)
    }

    fn to(port: u16) -> SocketAddrV4 {
        SocketAddrV4::new(Ipv4Addr::LOCALHOST, port)
    }

    #[test]
    fn a_subscription_lapses_unless_it_is_renewed() {
        let mut subscribers = Subscribers::default();
        subscribers.subscribe(to(1), 10, at(0)).unwrap();
        subscribers.subscribe(to(2), 10, at(0)).unwrap();
        subscribers.subscribe(to(1), 10, at(9)).unwrap();
        let left: Vec<_> = subscribers.present(at(10)).map(|one| one.to).collect();
        assert_eq!(left, [to(1)]);
        subscribers.subscribe(to(1), 0, at(11)).unwrap();
        assert_eq!(subscribers.present(at(11)).count(), 0);
    }

    #[test]
    fn there_is_an_end_to_how_many_are_served_and_who_lapses_makes_room() {
        let mut subscribers = Subscribers::default();
        for port in 1..=16 {
            subscribers.subscribe(to(port), if port == 1 { 10 } else { 100 }, at(0)).unwrap();
        }
        assert_eq!(subscribers.subscribe(to(17), 10, at(9)), Err(OscFault::Crowded(16)));
        assert_eq!(subscribers.subscribe(to(16), 10, at(9)), Ok(()), "it is one of them");
        assert_eq!(subscribers.subscribe(to(17), 10, at(10)), Ok(()), "the first has lapsed");
        assert_eq!(subscribers.of(Ipv4Addr::LOCALHOST).len(), 16);
        assert_eq!(subscribers.of(Ipv4Addr::new(10, 0, 0, 1)), []);
    }
}
