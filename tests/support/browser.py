"""A headless Chromium for tests, driven through its DevTools protocol over two pipes: no driver to install.

https://chromedevtools.github.io/devtools-protocol/. WebGL 1 and 2 run on SwiftShader, whatever the machine has, unless
the machine's own driver is asked for.
"""

import json
import os
import shutil
import subprocess
import threading
from collections.abc import Mapping
from pathlib import Path
from queue import Empty, Queue
from typing import Any, Literal, Self

from limits import LIFT, require_addresses

_FLAGS = (
    *("--headless=new", "--no-sandbox", "--no-first-run", "--disable-extensions", "--disable-component-update"),
    *("--disable-background-networking", "--disable-dev-shm-usage", "--hide-scrollbars", "--mute-audio"),
    *("--use-gl=angle", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--remote-debugging-pipe"),
)
_NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


def chromium() -> str | None:
    """Return the program; None if there is none."""
    return next((path for path in map(shutil.which, _NAMES) if path), None)


class PageError(Exception):
    """What a page threw. `value` is what it says of itself: message, and code if it has one."""

    def __init__(self, text: str, value: dict[str, Any] | None) -> None:
        super().__init__(text)
        self.value = value or {}


class Browser:
    """One Chromium with one page. Use it as a context manager.

    `angle` is what draws: "gl-egl" is the machine's OpenGL ES.
    """

    def __init__(self, profile: Path, angle: Literal["swiftshader", "gl-egl"] = "swiftshader") -> None:
        found = chromium()
        if found is None:
            import pytest

            pytest.skip("no Chromium: tools/system_packages.sh says how to get it")
        require_addresses("Chromium")
        self._command = [found, *_FLAGS, f"--use-angle={angle}", f"--user-data-dir={profile}", "about:blank"]
        self._events: Queue[dict[str, Any]] = Queue()
        self._answers: dict[int, Queue[dict[str, Any]]] = {}
        self._last = 0
        self.console: list[str] = []

    def __enter__(self) -> Self:
        """Start it. Its end of the pipes has the numbers 3 and 4."""
        read_end, self._to = os.pipe()
        self._from, write_end = os.pipe()
        shell = ["bash", "-c", f'{LIFT}exec "$@" 3<&{read_end} 4>&{write_end}', "bash", *self._command]
        self._process = subprocess.Popen(
            shell, pass_fds=(read_end, write_end), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(read_end)
        os.close(write_end)
        threading.Thread(target=self._listen, daemon=True).start()
        self._session = ""
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network"):
            self.send(f"{domain}.enable")
        return self

    def __exit__(self, *_: object) -> None:
        """End it."""
        self._process.terminate()
        self._process.wait(20)
        os.close(self._to)

    @property
    def process_id(self) -> int:
        """Number of its first process."""
        return self._process.pid

    def send(self, method: str, timeout: float = 60.0, **params: object) -> Any:
        """Send a command and return its answer."""
        self._last += 1
        number = self._last
        answer: Queue[dict[str, Any]] = Queue()
        self._answers[number] = answer
        message = {"id": number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        data = memoryview(json.dumps(message).encode() + b"\0")
        while data:
            data = data[os.write(self._to, data) :]
        try:
            found = answer.get(timeout=timeout)
        except Empty:
            raise TimeoutError(f"{method} has no answer after {timeout} s; console: {self.console}") from None
        if "error" in found:
            raise RuntimeError(f"{method}: {found['error']}")
        return found["result"]

    def open(self, url: str, screen: Mapping[str, Any] | None = None) -> None:
        """Go to a page and wait until it has loaded. The screen is the window, if none is given."""
        if screen is None:
            self.send("Emulation.clearDeviceMetricsOverride")
        else:
            self.send("Emulation.setDeviceMetricsOverride", **screen)
        self.console.clear()
        while not self._events.empty():
            self._events.get()
        self.send("Page.navigate", url=url)
        while self._events.get(timeout=30)["method"] != "Page.loadEventFired":
            pass

    def run(self, script: str, *arguments: object, timeout: float = 60.0) -> Any:
        """Return what the body of an async function gives in the page; its `given` are the arguments."""
        text = f"(async (...given) => {{ {script} }})(...{json.dumps(arguments)})"
        found = self.send("Runtime.evaluate", timeout, expression=text, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in found:
            details = found["exceptionDetails"]
            text = details.get("exception", {}).get("description", details["text"])
            raise PageError(
                text, details.get("exception", found["result"]).get("value") or found["result"].get("value")
            )
        return found["result"].get("value")

    def screenshot(self) -> bytes:
        """Return the page as PNG."""
        import base64

        return base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"])

    def _listen(self) -> None:
        data = b""
        while chunk := os.read(self._from, 1 << 20):
            *messages, data = (data + chunk).split(b"\0")
            for each in messages:
                message = json.loads(each)
                if "id" in message:
                    self._answers.pop(message["id"]).put(message)
                elif message["method"] == "Runtime.consoleAPICalled":
                    self.console.append(" ".join(str(one.get("value", one)) for one in message["params"]["args"]))
                elif message["method"] == "Runtime.exceptionThrown":
                    self.console.append(json.dumps(message["params"]["exceptionDetails"])[:1000])
                else:
                    self._events.put(message)
        os.close(self._from)
