//! Room for so many connections of a surface. There is always room for one more: whoever has not shown who it is goes first,
//! so that neither idle connections nor half of a request keep a stop out; and before all one who has so many that others could
//! not come.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

/// One who has a larger part of all places than this, and more than some, leaves before strangers: a stop comes by a new connection,
/// which is a stranger's until it was read.
const LARGEST_PART: usize = 8;
const SOME: usize = 8;

/// Room for connections.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    most: usize,
    taken: Arc<Mutex<Vec<Taken>>>,
}

/// A place, free again when it is dropped.
#[derive(Debug)]
pub(crate) struct Place {
    taken: Arc<Mutex<Vec<Taken>>>,
    leave: Arc<Notify>,
}

/// A place that is taken; the one that was heard last is the last of all.
#[derive(Debug)]
struct Taken {
    by: Guest,
    leave: Arc<Notify>,
}

/// Whose a place is.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Guest {
    /// Somebody of that network, who has shown nothing yet.
    Stranger(Option<IpAddr>),
    /// One who has shown who it is.
    Known(String),
}

impl Places {
    /// For at most `most` connections.
    #[must_use]
    pub(crate) fn new(most: usize) -> Self {
        Self { most, taken: Arc::default() }
    }

    /// A place for a connection from that address, and whether another one has to leave for it.
    ///
    /// Strangers leave before those who are known, unless one of these has very many; of all that may, one of whoever has the most,
    /// the one that was silent longest.
    #[must_use]
    pub(crate) fn take(&self, address: Option<IpAddr>) -> (Place, bool) {
        let mut taken = lock(&self.taken);
        let crowded = taken.len() >= self.most;
        if let Some(index) = if crowded { first_to_go(&taken, self.most) } else { None } {
            taken.remove(index).leave.notify_one();
        }
        let leave = Arc::<Notify>::default();
        taken.push(Taken { by: Guest::Stranger(address.map(network)), leave: Arc::clone(&leave) });
        (Place { taken: Arc::clone(&self.taken), leave }, crowded)
    }
}

impl Place {
    /// Says who has it, as has been shown just now.
    pub(crate) fn show(&self, who: &str) {
        let mut taken = lock(&self.taken);
        if let Some(index) = taken.iter().position(|one| Arc::ptr_eq(&one.leave, &self.leave)) {
            let mut mine = taken.remove(index);
            mine.by = Guest::Known(who.to_owned());
            taken.push(mine);
        }
    }

    /// Waits until it has to be left; for good, where it never has to.
    pub(crate) async fn leave(&self) {
        self.leave.notified().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        lock(&self.taken).retain(|one| !Arc::ptr_eq(&one.leave, &self.leave));
    }
}

fn first_to_go(taken: &[Taken], all: usize) -> Option<usize> {
    let mut places = HashMap::<&Guest, usize>::new();
    taken.iter().for_each(|one| *places.entry(&one.by).or_default() += 1);
    let crowds = |guest: &Guest| places[guest] > SOME.max(all / LARGEST_PART);
    let rank = |guest: &Guest| match guest {
        Guest::Known(_) => 2 * u8::from(crowds(guest)),
        Guest::Stranger(_) => 1,
    };
    let most = places.keys().map(|guest| (rank(guest), places[guest])).max()?;
    taken.iter().position(|one| (rank(&one.by), places[&one.by]) == most)
}

/// What one machine can take another address of at will: the whole /64 of IPv6.
#[must_use]
pub(crate) fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(v6) => {
            let [a, b, c, d, ..] = v6.segments();
            Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0).into()
        }
        v4 => v4,
    }
}

/// What is behind a lock is whole at any time, also where a thread that held it panicked.
fn lock(taken: &Mutex<Vec<Taken>>) -> MutexGuard<'_, Vec<Taken>> {
    taken.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;
    use std::pin::pin;
    use std::task::{Context, Waker};

    use super::*;

    fn v4(last: u8) -> Option<IpAddr> {
        Some(Ipv4Addr::new(10, 0, 0, last).into())
    }

    fn has_to_leave(place: &Place) -> bool {
        pin!(place.leave()).poll(&mut Context::from_waker(Waker::noop())).is_ready()
    }

    #[test]
    fn the_stranger_that_is_silent_longest_makes_room_and_who_is_known_stays() {
        let places = Places::new(3);
        let [booth, first, second] = [0, 1, 2].map(|_| places.take(v4(1)).0);
        booth.show("booth");
        let (third, crowded) = places.take(v4(1));
        assert!(crowded);
        assert_eq!([&booth, &first, &second, &third].map(has_to_leave), [false, true, false, false]);
        drop(first);
        assert!(places.take(v4(1)).1, "it has left already, and gives nothing back twice");
        assert!(has_to_leave(&second));
    }

    #[test]
    fn of_several_networks_the_one_with_the_most_makes_room() {
        let places = Places::new(4);
        let lone = places.take(v4(1)).0;
        let many: Vec<Place> = (0..3).map(|_| places.take(v4(2)).0).collect();
        let newest: Vec<Place> = (0..2).map(|_| places.take(v4(2)).0).collect();
        assert!(!has_to_leave(&lone), "though it is the oldest of all");
        assert_eq!(many.iter().map(has_to_leave).collect::<Vec<_>>(), [true, true, false]);
        assert!(!newest.iter().any(has_to_leave));
    }

    #[test]
    fn many_addresses_of_one_network_are_one() {
        let places = Places::new(4);
        let lone = places.take(v4(1)).0;
        let address = |last| Some(Ipv6Addr::new(0xfd00, 0, 0, 1, 0, 0, 0, last).into());
        let _many: Vec<Place> = (0..5).map(|last| places.take(address(last)).0).collect();
        assert!(!has_to_leave(&lone));
    }

    #[test]
    fn one_who_is_known_and_fills_all_places_makes_room_for_a_stop_that_is_a_strangers_until_it_is_read() {
        let places = Places::new(64);
        let operator = places.take(v4(1)).0;
        operator.show("tablet");
        let viewers: Vec<Place> = (0..63)
            .map(|_| {
                let place = places.take(v4(2)).0;
                place.show("viewer");
                place
            })
            .collect();
        let stop = places.take(v4(1)).0;
        let _next = places.take(v4(2)).0;
        assert!(!has_to_leave(&stop) && !has_to_leave(&operator), "one viewer is enough");
        assert_eq!(viewers.iter().map(has_to_leave).filter(|leaves| *leaves).count(), 2);
    }

    #[test]
    fn where_all_are_known_one_of_whoever_has_the_most_goes() {
        let places = Places::new(3);
        let taken = ["booth", "guest", "guest"].map(|who| {
            let place = places.take(v4(1)).0;
            place.show(who);
            place
        });
        let _stop = places.take(v4(9));
        assert_eq!(taken.each_ref().map(has_to_leave), [false, true, false]);
    }
}
