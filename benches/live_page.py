#!/usr/bin/env python3
"""What the live page costs a study whose runs take some 10 ms: the same study with a page that somebody looks at and without one, in turns.

    python3 benches/live_page.py [--turns N]     the release build, or what STARLINGS names; nothing is asserted

A viewer reads the stream as a browser does. Both workers compute all the time, so that whatever the page takes is missing to them: besides the time
on the clock, which other work on the machine moves, the processor time that the coordinator itself takes is told (where there is a /proc).
"""

import argparse
import json
import os
import re
import statistics
import subprocess
import tempfile
import threading
import time
import urllib.request
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent

#: The fast term costs steps of integration and moves nothing.
STUDY = """
[study]
name = "ten-milliseconds"
[model]
kind = "equations"
outputs = [ { name = "y", value = "x" } ]
max_steps = 100000000
[[model.states]]
name = "x"
initial = 0.3
rate = "a + b*t + sin(FAST*t)"
[[parameters]]
name = "a"
prior = { transform = "linear", median = 0.5, sd = 1.0 }
[[parameters]]
name = "b"
prior = { transform = "linear", median = 0.0, sd = 1.0 }
[[records]]
name = "r"
file = "data.csv"
channels = [ { column = "y", output = "y", noise = 0.1 } ]
[estimator]
kind = "roukf"
passes = 2
"""


class Viewer(threading.Thread):
    """Reads the stream of a page until it says that the run is over and then the report, as the page does."""

    def __init__(self, page: str) -> None:
        super().__init__(daemon=True)
        self.page, self.views = page, 0

    def run(self) -> None:
        try:
            with urllib.request.urlopen(self.page + "stream") as stream:
                while self.is_running(stream.readline()):
                    pass
            urllib.request.urlopen(self.page + "report").read()
        except OSError:
            pass

    def is_running(self, line: bytes) -> bool:
        if not line.startswith(b"data:"):
            return line != b""
        self.views += 1
        return json.loads(line[len(b"data:") :])["view"]["state"] == "running"


class Processor(threading.Thread):
    """Looks, until a process ends, how much processor time it has taken."""

    def __init__(self, pid: int) -> None:
        super().__init__(daemon=True)
        self.stat, self.own = Path(f"/proc/{pid}/stat"), 0.0

    def run(self) -> None:
        while True:
            try:
                user, system = self.stat.read_text().rpartition(")")[2].split()[11:13]
            except OSError:
                return
            self.own = (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")
            time.sleep(0.02)


class Turn(NamedTuple):
    """What one study took."""

    #: On the clock, and of processors by the coordinator without its workers, s.
    took: float
    own: float
    #: Views that were read, and runs of the model.
    views: int
    runs: int


def timed(program: str, folder: Path, page: bool) -> Turn:
    out = Path(tempfile.mkdtemp(dir=folder)) / "out"
    call = [program, "run", "study.toml", "--workers", "2", "--out", str(out), *(["--dashboard"] if page else [])]
    started = time.perf_counter()
    run = subprocess.Popen(call, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    processor, viewer = Processor(run.pid), None
    processor.start()
    assert run.stderr is not None
    for line in run.stderr:
        if found := re.match(r"live page at (\S+)", line):
            viewer = Viewer(found[1])
            viewer.start()
    if run.wait() != 0:
        raise SystemExit("the study failed")
    took = time.perf_counter() - started
    processor.join()
    if viewer:
        viewer.join(timeout=5)
    return Turn(took, processor.own, viewer.views if viewer else 0, runs(out))


def runs(out: Path) -> int:
    return int(json.loads((out / "summary.json").read_text())["runs"]["total"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turns", type=int, default=10)
    turns = parser.parse_args().turns
    program = os.environ.get("STARLINGS", str(ROOT / "target/release/starlings"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [f"{t / 50},{0.3 + 0.9 * t / 50 - 0.2 * (t / 50) ** 2}" for t in range(200)]
        (folder / "data.csv").write_text("\n".join(["time,y", *rows]) + "\n")
        # A run of 10 ms on this machine: by what one takes with a first guess.
        fast = 150_000.0
        for _ in range(3):
            (folder / "study.toml").write_text(STUDY.replace("FAST", f"{fast:.0f}"))
            first = timed(program, folder, False)
            each = 2 * first.took / first.runs
            print(f"{1e3 * each:.1f} ms a run, {first.runs} runs")
            fast *= 0.01 / each
        pairs = []
        for turn in range(turns):
            # Whoever is first changes from turn to turn.
            order = [False, True] if turn % 2 else [True, False]
            of = {page: timed(program, folder, page) for page in order}
            without, seen = of[False], of[True]
            pairs.append((seen.took / without.took - 1, (seen.own - without.own) / without.took))
            print(
                f"without {without.took:.3f} s, with {seen.took:.3f} s and {seen.views} views;"
                f" of it the coordinator {without.own:.2f} and {seen.own:.2f} s",
                flush=True,
            )
        for what, costs in zip(("on the clock", "more of a processor by the coordinator"), zip(*pairs)):
            costs = sorted(100 * cost for cost in costs)
            print(f"{what}: {statistics.median(costs):.1f} % (from {costs[0]:.1f} to {costs[-1]:.1f}) in {turns} turns")


if __name__ == "__main__":
    main()
