"""Headless Chromium by its debugging pipe and Firefox by Marionette: no driver, no package."""

from __future__ import annotations

import base64
import itertools
import json
import os
import socket
import subprocess
import time
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any


class Opened(ABC):
    """A page in a browser, as far as both browsers know the same."""

    complaints: list[str]

    @abstractmethod
    def run(self, script: str) -> Any:
        """The value of a script in the page; promises are awaited."""

    def wait(self, condition: str, seconds: float = 300.0) -> None:
        """Wait until a condition holds in the page."""
        done = self.run(
            f"(async () => {{ const end = Date.now() + {1000 * seconds};"
            f"while (!({condition})) {{ if (Date.now() > end) return false;"
            "await new Promise((go) => setTimeout(go, 20)); } return true; })()"
        )
        assert done, f"{condition} did not come true: {self.complaints}"


class Chromium(Opened):
    """One page in one browser; requests that leave the machine are recorded in `requests`."""

    def __init__(self, program: str, profile: Path) -> None:
        ours = os.pipe()
        theirs = os.pipe()

        def pipes() -> None:  # the browser reads 3 and writes 4
            for end, number in ((os.dup(ours[0]), 3), (os.dup(theirs[1]), 4)):
                os.dup2(end, number)

        flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--mute-audio"]
        flags += ["--remote-debugging-pipe", f"--user-data-dir={profile}", "--no-first-run"]
        flags += ["--disable-background-networking", "--disable-dev-shm-usage"]
        self._process = subprocess.Popen(
            [program, *flags, "about:blank"],
            preexec_fn=pipes,
            close_fds=False,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(ours[0])
        os.close(theirs[1])
        self._write, self._read = os.fdopen(ours[1], "wb"), os.fdopen(theirs[0], "rb")
        self._numbers, self._rest = itertools.count(1), b""
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self._session: str | None = None
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self.ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Accessibility", "Log"):
            self.ask(f"{domain}.enable")

    def _message(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            part = os.read(self._read.fileno(), 1 << 20)
            assert part, "the browser has ended"
            self._rest += part
        message, self._rest = self._rest.split(b"\0", 1)
        return json.loads(message)

    def ask(self, method: str, **params: Any) -> Any:
        """The answer to one command of the DevTools protocol."""
        number = next(self._numbers)
        question = {"id": number, "method": method, "params": params}
        if self._session:
            question["sessionId"] = self._session
        self._write.write(json.dumps(question).encode() + b"\0")
        self._write.flush()
        while True:
            message = self._message()
            if message.get("id") == number:
                assert "error" not in message, message["error"]
                return message["result"]
            self._note(message.get("method"), message.get("params", {}))

    def _note(self, method: str | None, params: dict[str, Any]) -> None:
        if method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(params["exceptionDetails"])[:600])
        elif method == "Log.entryAdded":
            self.complaints.append(params["entry"]["text"])

    def run(self, script: str) -> Any:
        """The value of a script in the page; promises are awaited."""
        answer = self.ask(
            "Runtime.evaluate",
            expression=script, awaitPromise=True, returnByValue=True, userGesture=True,
        )  # fmt: skip
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def open(self, address: str, width: int = 1280, height: int = 900) -> None:
        """Load a page in a window of a size in CSS pixels and wait for its first picture."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        self.ask("Page.navigate", url="about:blank")
        self.ask("Page.navigate", url=address)
        self.wait("globalThis.squeal?.view != null")

    def press(self, key: str, times: int = 1) -> None:
        """Press a key as a user would."""
        codes = {"ArrowRight": 39, "Tab": 9}
        for _ in range(times):
            for kind in ("rawKeyDown", "keyUp"):
                self.ask(
                    "Input.dispatchKeyEvent",
                    type=kind, key=key, code=key, windowsVirtualKeyCode=codes[key],
                )  # fmt: skip

    def picture(self, file: Path) -> None:
        """A screenshot of the whole page."""
        size = self.ask("Page.getLayoutMetrics")["cssContentSize"]
        shot = self.ask(
            "Page.captureScreenshot",
            captureBeyondViewport=True,
            clip={"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1},
        )
        file.write_bytes(base64.b64decode(shot["data"]))

    def close(self) -> None:
        """End the browser."""
        self._session = None
        self.ask("Browser.close")
        self._process.wait(30)
        self._write.close()
        self._read.close()


class Firefox(Opened):
    """One page in Firefox; what a script throws is its value."""

    def __init__(self, program: str, profile: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        (profile / "user.js").write_text(f'user_pref("marionette.port", {port});\n')
        self._process = subprocess.Popen(
            [program, "--headless", "--marionette", "--no-remote", "--profile", str(profile)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        end = time.monotonic() + 120
        while True:
            try:
                self._socket = socket.create_connection(("127.0.0.1", port))
                break
            except OSError:
                assert time.monotonic() < end
                assert self._process.poll() is None
                time.sleep(0.2)
        self._stream = self._socket.makefile("rb")
        self._answer()  # its greeting
        self.complaints = []
        self.ask("WebDriver:NewSession", {})
        self.ask("WebDriver:SetTimeouts", {"script": 300_000})

    def _answer(self) -> Any:
        size = b""
        while not size.endswith(b":"):
            byte = self._stream.read(1)
            assert byte, "the browser has ended"
            size += byte
        return json.loads(self._stream.read(int(size[:-1])))

    def ask(self, method: str, params: dict[str, Any]) -> Any:
        """The answer to one command of Marionette."""
        question = json.dumps([0, 1, method, params]).encode()
        self._socket.sendall(b"%d:%s" % (len(question), question))
        *_, error, result = self._answer()
        assert error is None, error
        return result

    def run(self, script: str) -> Any:
        """The value of a script in the page; promises are awaited."""
        whole = (
            "const done = arguments[arguments.length - 1];"
            f"Promise.resolve(({script})).then(done, (e) => done(String(e)));"
        )
        return self.ask("WebDriver:ExecuteAsyncScript", {"script": whole, "args": []})["value"]

    def open(self, address: str) -> None:
        """Load a page and wait for its first picture."""
        self.ask("WebDriver:Navigate", {"url": address})
        self.wait("globalThis.squeal?.view != null")

    def close(self) -> None:
        """End the browser."""
        self._socket.close()
        self._process.terminate()
        self._process.wait(30)
