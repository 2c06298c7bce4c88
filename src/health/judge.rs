//! From what is known of the members to the standing of their group, and to what the hall has to hear of it.

use super::{
    Change, Demand, GroupStanding, HealthState, HealthTable, Latch, LossPolicy, Notice, WELL_AFTER, Why,
    state, well,
};
use crate::time::MonoTime;
use crate::wire::DPFE;

/// What the members of one group amount to: of each kind the first that there is.
#[derive(Debug, Clone, Copy, Default)]
struct Findings {
    tripped: Option<Why>,
    first_error: Option<Why>,
    must_rehome: Option<Why>,
    silent: Option<Why>,
    poor: Option<Why>,
    moved: Option<Why>,
    unsure: Option<Why>,
    outside: Option<Why>,
    unseen: bool,
}

impl HealthTable {
    pub(super) fn judge(&mut self, group: usize, now: MonoTime, on: &mut dyn FnMut(Notice)) {
        let findings = self.findings(group, now);
        let place = &mut self.places[group];
        if findings.poor.is_some() {
            place.poor = now;
        }
        let before = *place;
        let (standing, why) = before.after(findings, self.watched, now);
        (place.standing, place.why) = (standing, why);
        let is_explained = standing == HealthState::Error
            && matches!(before.why, Why::Refuses(_))
            && !matches!(why, Why::Refuses(_));
        if standing == before.standing && !is_explained {
            return;
        }
        self.settle(group, before.standing, standing);
        on(Notice::Group(Change { group, at: now, from: before.standing, to: standing, why }));
        if let (HealthState::Excluded, Some(controller)) = (standing, why.controller()) {
            on(Notice::Hall(state::Event::Rebooted(controller)));
        }
        // A seat that is out already may come down only now.
        let lets_go = before.standing == HealthState::Lost && why.is_of_drives();
        let falls_out = (before.standing.may_move() || is_explained || lets_go) && !standing.may_move();
        if let Some(demand) = self.demand(standing, why).filter(|_| falls_out) {
            on(Notice::Hall(state::Event::Policy(demand, group)));
        }
    }

    fn findings(&self, group: usize, now: MonoTime) -> Findings {
        let mut found = Findings::default();
        for controller in self.groups.members(group) {
            let member = &self.members[controller];
            let when = |is: bool, why: Why| is.then_some(why);
            found.tripped = found.tripped.or(when(member.faults.tripped, Why::EmergencyStop(controller)));
            found.first_error = found.first_error.or(member.faults.first);
            found.must_rehome = found.must_rehome.or(member.must_rehome);
            found.silent = found.silent.or(when(member.is_silent(now), Why::Silent(controller)));
            found.poor = found.poor.or(when(member.is_poor(), Why::AcksMissing(controller)));
            let is_moved = |why: &Why| matches!(why, Why::Moved(_));
            found.moved = found.moved.or(member.unsure.filter(is_moved));
            found.unsure = found.unsure.or(member.unsure);
            let outside = |(axis, pulses)| Why::Outside { controller, axis, pulses };
            found.outside = found.outside.or(member.outside.map(outside));
            found.outside = found.outside.or(when(member.ambiguous, Why::Ambiguous(controller)));
            let pushed = |pushed| Why::Pushed { controller, pushed };
            found.outside = found.outside.or(member.pushed.map(pushed));
            found.unseen |= !member.is_seen(now);
        }
        found
    }

    /// Makes the members of a group that stood so fit for a new standing.
    fn settle(&mut self, group: usize, from: HealthState, to: HealthState) {
        let well = matches!(to, HealthState::Ok | HealthState::Degraded | HealthState::Unwatched);
        for controller in self.groups.members(group).filter(|_| !well) {
            let member = &mut self.members[controller];
            member.forget();
            // One that was homed while it was out is known, and so is one that was never found well, though neither was read.
            if from.may_move() {
                member.distrust();
            }
        }
    }

    /// What the hall does when a group falls out. A drive with an alarm may hold its seat no more: then all park.
    const fn demand(&self, standing: HealthState, why: Why) -> Option<Demand> {
        match (standing, why, self.policy) {
            (HealthState::Stopped, ..) => None,
            (.., LossPolicy::Park) => Some(Demand::Park),
            _ if why.is_of_drives() => Some(Demand::Park),
            (.., LossPolicy::Pause) => Some(Demand::Pause),
            (.., LossPolicy::Continue) => None,
        }
    }

    /// Tells the hall of another master, of a new emergency stop, and when the last one is released.
    pub(super) fn tell_of_stops(&mut self, on: &mut dyn FnMut(Notice)) {
        let mut pressed = false;
        for (controller, member) in self.members.iter_mut().enumerate() {
            pressed |= member.holds();
            if let Some(trouble) = member.take_trouble() {
                on(Notice::Hall(state::Event::Trouble(trouble)));
            }
            // Wherever it is pressed the hall stops; it waits for a release only where somebody is to sit.
            let held = member.holds().then_some(state::Event::EmergencyStop(controller));
            if let Some(stop) = member.faults.take_press().or(held).filter(|_| !self.stop_told) {
                self.stop_told = true;
                on(Notice::Hall(stop));
            }
        }
        if self.stop_told && !pressed {
            self.stop_told = false;
            on(Notice::Hall(state::Event::AllReleased));
        }
    }

    /// Tells the hall whether groups that take part wait to be cleared.
    pub(super) fn tell_of_latches(&mut self, on: &mut dyn FnMut(Notice)) {
        let latched = |group: &usize| {
            matches!(self.places[*group].standing, HealthState::Stopped | HealthState::Error)
                && self.groups.members(*group).any(|controller| !self.members[controller].out)
        };
        let mut latch = Latch::Free;
        for group in (0..self.places.len()).filter(latched) {
            let mut members = self.groups.members(group).map(|controller| &self.members[controller]);
            let held = members.any(|member| member.faults.pressed || member.faults.go_on());
            latch = if held || latch == Latch::Held { Latch::Held } else { Latch::Over };
        }
        if std::mem::replace(&mut self.latch_told, latch) != latch {
            on(Notice::Hall(state::Event::Latched(latch)));
        }
    }

    pub(super) fn tell_of_counts(&mut self, now: MonoTime, on: &mut dyn FnMut(Notice)) {
        for (controller, member) in self.members.iter_mut().enumerate().filter(|_| self.watched) {
            if member.counts_now(now) {
                on(Notice::Count(controller));
            }
        }
    }

    pub(super) fn tell_of_reads(&mut self, now: MonoTime, on: &mut dyn FnMut(Notice)) {
        for (controller, member) in self.members.iter_mut().enumerate() {
            let standing = self.places[self.groups.group_of(controller)].standing;
            let wanted = standing.is_looked_at() || (self.watched && member.wants_baseline(now));
            if wanted && member.reads.begins_now(now) {
                on(Notice::Read(controller));
            }
        }
    }
}

impl Why {
    /// True if drives may hold their seat no more.
    const fn is_of_drives(self) -> bool {
        matches!(self, Self::Drive { .. } | Self::Killed { .. } | Self::Alarm { register: DPFE, .. })
    }

    /// Why a group that was out for this joins again. That somebody moved it goes on to be worth a word.
    const fn once_seen(self) -> Self {
        match self {
            Self::Moved(_) => self,
            _ => Self::SeenAgain,
        }
    }
}

impl GroupStanding {
    fn after(self, found: Findings, watched: bool, now: MonoTime) -> (HealthState, Why) {
        let same = (self.standing, self.why);
        if let Some(why) = found.tripped {
            return (HealthState::Stopped, why);
        }
        if let Some(why) = found.first_error {
            return (HealthState::Error, why);
        }
        match (self.standing, found) {
            // Both last until somebody looks anew.
            (HealthState::Stopped | HealthState::Error, _) => same,
            (_, Findings { must_rehome: Some(why), .. }) => (HealthState::Excluded, why),
            (HealthState::Excluded, _) => (HealthState::Lost, Why::NotSeenYet),
            (_, Findings { outside: Some(why), .. }) => (HealthState::Lost, why),
            (HealthState::Lost, _)
                if matches!(self.why, Why::Outside { .. } | Why::Ambiguous(_) | Why::Pushed { .. }) =>
            {
                (HealthState::Lost, Why::NotSeenYet)
            }
            (HealthState::Lost, Findings { unseen: false, .. }) => {
                (HealthState::Rejoining, self.why.once_seen())
            }
            (HealthState::Lost | HealthState::Unwatched, _) => same,
            (_, Findings { moved: Some(why), .. } | Findings { unsure: Some(why), .. }) => {
                (HealthState::Lost, why)
            }
            (_, Findings { silent: Some(why), .. }) if watched => (HealthState::Lost, why),
            (HealthState::Rejoining, _) => same,
            (_, Findings { poor: Some(why), .. }) => (HealthState::Degraded, why),
            (HealthState::Degraded, _) if now.since(self.poor) < WELL_AFTER => same,
            (HealthState::Ok | HealthState::Degraded, _) => well(watched),
        }
    }
}
