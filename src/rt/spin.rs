//! Waking up on time at the price of processor time: a clock whose sleeps end early, and that spins through the rest.
//! Tick thread; allocates nothing.

use std::cell::Cell;
use std::hint;
use std::time::Duration;

use crate::time::{Clock, MonoTime};

/// The part of a period, in percent, that spin and work may take together. The kernel takes the processor away from
/// real-time threads that use 95 % of a second.
const LIMIT_PERCENT: u32 = 90;

/// How long a tick may spin before its deadline, of the `asked`, where the tick before it has worked for `work`.
///
/// Both fall between the same two deadlines, so that no period is used up however the work goes up and down.
fn spin_after(work: Duration, asked: Duration, period: Duration) -> Duration {
    asked.min((period * LIMIT_PERCENT / 100).saturating_sub(work))
}

/// How long a play spun before its deadlines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Spun {
    /// What was asked for.
    pub(crate) asked: Duration,
    /// What was left of that, the work of the ticks and the limit of 90 % taken off: the mean of all ticks but the first.
    pub granted: Duration,
}

/// A clock for the tick loop: sleeps until shortly before each deadline, then spins.
///
/// What lies between the end of one sleep and the beginning of the next is taken for the work of a tick. The spin is cut
/// so that it and the work before it together stay under 90 % of the period.
#[derive(Debug)]
pub struct Spinning<'a, C> {
    clock: &'a C,
    asked: Duration,
    period: Duration,
    /// When the sleep before ended.
    woke: Cell<Option<MonoTime>>,
    /// What was granted in all so far, and how often.
    granted: Cell<(Duration, u32)>,
}

impl<'a, C: Clock> Spinning<'a, C> {
    /// Spins for `asked` at the most before each of the deadlines that are `period` apart, from the second on; zero
    /// never spins.
    #[must_use]
    pub fn new(clock: &'a C, asked: Duration, period: Duration) -> Self {
        Self { clock, asked, period, woke: Cell::new(None), granted: Cell::default() }
    }

    /// How long it has spun so far.
    #[must_use]
    pub fn spun(&self) -> Spun {
        let (sum, times) = self.granted.get();
        Spun { asked: self.asked, granted: sum.checked_div(times).unwrap_or_default() }
    }

    /// What the next deadline may be spun for.
    fn grant(&self) -> Duration {
        let Some(woke) = self.woke.get() else { return Duration::ZERO };
        let spin = spin_after(self.clock.now().since(woke), self.asked, self.period);
        let (sum, times) = self.granted.get();
        self.granted.set((sum.saturating_add(spin), times.saturating_add(1)));
        spin
    }
}

impl<C: Clock> Clock for Spinning<'_, C> {
    fn now(&self) -> MonoTime {
        self.clock.now()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        if self.asked.is_zero() {
            return self.clock.sleep_until(deadline);
        }
        self.clock.sleep_until(deadline.before(self.grant()));
        let mut now = self.clock.now();
        while now < deadline {
            hint::spin_loop();
            now = self.clock.now();
        }
        self.woke.set(Some(now));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = us(1_000);

    const fn us(us: u64) -> Duration {
        Duration::from_micros(us)
    }

    #[test]
    fn spin_and_work_together_stay_under_nine_tenths_of_the_period() {
        for asked in [1, 100, 899, 900] {
            for work in 0..=900 {
                let spin = spin_after(us(work), us(asked), PERIOD);
                assert!(spin + us(work) <= us(900) && spin <= us(asked), "{asked} asked, {work} worked");
            }
        }
        assert_eq!(spin_after(us(20), us(900), PERIOD), us(880));
    }

    #[test]
    fn a_spin_that_leaves_room_for_the_work_is_what_was_asked_for() {
        assert_eq!(spin_after(us(800), us(100), PERIOD), us(100));
        assert_eq!(spin_after(us(50_000), us(900), us(1_000_000)), us(900));
    }

    #[test]
    fn ticks_that_take_more_than_they_have_leave_nothing_to_spin() {
        assert_eq!(spin_after(us(950), us(100), PERIOD), Duration::ZERO);
        assert_eq!(spin_after(us(50_000), us(900), PERIOD), Duration::ZERO);
    }

    /// Time that passes by a microsecond with each look at it, and tells how often it was slept through and looked at.
    #[derive(Default)]
    struct Looks {
        now: Cell<u64>,
        asleep_until: Cell<u64>,
        looks: Cell<u64>,
    }

    impl Clock for Looks {
        fn now(&self) -> MonoTime {
            self.now.set(self.now.get() + 1_000);
            self.looks.set(self.looks.get() + 1);
            MonoTime::from_nanos(self.now.get())
        }

        fn sleep_until(&self, deadline: MonoTime) {
            self.asleep_until.set(deadline.as_nanos());
            self.now.set(self.now.get().max(deadline.as_nanos()));
        }
    }

    /// Ticks a millisecond apart that work for 50 µs each: when the last sleep was to end before its deadline, µs.
    fn last_sleep(spin: Duration, ticks: u32) -> u64 {
        let clock = Looks::default();
        let spinning = Spinning::new(&clock, spin, PERIOD);
        for tick in 1..=ticks {
            let deadline = MonoTime::default() + PERIOD * tick;
            spinning.sleep_until(deadline);
            assert!(spinning.now() >= deadline, "tick {tick}");
            clock.now.set(clock.now.get() + 50_000);
        }
        u64::from(ticks) * 1_000 - clock.asleep_until.get() / 1_000
    }

    #[test]
    fn it_sleeps_until_shortly_before_the_deadline_and_wakes_at_it() {
        assert_eq!(last_sleep(us(100), 1), 0, "the first tick");
        assert_eq!(last_sleep(us(100), 2), 100);
        // A look of a microsecond each at the end of the tick and before.
        assert_eq!(last_sleep(us(900), 2), 900 - 52);
    }

    #[test]
    fn what_the_work_leaves_of_the_spin_is_told() {
        let told = |asked, ticks| {
            let clock = Looks::default();
            let spinning = Spinning::new(&clock, us(asked), PERIOD);
            for tick in 1..=ticks {
                spinning.sleep_until(MonoTime::default() + PERIOD * tick);
                clock.now.set(clock.now.get() + 50_000);
            }
            spinning.spun()
        };
        assert_eq!(told(100, 5), Spun { asked: us(100), granted: us(100) });
        assert_eq!(told(900, 5), Spun { asked: us(900), granted: us(900 - 51) });
        assert_eq!(told(900, 1), Spun { asked: us(900), granted: Duration::ZERO });
        assert_eq!(told(0, 5), Spun::default());
    }

    /// What the looks of one tick take.
    const LOOKS: Duration = us(5);

    /// Time in which a thread sleeps, wakes up late, and is otherwise awake; a look at it takes a microsecond.
    #[derive(Default)]
    struct Awake {
        now: Cell<u64>,
        asleep: Cell<u64>,
        late: Cell<u64>,
    }

    impl Clock for Awake {
        fn now(&self) -> MonoTime {
            self.now.set(self.now.get() + 1_000);
            MonoTime::from_nanos(self.now.get())
        }

        fn sleep_until(&self, deadline: MonoTime) {
            if deadline.as_nanos() > self.now.get() {
                let woken = deadline.as_nanos() + self.late.get();
                self.asleep.set(self.asleep.get() + woken - self.now.get());
                self.now.set(woken);
            }
        }
    }

    #[test]
    fn whatever_the_work_a_tenth_of_each_period_is_slept_and_no_tick_begins_later_than_its_thread_woke() {
        let clock = Awake::default();
        let spinning = Spinning::new(&clock, us(900), PERIOD);
        spinning.sleep_until(MonoTime::default() + PERIOD);
        let mut began_late = Duration::ZERO;
        for tick in 2..=2_000_u32 {
            let deadline = MonoTime::default() + PERIOD * tick;
            let (work, late) = (u64::from(tick * 7_919 % 880), u64::from(tick * 104_729 % 90));
            clock.now.set(clock.now.get() + work * 1_000);
            clock.late.set(late * 1_000);
            let asleep = clock.asleep.get();
            spinning.sleep_until(deadline);
            // What it overslept before its deadline was sleep of this period as well.
            let slept = Duration::from_nanos(clock.asleep.get() - asleep) + began_late;
            assert!(slept + LOOKS >= us(100), "tick {tick}: {work} worked, {late} late, {slept:?} slept");
            began_late = MonoTime::from_nanos(clock.now.get()).since(deadline);
            assert!(began_late <= us(late) + LOOKS, "tick {tick}: {work} worked, {began_late:?} late");
        }
    }

    #[test]
    fn without_a_spin_the_clock_is_not_even_looked_at() {
        let clock = Looks::default();
        let spinning = Spinning::new(&clock, Duration::ZERO, PERIOD);
        spinning.sleep_until(MonoTime::from_nanos(1_000_000));
        spinning.sleep_until(MonoTime::from_nanos(2_000_000));
        assert_eq!((clock.looks.get(), clock.now.get()), (0, 2_000_000));
    }

    #[test]
    fn a_deadline_that_has_passed_is_not_waited_for() {
        let clock = Looks::default();
        clock.now.set(9_000_000);
        Spinning::new(&clock, us(100), PERIOD).sleep_until(MonoTime::from_nanos(1_000_000));
        assert_eq!(clock.looks.get(), 1);
    }
}
