#!/usr/bin/env python3
"""Opens a page of `roborun report` in headless Chromium and uses it as a person would.

usage: page_in_chromium.py PAGE.html FOLDER [STATIC.html...]     FOLDER: where screenshots go, or empty; STATIC: pages without a script

Fails on an error in the console, a request of any kind, a slider, key or click that does not change picture and reasons, a colour
scheme that changes nothing, and on a page of 3 MB or more.
"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from chromium import check, folder_of, use_page  # noqa: E402

PICTURE = """document.getElementById('scene').toDataURL()"""
CHARTS = """[...document.querySelectorAll('#charts canvas')].map(c => c.toDataURL()).join()"""
CAMERAS = """[...document.querySelectorAll('#cameras canvas')].map(c => c.toDataURL()).join()"""
WHY = """document.getElementById('why').textContent"""
TIME = """Number(document.getElementById('time').value)"""


def fits(page):
    page.call("Emulation.setDeviceMetricsOverride", width=830, height=900, deviceScaleFactor=1, mobile=False)
    good = page.value("document.documentElement.scrollWidth <= innerWidth")
    page.call("Emulation.setDeviceMetricsOverride", width=1400, height=900, deviceScaleFactor=1, mobile=False)
    return good


def look_at_static(page, folder, name):
    """A page without a script: a table, in light and dark colours, no wider than 830 px."""
    ground = "getComputedStyle(document.body).backgroundColor"
    check(f"{name}: there is a table", page.value("document.querySelectorAll('tr').length") > 1)
    check(f"{name}: nothing is wider than a page of 830 px", fits(page))
    light = page.value(ground)
    for scheme in ("dark", "light"):
        page.scheme(scheme)
        check(f"{name}: {scheme} has colours of its own", (page.value(ground) == light) == (scheme == "light"))
        if folder:
            page.shot(folder / f"{name}_{scheme}.png")


def use(page, folder):
    check("there are decisions", page.value("page.story.decision.time_s.length") > 3)
    check("the verdict of the scenario stands first", page.value("""(() => { const v = document.getElementById('verdict');
        return !v.hidden && v.className === 'bad' && v.textContent.includes('FAILED') && v.textContent.includes('must be <reached_goal>') &&
        v.getBoundingClientRect().bottom < document.getElementById('facts').getBoundingClientRect().top + 1; })()"""))
    page.value("document.querySelector('#verdict button').click()")
    check("its button goes to the moment", page.value(f"Math.abs({TIME} - 2.5) < 0.02"))
    page.key("Home")
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
    view = page.value(PICTURE)
    page.key("+")
    check("+ is nearer", page.value(PICTURE) != view)
    page.value("document.getElementById('slant').click()")
    page.value("document.querySelector('#events tr').focus()")
    page.key("Enter")
    check("Enter on an event goes to its moment", page.value(f"Math.abs({TIME} - page.rows[0].time) < 0.02"))
    check("nothing is wider than a page of 830 px", fits(page))
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


def main():
    path = pathlib.Path(sys.argv[1]).resolve()
    folder = folder_of(sys.argv[2] if len(sys.argv) > 2 else "")
    check(f"the page has less than 3 MB ({path.stat().st_size / 1e6:.2f})", path.stat().st_size < 3e6)

    def look(page, drawn_s):
        print(f"       drawn after {drawn_s:.2f} s")
        use(page, folder)

    code = use_page(path.as_uri(), look)
    for page_without_script in sys.argv[3:]:
        other = pathlib.Path(page_without_script).resolve()
        code = max(code, use_page(other.as_uri(), lambda page, _: look_at_static(page, folder, other.stem), "location.protocol === 'file:' && document.readyState === 'complete'"))
    return code


if __name__ == "__main__":
    sys.exit(main())
