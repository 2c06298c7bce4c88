"""The table of the walk: for each job of an operator what was done, what was seen, and whether that is as it should be."""

import textwrap

JOBS = {
    2: "stop everything in 100 ms",
    3: "a dead controller is named before the doors open",
    4: "never jerk the guests",
    8: "power blinked: parked until a person says so",
    9: "60 % for the kids' show, row A off",
    10: "no water",
    13: "a broken seat out, the show goes on",
    15: "today's list of cues",
    16: "house automation drives it",
    17: "prove what was played",
    19: "install it; is it real-time?",
    21: "a tablet, and no slip of the finger",
    22: "watch it from afar",
    24: "nobody on the guest network may start it",
}


class Table:
    """What was seen so far."""

    def __init__(self):
        self.seen = {job: [] for job in JOBS}

    def saw(self, job, done, seen, ok):
        """Notes that something was done, what was seen of it, and whether that is as it should be."""
        self.seen[job].append((done, str(seen), bool(ok)))

    def is_good(self):
        return all(seen and all(ok for _, _, ok in seen) for seen in self.seen.values())

    def show(self):
        for job, seen in self.seen.items():
            verdict = "ok" if seen and all(ok for _, _, ok in seen) else "FAILED"
            print(f"{job:>2}  {JOBS[job]:<52} {verdict}")
            for done, what, ok in seen or [("nothing", "it was never come to", False)]:
                text = f"{done}: {what}" + ("" if ok else "  <-- WRONG")
                print(textwrap.fill(text, 118, initial_indent="    ", subsequent_indent="      "))
