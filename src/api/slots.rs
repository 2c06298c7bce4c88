//! Room for so many connections and no more, and for so many of one address, so that nobody shuts the others out.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Room for connections.
#[derive(Debug, Clone)]
pub(super) struct Slots {
    most: usize,
    most_of_one: usize,
    taken: Arc<Mutex<Taken>>,
}

#[derive(Debug, Default)]
struct Taken {
    all: usize,
    by_address: HashMap<IpAddr, usize>,
}

/// A place, free again when it is dropped.
#[derive(Debug)]
pub(super) struct Slot {
    taken: Arc<Mutex<Taken>>,
    address: Option<IpAddr>,
}

impl Slots {
    /// For at most `most` connections, and `most_of_one` of an address.
    pub(super) fn new(most: usize, most_of_one: usize) -> Self {
        Self { most, most_of_one, taken: Arc::default() }
    }

    /// A place, where there is one.
    pub(super) fn take(&self, address: Option<IpAddr>) -> Option<Slot> {
        let mut taken = lock(&self.taken);
        if taken.all >= self.most {
            return None;
        }
        if let Some(address) = address {
            let of_one = taken.by_address.entry(address).or_default();
            if *of_one >= self.most_of_one {
                return None;
            }
            *of_one += 1;
        }
        taken.all += 1;
        drop(taken);
        Some(Slot { taken: Arc::clone(&self.taken), address })
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let mut taken = lock(&self.taken);
        taken.all -= 1;
        if let Some(address) = self.address
            && let Some(of_one) = taken.by_address.get_mut(&address)
        {
            *of_one -= 1;
            if *of_one == 0 {
                taken.by_address.remove(&address);
            }
        }
    }
}

fn lock(taken: &Mutex<Taken>) -> MutexGuard<'_, Taken> {
    taken.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    fn from(last: u8) -> Option<IpAddr> {
        Some(Ipv4Addr::new(10, 0, 0, last).into())
    }

    #[test]
    fn no_more_than_there_is_room_for_and_no_more_of_one() {
        let slots = Slots::new(3, 2);
        let held = [slots.take(from(1)).unwrap(), slots.take(from(1)).unwrap()];
        assert!(slots.take(from(1)).is_none(), "two of one address");
        let other = slots.take(from(2)).unwrap();
        assert!(slots.take(from(3)).is_none(), "three in all");
        drop(other);
        assert!(slots.take(None).is_some());
        drop(held);
        assert!(slots.take(from(1)).is_some());
        assert!(lock(&slots.taken).by_address.is_empty(), "nothing is kept of who has gone");
    }
}
