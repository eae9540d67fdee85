#!/usr/bin/env python3
"""Opens a page of `roborun report` in headless Chromium and uses it as a person would.

usage: page_in_chromium.py PAGE.html [FOLDER]     FOLDER: where screenshots go

Fails on an error in the console, a request of any kind, a slider, key or click that does not change picture and reasons, a colour
scheme that changes nothing, and on a page of 3 MB or more. Chromium is spoken to over its pipe (--remote-debugging-pipe): no port, no library.
"""
import base64
import fcntl
import json
import os
import pathlib
import shutil
import subprocess
import sys
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


PICTURE = """document.getElementById('scene').toDataURL()"""
CHARTS = """[...document.querySelectorAll('#charts canvas')].map(c => c.toDataURL()).join()"""
CAMERAS = """[...document.querySelectorAll('#cameras canvas')].map(c => c.toDataURL()).join()"""
WHY = """document.getElementById('why').textContent"""
TIME = """Number(document.getElementById('time').value)"""
failures = []


def check(what, good):
    print("ok    " if good else "FAILED", what)
    if not good:
        failures.append(what)


def use(page, folder):
    check("there are decisions", page.value("page.story.decision.time_s.length") > 3)
    check("there are charts", page.value("document.querySelectorAll('#charts canvas').length") >= 4)
    check("there are two cameras, and the true world", page.value("document.querySelectorAll('#cameras canvas').length === 2 && page.story.world.circles.length === 1"))
    first = [page.value(e) for e in (PICTURE, CHARTS, WHY, CAMERAS)]
    page.value("""(() => { const s = document.getElementById('time'); s.value = (Number(s.min) + Number(s.max)) / 2;
                  s.dispatchEvent(new Event('input')); })()""")
    middle = [page.value(e) for e in (PICTURE, CHARTS, WHY, CAMERAS)]
    for name, a, b in zip(("the view in space", "the charts", "the reasons", "what the cameras saw"), first, middle):
        check(f"the slider changes {name}", a != b)
    check("there are reasons", len(middle[2].splitlines()) > 3)
    before = page.value(TIME)
    page.key("ArrowRight")
    after = page.value(TIME)
    check("the right arrow goes to a later decision", after > before and page.value(WHY) != middle[2])
    page.key("ArrowLeft")
    page.key("ArrowLeft")
    check("the left arrow goes back", page.value(TIME) < after)
    page.key("End")
    check("End goes to the end", page.value(f"Math.abs({TIME} - page.axis.until) < 0.02"))
    page.key("Home")
    check("Home goes to the beginning", page.value(f"Math.abs({TIME} - page.axis.from) < 0.02"))
    box = page.value("""(() => { const r = document.querySelector('#charts canvas').getBoundingClientRect();
                        scrollTo(0, r.top); return document.querySelector('#charts canvas').getBoundingClientRect().toJSON(); })()""")
    for kind in ("mousePressed", "mouseReleased"):
        page.call("Input.dispatchMouseEvent", type=kind, x=box["x"] + 0.6 * box["width"], y=box["y"] + 0.5 * box["height"], button="left", clickCount=1)
    span = page.value("page.axis.until - page.axis.from")
    check("a click on a chart chooses its moment", 0.5 < (page.value(TIME) - page.value("page.axis.from")) / span < 0.65)
    view = page.value(PICTURE)
    page.value("document.getElementById('top').click()")
    check("the view turns", page.value(PICTURE) != view)
    page.value("document.getElementById('slant').click(); scrollTo(0, 0)")
    light = page.value(PICTURE)
    if folder:
        page.shot(folder / "light.png")
    page.scheme("dark")
    check("dark is another picture", page.value(PICTURE) != light)
    if folder:
        page.shot(folder / "dark.png")
    page.call("Emulation.setEmulatedMedia", media="print", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    page.wait_for("page.theme.paper === '#ffffff'")  # on paper it is light, also in the dark
    if folder:
        page.shot(folder / "print.png")
    page.call("Emulation.setEmulatedMedia", media="")
    page.scheme("light")


def from_page(request, url):
    """The page itself, or what it made of its own parts."""
    return request in (url, "about:blank") or request.startswith("blob:null/")


def complaints(events, url):
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
    return found


def main():
    path = pathlib.Path(sys.argv[1]).resolve()
    folder = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 and sys.argv[2] else None
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        print("SKIPPED: no chromium on this machine: toolchain/setup tests/platform/report/packages.txt installs it")
        return 77
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    check(f"the page has less than 3 MB ({path.stat().st_size / 1e6:.2f})", path.stat().st_size < 3e6)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile)
        try:
            page = Page(browser)
            page.call("Emulation.setDeviceMetricsOverride", width=1400, height=900, deviceScaleFactor=1, mobile=False)
            page.scheme("light")
            start = time.monotonic()
            page.call("Page.navigate", url=path.as_uri())
            page.wait_for("document.documentElement?.dataset.ready === 'yes'")
            print(f"       drawn after {time.monotonic() - start:.2f} s")
            use(page, folder)
            for complaint in complaints(browser.events, path.as_uri()):
                check(complaint, False)
        finally:
            browser.close()
    print(f"{len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
