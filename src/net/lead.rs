//! Until when this machine may send to the controllers of a hall that has two. Whoever is promised more moves it on; it is compared before
//! each datagram, whatever thread sends that, as the last thing before the kernel gets it.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::time::MonoTime;

/// The end of a lead: a reading of the monotonic clock. Before the first promise, and once it is over, nothing leaves.
#[derive(Debug, Default)]
pub struct Lead(AtomicU64);

impl Lead {
    /// Until when.
    #[must_use]
    pub(crate) fn until(&self) -> MonoTime {
        MonoTime::from_nanos(self.0.load(Ordering::Relaxed))
    }

    /// It lasts until then at least. A later end that was promised before stays.
    pub fn extend(&self, until: MonoTime) {
        self.0.fetch_max(until.as_nanos(), Ordering::Relaxed);
    }

    /// True if nothing may leave any more at `now`.
    #[must_use]
    pub(crate) fn is_over(&self, now: MonoTime) -> bool {
        now >= self.until()
    }
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;
    use std::sync::Arc;
    use std::time::Duration;

    use super::*;
    use crate::net::{Delivery, Ports, SendFault};
    use crate::sys::clock::Monotonic;
    use crate::time::Clock as _;

    #[test]
    fn a_lead_lasts_until_the_latest_promise() {
        let (lead, at) = (Lead::default(), MonoTime::from_nanos);
        assert!(lead.is_over(at(0)), "nobody promised anything");
        lead.extend(at(10));
        lead.extend(at(5));
        assert!(!lead.is_over(at(9)) && lead.is_over(at(10)));
    }

    #[test]
    fn nothing_leaves_once_the_lead_is_over_whoever_sends_and_without_one_it_never_is() {
        let peer = UdpSocket::bind("127.0.0.1:0").unwrap();
        peer.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let address = peer.local_addr().unwrap().to_string().parse().unwrap();
        let (sender, _receiver) = Ports::open("127.0.0.1:0".parse().unwrap(), &[address]).unwrap().split();
        let lead = Arc::<Lead>::default();
        let led = sender.clone().led_by(Some(Arc::clone(&lead)));
        let reads = led.clone();
        for one in [&led, &reads] {
            assert_eq!(one.send(0, b"no"), Delivery::Failed(SendFault::NOT_LEADING));
        }
        lead.extend(Monotonic.now() + Duration::from_secs(60));
        assert_eq!(reads.send(0, b"led"), Delivery::Sent);
        assert_eq!(sender.send(0, b"alone"), Delivery::Sent);
        let mut buf = [0; 16];
        for text in [&b"led"[..], b"alone"] {
            let len = peer.recv(&mut buf).unwrap();
            assert_eq!(&buf[..len], text);
        }
        assert!(SendFault::NOT_LEADING.to_string().contains("the other show machine"));
    }
}
