//! Counts wrong tokens by address, so that guessing has to wait. A valid token never waits.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::control::network;
use crate::time::MonoTime;

/// Wrong tries of one address within [`WINDOW`]; after that it is told to wait.
const MOST: u32 = 5;
/// Counted from the first wrong try.
const WINDOW: Duration = Duration::from_secs(60);
/// Addresses that are remembered; of more the oldest are forgotten.
const ADDRESSES: usize = 1024;

/// Wrong tries so far.
#[derive(Debug, Default)]
pub(super) struct Tries(Mutex<HashMap<IpAddr, Wrong>>);

#[derive(Debug, Clone, Copy)]
struct Wrong {
    first: MonoTime,
    tries: u32,
}

impl Tries {
    /// How long that address is told to wait; `None` if it is not.
    pub(super) fn wait(&self, address: IpAddr, now: MonoTime) -> Option<Duration> {
        let table = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let wrong = table.get(&network(address)).filter(|wrong| wrong.tries >= MOST)?;
        WINDOW.checked_sub(now.since(wrong.first)).filter(|left| !left.is_zero())
    }

    /// Counts a wrong try.
    pub(super) fn count(&self, address: IpAddr, now: MonoTime) {
        let mut table = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let address = network(address);
        if table.len() >= ADDRESSES && !table.contains_key(&address) {
            table.retain(|_, wrong| now.since(wrong.first) < WINDOW);
            let oldest = table.iter().min_by_key(|(_, wrong)| wrong.first).map(|(&address, _)| address);
            if let Some(oldest) = oldest.filter(|_| table.len() >= ADDRESSES) {
                table.remove(&oldest);
            }
        }
        let wrong = table.entry(address).or_insert(Wrong { first: now, tries: 0 });
        if now.since(wrong.first) >= WINDOW {
            *wrong = Wrong { first: now, tries: 0 };
        }
        wrong.tries += 1;
    }
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, Ipv6Addr};

    use super::*;

    fn at(seconds: u64) -> MonoTime {
        MonoTime::from_nanos(0) + Duration::from_secs(seconds)
    }

    fn v4(last: u8) -> IpAddr {
        Ipv4Addr::new(10, 0, 0, last).into()
    }

    #[test]
    fn after_five_wrong_tries_an_address_waits_out_its_minute_and_the_others_do_not() {
        let tries = Tries::default();
        (0..5).for_each(|_| {
            assert_eq!(tries.wait(v4(1), at(100)), None);
            tries.count(v4(1), at(100));
        });
        assert_eq!(tries.wait(v4(1), at(130)), Some(Duration::from_secs(30)));
        assert_eq!(tries.wait(v4(2), at(130)), None);
        assert_eq!(tries.wait(v4(1), at(160)), None);
        tries.count(v4(1), at(160));
        assert_eq!(tries.wait(v4(1), at(160)), None, "the next minute has its own five");
    }

    #[test]
    fn a_machine_with_many_addresses_of_one_network_counts_as_one() {
        let tries = Tries::default();
        let address = |last| IpAddr::from(Ipv6Addr::new(0xfd00, 0, 0, 1, 0, 0, 0, last));
        (0..5).for_each(|last| tries.count(address(last), at(0)));
        assert!(tries.wait(address(9), at(1)).is_some());
    }

    #[test]
    fn many_addresses_do_not_fill_the_memory() {
        let tries = Tries::default();
        for n in 0..5000_u32 {
            tries.count(Ipv4Addr::from(n).into(), at(u64::from(n) / 100));
        }
        assert_eq!(tries.0.lock().unwrap().len(), ADDRESSES);
    }
}
