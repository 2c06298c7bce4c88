//! What happens in halls beside what always may.

use kinocue::harness::engine::Mix;

use super::cues::{FEWER, KINDS, Kind, MBOXES, RELOADED, TOGETHER, TURNTABLES};
use super::dice::Dice;
use super::ether::Weather;
use super::hall::Hall;
use super::master::{Master, Plan};
use super::seat::{MS, Settings};

/// Cables are exchanged within so long, each seat answers nobody meanwhile.
const EXCHANGED_MS: [u64; 3] = [1_000, 1_500, 2_500];

/// So old is what a controller tells at the most.
const STALE_MS: [u64; 3] = [20, 40, 60];

/// For so long a seat is deaf at the least: it takes some tenths of a second to see it.
const DEAF_MS: [u64; 3] = [500, 800, 2_000];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bent {
    /// Another master sends frames of its own to a seat for a while.
    Master,
    /// Two seats exchange their addresses.
    Exchange,
    /// The hall opens anew with another configuration.
    Reload,
    /// With one that drives fewer axes than its frames have places.
    Fewer,
    /// All controllers are IMAX or MBOX.
    Mbox,
    /// Controllers say that they know their zero after a reboot, though they do not.
    Lie,
    /// Registers say for a while where a seat was.
    Stale,
    /// Chairs have a turntable, and somebody turns it while their power is off.
    Table,
    /// In a show as well seats are jogged at their keys, or home by themselves: they ack frames and do not execute them.
    Deaf,
    /// All seats may get one datagram together, and one is out or levelled now and then.
    Together,
}

impl Bent {
    /// Of which kinds its halls are, or its hall is, one after the other.
    pub(crate) fn kinds(self, dice: &mut Dice) -> &'static [Kind] {
        match self {
            Self::Master | Self::Stale | Self::Deaf => &KINDS,
            Self::Exchange => dice.pick(&[&KINDS[2..3], &KINDS[6..7], &MBOXES[2..3]]),
            Self::Reload => &RELOADED[dice.range(0, RELOADED.len() as u64) as usize],
            Self::Fewer => &FEWER[dice.range(0, FEWER.len() as u64) as usize],
            Self::Mbox => &MBOXES,
            Self::Together => &TOGETHER,
            Self::Table => &TURNTABLES,
            Self::Lie => dice.pick(&[&KINDS[..], &MBOXES]),
        }
    }

    /// How a seat is set then.
    pub(crate) fn furnish(self, settings: &mut Settings) {
        settings.lies = self == Self::Lie;
        if settings.mbox {
            // It has no reports, and both orders of words.
            (settings.report_ms, settings.high_first) = (0, !settings.high_first);
        }
    }

    /// It happens at one deed in so many.
    pub(crate) const fn times(self) -> u64 {
        match self {
            Self::Master | Self::Stale => 5,
            Self::Exchange | Self::Lie => 12,
            Self::Reload | Self::Fewer | Self::Deaf => 8,
            Self::Table => 20,
            Self::Together => 6,
            Self::Mbox => 25,
        }
    }

    /// Whether its halls open with another configuration each time.
    pub(crate) const fn reloads(self) -> bool {
        matches!(self, Self::Reload | Self::Fewer)
    }

    /// It happens.
    pub(crate) fn act(self, hall: &mut Hall<'_, '_>, dice: &mut Dice) {
        let seat = dice.range(0, hall.kind.axes.len() as u64) as usize;
        let now = hall.ether.ns();
        match self {
            Self::Master => {
                let plan = dice.pick(&[Plan::Swing(10.0), Plan::Swing(40.0), Plan::Park, Plan::Jumps]);
                let ms = dice.pick(&[100, 400, 1_500, 3_000]);
                hall.note(|| format!("seat {}: another master: {plan:?} for {ms} ms", seat + 1));
                hall.ether.intrude(seat, Master::new(plan, now, ms, dice));
            }
            Self::Exchange => {
                let ms = dice.pick(&EXCHANGED_MS);
                hall.note(|| format!("the seats exchange their addresses within {ms} ms"));
                (0..2).for_each(|seat| hall.ether.turns(seat, Weather::Cut, ms));
                hall.pass(ms / 2);
                hall.ether.exchange();
            }
            Self::Reload | Self::Fewer => hall.leave(),
            Self::Together => {
                let mix = hall.runtime.desk.mix(seat);
                let motion = dice.pick(&[1.0, 1.0, 0.5]);
                hall.set(seat, Mix { on: !mix.on, motion, ..mix });
            }
            Self::Mbox | Self::Lie => {
                let dark = dice.pick(&[1_000, 1_500]);
                hall.note(|| format!("seat {}: its power goes for {dark} ms", seat + 1));
                hall.ether.world().lines[seat].seat.reboot(now, dark * MS);
            }
            Self::Table => {
                let (dark, mm) = (dice.pick(&[1_000, 1_500]), dice.range(0, 180) as f64 - 90.0);
                hall.note(|| {
                    format!("seat {}: its power goes for {dark} ms, its table is turned by {mm}", seat + 1)
                });
                let chair = &mut hall.ether.world().lines[seat].seat;
                chair.reboot(now, dark * MS);
                chair.turn(mm);
            }
            Self::Deaf => {
                let mm = dice.range(0, 120) as f64 - 60.0;
                let jogged = (dice.range(0, hall.kind.axes[seat].min(6) as u64) as usize, mm);
                let jogged = (!dice.one_in(3)).then_some(jogged);
                let ms = dice.pick(&DEAF_MS);
                hall.note(|| format!("seat {}: deaf for {ms} ms or more, jogged {jogged:?}", seat + 1));
                hall.ether.world().lines[seat].seat.seize(jogged, now, ms * MS);
            }
            Self::Stale => {
                let ms = dice.pick(&STALE_MS);
                let (axis, mm) = (dice.range(0, hall.kind.axes[seat].min(6) as u64), dice.range(0, 120));
                let mm = mm as f64 - 60.0;
                hall.ether.world().lines[seat].seat.freeze(now, now + ms * MS);
                let done = hall.ether.jog(seat, axis as usize, mm, now);
                hall.note(|| {
                    format!(
                        "seat {}: answers as now for {ms} ms; axis {}: jogged by {mm} mm: {done}",
                        seat + 1,
                        axis + 1
                    )
                });
            }
        }
    }
}
