"""What is left of the day: reports and metrics, and the frames that were captured, held against what was done."""

import json
import statistics

import judge
import wire

A1, B1, B2 = 7408, 7412, 7413
WATER = "Y02"


def reports(terminal, table, tablet, guest):
    """Proof of play, who asked for what, and what a fleet would watch."""
    said = terminal.readme("kinocue report --day today", user="anna")
    report = json.loads(terminal.run("kinocue report --day today --json", user="anna"))
    results = [(show["cue"], show["result"], show["operator"]) for show in report["shows"]]
    table.saw(17, "kinocue report --day today", f"{len(results)} shows; {said.strip().splitlines()[-1]}", len(results) > 5)
    expected = [("seat-demo", "completed"), ("bench-ride", "completed")]
    table.saw(17, "the list of two", ", ".join(f"{cue} {result} by {who}" for cue, result, who in results[:2]),
              [one[:2] for one in results[:2]] == expected)
    table.saw(17, "the stops", f"{sum(result == 'stopped' for _, result, _ in results)} stopped", results[2][1] == "stopped")
    cut = [cue for cue, result, _ in results if result == "interrupted"]
    table.saw(8, "the report", f"{len(cut)} show named as interrupted: {', '.join(cut)}", cut == ["seat-demo"])
    whole = all(len(show["sha256"]) == 64 and show["seats_total"] == 8 for show in report["shows"])
    csv = terminal.run("kinocue report --day today --csv", user="anna").splitlines()
    table.saw(17, "hash and seats of each; CSV", f"{len(csv) - 1} records", whole and len(csv) == 1 + len(results))
    actions = {(action["who"], action["what"].split()[0]) for action in report["actions"]}
    who = sorted({who for who, _ in actions})
    table.saw(24, "kinocue report --day today --actions", f"{len(report['actions'])} actions by {', '.join(who)}",
              any("anna" in name for name in who) and any("tablet" in name for name in who))
    watched(terminal, table, tablet, guest)


def watched(terminal, table, tablet, guest):
    code, headers, text = tablet.get("/metrics")
    wanted = ["kinocue_build_info", "kinocue_state", "kinocue_tick_lateness_seconds_bucket", "kinocue_frames_sent_total",
              "kinocue_controller_up"]
    missing = [name for name in wanted if f"\n{name}" not in "\n" + text]
    table.saw(22, "/metrics", f"{code}, {len(text.splitlines())} lines, missing: {', '.join(missing) or 'nothing'}",
              code == 200 and not missing)
    up = next(line for line in text.splitlines() if line.startswith('kinocue_controller_up{controller="B4"'))
    table.saw(22, "of one controller", up, up.endswith(" 1") or up.endswith(" 1.0"))
    codes = [guest.get(path)[0] for path in ("/healthz", "/readyz")]
    table.saw(22, "/healthz, /readyz", codes, codes == [200, 200])
    said = terminal.run("journalctl -q -o cat KINOCUE_CONTROLLER=B4 | tail -1")
    table.saw(22, "the log of one controller", said.strip(), "B4" in said)


def frames(table, log, at, stops, crashed, parked, removed):
    """The captured frames: what seats were told while all that happened."""
    by_port = wire.read("/trial/loopback.pcap")
    felt(table, by_port, stops)
    smooth(table, by_port, log)
    still = [port for port, all_of in by_port.items() if judge.between(all_of, crashed + 0.1, parked)]
    table.saw(8, f"frames in the {parked - crashed:.1f} s until PARK", f"{len(still)} seats got any", not still)
    levels(table, by_port, at)
    wet = judge.outputs(judge.between(by_port[B1], at["go"], at["dry"]))
    table.saw(10, "seat-demo with water, output Y02", "on" if WATER in wet else "never on", WATER in wet)
    dry = judge.outputs(judge.between(by_port[B1], at["dry"] + 0.5, at["end"]))
    table.saw(10, "effects off water, sought back, and the children's show", "on" if WATER in dry else "never on",
              WATER not in dry and dry)
    out(table, by_port, at)
    last = judge.between(by_port[B1], removed - 30, removed)[-1]
    table.saw(19, "where the seats are since the package was removed", f"{max(last.mm):.1f} mm", max(last.mm) < 0.1)


def smooth(table, by_port, log):
    """Whether limits were kept in every frame. A machine that slept through ticks says so, and cuts a move short as a crash does."""
    count = sum(len(all_of) for all_of in by_port.values())
    judged = [judge.worst(all_of) for all_of in by_port.values()]
    worst = {name: max(found[name] for found, _ in judged) for name in judge.LIMITS}
    said = ", ".join(f"{name} {100 * part:.0f} %" for name, part in worst.items())
    table.saw(4, f"all {count} frames of the walk, of their limits at the most", said, all(part <= 1.01 for part in worst.values()))
    slept = log.count("a frame more than 50 ms late")
    cuts = max(cuts for _, cuts in judged)
    table.saw(4, "moves that were cut short", f"{cuts}: one by the crash, {slept} where this machine slept", cuts <= 1 + slept)


def felt(table, by_port, stops):
    motors = wire.motor_ends(by_port, "/trial/frames.csv", "/trial/moves.csv")
    ways = dict.fromkeys(how for how, _, _ in stops)
    for way in ways:
        felt_by = [judge.stop(by_port, motors, click, stopped) for how, click, stopped in stops if how == way]
        said = "; ".join(
            f"{what} {spread([getattr(stop, name) for stop in felt_by])}"
            for name, what in (("slower", "first slower frame after"), ("still", "last frame that moves ends after"),
                               ("motors", "motors still after"))
        )
        speed = statistics.mean(stop.speed for stop in felt_by)
        good = all(stop.slower <= 100 and max(stop.still, stop.motors) <= 300 for stop in felt_by)
        table.saw(2, f"{way}, {len(felt_by)} x at {speed:.0f} mm/s", said, good)


def spread(values):
    return "/".join(f"{value:.0f}" for value in sorted(values)) + " ms"


def levels(table, by_port, at):
    whole = judge.between(by_port[B1], at["kids"], at["end"])
    low, high = judge.reach([frame for frame in whole if frame.over < 0.05])
    most = judge.NEUTRAL + 0.6 * (judge.STROKE - judge.NEUTRAL)
    table.saw(9, "row B in the children's show", f"{low:.0f} to {high:.0f} mm of {judge.STROKE:.0f}, never above {most:.0f}", high <= most + 0.1)
    still = judge.standstill(by_port[A1], at["row_a"] + 3, at["row_a_end"])
    table.saw(9, "row A at level 0 %", "stands at neutral" if still else "moves", still)


def out(table, by_port, at):
    gone = judge.between(by_port[B2], at["b2_in"] - 1, at["b2_in"])
    where = max((max(frame.mm) for frame in gone), default=0.0)
    table.saw(13, "B2 out in mid-show", f"at {where:.1f} mm, without output {sorted(judge.outputs(gone))}", where < 0.1)
    others = judge.standstill(by_port[B1], at["b2_out"], at["b2_in"])
    table.saw(13, "B1 meanwhile", "stands" if others else "plays on", not others)
    one, joined = (judge.between(by_port[port], at["row_a_end"] - 0.5, at["row_a_end"]) for port in (B1, B2))
    same = len({frame.mm for frame in one}) > 10 and [frame.mm for frame in one] == [frame.mm for frame in joined]
    table.saw(13, "B2 in again", "moves as B1 does" if same else "elsewhere than B1", same)
