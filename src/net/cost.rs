//! What frames cost this machine: how long it takes to hand one to the kernel, and how many fit between two ticks. Measured, over
//! loopback, where whoever sends does the receiver's part as well: to a network card it is rather less.

use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::time::Duration;

use crate::time::{Clock, Rate};
use crate::wire::MAX_LEN;

/// Frames that are timed together, few enough for the buffer of a socket; and how often: the middlemost counts.
const BATCH: u32 = 16;
const BATCHES: usize = 25;
/// Share of the time between ticks that sending may take. The rest is for the engine, for replies, and for ticks that come late.
const MOST: f64 = 0.5;

/// What it takes to hand one frame to the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SendCost(pub(crate) Duration);

impl SendCost {
    /// Measures it, in a few milliseconds, by frames from this program to itself.
    ///
    /// # Errors
    /// If the system refuses a socket on loopback.
    pub(crate) fn measured(clock: &impl Clock) -> io::Result<Self> {
        let [from, to] =
            [UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?, UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?];
        from.connect(to.local_addr()?)?;
        to.set_nonblocking(true)?;
        let mut frame = [0; MAX_LEN];
        let mut costs = [Duration::ZERO; BATCHES];
        for cost in &mut costs {
            let began = clock.now();
            for _ in 0..BATCH {
                from.send(&frame)?;
            }
            *cost = clock.now().since(began) / BATCH;
            while to.recv(&mut frame).is_ok() {}
        }
        costs.sort();
        Ok(Self(costs[BATCHES / 2]))
    }

    /// The share of the time between ticks that frames to so many controllers take.
    #[expect(clippy::cast_precision_loss, reason = "some thousands")]
    pub(crate) fn share(self, controllers: usize, rate: Rate) -> f64 {
        self.0.as_secs_f64() * controllers as f64 * rate.hz()
    }

    /// What to do where they take too much of it; `None` where they do not.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of controllers")]
    pub(crate) fn remedy(self, controllers: usize, rate: Rate) -> Option<String> {
        let share = self.share(controllers, rate);
        (share > MOST).then(|| {
            let (hz, fit) = (rate.hz() * MOST / share, (MOST / self.share(1, rate)) as usize);
            format!(
                "set rate_hz to {hz:.0} or less, or drive no more than {fit} controllers from this machine"
            )
        })
    }

    /// In words.
    pub(crate) fn words(self, controllers: usize, rate: Rate) -> String {
        let (share, hz, us) = (100.0 * self.share(controllers, rate), rate.hz(), self.0.as_secs_f64() * 1e6);
        format!(
            "frames to {controllers} at {hz} Hz take {share:.0} % of the time between ticks, {us:.1} us each"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sys::clock::Monotonic;

    #[test]
    fn frames_that_take_more_than_half_of_the_time_between_ticks_are_told_with_what_fits() {
        let (cost, rate) = (SendCost(Duration::from_nanos(3_500)), Rate::from_hz(1_000.0));
        assert_eq!(cost.remedy(142, rate), None);
        let words = "frames to 256 at 1000 Hz take 90 % of the time between ticks, 3.5 us each";
        assert_eq!(cost.words(256, rate), words);
        let remedy = "set rate_hz to 558 or less, or drive no more than 142 controllers from this machine";
        assert_eq!(cost.remedy(256, rate).as_deref(), Some(remedy));
    }

    #[test]
    fn what_a_frame_costs_is_measured() {
        let cost = SendCost::measured(&Monotonic).expect("loopback has free ports");
        assert!(cost.0 > Duration::ZERO, "{cost:?}");
    }
}
