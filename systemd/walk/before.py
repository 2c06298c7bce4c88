"""From the package to a hall that is ready: install, configure, start, fill the library, check, and who is let in."""

import json
import pathlib
import pwd
import re
import socket
import subprocess
import time

from hall import ADDRESS, Failed, Tablet

CONFIG = "/etc/kinocue/kinocue.toml"
SIM_SOCKET = "/run/sim.sock"
GEAR = """
[osc]
listen = "127.0.0.1:53000"
sources = ["127.0.0.1"]
[text]
listen = "127.0.0.1:53535"
sources = ["127.0.0.1"]

[preset.kids]
motion = "60%"
vibration = "50%"
effects = { water = false }
"""
TODAY = """\
title = "Saturday"

[[entry]]
cue = "seat-demo"
then = "go"

[[entry]]
cue = "bench-ride"
preset = "kids"
"""


def install(terminal, table):
    """The package: what it brings, and that nothing runs because of it."""
    said = terminal.run("apt install ./kinocue_*.deb")
    terminal.read_section()
    terminal.take("apt install ./kinocue_*.deb")
    active = subprocess.run(["systemctl", "is-active", "kinocue"], capture_output=True, text=True).stdout.strip()
    enabled = subprocess.run(["systemctl", "is-enabled", "kinocue"], capture_output=True, text=True).stdout.strip()
    table.saw(19, "installed the package", f"the service is {active} and {enabled}", (active, enabled) == ("inactive", "disabled"))
    brought = ["/usr/share/man/man1/kinocue-serve.1.gz", "/usr/share/bash-completion/completions/kinocue"]
    missing = [path for path in brought if not pathlib.Path(path).exists()]
    missing += [] if "kinocue check" in said else ["a word of what to do next"]
    table.saw(19, "looked for manual pages, completions, advice", f"missing: {', '.join(missing) or 'nothing'}", not missing)


def install_again(terminal, table):
    """Purged and installed anew: what belongs to the site has stayed, and still nothing runs."""
    terminal.run("apt-get purge -y kinocue")
    left = [path for path in ("/usr/bin/kinocue", "/usr/lib/systemd/system/kinocue.service") if pathlib.Path(path).exists()]
    kept = [path for path in (CONFIG, "/var/lib/kinocue/cues/seat-demo.csv", "/var/log/kinocue") if pathlib.Path(path).exists()]
    table.saw(19, "purged the package", f"left of it: {left or 'nothing'}; of the site: {', '.join(kept)}", not left and len(kept) == 3)
    terminal.run("apt install ./kinocue_*.deb")
    active = subprocess.run(["systemctl", "is-active", "kinocue"], capture_output=True, text=True).stdout.strip()
    table.saw(19, "installed it once more", f"the service is {active}", active == "inactive")


def configure(terminal):
    """A configuration with simulated seats, tokens for booth and tablet, and show-control gear; gives the two tokens."""
    terminal.readme(f"cp /usr/share/doc/kinocue/examples/kinocue.toml {CONFIG}")
    terminal.readme(f"kinocue check {CONFIG}")
    terminal.readme(f"cp /usr/share/doc/kinocue/examples/simulated.toml {CONFIG}")
    tokens = {}
    terminal.readme("kinocue token booth --role engineer")
    with open(CONFIG, "a") as file:
        file.write(GEAR)
        for name, role in (("booth", "engineer"), ("tablet", "operate")):
            token = json.loads(terminal.run(f"kinocue token {name} --role {role} --json 2> /dev/null"))
            tokens[name] = token["token"]
            file.write("\n" + token["config"] + "\n")
    terminal.run(f"kinocue check {CONFIG}")
    return Tablet(tokens["booth"]), Tablet(tokens["tablet"])


def seats(terminal):
    """Simulated controllers, which log what they were sent and how their motors moved."""
    command = terminal.take(f"kinocue sim --safe --count 8 --control {SIM_SOCKET} &").rstrip("& ").split()
    logs = ["--log", "/trial/frames.csv", "--moves", "/trial/moves.csv"]
    sim = subprocess.Popen([*command, *logs], stdout=subprocess.DEVNULL, stderr=open("/trial/sim.err", "w"))
    for _ in range(500):
        if "7415" in pathlib.Path("/trial/sim.err").read_text():
            return sim
        time.sleep(0.01)
    raise Failed("the simulated controllers did not come up")


def plug(command):
    """Tells a simulated controller what happens to it; gives when that was so, unix time."""
    with socket.socket(socket.AF_UNIX) as peer:
        peer.settimeout(5)
        peer.connect(SIM_SOCKET)
        peer.sendall(command.encode() + b"\n")
        answer = peer.recv(1024)
    if answer.strip() != b"ok":
        raise Failed(f"sim: {command}: {answer}")
    return time.time()


def start(terminal, table):
    """The service, and whether it is what the unit promises."""
    terminal.run("useradd anna")
    terminal.readme("usermod --append --groups kinocue anna")
    begin = time.monotonic()
    terminal.readme("systemctl enable --now kinocue")
    ready = time.monotonic() - begin
    said = terminal.readme("systemctl status kinocue")
    table.saw(19, "started the service", f"ready after {ready:.1f} s: {line_of('Status:', said)}", ready < 10)
    pid = main_pid()
    user = pwd.getpwuid(pathlib.Path(f"/proc/{pid}").stat().st_uid).pw_name
    policy = subprocess.run(["chrt", "-p", str(pid)], capture_output=True, text=True).stdout
    policy = line_of("policy:", policy)
    table.saw(19, "asked the system who runs it, and how", f"user {user}, {policy}", user == "kinocue" and "SCHED_FIFO" in policy)
    said = terminal.run("chrt --fifo 50 kinocue doctor || true")
    real_time = line_of("realtime_policy", said)
    found = f"{real_time}; {line_of('lateness_idle', said)}"
    table.saw(19, "kinocue doctor with the priority of the service", found, "FIFO" in real_time.upper())


def library(terminal, table):
    """Two cues and a playlist; one playlist that names a cue that is not there."""
    for cue in ("seat-demo", "bench-ride"):
        terminal.readme(f"kinocue upload /usr/share/kinocue/cues/{cue}.csv", user="anna")
    pathlib.Path("/trial/today.toml").write_text(TODAY)
    terminal.readme("cp today.toml /var/lib/kinocue/playlists/today.toml", user="anna")
    pathlib.Path("/var/lib/kinocue/playlists/torn.toml").write_text(TODAY.replace("bench-ride", "no-such-cue"))
    said = terminal.run("kinocue playlist torn", user="anna", fails=True)
    named = re.search(r"torn\.toml:\d+.*no-such-cue.*", said)
    table.saw(15, "loaded a list with a cue that is not there", named[0] if named else said, named)


def preflight(terminal, table, booth):
    """A dead controller is found while the hall is dark, and named; then all is well."""
    named(table, booth, "while all seats rest")
    booth.until("B4 back", lambda status: health(status, "B4") == "ok", 10)
    plug("8@mute=1")
    begin = time.monotonic()
    said = terminal.run("kinocue preflight", user="anna", fails=True)
    took = time.monotonic() - begin
    line = next((line for line in said.splitlines() if "B4" in line), "B4 is not named")
    found = all(word in line for word in ("row B", "127.0.0.1:7415"))
    table.saw(3, "preflight with B4 unplugged", f"failed after {took:.1f} s: {' '.join(line.split())}", found and took < 10)
    plug("8@mute=0")
    booth.until("B4 back", lambda status: health(status, "B4") == "ok", 10)
    said = terminal.readme("kinocue preflight", user="anna")
    table.saw(3, "preflight with it plugged in", said.strip().splitlines()[-1], "passed" in said)


def named(table, tablet, when):
    """B4's plug is pulled: how long until the status names it."""
    pulled = plug("8@mute=1")

    def is_named(status):
        return health(status, "B4") == "lost" and any(one["controller"] == "B4" for one in status["warnings"])

    status, _ = tablet.until("B4 lost", is_named, 5)
    took = time.time() - pulled
    warning = next(one for one in status["warnings"] if one["controller"] == "B4")
    others = [one["name"] for one in status["controllers"] if one["name"] != "B4" and one["health"] != "ok"]
    said = f"named after {1000 * took:.0f} ms ({warning['text']}); {status['state']}, others that suffer: {others or 'none'}"
    table.saw(3, f"pulled B4's plug {when}", said, took < 1.0 and not others)
    plug("8@mute=0")


def guests(table, booth, tablet):
    """Whoever is not let in, or may not, or comes from elsewhere."""
    guest = Tablet()
    foreign = Tablet(**{"Origin": "http://evil.example"})
    rebound = Tablet(**{"Host": "evil.example"})
    wrong = Tablet("nobody-has-this")
    refused = {
        "a guest presses GO": guest.press("show/go"),
        "a guest loads a list": guest.press("playlist", {"id": "today"}, "PUT"),
        "a wrong token": wrong.press("show/go"),
        "a page of others": foreign.press("show/go"),
        "another name of the server": rebound.press("show/go"),
        "the tablet arms, which an engineer does": tablet.press("show/arm"),
    }
    for who, (code, reply) in refused.items():
        table.saw(24, who, f"{code} {reply.get('code')}", code in (401, 403))
    code, _, _ = guest.get("/api/v1/show/go")
    table.saw(24, "a GET of a change", code, code in (404, 405))
    code, reply = tablet.press("show/go")
    table.saw(21, "GO before ARM", f"{code}: {reply.get('detail')}", code == 409)
    _, _, text = guest.get("/")
    scripts = re.findall(r'(?:src|href)="([^"]+)"', text)
    far = [path for path in scripts if "://" in path]
    alive = all(guest.get("/" + path.lstrip("/"))[0] == 200 for path in scripts)
    table.saw(21, f"opened http://{ADDRESS}/", f"one page and {len(scripts)} files of this machine alone", alive and not far)


def health(status, name):
    return next(one["health"] for one in status["controllers"] if one["name"] == name)


def main_pid():
    shown = subprocess.run(["systemctl", "show", "-P", "MainPID", "kinocue"], capture_output=True, text=True)
    return int(shown.stdout)


def line_of(word, text):
    """What stands behind a word, up to the end of its line."""
    return next((line.split(word, 1)[1].strip() for line in text.splitlines() if word in line), f"no {word}")
