"""Looks at every page of the program as a person would, and fails where it is not what it should be.

Usage: look.py PROGRAM PICTURES [DOCS]. Checked: values under the pointer are those of the store; the legend hides, a figure enlarges and
zooms, files of it can be saved; the keyboard does the same; contrast; nothing wider than the screen; no error on the console and no
request to elsewhere; a lost worker shows within two seconds; the live page becomes the report; a page of a million samples opens within two.
"""

import pathlib
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time

import live
from browser import Browser, Page
from expected import CONTRAST, PHONE, WIDE, check
from scripts import CONTRASTS, CUT, OPEN_ALL

# Widths of windows on laptops, at which tables are looked at too.
BETWEEN = (1024, 1100, 1200, 1280)
# s; a page opens when it is loaded.
OPEN = 2.0

# Pages with courses, whose values can be read.
TOUCHED = ("report", "explain", "identify", "forecast", "infer", "diagnose", "compare")


class Looker:
    def __init__(self, program, pictures, docs):
        self.program, self.pictures, self.docs = str(pathlib.Path(program).resolve()), pathlib.Path(pictures), docs
        self.browser = Browser()

    def make(self, folder, *arguments):
        done = subprocess.run([self.program, *arguments], capture_output=True, text=True)
        check(done.returncode == 0, f"{arguments}: {done.stderr}")
        return folder

    def look(self, name, url, docs_name=None):
        """A page at both widths and in the dark, with everything closed as a reader meets it, then open."""
        for width, (wide, high) in {"wide": WIDE, "phone": PHONE}.items():
            for scheme in ("light", "dark"):
                page = Page(self.browser, wide, high, dark=scheme == "dark")
                page.open(url)
                if scheme == "light":
                    page.picture(self.pictures / f"{name}-{width}.png")
                    if docs_name and self.docs and width == "wide":
                        page.size(1200, 760)
                        page.drawn()
                        page.picture(pathlib.Path(self.docs) / f"{docs_name}.png")
                        page.size(wide, high)
                page.run(OPEN_ALL)
                page.drawn()
                if scheme == "light" or width == "wide":
                    page.picture(self.pictures / f"{name}-{width}-{scheme}-open.png", whole=True)
                ratio, where = page.run(CONTRASTS)
                check(ratio >= CONTRAST, f"{name}, {width}, {scheme}: a contrast of {ratio:.2f} at {where}")
                over = page.run("document.documentElement.scrollWidth - innerWidth")
                check(over <= 0, f"{name}, {width}: the page is {over} px wider than the screen")
                if width == "phone" or name != "many":
                    for between in (wide, *(BETWEEN if (width, scheme) == ("wide", "light") else ())):
                        page.size(between, high)
                        cut = page.run(CUT)
                        check(not cut, f"{name}, {between} px: tables are cut off: {cut}")
                    page.size(wide, high)
                if (width, scheme) == ("wide", "light"):
                    self.touch(name, page)
                sizes = page.run("[...new Set([...document.querySelectorAll('.plot')].map((p) => getComputedStyle(p).fontSize))]")
                check(len(sizes) <= 1, f"{name}: text on axes has several sizes: {sizes}")
                faults = page.faults()
                check(not faults, f"{name}, {width}, {scheme}: {faults}")
                page.close()
        print(f"{name}: seen")

    def touch(self, name, page):
        """The first figure of any page: the pointer and the arrow keys show a value where there are some, a click and the Enter key enlarge it."""
        # Tools come to a figure when it is seen; some, as of shares of a table, have none.
        page.run("document.querySelectorAll('figure').forEach((f) => f.scrollIntoView())")
        time.sleep(0.5)
        page.run("""(() => { const f = [...document.querySelectorAll("figure")].find((f) => f.querySelector(".enlarge") && f.querySelector(".frame"));
            if (f) { f.classList.add("touched"); f.scrollIntoView({ block: "center" }); } })()""")
        if not page.run("Boolean(document.querySelector('.touched'))"):
            return check(name not in TOUCHED, f"{name}: no figure can be enlarged")
        dialog = "Boolean(document.querySelector('dialog'))"
        for enlarge in (lambda: page.click(".touched .enlarge"), lambda: (page.run("document.querySelector('.touched').focus()"), page.key("Enter"))):
            enlarge()
            page.wait(dialog, 5, f"{name}: a figure does not enlarge")
            page.key("Escape")
            page.wait(f"!{dialog}", 5, f"{name}: an enlarged figure does not close")
        if page.run("Boolean(document.querySelector('.touched .readout'))"):
            page.run("document.querySelector('.touched').focus()")
            page.key("ArrowRight")
            page.wait("!document.querySelector('.touched .readout').hidden", 5, f"{name}: the arrow keys show no value")
            x, y, w, h = page.run("(() => { const r = document.querySelector('.touched .frame').getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()")
            page.move(x + w / 2, y + h / 2)
            page.wait("document.querySelector('.touched .readout').textContent.trim() !== ''", 5, f"{name}: the pointer shows no value")

    def no_script(self, name, url):
        page = Page(self.browser, *WIDE)
        page.send("Emulation.setScriptExecutionDisabled", value=True)
        page.send("Page.navigate", url=url)
        time.sleep(1.0)
        page.picture(self.pictures / f"{name}-without-script.png")
        strings = page.send("DOMSnapshot.captureSnapshot", computedStyles=[])["strings"]
        check("tools" not in strings and any(text.startswith("observed − predicted") for text in strings), f"{name}: without script the page does not read")
        page.close()

    def click_through(self, url, store):
        """The first fit of a report: pointer, legend, enlarging, zoom, files, keyboard."""
        page = Page(self.browser, *WIDE)
        page.open(url)
        figure = "#fit figure"
        page.wait(f"document.querySelector('{figure} .tools')", 5)
        check(page.run(f"document.querySelector('{figure}').getBoundingClientRect().top < innerHeight"), "the fit is below the fold")
        rows = sqlite3.connect(store).execute("SELECT record, output, time, observed, predicted FROM predictions ORDER BY rowid").fetchall()
        rows = [row for row in rows if row[:2] == rows[0][:2]]
        lo, hi = rows[0][2], rows[-1][2]
        for share in (0.13, 0.5, 0.87):
            x, y, w, h = page.run(f"(() => {{ const r = document.querySelector('{figure} .frame').getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; }})()")
            page.move(x + share * w, y + h / 2)
            page.wait(f"!document.querySelector('{figure} .readout').hidden", 5)
            shown = page.run(f"""[...document.querySelectorAll('{figure} .plot')].map((p) => [...p.querySelectorAll(".readout [data-value]")].map((r) => [r.textContent, Number(r.dataset.value)]))""")
            near = min((row for row in rows if row[3] is not None), key=lambda row: abs(row[2] - (lo + share * (hi - lo))))
            values = [value for plot in shown for _, value in plot]
            check(near[3] in values, f"the measured value under the pointer is {shown}, the store has {near}")
            check(near[4] in values, f"the predicted value under the pointer is {shown}, the store has {near}")
            check(near[3] - near[4] in values, f"the residual under the pointer is {shown}, the store has {near}")
        self.legend(page, figure)
        self.enlarging(page, figure)
        self.files(page, figure, rows)
        page.run(f"document.querySelector('{figure}').focus()")
        page.key("ArrowRight")
        check(page.run(f"!document.querySelector('{figure} .readout').hidden"), "the arrow keys show no value")
        page.key("Enter")
        check(page.run("Boolean(document.querySelector('dialog[open]'))"), "the Enter key does not enlarge")
        page.key("Escape")
        page.wait("!document.querySelector('dialog')", 5, "the Escape key does not close")
        again = Page(self.browser, *WIDE)
        again.open(url)
        for one in (page, again):
            check(not one.faults(), one.faults())
            one.close()
        print("report: clicked through")

    def legend(self, page, figure):
        button = f"{figure} .keys button"
        before = page.run(f"document.querySelectorAll('{figure} svg g.off').length")
        page.click(button)
        check(page.run(f"document.querySelectorAll('{figure} svg g.off').length") > before, "the legend hides nothing")
        check(page.run(f"document.querySelector('{button}').getAttribute('aria-pressed')") == "false", "the legend does not say what it hides")
        page.click(button)
        check(page.run(f"document.querySelectorAll('{figure} svg g.off').length") == before, "the legend shows nothing again")

    def enlarging(self, page, figure):
        small = page.run(f"document.querySelector('{figure} .frame').getBoundingClientRect().height")
        page.click(f"{figure} .enlarge")
        page.wait("document.querySelector('dialog[open] .frame')", 5, "a click does not enlarge")
        large = page.run("document.querySelector('dialog[open] .frame').getBoundingClientRect().height")
        check(large > 1.2 * small, f"enlarged from {small} to {large} px")
        view = page.run("document.querySelector('dialog .drawing').getAttribute('viewBox')")
        page.click("dialog .zoom:nth-of-type(2)")
        check(page.run("document.querySelector('dialog .drawing').getAttribute('viewBox')") != view, "a click does not zoom")
        page.picture(self.pictures / "report-enlarged.png")
        page.key("Escape")
        page.wait("!document.querySelector('dialog')", 5, "the figure does not close")
        check(page.run(f"document.querySelector('{figure} .drawing').getAttribute('viewBox')") == view, "a closed figure stays zoomed")

    def files(self, page, figure, rows):
        page.run("""window.kept = []; URL.createObjectURL = (b) => { window.kept.push(b); return "data:,"; }; HTMLAnchorElement.prototype.click = () => {}""")
        for k, kind in enumerate(("CSV", "SVG", "PNG")):
            page.run(f"[...document.querySelectorAll('{figure} .tools button')].find((b) => b.textContent === '{kind}').click()")
            page.wait(f"window.kept.length > {k}", 10, f"no {kind}")
        table = page.run("window.kept[0].text()").strip().split("\n")
        check(table[0] == "plot,series,x,low,high", table[0])
        values = {line.rsplit(",", 1)[1] for line in table[1:] if ",measured," in line}
        stored = {repr(row[3]) for row in rows if row[3] is not None}
        same = {float(v) for v in values} == {float(v) for v in stored}
        check(same or len(rows) > 1200, "the CSV of a short figure does not hold what was measured")
        drawn = page.run("window.kept[1].text().then((t) => new DOMParser().parseFromString(t, 'image/svg+xml').querySelectorAll('parsererror').length)")
        check(drawn == 0, "the SVG is not well formed")
        check(page.run("window.kept[2].type === 'image/png' && window.kept[2].size > 5000"), "the PNG is empty")

    def million(self, path):
        page = Page(self.browser, *WIDE)
        page.open("about:blank")
        took = page.open(path.resolve().as_uri())
        size = path.stat().st_size
        check(size <= 5_000_000, f"a million samples take {size} bytes")
        check(took <= OPEN, f"a million samples open in {took:.2f} s")
        page.click("#fit figure .enlarge")
        page.wait("document.querySelector('dialog[open] .frame')", 5)
        before = page.run("document.querySelector('dialog polyline').getAttribute('points')")
        for _ in range(3):
            page.click("dialog .zoom:nth-of-type(2)")
        check(page.run("document.querySelector('dialog polyline').getAttribute('points')") != before, "the zoom shows nothing finer")
        page.picture(self.pictures / "million-zoomed.png")
        check(not page.faults(), page.faults())
        page.close()
        print(f"a million samples: {size / 1e6:.2f} MB, open in {took:.2f} s")

    def others(self, scratch, run):
        """The pages of the commands that are quick, each of a result of its own."""
        lorenz = pathlib.Path(shutil.copytree("examples/lorenz", scratch / "lorenz"))
        self.make(lorenz, "simulate", str(lorenz / "truth.toml"), "--until", "8", "--step", "0.002", "-o", str(lorenz / "data.csv"))
        for name, arguments in {
            "forecast": ("forecast", str(run), "--members", "50"),
            "infer": ("infer", str(lorenz / "study.toml")),
            "diagnose": ("diagnose", "examples/thrust-vector-control/diagnose.toml"),
        }.items():
            folder = self.make(scratch / name, *arguments, "--out", str(scratch / name))
            self.look(name, (folder / "report.html").as_uri(), f"page-{name}")
        other = self.make(scratch / "other", "run", "examples/pig-aorta-joint/study.toml", "--workers", "2", "--out", str(scratch / "other"))
        page = self.make(scratch / "compare.html", "compare", str(run), str(other), "--html", str(scratch / "compare.html"))
        self.look("compare", page.as_uri(), "page-compare")
        # Long names and units.
        wide = self.make(scratch / "wide", "run", "examples/toy-fsi-windkessel/study.toml", "--workers", "2", "--out", str(scratch / "wide"))
        self.look("wide-table", (wide / "report.html").as_uri())

    def all(self, scratch):
        run = self.make(scratch / "run", "run", "examples/pig-aorta/study.toml", "--workers", "2", "--out", str(scratch / "run"))
        report = (run / "report.html").as_uri()
        self.look("report", report, "page-report")
        self.click_through(report, run / "run.db")
        self.no_script("report", report)
        explained = self.make(scratch / "explain", "explain", "examples/pig-aorta/explain-ex-vivo.toml", "--workers", "2", "--out", str(scratch / "explain"))
        self.look("explain", (explained / "report.html").as_uri(), "page-explain")
        live.look(self, scratch)
        live.becomes_report(self, scratch)
        for name, arguments in {
            "identify": ("identify", "examples/pig-aorta/study.toml", "--workers", "2", "--html"),
            "spectrum": ("spectrum", "examples/oscillator/study.toml", "--html"),
        }.items():
            path = scratch / f"{name}.html"
            self.make(path, *arguments, str(path))
            self.look(name, path.as_uri(), f"page-{name}")
        self.others(scratch, run)
        samples = self.pictures / "samples"
        self.million(samples / "million.html")
        for path in sorted(samples.glob("*.html")):
            if path.name != "million.html":
                self.look(path.stem, path.resolve().as_uri())


def main():
    program, pictures, *docs = sys.argv[1:]
    with tempfile.TemporaryDirectory() as scratch:
        looker = Looker(program, pictures, docs[0] if docs else None)
        try:
            looker.all(pathlib.Path(scratch))
        finally:
            looker.browser.close()


main()
