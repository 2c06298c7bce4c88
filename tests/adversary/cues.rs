//! The cues that halls play, and the kinds of halls.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use kinocue::cue::{self, Source};
use kinocue::harness::app::staged::headroom;
use kinocue::harness::config::{BroadcastNetwork, Config, LossPolicy, from_to_args, load};
use kinocue::harness::engine::Headroom;
use kinocue::harness::motion::AxisGeometry;
use kinocue::harness::time::Rate;
use kinocue::harness::timeline::Timeline;
use kinocue::wire::{Dialect, Timing};

/// Seats of a hall, how fast it sends, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Kind {
    pub(crate) axes: &'static [usize],
    pub(crate) hz: f64,
    pub(crate) timing: Timing,
    pub(crate) policy: LossPolicy,
    pub(crate) dialect: Dialect,
    /// The most axes of a seat that the hall drives.
    drives: usize,
    /// Where all axes rest, of the stroke.
    park: f64,
    /// How far the cues go, of what they do otherwise.
    far: f64,
    /// The last axis of each seat is a turntable.
    pub(crate) turns: bool,
    ack_every: u32,
    /// All seats may get one datagram together, but for so many, the last.
    together: bool,
    pub(crate) outside: usize,
}

const PLAIN: Kind = Kind {
    axes: &[3],
    hz: 100.0,
    timing: Timing::Relative,
    policy: LossPolicy::Continue,
    dialect: Dialect::Smc,
    drives: 12,
    park: 0.0,
    far: 1.0,
    turns: false,
    ack_every: 1,
    together: false,
    outside: 0,
};
const MBOX: Kind = Kind { dialect: Dialect::Mbox, ..PLAIN };

/// Every kind that there is.
pub(crate) const KINDS: [Kind; 8] = [
    PLAIN,
    Kind { axes: &[6], ..PLAIN },
    Kind { axes: &[3, 6], hz: 50.0, ..PLAIN },
    Kind { axes: &[8], hz: 50.0, ..PLAIN },
    Kind { axes: &[6], timing: Timing::Absolute, ..PLAIN },
    Kind { axes: &[3], hz: 200.0, ..PLAIN },
    Kind { axes: &[3, 3], hz: 50.0, policy: LossPolicy::Park, ..PLAIN },
    Kind { axes: &[1], hz: 1_000.0, ..PLAIN },
];

/// Halls of IMAX and MBOX controllers.
pub(crate) const MBOXES: [Kind; 5] = [
    MBOX,
    Kind { axes: &[6], ..MBOX },
    Kind { axes: &[3, 3], hz: 50.0, ..MBOX },
    Kind { axes: &[6], timing: Timing::Absolute, hz: 50.0, ..MBOX },
    Kind { axes: &[3], hz: 200.0, policy: LossPolicy::Park, ..MBOX },
];

const HIGH: Kind = Kind { park: 0.3, far: 0.5, ..PLAIN };

/// Halls of other rates and sizes.
pub(crate) const OTHERS: [Kind; 9] = [
    Kind { hz: 20.0, ..PLAIN },
    Kind { axes: &[6], hz: 20.0, ..PLAIN },
    Kind { axes: &[8], hz: 1_000.0, ..PLAIN },
    Kind { axes: &[6], hz: 1_000.0, timing: Timing::Absolute, ..PLAIN },
    Kind { axes: &[3], hz: 100.0, ack_every: 10, ..PLAIN },
    Kind { axes: &[3], hz: 100.0, ack_every: 4, ..PLAIN },
    Kind { axes: &[3], hz: 5.0, ..PLAIN },
    Kind { axes: &[3], hz: 1_000.0, ..PLAIN },
    Kind { axes: &[3, 6, 3, 6, 3, 6], hz: 100.0, ..PLAIN },
];

/// Halls that ask for as few acks as a configuration may, or for a few more.
pub(crate) const SELDOM: [Kind; 6] = [
    Kind { hz: 20.0, ack_every: 2, ..PLAIN },
    Kind { hz: 100.0, ack_every: 3, ..PLAIN },
    Kind { hz: 100.0, ack_every: 5, ..PLAIN },
    Kind { hz: 100.0, ack_every: 6, ..PLAIN },
    Kind { hz: 250.0, ack_every: 13, ..PLAIN },
    Kind { hz: 1_000.0, ack_every: 51, ..PLAIN },
];

/// What configurations the same seats may have, one after the other; what a hall does not drive has no place in its frames.
pub(crate) const RELOADED: [[Kind; 4]; 4] = [
    [
        PLAIN,
        HIGH,
        Kind { hz: 50.0, far: 0.7, ..PLAIN },
        Kind { hz: 200.0, timing: Timing::Absolute, park: 0.1, ..PLAIN },
    ],
    [
        Kind { axes: &[6], ..PLAIN },
        Kind { axes: &[6], drives: 3, ..HIGH },
        Kind { axes: &[6], hz: 50.0, far: 0.7, ..PLAIN },
        Kind { axes: &[6], timing: Timing::Absolute, park: 0.5, far: 0.5, ..PLAIN },
    ],
    [
        Kind { axes: &[8], hz: 50.0, ..PLAIN },
        Kind { axes: &[8], drives: 6, ..HIGH },
        Kind { axes: &[8], drives: 3, ..PLAIN },
        Kind { axes: &[8], park: 0.2, far: 0.5, ..PLAIN },
    ],
    [
        Kind { axes: &[3, 6], hz: 50.0, ..PLAIN },
        Kind { axes: &[3, 6], drives: 3, ..HIGH },
        Kind { axes: &[3, 6], hz: 200.0, policy: LossPolicy::Park, ..PLAIN },
        Kind { axes: &[3, 6], park: 0.2, far: 0.5, ..PLAIN },
    ],
];

/// The same of halls that drive fewer axes than their seats have, by frames that have places for more.
pub(crate) const FEWER: [[Kind; 2]; 4] = [
    [PLAIN, Kind { drives: 1, hz: 50.0, ..PLAIN }],
    [Kind { axes: &[6], ..PLAIN }, Kind { axes: &[6], drives: 4, ..HIGH }],
    [Kind { axes: &[6], timing: Timing::Absolute, ..PLAIN }, Kind { axes: &[6], drives: 5, ..PLAIN }],
    [Kind { axes: &[8], hz: 50.0, ..PLAIN }, Kind { axes: &[8], drives: 7, ..HIGH }],
];

/// Halls of chairs with a turntable, whose park is the middle of its range or elsewhere.
pub(crate) const TURNTABLES: [Kind; 5] = [
    Kind { axes: &[4], turns: true, park: 0.5, far: 0.6, ..PLAIN },
    Kind { axes: &[4, 4], turns: true, park: 0.5, far: 0.6, hz: 50.0, ..PLAIN },
    Kind { axes: &[4], turns: true, park: 0.2, far: 0.5, timing: Timing::Absolute, ..PLAIN },
    Kind { axes: &[4], turns: true, ..PLAIN },
    Kind { axes: &[4], turns: true, park: 0.5, hz: 200.0, policy: LossPolicy::Park, ..MBOX },
];

/// Halls whose seats may get one datagram together.
pub(crate) const TOGETHER: [Kind; 4] = [
    Kind { axes: &[3, 3, 3], hz: 50.0, together: true, ..PLAIN },
    Kind { axes: &[6, 6], timing: Timing::Absolute, together: true, ..PLAIN },
    Kind { axes: &[3, 3], ack_every: 4, together: true, ..PLAIN },
    Kind { axes: &[3, 3], hz: 50.0, policy: LossPolicy::Continue, together: true, ..MBOX },
];

/// One of which a seat is in another network.
pub(crate) const OUTSIDE: Kind = Kind { outside: 1, ..TOGETHER[0] };

/// The same whose seats get their own.
const ALONE: [Kind; 4] = [TOGETHER[0].alone(), TOGETHER[1].alone(), TOGETHER[2].alone(), TOGETHER[3].alone()];

/// A cue that is ready to be staged.
pub(crate) type Ready = (Arc<Timeline>, Headroom);

/// A hall's configuration and its cues: of all axes, of three, and one that stands high.
#[derive(Debug)]
pub(crate) struct Book {
    pub(crate) config: Arc<Config>,
    pub(crate) cues: Vec<Ready>,
}

impl Kind {
    /// The same where each gets its own.
    pub(crate) const fn alone(self) -> Self {
        Self { together: false, ..self }
    }

    pub(crate) fn period_ms(&self) -> f64 {
        1_000.0 / self.hz
    }

    pub(crate) fn asks_ms(&self) -> f64 {
        f64::from(self.ack_every) * self.period_ms()
    }

    fn config(&self) -> Config {
        let dialect = if self.dialect == Dialect::Mbox { ",dialect=mbox" } else { "" };
        let to = |(index, axes): (usize, &usize)| {
            let driven = self.drives.min(*axes);
            format!("127.0.1.{}:7408,axes={driven}{dialect}", index + 1)
        };
        let tos: Vec<String> = self.axes.iter().enumerate().map(to).collect();
        let mut config = from_to_args(&tos, &[], self.most()).expect("the addresses are sound");
        config.show.rate_hz = self.hz;
        config.show.ack_every = self.ack_every;
        config.show.timing = self.timing;
        config.show.loss_policy = self.policy;
        for controller in &mut config.controllers {
            let seat = Arc::make_mut(&mut controller.seat);
            let own = seat.axes;
            if self.turns {
                seat.each[own - 1] = turntable();
            }
            seat.each[..own].iter_mut().for_each(|axis| (axis.park, axis.neutral) = (self.park, self.park));
            // Its replies tell nothing of an emergency stop.
            controller.estop_inputs = u16::from(self.dialect == Dialect::Mbox);
        }
        if self.together {
            config.broadcast = self.network();
        }
        config.seats = config.controllers.iter().map(|controller| Arc::clone(&controller.seat)).collect();
        config
    }

    /// The network of all seats, as a configuration has it.
    fn network(&self) -> Option<BroadcastNetwork> {
        let (axes, mbox) = (self.axes[0], self.dialect == Dialect::Mbox);
        let mut text = format!(
            "[broadcast.all]\nalone = true\nnetwork = \"127.0.1.0/24\"\n[seat.s]\naxes = {axes}\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
             max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n"
        );
        for seat in 1..=self.axes.len() {
            let dialect = if mbox { "mbox" } else { "smc" };
            let third = if seat > self.axes.len() - self.outside { 2 } else { 1 };
            text += &format!(
                "[[controller]]\nname = \"c{seat}\"\nseat = \"s\"\naddress = \"127.0.{third}.{seat}:7408\"\ndialect = \"{dialect}\"\n"
            );
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("hall.toml");
        std::fs::write(&path, text).expect("the folder is ours");
        load(&path).expect("it is sound").broadcast
    }

    fn most(&self) -> usize {
        self.axes.iter().map(|axes| self.drives.min(*axes)).max().unwrap_or(1)
    }

    /// What there is for halls of this kind; made once.
    pub(crate) fn book(&self) -> &'static Book {
        const ALL: usize = KINDS.len()
            + MBOXES.len()
            + 24
            + OTHERS.len()
            + SELDOM.len()
            + TURNTABLES.len()
            + 2 * TOGETHER.len()
            + 1;
        static BOOKS: [OnceLock<Book>; ALL] = [const { OnceLock::new() }; ALL];
        let mut all = KINDS
            .iter()
            .chain(&OTHERS)
            .chain(&SELDOM)
            .chain(&MBOXES)
            .chain(&TURNTABLES)
            .chain(&TOGETHER)
            .chain(&ALONE)
            .chain([&OUTSIDE])
            .chain(RELOADED.iter().flatten())
            .chain(FEWER.iter().flatten());
        let index = all.position(|kind| kind == self).expect("it is one of them");
        BOOKS[index].get_or_init(|| {
            let config = self.config();
            let (axes, far) = (self.most(), self.far);
            let texts = [
                swing(axes, 0.8, 40.0 * far, 75.0),
                swing(axes.min(3), 0.5, 50.0 * far, 70.0),
                swing(axes, 0.3, 20.0 * far, 120.0),
                wet(axes, 40.0 * far, "5,0.003"),
                wet(axes, 0.0, "5,0.003"),
                wet(axes, 0.0, "4,0.02"),
                wet(axes, 0.0, "2,0.06"),
                wet(axes, 0.0, "9.0909,0.003"),
            ];
            let ready = |text: &String| {
                let cue = cue::read(Path::new("ride.csv"), text.as_bytes(), &Source::Native);
                let timeline = Timeline::new(cue.expect("the cue is sound"));
                let headroom = headroom(&config, &timeline, Rate::from_hz(self.hz));
                (Arc::new(timeline), headroom)
            };
            let cues = texts.iter().map(ready).collect();
            Book { config: Arc::new(config), cues }
        })
    }
}

/// One that turns as far and as fast in degrees as the cylinders go in millimetres, by as many pulses, to both sides of its zero.
fn turntable() -> AxisGeometry {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("hall.toml");
    let text = "[seat.table]\naxes = 1\n[seat.table.axis1]\nunit = \"deg\"\nrange = [-75, 75]\npulses_per_rev = 720000\n\
        max_velocity_deg_s = 240\nmax_acceleration_deg_s2 = 3000\nmax_jerk_deg_s3 = 60000\n\
        [[controller]]\nname = \"T1\"\nseat = \"table\"\naddress = \"127.0.1.1:7408\"\n";
    std::fs::write(&path, text).expect("it is ours");
    load(&path).expect("it is sound").controllers[0].seat.each[0]
}

/// Six seconds in which all axes swing, each a little after the one before.
pub(crate) fn swing(axes: usize, hz: f64, mm: f64, about_mm: f64) -> String {
    swing_on(300, axes, hz, mm, about_mm)
}

fn swing_on(rows: u32, axes: usize, hz: f64, mm: f64, about_mm: f64) -> String {
    let names: String = (1..=axes).map(|axis| format!(",a{axis}")).collect();
    let mut text = format!("time_ms{names}\n");
    for row in 0..=rows {
        text += &(row * 20).to_string();
        for axis in 0..axes {
            let turn = hz * f64::from(row) * 0.02 + axis as f64 * 0.13;
            text += &format!(",{:.9}", (about_mm + mm * (turn * std::f64::consts::TAU).sin()) / 150.0);
        }
        text.push('\n');
    }
    text
}

/// The same with vibration of the first axis and air all along.
pub(crate) fn wet(axes: usize, mm: f64, shake: &str) -> String {
    let swing = swing_on(1_200, axes, 0.3, mm, 75.0);
    let mut text = String::new();
    for (row, line) in swing.lines().enumerate() {
        text += line;
        text += &if row == 0 { ",v1_hz,v1_amp,fx_air".to_owned() } else { format!(",{shake},1") };
        text.push('\n');
    }
    text
}
