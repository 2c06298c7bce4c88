//! What the table is told beside frames, replies and the observer's events, as one value each, so that it can be kept and told again.

use super::{HealthTable, Pushed, Sighting};
use crate::belief::Fall;
use crate::motion::Pulses;
use crate::time::MonoTime;

/// Something that the table is told. The number is that of a controller, in `Joined` and `LookAnew` of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HealthInput {
    /// [`HealthTable::on_part`].
    Part(usize, bool),
    /// [`HealthTable::on_refused`].
    Refused(usize),
    /// [`HealthTable::on_status`].
    Alive(usize, MonoTime),
    /// [`HealthTable::on_answer`].
    Answered(usize, MonoTime),
    /// [`HealthTable::on_read_sent`].
    ReadSent(usize, u32),
    /// [`HealthTable::on_other_sent`].
    OtherSent(usize, u32),
    /// [`HealthTable::on_beat_sent`].
    BeatSent(usize, MonoTime),
    /// [`HealthTable::on_beat_kept`].
    BeatKept(usize, MonoTime),
    /// [`HealthTable::on_zero`].
    Zero(usize, bool),
    /// [`HealthTable::on_killed`]: the axis, from 1, and by what.
    Killed(usize, usize, u16),
    /// [`HealthTable::on_lost_zero`].
    LostZero(usize),
    /// [`HealthTable::on_wide_registers`].
    Wide(usize),
    /// [`HealthTable::on_sighting`].
    Seen(usize, Sighting, MonoTime),
    /// [`HealthTable::on_other_axes`].
    OtherAxes(usize, u16),
    /// [`HealthTable::on_count`].
    Count(usize, u16),
    /// [`HealthTable::on_counted`].
    Counted(usize),
    /// [`HealthTable::on_moved`].
    Moved(usize),
    /// [`HealthTable::on_fell_out`].
    FellOut(usize, Fall),
    /// [`HealthTable::on_outside`].
    Outside(usize, Option<(usize, Pulses)>),
    /// [`HealthTable::on_pushed`].
    Pushed(usize, Option<Pushed>),
    /// [`HealthTable::on_ambiguous`].
    Ambiguous(usize, bool),
    /// [`HealthTable::on_homed`].
    Homed(usize),
    /// [`HealthTable::on_joined`].
    Joined(usize),
    /// [`HealthTable::look_anew`].
    LookAnew(usize),
}

impl HealthInput {
    /// True if there is whatever it is of, in a hall of so many controllers and groups.
    pub(crate) const fn is_of(self, controllers: usize, groups: usize) -> bool {
        match self {
            Self::Joined(group) | Self::LookAnew(group) => group < groups,
            Self::Part(of, _)
            | Self::Refused(of)
            | Self::Alive(of, _)
            | Self::Answered(of, _)
            | Self::ReadSent(of, _)
            | Self::OtherSent(of, _)
            | Self::BeatSent(of, _)
            | Self::BeatKept(of, _)
            | Self::Zero(of, _)
            | Self::Killed(of, ..)
            | Self::LostZero(of)
            | Self::Wide(of)
            | Self::Seen(of, ..)
            | Self::OtherAxes(of, _)
            | Self::Count(of, _)
            | Self::Counted(of)
            | Self::Moved(of)
            | Self::FellOut(of, _)
            | Self::Outside(of, _)
            | Self::Pushed(of, _)
            | Self::Ambiguous(of, _)
            | Self::Homed(of) => of < controllers,
        }
    }
}

impl HealthTable {
    /// Takes it.
    pub(crate) fn take(&mut self, input: HealthInput) {
        match input {
            HealthInput::Part(controller, takes_part) => self.on_part(controller, takes_part),
            HealthInput::Refused(controller) => self.on_refused(controller),
            HealthInput::Alive(controller, at) => self.on_status(controller, at),
            HealthInput::Answered(controller, at) => self.on_answer(controller, at),
            HealthInput::ReadSent(controller, datagrams) => self.on_read_sent(controller, datagrams),
            HealthInput::OtherSent(controller, datagrams) => self.on_other_sent(controller, datagrams.into()),
            HealthInput::BeatSent(controller, at) => self.on_beat_sent(controller, at),
            HealthInput::BeatKept(controller, at) => self.on_beat_kept(controller, at),
            HealthInput::Zero(controller, homed) => self.on_zero(controller, homed),
            HealthInput::Killed(controller, axis, cause) => self.on_killed(controller, axis, cause),
            HealthInput::LostZero(controller) => self.on_lost_zero(controller),
            HealthInput::Wide(controller) => self.on_wide_registers(controller),
            HealthInput::Seen(controller, sighting, at) => self.on_sighting(controller, &sighting, at),
            HealthInput::OtherAxes(controller, drives) => self.on_other_axes(controller, drives),
            HealthInput::Count(controller, packets) => self.on_count(controller, packets),
            HealthInput::Counted(controller) => self.on_counted(controller),
            HealthInput::Moved(controller) => self.on_moved(controller),
            HealthInput::FellOut(controller, why) => self.on_fell_out(controller, why),
            HealthInput::Outside(controller, outside) => self.on_outside(controller, outside),
            HealthInput::Pushed(controller, pushed) => self.on_pushed(controller, pushed),
            HealthInput::Ambiguous(controller, ambiguous) => self.on_ambiguous(controller, ambiguous),
            HealthInput::Homed(controller) => self.on_homed(controller),
            HealthInput::Joined(group) => self.on_joined(group),
            HealthInput::LookAnew(group) => self.look_anew(group),
        }
    }

    /// The table knows nothing of a group but that it stands well.
    pub(crate) fn assume_well(&mut self, group: usize) {
        for controller in self.groups.members(group) {
            self.members[controller] = self.members[controller].anew();
        }
        let (standing, why) = super::well(self.watched);
        self.places[group] = super::GroupStanding { standing, why, poor: MonoTime::default() };
    }

    /// True if a look at that controller was taken: it is known by what it counted then.
    pub(crate) fn has_seen(&self, controller: usize) -> bool {
        self.members[controller].has_baseline()
    }

    /// True if the table knows that already, so that nothing comes of telling it again.
    pub(crate) fn knows(&self, input: HealthInput) -> bool {
        match input {
            HealthInput::Part(controller, takes_part) => self.members[controller].out != takes_part,
            HealthInput::Outside(controller, outside) => self.members[controller].outside == outside,
            HealthInput::Pushed(controller, pushed) => self.members[controller].pushed == pushed,
            HealthInput::Ambiguous(controller, ambiguous) => self.members[controller].ambiguous == ambiguous,
            HealthInput::OtherSent(_, datagrams) => datagrams == 0,
            _ => false,
        }
    }
}
