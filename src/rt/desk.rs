//! Where operators set what lasts: levels, effects, seats on or off, trim, and the stop that is read every tick. Last
//! value wins, so that no flood of changes can hold up the tick thread, or a stop.

use std::sync::Arc;
use std::sync::atomic::AtomicBool as Signal;

use crate::engine::Mix;
use crate::published::atomics::{AtomicBool, AtomicI32, AtomicU32, Ordering};

/// What operators set. Anyone may write; the tick thread reads all of it every tick.
#[derive(Debug)]
pub struct Desk {
    calls: Calls,
    trim_ms: AtomicI32,
    strips: Box<[Strip]>,
}

/// What is asked of a hall whichever configuration it was opened with: flags that outlive each of its desks.
#[derive(Debug, Clone, Default)]
pub struct Calls {
    /// The lanes are to come to rest.
    stop: Arc<AtomicBool>,
    /// Set by a signal: the program is to end.
    ended: Arc<Signal>,
}

impl Calls {
    /// Those of a program that a signal ends by that flag.
    #[must_use]
    pub(crate) fn ended_by(signal: &Arc<Signal>) -> Self {
        Self { ended: Arc::clone(signal), ..Self::default() }
    }

    /// Asks for the lanes to come to rest at once: one store, which waits for nothing and cannot fail.
    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::Release);
    }
}

/// What is set for one seat.
#[derive(Debug)]
struct Strip {
    motion: AtomicU32,
    vibration: AtomicU32,
    effects: AtomicU32,
    switches: AtomicU32,
    on: AtomicBool,
}

impl Desk {
    /// A desk of one strip for each lane.
    #[must_use]
    pub fn new(mixes: impl Iterator<Item = Mix>) -> Self {
        let strip = |_| Strip {
            motion: AtomicU32::new(0),
            vibration: AtomicU32::new(0),
            effects: AtomicU32::new(0),
            switches: AtomicU32::new(0),
            on: AtomicBool::new(true),
        };
        let mixes: Vec<Mix> = mixes.collect();
        let desk = Self {
            calls: Calls::default(),
            trim_ms: AtomicI32::new(0),
            strips: mixes.iter().map(strip).collect(),
        };
        mixes.into_iter().enumerate().for_each(|(lane, mix)| desk.set(lane, mix));
        desk
    }

    /// The same desk, asked by those flags.
    #[must_use]
    pub(crate) fn called_by(self, calls: Calls) -> Self {
        Self { calls, ..self }
    }

    /// The flags that it is asked by.
    #[must_use]
    pub(crate) const fn calls(&self) -> &Calls {
        &self.calls
    }

    /// Whether a signal wants the program to end.
    #[must_use]
    pub(crate) fn is_ended(&self) -> bool {
        self.calls.ended.load(Ordering::Relaxed)
    }

    /// How many lanes it has.
    #[must_use]
    pub fn lanes(&self) -> usize {
        self.strips.len()
    }

    /// What is set for a lane.
    ///
    /// # Panics
    /// Where there is no such lane.
    #[must_use]
    pub fn mix(&self, lane: usize) -> Mix {
        let strip = &self.strips[lane];
        let level = |level: &AtomicU32| f64::from(f32::from_bits(level.load(Ordering::Relaxed)));
        // First: a seat that is on is on at what was set before that.
        let on = strip.on.load(Ordering::Acquire);
        Mix {
            motion: level(&strip.motion),
            vibration: level(&strip.vibration),
            effects: strip.effects.load(Ordering::Relaxed),
            switches: strip.switches.load(Ordering::Relaxed),
            on,
        }
    }

    /// Sets what a lane makes of the cue; levels are taken into 0 to 1.
    ///
    /// # Panics
    /// Where there is no such lane.
    pub fn set(&self, lane: usize, mix: Mix) {
        self.set_levels(lane, mix.motion, mix.vibration);
        let strip = &self.strips[lane];
        strip.effects.store(mix.effects, Ordering::Relaxed);
        strip.switches.store(mix.switches, Ordering::Relaxed);
        strip.on.store(mix.on, Ordering::Release);
    }

    /// Sets the levels alone: whatever else is set meanwhile, be it that the seat is off, stays.
    ///
    /// # Panics
    /// Where there is no such lane.
    #[expect(clippy::cast_possible_truncation, reason = "a level needs no more than seven digits")]
    pub(crate) fn set_levels(&self, lane: usize, motion: f64, vibration: f64) {
        let strip = &self.strips[lane];
        // Not-a-number is no motion.
        let bits = |level: f64| (level.clamp(0.0, 1.0).max(0.0) as f32).to_bits();
        strip.motion.store(bits(motion), Ordering::Relaxed);
        strip.vibration.store(bits(vibration), Ordering::Relaxed);
    }

    /// Leaves a seat out, and all else of it as it is set.
    ///
    /// # Panics
    /// Where there is no such lane.
    pub(crate) fn leave_out(&self, lane: usize) {
        self.strips[lane].on.store(false, Ordering::Release);
    }

    /// How much later than the film the motion is to be, milliseconds.
    #[must_use]
    pub(crate) fn trim_ms(&self) -> i32 {
        self.trim_ms.load(Ordering::Relaxed)
    }

    /// Sets it; the engine takes it into its range.
    pub fn set_trim_ms(&self, ms: i32) {
        self.trim_ms.store(ms, Ordering::Relaxed);
    }

    /// Asks for the lanes to come to rest at once.
    pub fn stop(&self) {
        self.calls.stop();
    }

    /// Takes the request for a stop, if there is one.
    #[must_use]
    pub fn take_stop(&self) -> bool {
        // A plain load in all the ticks in which there is none.
        let stop = &self.calls.stop;
        stop.load(Ordering::Acquire) && stop.swap(false, Ordering::AcqRel)
    }
}
