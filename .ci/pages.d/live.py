"""The live page of a run: a lost worker shows, and the page becomes the report."""

import contextlib
import os
import pathlib
import shutil
import signal
import subprocess
import time

from browser import Page, until
from expected import CONTRAST, PHONE, WIDE, check
from scripts import CONTRASTS

# s; a worker is lost when its stream breaks.
LOST = 2.0


def look(looker, scratch):
    """The live page: one of two workers is killed in front of it, by a run that does not end before everything was looked at."""
    study = pathlib.Path(shutil.copytree("examples/coarctation", scratch / "many-passes")) / "study.toml"
    text = study.read_text().replace('kind = "roukf"', 'kind = "roukf"\npasses = 1000')
    check("passes = 1000" in text, "the study has no filter")
    study.write_text(text)
    with dashboard(looker, study, scratch / "live") as (run, url):
        page = Page(looker.browser, *WIDE)
        page.open(url)
        page.wait("document.querySelectorAll('#workers tr, table tbody tr').length > 0", 60, "the live page shows no worker")
        time.sleep(1.5)
        page.picture(looker.pictures / "live-wide.png")
        if looker.docs:
            page.picture(pathlib.Path(looker.docs) / "live-page.png")
        ratio, where = page.run(CONTRASTS)
        check(ratio >= CONTRAST, f"live page: a contrast of {ratio:.2f} at {where}")
        local = subprocess.run(["pgrep", "-P", str(run.pid), "-f", "worker"], capture_output=True, text=True).stdout.split()
        check(local, "the run has no worker process of its own")
        os.kill(int(local[0]), signal.SIGKILL)
        begun = time.monotonic()
        page.wait("[...document.querySelectorAll('.lost')].some((e) => e.checkVisibility() && /lost/.test(e.textContent))", 10, "a killed worker does not show")
        took = time.monotonic() - begun
        check(took <= LOST, f"a killed worker shows after {took:.2f} s")
        page.picture(looker.pictures / "live-lost.png")
        page.size(*PHONE)
        time.sleep(0.5)
        page.picture(looker.pictures / "live-phone.png", whole=True)
        check(page.run("document.documentElement.scrollWidth <= innerWidth"), "the live page is wider than a phone")
        check(not page.faults(), page.faults())
        check(run.poll() is None, "the run ended while it was looked at")
        page.close()
        print(f"live page: a killed worker shows after {took:.2f} s")


def becomes_report(looker, scratch):
    """The live page of a run that ends is its report."""
    with dashboard(looker, "examples/coarctation/study.toml", scratch / "ends") as (_, url):
        page = Page(looker.browser, *WIDE)
        page.open(url)

        def is_report():
            try:
                return page.run("location.pathname.endsWith('/report') && Boolean(document.querySelector('#fit figure'))")
            except RuntimeError:
                return False  # Between two pages there is nobody to ask.

        until(is_report, 120, "the live page does not become the report")
        page.close()
        print("live page: becomes the report")


@contextlib.contextmanager
def dashboard(looker, study, out):
    """A run with its live page: the process, and the address that it printed."""
    says = out.with_suffix(".says")
    command = [looker.program, "run", str(study), "--out", str(out), "--workers", "2", "--dashboard"]
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=says.open("w"))
    try:
        until(lambda: "live page at" in says.read_text() or run.poll() is not None, 120, "no live page")
        check(run.poll() is None, says.read_text())
        yield run, next(line.split(" at ", 1)[1] for line in says.read_text().splitlines() if line.startswith("live page at"))
    finally:
        run.send_signal(signal.SIGINT)
        run.wait(60)
