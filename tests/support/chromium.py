"""Headless Chromium for tests of pages, spoken to over its pipe (--remote-debugging-pipe): no port, no library.

A test is a function of a Page that calls check(); use_page() opens the page for it and judges what the browser complained about.
"""
import base64
import fcntl
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

PATIENCE_S = 120  # a slow, shared machine


class Browser:
    """The DevTools protocol: JSON messages with a zero byte behind each, on descriptors 3 and 4."""

    def __init__(self, program, profile):
        to_browser, self.out = os.pipe()
        self.into, from_browser = os.pipe()

        def place():  # in the child; high numbers first, as either end may have the other's
            ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (to_browser, from_browser)]
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--disable-extensions",
             "--disable-background-networking", "--remote-debugging-pipe", f"--user-data-dir={profile}", "--window-size=1400,1500", "about:blank"],
            preexec_fn=place, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.number, self.rest, self.events = 0, b"", []

    def message(self):
        while b"\0" not in self.rest:
            more = os.read(self.into, 1 << 20)
            if not more:
                raise RuntimeError("chromium has gone")
            self.rest += more
        one, self.rest = self.rest.split(b"\0", 1)
        return json.loads(one)

    def call(self, method, session=None, **parameters):
        self.number += 1
        request = {"id": self.number, "method": method, "params": parameters}
        if session:
            request["sessionId"] = session
        os.write(self.out, json.dumps(request).encode() + b"\0")
        while True:
            answer = self.message()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def close(self):
        self.process.terminate()
        self.process.wait(30)


class Page:
    def __init__(self, browser):
        self.browser = browser
        target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        return self.browser.call(method, self.session, **parameters)

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait_for(self, expression):
        until = time.monotonic() + PATIENCE_S
        while True:
            try:
                if self.value(expression):
                    return
            except RuntimeError:
                pass  # the page before has gone, the next one is not there yet
            if time.monotonic() > until:
                raise SystemExit(f"FAILED never came: {expression}")
            time.sleep(0.05)

    def key(self, key, shift=False):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, modifiers=8 if shift else 0)

    def scheme(self, name):
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": name}])
        time.sleep(0.3)  # the page draws again when it is told

    def shot(self, path):
        self.call("Emulation.setDeviceMetricsOverride", width=1400, height=1650, deviceScaleFactor=1, mobile=False)
        data = self.call("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(data))


failures = []


def check(what, good):
    print("ok    " if good else "FAILED", what)
    if not good:
        failures.append(what)


def from_page(request, url):
    """The page itself, or what it made of its own parts."""
    return request in (url, "about:blank") or request.startswith("blob:null/")


def complaints(events, url):
    """Errors and warnings of the console, and requests to anywhere but the page itself and the flight that serves it."""
    found = []
    for event in events:
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            found.append(details.get("exception", {}).get("description") or details.get("text", "exception"))
        if method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning"):
            found.append(str(parameters["args"]))
        if method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            found.append(parameters["entry"]["text"])
        if method == "Network.requestWillBeSent" and not from_page(parameters["request"]["url"], url):
            found.append("request: " + parameters["request"]["url"][:200])
        if method == "Network.webSocketCreated" and parameters["url"] != url.replace("http:", "ws:"):
            found.append("web socket: " + parameters["url"][:200])
    return found


kDrawn = "document.documentElement?.dataset.ready === 'yes'"


def use_page(url, use, ready=kDrawn):
    """Opens `url`, calls use(page, seconds until it was `ready`), closes the browser. The exit code: 0, 1 failed, 77 no browser."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        print("SKIPPED: no chromium on this machine: toolchain/setup tests/platform/report/packages.txt installs it")
        return 77
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile)
        try:
            page = Page(browser)
            page.call("Emulation.setDeviceMetricsOverride", width=1400, height=900, deviceScaleFactor=1, mobile=False)
            page.scheme("light")
            start = time.monotonic()
            page.call("Page.navigate", url=url)
            page.wait_for(ready)
            use(page, time.monotonic() - start)
            for complaint in complaints(browser.events, url):
                check(complaint, False)
        finally:
            browser.close()
    print(f"{len(failures)} failed")
    return 1 if failures else 0


def folder_of(name):
    """Where screenshots go; None for an empty name."""
    if not name:
        return None
    pathlib.Path(name).mkdir(parents=True, exist_ok=True)
    return pathlib.Path(name)
