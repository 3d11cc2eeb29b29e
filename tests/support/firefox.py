"""A Firefox for tests, driven through Marionette, which is built into it: no driver to install.

https://firefox-source-docs.mozilla.org/testing/marionette/Protocol.html. Headless it has no WebGL
(https://bugzil.la/1375585), so it draws on the X server of tests, Xvfb; WebGL 1 and 2 run on Mesa's software driver. It
has the methods of `Browser` that tests of pictures use: `open`, `run`, `screenshot`.
"""

import base64
import json
import os
import shutil
import socket
import subprocess
import time
from pathlib import Path
from typing import Any, Self

from browser import PageError
from limits import LIFT, require_addresses

_NAMES = ("firefox-esr", "firefox")
_START_S = 60.0
_PREFERENCES = {
    "app.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.homepage_override.mstone": "ignore",
    "datareporting.policy.dataSubmissionEnabled": False,
    "dom.max_script_run_time": 0,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.reportingpolicy.firstRun": False,
    "webgl.force-enabled": True,
    "webgl.disable-fail-if-major-performance-caveat": True,
}
_SCRIPT = """
const [text, given, done] = arguments;
const made = new (async () => {}).constructor("...given", text);
made(...given).then(
  (value) => done({ value: value === undefined ? null : value }),
  (error) => done({ thrown: String(error), value: { message: String(error?.message), code: error?.code ?? null } }),
);
"""


def firefox() -> str | None:
    """Return the program; None if there is none."""
    return next((path for path in map(shutil.which, _NAMES) if path), None)


class Firefox:
    """One Firefox with one page. Use it as a context manager."""

    def __init__(self, profile: Path) -> None:
        found = firefox()
        if found is None or shutil.which("Xvfb") is None:
            import pytest

            pytest.skip("no Firefox that draws: tools/system_packages.sh says how to get it")
        require_addresses("Firefox")
        profile.mkdir(parents=True, exist_ok=True)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._port: int = free.getsockname()[1]
        preferences = {**_PREFERENCES, "marionette.port": self._port}
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in preferences.items()]
        (profile / "user.js").write_text("\n".join(lines))
        self._command = [found, "--marionette", "--no-remote", "--profile", str(profile), "about:blank"]
        # Mesa draws in software; without a home of its own it would share one with other programs.
        self._environment = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "HOME": str(profile)}
        self._last = 0
        self._data = b""

    def __enter__(self) -> Self:
        """Start it."""
        quiet = subprocess.DEVNULL
        read_end, write_end = os.pipe()
        screen = ["Xvfb", "-displayfd", str(write_end), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"]
        self._screen = subprocess.Popen(screen, pass_fds=(write_end,), stdout=quiet, stderr=quiet)
        os.close(write_end)
        with os.fdopen(read_end) as told:
            self._environment["DISPLAY"] = f":{told.readline().strip()}"
        shell = ["bash", "-c", f'{LIFT}exec "$@"', "bash", *self._command]
        self._process = subprocess.Popen(shell, stdout=quiet, stderr=quiet, env=self._environment)
        ends = time.monotonic() + _START_S
        while True:
            try:
                self._socket = socket.create_connection(("127.0.0.1", self._port), timeout=5)
                break
            except OSError:
                if time.monotonic() > ends or self._process.poll() is not None:
                    self._process.kill()
                    self._screen.kill()
                    raise
                time.sleep(0.2)
        self._socket.settimeout(180)
        self._message()
        self.send("WebDriver:NewSession", strictFileInteractability=False)
        self.send("WebDriver:SetTimeouts", script=120_000, pageLoad=60_000)
        return self

    def __exit__(self, *_: object) -> None:
        """End it."""
        self._socket.close()
        for process in (self._process, self._screen):
            process.terminate()
            process.wait(20)

    def send(self, command: str, **parameters: object) -> Any:
        """Send a command and return its answer."""
        self._last += 1
        text = json.dumps([0, self._last, command, parameters]).encode()
        self._socket.sendall(f"{len(text)}:".encode() + text)
        _, _, error, result = self._message()
        if error:
            raise RuntimeError(f"{command}: {error['error']}: {error['message']}")
        return result

    def open(self, url: str) -> None:
        """Go to a page and wait until it has loaded."""
        self.send("WebDriver:Navigate", url=url)

    def run(self, script: str, *arguments: object) -> Any:
        """Return what the body of an async function gives in the page; its `given` are the arguments."""
        found = self.send("WebDriver:ExecuteAsyncScript", script=_SCRIPT, args=[script, list(arguments)], sandbox=None)
        answer = found["value"]
        if "thrown" in answer:
            raise PageError(answer["thrown"], answer["value"])
        return answer["value"]

    def screenshot(self) -> bytes:
        """Return the page as PNG."""
        return base64.b64decode(self.send("WebDriver:TakeScreenshot", full=False)["value"])

    def _message(self) -> Any:
        while b":" not in self._data:
            self._data += self._received()
        size, _, self._data = self._data.partition(b":")
        while len(self._data) < int(size):
            self._data += self._received()
        text, self._data = self._data[: int(size)], self._data[int(size) :]
        return json.loads(text)

    def _received(self) -> bytes:
        data = self._socket.recv(1 << 20)
        if not data:
            raise ConnectionError("Firefox has ended")
        return data
