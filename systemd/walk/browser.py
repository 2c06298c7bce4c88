"""The tablet's page in a real browser: Debian's chromium without a screen, driven by chromedriver. Neither has to be there."""

import json
import shutil
import subprocess
import time
import urllib.request

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"


def is_installed():
    return bool(shutil.which("chromium") and shutil.which("chromedriver"))


class Browser:
    """A browser with one page."""

    def __init__(self, url):
        self.driver = subprocess.Popen(["chromedriver", "--port=9515"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.session = ""
        arguments = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--no-first-run", "--no-proxy-server"]
        wanted = {"capabilities": {"alwaysMatch": {"goog:chromeOptions": {"args": arguments}}}}
        self.session = "/session/" + self._patiently("/session", wanted)["sessionId"]
        self._post("/url", {"url": url})
        # When a finger comes down, by the clock that captures have.
        self.run("addEventListener('pointerdown', () => { window.pressed = Date.now() }, { capture: true })")

    def run(self, script):
        return self._post("/execute/sync", {"script": script, "args": []})

    def wait(self, expression, seconds=20):
        end = time.monotonic() + seconds
        while not self.run(f"return Boolean({expression})"):
            if time.monotonic() > end:
                raise TimeoutError(f"the page never had {expression}")
            time.sleep(0.02)

    def reads(self, element, text):
        self.wait(f"document.getElementById('{element}').textContent.toLowerCase().includes('{text}')")

    def press(self, selector):
        self.wait(f"document.querySelector('{selector}').matches(':enabled')")
        self._post(f"/element/{self._find(selector)}/click", {})

    def touch(self, selector):
        """Puts a finger on an element; returns when, unix time."""
        place = {"type": "pointerMove", "duration": 0, "origin": {ELEMENT: self._find(selector)}, "x": 0, "y": 0}
        down = [place, {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]
        finger = {"type": "pointer", "id": "finger", "parameters": {"pointerType": "touch"}, "actions": down}
        self._post("/actions", {"actions": [finger]})
        return self.run("return window.pressed") / 1000

    def type_text(self, text):
        keys = [{"type": kind, "value": key} for key in text for kind in ("keyDown", "keyUp")]
        self._post("/actions", {"actions": [{"type": "key", "id": "keys", "actions": keys}]})

    def close(self):
        try:
            if self.session:
                self._ask("DELETE", self.session, None)
        finally:
            self.driver.kill()
            self.driver.wait()

    def _find(self, selector):
        return self._post("/element", {"using": "css selector", "value": selector})[ELEMENT]

    def _post(self, path, body):
        return self._ask("POST", self.session + path, body)

    def _patiently(self, path, body):
        for _ in range(100):
            try:
                return self._post(path, body)
            except ConnectionError:
                time.sleep(0.1)
            except urllib.error.URLError as error:
                if not isinstance(error.reason, ConnectionError):
                    raise
                time.sleep(0.1)
        raise TimeoutError("chromedriver does not answer")

    def _ask(self, method, path, body):
        bytes = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"http://127.0.0.1:9515{path}", bytes, {"Content-Type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=60) as reply:
            return json.load(reply)["value"]
