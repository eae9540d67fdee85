#!/usr/bin/env python3
"""Makes the page of toolchain/web/build: the page of a flight, with the program that flies it in the place of a story.

usage: assemble.py FOLDER PAGE.html     FOLDER: with roborun_web.js and roborun_web.wasm
"""
import base64
import pathlib
import re
import sys
import zlib

HERE = pathlib.Path(__file__).resolve().parent
PARTS = HERE.parents[1] / "platform/report/page"
SCRIPTS = ["flight_scene.js", "flight_charts.js", "flight_cameras.js", "flight_live.js", "flight_page.js"]


def main():
    built, page = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    worker = (built / "roborun_web.js").read_text() + (HERE / "worker.js").read_text()
    if "</script" in worker:
        sys.exit("assemble.py: the worker has a </script in it: must not, it stands in a page")
    script = "".join((PARTS / name).read_text() for name in SCRIPTS) + (HERE / "web_page.js").read_text()
    parts = {
        "TITLE": "roborun: a flight in your browser",
        # Compiling WebAssembly, and a worker from a part of this page: nothing is loaded.
        "POLICY": " 'wasm-unsafe-eval'; worker-src blob:",
        "STYLE": (PARTS / "page.css").read_text() + (PARTS / "flight_page.css").read_text() + (HERE / "web_page.css").read_text(),
        "FOOTER": 'Flown in this page by roborun, <span id="build"></span>. Nothing is sent or loaded.',
        "STORY": base64.b64encode(zlib.compress((built / "roborun_web.wasm").read_bytes(), 9)).decode(),
        "SCRIPT": script,
    }
    html = (PARTS / "flight_page.html").read_text().replace("<script>\n@SCRIPT@", f'<script id="worker" type="text/plain">{worker}</script>\n<script>\n@SCRIPT@')
    page.write_text(re.sub("@([A-Z]+)@", lambda m: parts.get(m[1], m[0]), html))


main()
