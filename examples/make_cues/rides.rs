//! The rides in `cues/`, beat by beat.

use super::shapes::Way::{Heave, Pitch, Roll, Surge, Sway, Yaw};
use super::shapes::{Axis, Burst, Ride, Rumble, shift, wave};

pub(crate) const ALL: [Ride; 5] = [SEAT_DEMO, BENCH_RIDE, COASTER, VOYAGE, STORM];

const fn axis(mix: [f64; 6], lag: f64) -> Axis {
    Axis { mix, lag }
}

const fn burst(effect: &'static str, from: f64, to: f64) -> Burst {
    Burst { effect, from, to }
}

const fn rumble(from: f64, to: f64, hz: f64, amplitude: f64) -> Rumble {
    Rumble { from, to, hz, amplitude }
}

/// One lift in front, two behind: pitch back lifts the front, roll left lowers the left.
const BENCH: [Axis; 3] = [
    axis([1.0, 1.0, 0.0, 0.0, 0.0, 0.0], 0.0),
    axis([1.0, -0.5, -1.0, 0.0, 0.0, 0.0], 0.0),
    axis([1.0, -0.5, 1.0, 0.0, 0.0, 0.0], 0.0),
];

/// Six legs in pairs at 0, 120 and 240 degrees: the legs of a pair lean against each other, so that the difference
/// within pairs turns and slides the seat, and what they have in common lifts and tilts it.
const fn legs(lag: f64) -> [Axis; 6] {
    [
        axis([1.0, 0.9, -0.3, 1.0, 0.2, 0.9], lag),
        axis([1.0, 0.9, 0.3, -1.0, 0.2, -0.9], lag),
        axis([1.0, -0.2, 1.0, 1.0, 0.7, -0.5], lag),
        axis([1.0, -0.7, 0.7, -1.0, -0.9, 0.4], lag),
        axis([1.0, -0.7, -0.7, 1.0, -0.9, -0.4], lag),
        axis([1.0, -0.2, -1.0, -1.0, 0.7, 0.5], lag),
    ]
}

const PLATFORM: [Axis; 6] = legs(0.0);

/// Two platforms, one behind the other: a wave reaches the second 0.4 s later.
const PAIR: [Axis; 12] = {
    let (front, back) = (legs(0.0), legs(0.4));
    [
        front[0], front[1], front[2], front[3], front[4], front[5], back[0], back[1], back[2], back[3],
        back[4], back[5],
    ]
};

/// Three axes: what the seat can do, one thing after the other.
const SEAT_DEMO: Ride = Ride {
    file: "seat-demo.csv",
    title: "Seat demo",
    axes: &BENCH,
    length: 11.0,
    row_ms: 20,
    beats: &[
        // Up, a nod, a sway to either side, and down again.
        shift(Heave, 0.5, 2.0, 0.75),
        shift(Pitch, 3.0, 1.0, -0.2),
        shift(Pitch, 4.0, 1.0, 0.2),
        shift(Roll, 5.2, 0.8, 0.15),
        shift(Roll, 6.0, 1.2, -0.3),
        shift(Roll, 7.2, 0.8, 0.15),
        shift(Heave, 8.0, 2.6, -0.75),
    ],
    rumbles: &[rumble(2.6, 3.0, 16.0, 0.0012)],
    effects: &["air", "water", "wind", "leg", "light"],
    bursts: &[
        burst("light", 0.6, 0.9),
        burst("air", 3.4, 3.7),
        burst("water", 4.2, 4.4),
        burst("wind", 5.2, 7.8),
        burst("leg", 6.4, 6.7),
    ],
};

/// Three axes: a lift hill, a drop, two turns, a splash and the brakes.
const BENCH_RIDE: Ride = Ride {
    file: "bench-ride.csv",
    title: "Bench ride",
    axes: &BENCH,
    length: 18.0,
    row_ms: 20,
    beats: &[
        shift(Heave, 0.5, 2.0, 0.45),
        // The lift hill: leant back, the chain clacking.
        shift(Pitch, 2.2, 1.2, 0.22),
        wave(Heave, 2.6, 5.0, 4.0, 0.008),
        shift(Heave, 2.6, 2.2, 0.15),
        // Over the top, and down.
        shift(Pitch, 5.0, 1.2, -0.5),
        shift(Heave, 5.4, 1.0, -0.3),
        wave(Heave, 5.6, 7.4, 5.0, 0.01),
        shift(Pitch, 6.4, 1.1, 0.36),
        shift(Heave, 6.5, 1.1, 0.2),
        // Left, then right.
        shift(Roll, 7.2, 0.9, 0.28),
        shift(Roll, 8.6, 1.1, -0.56),
        shift(Roll, 10.4, 0.9, 0.28),
        // Three little hills.
        wave(Heave, 10.8, 13.6, 1.2, 0.12),
        wave(Pitch, 10.8, 13.6, 1.2, 0.04),
        // The brakes, then home.
        shift(Pitch, 13.7, 0.7, -0.3),
        shift(Pitch, 14.5, 1.1, 0.22),
        shift(Heave, 15.2, 2.2, -0.5),
    ],
    rumbles: &[
        rumble(2.6, 5.0, 12.0, 0.002),
        rumble(5.6, 7.2, 16.0, 0.0012),
        rumble(13.7, 14.5, 20.0, 0.0008),
    ],
    effects: &["air", "water", "wind", "leg", "smoke", "light"],
    bursts: &[
        burst("wind", 5.2, 10.6),
        burst("air", 5.8, 6.1),
        burst("air", 8.6, 8.8),
        burst("leg", 10.9, 11.2),
        burst("water", 12.0, 12.2),
        burst("leg", 12.5, 12.8),
        burst("smoke", 13.7, 14.6),
        burst("light", 5.0, 5.2),
        burst("light", 14.6, 16.0),
    ],
};

/// Six axes: a launch, a drop, turns, a corkscrew and a long brake run.
const COASTER: Ride = Ride {
    file: "coaster.csv",
    title: "Coaster",
    axes: &PLATFORM,
    length: 50.0,
    row_ms: 25,
    beats: &[
        shift(Heave, 0.5, 2.0, 0.5),
        // Launch: pressed back into the seat, rumbling down the track.
        shift(Surge, 4.0, 0.6, 0.18),
        shift(Pitch, 4.0, 0.7, 0.15),
        wave(Heave, 4.2, 7.5, 6.0, 0.005),
        shift(Surge, 7.0, 1.2, -0.18),
        // Up the top hat and over.
        shift(Pitch, 7.2, 1.0, 0.1),
        shift(Heave, 7.4, 1.6, 0.1),
        shift(Pitch, 9.4, 1.1, -0.45),
        shift(Heave, 9.6, 1.0, -0.28),
        wave(Heave, 9.8, 12.0, 5.0, 0.008),
        shift(Pitch, 11.2, 0.9, 0.3),
        shift(Heave, 11.2, 1.0, 0.18),
        // A long left turn, an abrupt right one.
        shift(Roll, 13.0, 1.0, 0.22),
        shift(Yaw, 13.2, 1.6, 0.1),
        wave(Heave, 13.5, 17.0, 3.0, 0.012),
        shift(Roll, 17.0, 1.0, -0.44),
        shift(Yaw, 17.0, 1.2, -0.2),
        wave(Sway, 17.5, 20.0, 2.0, 0.03),
        shift(Roll, 20.0, 0.9, 0.22),
        shift(Yaw, 20.0, 1.2, 0.1),
        // Five hills, each lower than the one before.
        wave(Heave, 21.5, 25.0, 0.9, 0.19),
        wave(Pitch, 21.5, 25.0, 0.9, 0.04),
        wave(Heave, 24.5, 28.5, 1.1, 0.13),
        wave(Pitch, 24.5, 28.5, 1.1, 0.04),
        // The corkscrew.
        wave(Roll, 29.5, 34.5, 0.5, 0.26),
        wave(Yaw, 29.5, 34.5, 0.5, 0.08),
        wave(Heave, 29.5, 34.5, 1.0, 0.05),
        // A second, shorter launch and a dive into the tunnel.
        shift(Surge, 35.0, 0.6, 0.15),
        shift(Surge, 36.4, 1.0, -0.15),
        shift(Pitch, 37.0, 0.8, -0.25),
        wave(Heave, 37.2, 41.0, 6.0, 0.005),
        wave(Sway, 37.5, 41.0, 1.3, 0.05),
        shift(Pitch, 39.5, 1.0, 0.15),
        // Brakes in two bites, then home.
        shift(Surge, 42.0, 0.5, -0.12),
        shift(Surge, 43.4, 0.5, -0.06),
        shift(Surge, 45.0, 1.4, 0.18),
        shift(Heave, 46.5, 2.4, -0.5),
    ],
    rumbles: &[
        rumble(4.2, 7.5, 16.0, 0.0012),
        rumble(9.8, 12.0, 14.0, 0.0016),
        rumble(37.2, 41.0, 18.0, 0.001),
        rumble(42.0, 44.0, 22.0, 0.0006),
    ],
    effects: &["air", "water", "wind", "leg", "smoke", "light"],
    bursts: &[
        burst("smoke", 3.6, 4.6),
        burst("light", 4.0, 4.3),
        burst("wind", 4.2, 8.5),
        burst("wind", 9.4, 28.5),
        burst("air", 9.8, 10.2),
        burst("leg", 22.0, 22.3),
        burst("leg", 25.4, 25.7),
        burst("air", 31.0, 31.3),
        burst("wind", 35.0, 41.5),
        burst("water", 38.0, 38.3),
        burst("light", 37.2, 37.4),
        burst("light", 39.0, 39.2),
        burst("smoke", 43.4, 44.4),
    ],
};

/// Twelve axes: two platforms on the deck of a ship, through swell and a heavy sea.
const VOYAGE: Ride = Ride {
    file: "voyage.csv",
    title: "Voyage",
    axes: &PAIR,
    length: 56.0,
    row_ms: 40,
    beats: &[
        shift(Heave, 0.5, 2.5, 0.5),
        // Out of the harbour.
        wave(Heave, 3.0, 22.0, 0.17, 0.1),
        wave(Pitch, 4.0, 24.0, 0.22, 0.06),
        wave(Roll, 5.0, 26.0, 0.13, 0.07),
        // The heavy sea: steep waves, each followed by a slam.
        wave(Heave, 20.0, 44.0, 0.26, 0.2),
        wave(Pitch, 20.5, 44.0, 0.31, 0.12),
        wave(Roll, 19.0, 46.0, 0.19, 0.1),
        wave(Yaw, 22.0, 44.0, 0.11, 0.05),
        wave(Heave, 27.0, 29.0, 3.5, 0.015),
        wave(Heave, 31.0, 33.0, 3.5, 0.015),
        wave(Heave, 35.0, 37.5, 3.0, 0.02),
        wave(Sway, 26.0, 42.0, 0.7, 0.025),
        // Under the lee of the land, and alongside.
        wave(Heave, 42.0, 51.0, 0.2, 0.07),
        wave(Roll, 43.0, 51.0, 0.24, 0.04),
        shift(Surge, 49.5, 0.6, -0.06),
        shift(Surge, 50.6, 1.4, 0.06),
        shift(Heave, 52.0, 2.5, -0.5),
    ],
    rumbles: &[],
    effects: &["air", "water", "wind", "light"],
    bursts: &[
        burst("wind", 18.0, 44.0),
        burst("water", 27.4, 27.7),
        burst("water", 31.4, 31.7),
        burst("water", 35.4, 35.9),
        burst("air", 35.2, 35.5),
        burst("light", 33.8, 34.0),
        burst("light", 38.2, 38.4),
    ],
};

/// Six axes: a small aeroplane through a thunderstorm.
const STORM: Ride = Ride {
    file: "storm.mcap",
    title: "Storm",
    axes: &PLATFORM,
    length: 44.0,
    row_ms: 40,
    beats: &[
        shift(Heave, 0.5, 2.0, 0.5),
        // Climbing towards the clouds.
        shift(Pitch, 3.0, 2.0, 0.14),
        wave(Roll, 4.0, 14.0, 0.3, 0.04),
        wave(Heave, 6.0, 14.0, 0.7, 0.03),
        shift(Pitch, 11.0, 2.0, -0.14),
        // In the storm: turbulence of four frequencies without a common period, and two air pockets.
        wave(Heave, 12.0, 36.0, 0.61, 0.07),
        wave(Heave, 12.5, 35.5, 1.37, 0.035),
        wave(Pitch, 12.0, 36.0, 0.83, 0.04),
        wave(Roll, 12.0, 36.0, 0.47, 0.1),
        wave(Roll, 13.0, 35.0, 1.13, 0.025),
        wave(Sway, 13.0, 35.0, 0.71, 0.03),
        wave(Yaw, 14.0, 34.0, 0.29, 0.05),
        shift(Heave, 18.0, 0.9, -0.2),
        shift(Heave, 19.4, 1.4, 0.2),
        shift(Heave, 27.0, 0.8, -0.18),
        shift(Heave, 28.2, 1.3, 0.18),
        // Out of it, down and onto the runway.
        shift(Pitch, 35.5, 1.5, -0.1),
        shift(Pitch, 37.6, 0.9, 0.16),
        wave(Heave, 38.6, 40.2, 4.0, 0.012),
        shift(Pitch, 39.2, 0.9, -0.06),
        shift(Surge, 39.4, 0.8, -0.08),
        shift(Surge, 40.6, 1.0, 0.08),
        shift(Heave, 41.2, 2.2, -0.5),
    ],
    rumbles: &[
        rumble(16.0, 17.0, 18.0, 0.001),
        rumble(24.5, 26.0, 18.0, 0.001),
        rumble(38.6, 40.2, 14.0, 0.0016),
    ],
    effects: &["air", "water", "wind", "light"],
    bursts: &[
        burst("wind", 12.0, 36.0),
        burst("water", 14.0, 14.4),
        burst("water", 22.0, 22.4),
        burst("water", 30.0, 30.4),
        burst("light", 15.6, 15.8),
        burst("light", 24.0, 24.2),
        burst("light", 24.4, 24.5),
        burst("air", 18.2, 18.6),
        burst("air", 27.1, 27.4),
    ],
};
