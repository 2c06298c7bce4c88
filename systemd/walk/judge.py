"""What frames tell of how seats were moved: how soon a stop was felt, whether limits were kept, where seats were meanwhile."""

from typing import NamedTuple

# Seat type bench3 of simulated.toml: mm, s.
STROKE, NEUTRAL = 150.0, 75.0
LIMITS = {"velocity": 240.0, "acceleration": 3000.0, "jerk": 60_000.0}
TICK = 0.010  # at 100 Hz
STRIDE = 2  # ticks between the poses that acceleration and jerk are taken over: positions are whole pulses
STILL = 1e-6  # mm
REST = 8  # poses
SILENCE = 0.050  # s; a hall that was late by more holds the seats, and joins its film anew


class Stop(NamedTuple):
    """How soon a stop was felt, ms from the click, at the seat that was last."""

    slower: float  # the first frame that is slower than the one before
    still: float  # the end of the last frame that moves
    motors: float  # the end of the last move of the simulated motors
    speed: float  # how fast the seats were at the click, mm/s


def between(frames, begin, end):
    return [frame for frame in frames if begin <= frame.at < end]


def speeds(frames):
    """Each frame with the speed of its fastest axis, mm/s, from the frame before on."""
    for before, frame in zip(frames, frames[1:]):
        way = max(abs(to - since) for to, since in zip(frame.mm, before.mm))
        yield frame, way / max(frame.over, TICK)


def stop(frames, motors, click, stopped):
    """How soon the seats felt a stop that was pressed while they gained speed, and that was over some time later."""
    all_of = [of_seat(frames[port], motors[port], click, stopped) for port in frames]
    return Stop(*(max(column) for column in zip(*all_of)))


def of_seat(frames, motors, click, stopped):
    before = [speed for frame, speed in speeds(between(frames, click - 0.3, click))]
    if before[-1] <= before[-10]:
        raise ValueError(f"the seats did not gain speed before the click: {before[-10:]}")
    last, slower, still = before[-1], None, None
    for frame, speed in speeds(between(frames, click - 2 * TICK, stopped)):
        if frame.at >= click:
            if slower is None and speed < last:
                slower = frame.at
            if speed * TICK > STILL:
                still = frame.at + frame.over
            last = speed
    ended = max(end for end, moved in motors if moved and end < stopped)
    return tuple(1000 * (at - click) for at in (slower, still, ended)) + (before[-1],)


def worst(frames):
    """The greatest speed, acceleration and jerk of any axis in all frames of a seat, as parts of their limits; and how often
    frames failed to come while it moved, as in a crash: its controller halts it then, whatever the hall would have done."""
    found, cuts = dict.fromkeys(LIMITS, 0.0), 0
    for poses, cut in runs(frames):
        cuts += cut
        for axis in range(len(poses[0])):
            line = [pose[axis] for pose in poses]
            for order, name in enumerate(LIMITS, start=1):
                stride = 1 if order == 1 else STRIDE
                found[name] = max(found[name], derivative(line, order, stride) / LIMITS[name])
    return found, cuts


def runs(frames):
    """Poses tick by tick of each run of frames without a silence, from rest on, and whether it was cut short of rest."""
    poses, last, moved = [], None, False
    for frame in frames:
        if last and frame.at - last.at - last.over > SILENCE:
            yield poses + (0 if moved else REST) * [last.mm], moved
            poses = []
        before = last.mm if last else frame.mm
        moved = frame.mm != before
        if not poses:
            poses = REST * [before]
        ticks = max(1, round(frame.over / TICK))
        if ticks == 1 or not moved:
            poses += ticks * [frame.mm]
        else:  # one slow frame that brings a seat to park, or one after a tick that was slept through
            yield poses, False
            poses = [frame.mm]
        last = frame
    yield poses, False


def derivative(line, order, stride):
    """The greatest size of a difference of that order, divided by its times."""
    differences = line
    for _ in range(order):
        differences = [to - since for since, to in zip(differences, differences[stride:])]
    return max((abs(one) for one in differences), default=0.0) / (stride * TICK) ** order


def reach(frames):
    """The lowest and the highest that any axis was sent to, mm."""
    all_mm = [mm for frame in frames for mm in frame.mm]
    return min(all_mm), max(all_mm)


def outputs(frames):
    """Outputs that were on in any frame."""
    return frozenset().union(*(frame.outputs for frame in frames)) if frames else frozenset()


def standstill(frames, begin, end):
    """Whether no axis was sent anywhere else in that time."""
    poses = {frame.mm for frame in between(frames, begin, end)}
    return len(poses) <= 1
