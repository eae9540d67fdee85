#!/usr/bin/env python3
"""Opens the page of a flight that goes on (`roborun run --live PORT`) in headless Chromium, and stays until the flight has ended.

usage: live_in_chromium.py PORT [FOLDER]     FOLDER: where screenshots go

Fails on an error in the console, a request to elsewhere, a picture, charts or reasons that do not change while the flight goes on, a view
of the past that does not stay, and a page that does not say that the flight has ended.
"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from chromium import check, folder_of, use_page  # noqa: E402

PICTURE = "document.getElementById('scene').toDataURL()"
CHARTS = "[...document.querySelectorAll('#charts canvas')].map(c => c.toDataURL()).join()"
DECISIONS = "page.story.decision.time_s.length"
TIME = "Number(document.getElementById('time').value)"


def wait_for_decisions(page, more):
    page.wait_for(f"{DECISIONS} >= {page.value(DECISIONS) + more}")


def look(page, folder):
    page.value("document.dispatchEvent(new KeyboardEvent('keydown', { key: 'End' }))")
    before, picture, charts = page.value(TIME), page.value(PICTURE), page.value(CHARTS)
    wait_for_decisions(page, 3)
    check("who looks at the end goes with the flight", page.value(TIME) > before + 1 and page.value("page.t >= page.axis.until - 0.5"))
    check("the picture moves", page.value(PICTURE) != picture)
    check("the charts grow", page.value(CHARTS) != charts)
    check("the newest decision has its reasons", page.value("page.story.decision.why.at(-1).split('\\n').length") > 3)
    check("the map grows", page.value("page.story.map.length") > 1)
    if folder:
        page.shot(folder / "live.png")
    page.value(f"page.go(({TIME} + page.axis.from) / 2)")
    there = page.value(TIME)
    wait_for_decisions(page, 2)
    check("who looks back stays there", page.value(TIME) == there)
    page.wait_for("document.getElementById('note').textContent.includes('The flight has ended')")
    numbers = page.value(f"{DECISIONS}") - page.value("new Set(page.story.decision.time_s).size")
    check("no decision is there twice", numbers == 0)


sys.exit(use_page(f"http://127.0.0.1:{sys.argv[1]}/", lambda page, _: look(page, folder_of(sys.argv[2] if len(sys.argv) > 2 else ""))))
