//! One look at a controller: all that it has told since it was asked who it is, put together into a sighting.

use super::reads::MonitorRead::{self, Inputs, Mode, Outputs, Packets, Polarity, StopMask, Versions, Zero};
use super::reads::ZERO_KNOWN;
use super::stop_signs::StopSigns;
use crate::health::{Continuity, Identity, Sighting};
use crate::observe::Look;
use crate::wire::{Dialect, RegisterReply, ReplyCode};

/// A look at one controller, again and again.
#[derive(Debug, Clone)]
pub(in crate::drive) struct Probe {
    dialect: Dialect,
    /// Axes whose positions are read.
    axes: usize,
    /// Inputs of which any one means an emergency stop.
    estop_inputs: u16,
    seen: Seen,
    stop: StopSigns,
}

/// What was told since it was asked last.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    /// It was asked, and what it told was not taken yet.
    open: bool,
    /// Which reads were answered, in whatever way, and the first words that each told.
    answered: [bool; MonitorRead::ALL.len()],
    told: [Option<[u16; 3]>; MonitorRead::ALL.len()],
    error: u16,
}

impl Probe {
    pub(super) fn new(dialect: Dialect, axes: usize, estop_inputs: u16) -> Self {
        Self { dialect, axes, estop_inputs, seen: Seen::default(), stop: StopSigns::default() }
    }

    /// It is asked for all of it.
    pub(super) fn begin(&mut self) {
        self.seen = Seen { open: true, ..Seen::default() };
        self.stop.begin();
    }

    /// What was told so far counts for nothing.
    pub(super) fn abandon(&mut self) {
        self.seen = Seen::default();
    }

    /// True if a look asks for that, positions apart.
    pub(super) fn asks(&self, read: MonitorRead) -> bool {
        match read {
            Packets | StopMask => self.dialect == Dialect::Smc,
            Outputs | Polarity => false,
            // Elsewhere they tell nothing of an emergency stop.
            Inputs => self.dialect == Dialect::Smc || self.estop_inputs != 0,
            _ => true,
        }
    }

    /// Hears an answer to a read.
    pub(super) fn hear(&mut self, read: MonitorRead, reply: &RegisterReply<'_>) {
        let Self { dialect, seen, .. } = self;
        if !seen.open {
            return;
        }
        seen.answered[read as usize] = true;
        if *dialect == Dialect::Smc && reply.code != ReplyCode::Running {
            seen.error = reply.error;
        }
        let words = reply.values(*dialect);
        let told = (words.len() >= usize::from(reply.num.max(1)))
            .then(|| std::array::from_fn(|index| words.get(index).unwrap_or(0)));
        // It tells of the request alone. What it has no versions for is known by the rest.
        let is_without = *dialect == Dialect::Mbox && read == Versions && reply.code != ReplyCode::Running;
        let told = told.or_else(|| is_without.then_some([0; 3]));
        seen.told[read as usize] = told.or(seen.told[read as usize]);
    }

    /// Minds a reply code, which may be a sign of an emergency stop.
    pub(super) fn mind_stop(&mut self, code: ReplyCode) {
        // An MBOX controller says with x = 4 that a request was too short.
        if self.dialect == Dialect::Smc && code == ReplyCode::EmergencyStop {
            self.stop.mind();
        }
    }

    fn told(&self, read: MonitorRead) -> Option<[u16; 3]> {
        self.seen.told[read as usize]
    }

    /// What was seen, once all has been told; once for each time it was asked.
    pub(super) fn take(&mut self) -> Option<Sighting> {
        let [work_mode, _, axes] = self.told(Mode)?;
        let [minor_version, version, _] = self.told(Versions)?;
        let [zero, ..] = self.told(Zero)?;
        let packets = self.told(Packets).map(|[packets, ..]| packets);
        let continuity = packets.map_or(Continuity::Answers, Continuity::Packets);
        let is_told = packets.is_some() || self.dialect != Dialect::Smc;
        let has_place = |read: &MonitorRead| {
            read.first_axis().is_none_or(|first| first >= self.axes) || self.told(*read).is_some()
        };
        // Positions may have been asked for beside it: what comes before them is still to be heard then.
        if !self.seen.open || !is_told || !MonitorRead::BLOCKS.iter().all(has_place) || !self.is_whole() {
            return None;
        }
        self.seen.open = false;
        let (minor_version, alarm) = match self.dialect {
            Dialect::Smc => (minor_version, 0),
            Dialect::Mbox => (0, minor_version),
        };
        let identity = Identity { version, minor_version, work_mode, axes };
        Some(Sighting { identity, error: self.seen.error, alarm, continuity, homed: zero == ZERO_KNOWN })
    }

    /// True if all was answered that tells of an emergency stop, by its code or by the inputs.
    fn is_whole(&self) -> bool {
        let tell = [Mode, Zero, Versions, Inputs].into_iter().filter(|read| self.asks(*read));
        tell.into_iter().all(|read| self.seen.answered[read as usize])
    }

    /// What this look says of an emergency stop, once all has been answered that tells of one; said once.
    pub(super) fn take_look(&mut self) -> Option<Look> {
        let first = |read| self.told(read).map(|[word, ..]| word);
        let (inputs, mask) = (first(Inputs), first(StopMask));
        let stop = self.is_whole().then(|| self.stop.take(inputs, self.estop_inputs, mask))??;
        Some(Look { stop, inputs })
    }
}

#[cfg(test)]
mod tests;
