"""Chromium without a window, by its own DevTools protocol: pages, fingers, keys, screenshots."""

import asyncio
import base64
import contextlib
import itertools
import json
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

from tornado.websocket import websocket_connect

from robotont_testing.harness import again_until, wait_for

CHROMIUM = shutil.which("chromium")
PATIENCE = 30.0  # [s] for an answer of the browser
PHONE, PHONE_LYING, DESKTOP = (390, 844, 3), (844, 390, 3), (1280, 800, 1)  # width, height [px], pixel ratio
LEFT = ("Inspected target navigated or closed", "Execution context was destroyed.")  # as Chromium says it


class PageLeftError(AssertionError):
    """The page of a script was left before the script had ended."""


def one_browser():
    """For a fixture of pytest: a Browser, until its tests have ended."""
    if CHROMIUM is None:
        raise unittest.SkipTest("no chromium")
    with Browser() as one:
        yield one


class Browser:
    """A browser with a profile of its own; ends with the `with` block."""

    def __init__(self):
        lifeline = os.environ.get("ROBOTONT_LIFELINE", "").rpartition(":")[2]  # goes also when this is killed
        self._folder = tempfile.mkdtemp(prefix="robotont_browser_", dir=lifeline or None)
        self.process = subprocess.Popen(
            [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--remote-debugging-port=0",
             "--disable-dev-shm-usage", "--disable-background-networking", "--disable-component-update",
             "--disable-extensions", "--disable-breakpad",
             "--hide-scrollbars=false", f"--user-data-dir={self._folder}", "about:blank"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
            env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"})
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._numbers = itertools.count(1)
        self._answers = {}
        self.events = []  # (session, method, parameters)
        try:
            self._connect(Path(self._folder) / "DevToolsActivePort")
        except BaseException:
            self.__exit__()
            raise

    def _connect(self, port_file):
        port, path = wait_for(lambda: port_file.exists() and len(port_file.read_text().split()) == 2
                              and port_file.read_text().split(), "the browser", timeout=PATIENCE)

        async def connect():
            return await websocket_connect(
                f"ws://127.0.0.1:{port}{path}", max_message_size=2 ** 28, on_message_callback=self._on_message)
        self._socket = asyncio.run_coroutine_threadsafe(connect(), self._loop).result(PATIENCE)
        self._socket.protocol.stream.set_nodelay(True)  # else a message may wait until the one before is acknowledged

    def _on_message(self, text):
        if text is None:
            return
        message = json.loads(text)
        if "id" in message:
            self._answers.pop(message["id"]).set_result(message)
        else:
            self.events.append((message.get("sessionId"), message["method"], message["params"]))

    def call(self, method, session=None, **parameters):
        """The result of a method of the protocol; AssertionError when the browser refuses it."""
        async def answered():
            number = next(self._numbers)
            self._answers[number] = answer = self._loop.create_future()
            message = {"id": number, "method": method, "params": parameters}
            await self._socket.write_message(json.dumps({**message, "sessionId": session} if session else message))
            return await answer
        answer = asyncio.run_coroutine_threadsafe(answered(), self._loop).result(PATIENCE)
        if answer.get("error", {}).get("message") in LEFT:
            raise PageLeftError(answer["error"]["message"])
        assert "error" not in answer, (method, answer["error"])
        return answer["result"]

    def page(self, url, size=DESKTOP, dark=False, language="en", script="", any_certificate=False):
        """Open a Page; `script` runs before those of the page. `any_certificate`: as if the user had accepted it."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, target, session)
        page.look(size, dark)
        page.call("Page.enable")
        page.call("Page.addScriptToEvaluateOnNewDocument", source=f"""{script}
            Object.defineProperty(navigator, 'languages', {{get: () => ['{language}']}});""")
        page.call("Runtime.enable")
        page.call("Log.enable")
        page.call("Security.setIgnoreCertificateErrors", ignore=any_certificate)
        page.call("Page.navigate", url=url)
        page.wait("document.readyState == 'complete' && location.href != 'about:blank'", "the page")
        return page

    def kill(self):
        """End every process of the browser at once, as a crash does."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.kill()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        shutil.rmtree(self._folder, ignore_errors=True)


class Page:
    """One tab."""

    def __init__(self, browser, target, session):
        self._browser = browser
        self._target = target
        self._session = session
        self._fingers = {}

    def call(self, method, **parameters):
        """The result of a method of the protocol for this tab."""
        return self._browser.call(method, self._session, **parameters)

    def run(self, script):
        """The value of JavaScript in the page; awaits promises."""
        result = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, script, what, timeout=PATIENCE):
        """The first true value of a script, also of the next page; AssertionError names `what` after `timeout` [s]."""
        def value():
            with contextlib.suppress(PageLeftError):
                return self.run(script)
        return wait_for(value, what, timeout, period=0.02)

    def look(self, size, dark):
        """Be a screen of a `size` (width, height [px], pixel ratio); `dark`: with a dark colour scheme."""
        width, height, ratio = size
        phone = min(width, height) < 500
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio,
                  mobile=phone)
        self.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=5)
        self.call("Emulation.setEmulatedMedia",
                  features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def box(self, selector):
        """(left, top, width, height) of an element [px]."""
        return tuple(self.run(f"(() => {{const b = document.querySelector({selector!r}).getBoundingClientRect();"
                              "return [b.x, b.y, b.width, b.height]})()"))

    def place(self, selector, right=0.0, up=0.0):
        """(x, y) [px] on an element: a part of its half width from its middle."""
        left, top, width, height = self.box(selector)
        return left + width / 2 * (1 + right), top + height / 2 - width / 2 * up

    def finger(self, number, selector, right=0.0, up=0.0):
        """Put finger `number` on an element, or move it there, to a `place`."""
        self.finger_at(number, *self.place(selector, right, up))

    def push(self, number, selector, right=0.0, up=0.0, reach=80.0):
        """Put finger `number` on a stick of the page, or keep it there, and push it by parts of its reach [px]."""
        x, y = self.place(selector)
        if number not in self._fingers:
            self.finger_at(number, x, y)
        self.finger_at(number, x + reach * right, y - reach * up)

    def push_until(self, condition, what, *where, **how):
        """Push a stick until `condition()`, as a person: who sees that a stall has taken the stick pushes it anew."""
        def anew():
            self.lift()
            self.push(1, *where, **how)
        return again_until(anew, condition, what, 2.0, 40.0)

    def finger_at(self, number, x, y):
        """Put finger `number` on (x, y) [px], or move it there."""
        kind = "touchMove" if number in self._fingers else "touchStart"
        self._fingers[number] = {"x": x, "y": y, "id": number}
        self._touch(kind)

    @property
    def touched(self):
        """Whether a finger is on the screen."""
        return bool(self._fingers)

    def lift(self):
        """Lift all fingers."""
        if self._fingers:
            self._fingers.clear()
            self._touch("touchEnd")

    def cancel_fingers(self):
        """As when the system takes the screen away from the page."""
        self._fingers.clear()
        self._touch("touchCancel")

    def _touch(self, kind):
        points = [] if kind == "touchCancel" else list(self._fingers.values())
        self.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def tap(self, selector):
        """Click an element."""
        self.run(f"document.querySelector({selector!r}).click()")

    def key(self, code, down):
        """Press or release a key, such as KeyW."""
        self.call("Input.dispatchKeyEvent", type="rawKeyDown" if down else "keyUp", code=code)

    def text(self, selector):
        """Text of an element."""
        return self.run(f"document.querySelector({selector!r}).textContent.trim()")

    def screenshot(self, path):
        """Save a PNG."""
        Path(path).write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def complaints(self):
        """Complaints of the browser: exceptions, refused resources, accessibility of the policy."""
        found = []
        for session, method, parameters in self._browser.events:
            if session == self._session and method == "Runtime.exceptionThrown":
                found.append(parameters["exceptionDetails"])
            if session == self._session and method == "Log.entryAdded" and parameters["entry"]["level"] == "error":
                found.append(parameters["entry"]["text"])
        return found

    def close(self):
        """Close the tab."""
        self._browser.call("Target.closeTarget", targetId=self._target)
