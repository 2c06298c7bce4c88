"""The inside of walk.sh: a technician's day with the package, from install to report, and a table of what was seen. The pictures
are taken from outside: frames on the wire, replies, files. Run as root in a container; /trial/errors has all that was said."""

import subprocess
import sys
import time
import traceback

import after
import before
import show
from hall import Tablet, Terminal, say
from table import Table


def walk(table):
    terminal = Terminal()
    before.install(terminal, table)
    tap = subprocess.Popen([sys.executable, "/trial/walk/wire.py", "/trial/loopback.pcap"], stdout=subprocess.PIPE, text=True)
    tap.stdout.readline()
    booth, tablet = before.configure(terminal)
    sim = before.seats(terminal)
    before.start(terminal, table)
    before.library(terminal, table)
    booth.until_state("parked")
    before.preflight(terminal, table, booth)
    before.guests(table, booth, tablet)
    at = show.playlist(terminal, table, booth, tablet)
    stops = show.stops(terminal, table, booth, tablet)
    crashed, parked = show.crash(terminal, table, booth, tablet)
    after.reports(terminal, table, tablet, Tablet())
    removed = show.upgrade(terminal, table, booth, tablet)
    before.install_again(terminal, table)
    log = terminal.run("journalctl --no-pager -q -o short-precise -u kinocue")
    for process in (sim, tap):
        process.terminate()
        if process.wait(10) != 0:
            raise RuntimeError(f"{process.args} ended with {process.returncode}")
    after.frames(table, log, at, stops, crashed, parked, removed)
    table.saw(19, "every command of the README's section", f"tried, but for {terminal.left or 'none'}", not terminal.left)


def main():
    table, begin = Table(), time.monotonic()
    failed = None
    try:
        walk(table)
    except Exception as error:  # whatever it is, what was seen so far is shown
        traceback.print_exc()
        failed = f"{type(error).__name__}: {error}"
    table.show()
    say(f"took {time.monotonic() - begin:.0f} s")
    if failed:
        print(f"\nthe walk ended early: {failed}")
    elif table.is_good():
        print("\nall as it should be")


main()
