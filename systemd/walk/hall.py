"""The hall from outside: commands as somebody types them, requests as the tablet's page sends them."""

import http.client
import json
import pathlib
import re
import subprocess
import sys
import time
import uuid

ADDRESS = "127.0.0.1:8480"
README = pathlib.Path("/usr/share/doc/kinocue/README.md")
SECTION = "## Running a hall"


class Failed(Exception):
    """Something that the walk cannot go on without."""


def say(text):
    print(text, file=sys.stderr, flush=True)


class Terminal:
    """Runs commands. Those of the README's section are taken from it word by word, and none of them is to be left out."""

    def __init__(self):
        self.left = []

    def read_section(self):
        text = README.read_text().split(f"\n{SECTION}\n", 1)[1].split("\n## ", 1)[0]
        blocks = re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        lines = "".join(blocks).replace("\\\n", " ").splitlines()
        self.left = [re.sub(r"\s+#.*", "", line).strip() for line in lines if line.strip()]

    def take(self, command):
        """A command that stands in the README, to be run once."""
        if command not in self.left:
            raise Failed(f"README, {SECTION}: there is no `{command}`, or it was run already")
        self.left.remove(command)
        return command

    def readme(self, command, user=None):
        """Runs a command that stands in the README."""
        return self.run(self.take(command), user)

    def run(self, command, user=None, fails=False, seconds=60):
        """Runs a command in a shell, as somebody; returns what it wrote to both outputs."""
        shell = ["runuser", "-u", user, "--", "bash", "-c", command] if user else ["bash", "-c", command]
        say(f"{user or 'root'}$ {command}")
        done = subprocess.run(shell, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd="/trial", timeout=seconds)
        say(done.stdout.rstrip())
        if fails != (done.returncode != 0):
            raise Failed(f"`{command}` ended with {done.returncode}: {done.stdout.strip()[-300:]}")
        return done.stdout


class Tablet:
    """Sends what the page would send, with somebody's token."""

    def __init__(self, token=None, **headers):
        self.headers = {"Origin": f"http://{ADDRESS}", **headers}
        if token:
            self.headers["Authorization"] = f"Bearer {token}"

    def get(self, path):
        """What is there: the code of the reply, its headers and its text."""
        return self._request("GET", path, None, {})

    def press(self, path, body=None, method="POST", **more):
        """Asks for a change; returns the code of the reply and its JSON."""
        headers = {
            "Content-Type": "application/json",
            "Idempotency-Key": uuid.uuid4().hex,
            "X-Kinocue-Sent": str(time.time_ns() // 1_000_000),
            **more,
        }
        code, _, text = self._request(method, f"/api/v1/{path}", json.dumps(body or {}), headers)
        return code, json.loads(text or "{}")

    def must(self, path, body=None, method="POST"):
        """The same for what has to be done."""
        code, reply = self.press(path, body, method)
        say(f"tablet: {method} {path} {body or ''}: {code} {reply.get('state')}: {reply.get('detail', '')}")
        if code != 200:
            raise Failed(f"{path}: {code} {reply}")
        return reply

    def status(self):
        code, _, text = self.get("/api/v1/status")
        if code != 200:
            raise Failed(f"status: {code} {text}")
        return json.loads(text)

    def until(self, what, is_so, seconds):
        """Looks at the status until that is so; returns it, and how long that took."""
        begin = time.monotonic()
        while True:
            try:
                status = self.status()
                if is_so(status):
                    return status, time.monotonic() - begin
            except OSError:
                status = {}  # it starts anew
            if time.monotonic() - begin > seconds:
                raise Failed(f"not {what} within {seconds} s, but {status.get('state')}: {status.get('cause')}")
            time.sleep(0.005)

    def until_state(self, state, seconds=20):
        return self.until(state, lambda status: status["state"] == state, seconds)

    def until_film(self, cue, position_s, seconds=30):
        """Waits until a cue plays and its film is there."""

        def is_there(status):
            show = status["show"]
            there = show and show["cue"] == cue and show["position_s"] >= position_s
            return there and status["state"] in ("playing", "holding")

        return self.until(f"playing {cue} at {position_s} s", is_there, seconds)

    def _request(self, method, path, body, headers):
        connection = http.client.HTTPConnection(ADDRESS, timeout=30)
        try:
            connection.request(method, path, body, {**self.headers, **headers})
            reply = connection.getresponse()
            return reply.status, reply.headers, reply.read().decode()
        finally:
            connection.close()
