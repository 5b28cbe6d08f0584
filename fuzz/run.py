#!/usr/bin/env python3
"""Runs every fuzz target until it has had its processor time, and tells what came of it: the table of docs/fuzzing.md.

    fuzz/run.py [--seconds N] [--at-once N] [--add] [--write] [TARGET ...]
                            600 s each; --write writes the page, --add goes on from what it says
"""
import argparse
import os
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FOLDER = Path(__file__).parent
PAGE = FOLDER.parent / "docs" / "fuzzing.md"
MARKS = ("<!-- targets: written by fuzz/run.py -->\n", "<!-- /targets -->\n")
# Wall time of one start, seconds: targets take turns, so that a run that is stopped has looked at all of them.
TURN = 60
HOST = re.search("host: (.*)", subprocess.run(["rustc", "-vV"], stdout=subprocess.PIPE, text=True, check=True).stdout)[1]
ENVIRONMENT = os.environ | {"RUSTC_BOOTSTRAP": "1"}


def cargo_fuzz(*arguments, **options):
    return subprocess.run(["cargo", "fuzz", *arguments], cwd=FOLDER, env=ENVIRONMENT, text=True, **options)


class Target:
    def __init__(self, name):
        self.name, self.seconds, self.executions, self.findings = name, 0.0, 0, []
        head = (FOLDER / "targets" / f"{name}.rs").read_text().splitlines()[0]
        self.program = FOLDER / "target" / HOST / "release" / name
        self.takes = head.removeprefix("//! ").rstrip(".")

    def turn(self, left):
        """Fuzzes for a while; a finding ends the target."""
        corpus, artifacts = FOLDER / "corpus" / self.name, FOLDER / "artifacts" / self.name
        corpus.mkdir(parents=True, exist_ok=True)
        artifacts.mkdir(parents=True, exist_ok=True)
        limits = [f"-max_total_time={max(1, min(TURN, int(left)))}", "-rss_limit_mb=2048", "-print_final_stats=1"]
        call = [self.program, *limits, f"-artifact_prefix={artifacts}/", corpus]
        # The program itself and not cargo, whose time is not the target's.
        running = subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace")
        said = running.stderr.read()
        _, status, used = os.wait4(running.pid, 0)
        running.returncode = os.waitstatus_to_exitcode(status)
        self.seconds += used.ru_utime + used.ru_stime
        self.executions += sum(map(int, re.findall(r"stat::number_of_executed_units:\s*(\d+)", said)))
        if running.returncode != 0:
            self.findings.append(said[-4000:])
            print(f"{self.name}: found something\n{said[-4000:]}", flush=True)


def table(targets):
    lines = ["| target | what it takes | processor time, s | executions | findings |", "|---|---|---|---|---|"]
    lines += [f"| `{t.name}` | {t.takes} | {t.seconds:.0f} | {t.executions} | {len(t.findings)} |" for t in targets]
    return "\n".join(lines) + "\n"


def add(targets):
    """Counts what the page says of earlier runs: for readers that have not changed since."""
    said = {row[0]: row[1:] for row in re.findall(r"\| `(\w+)` \|.*\| (\d+) \| (\d+) \| 0 \|", PAGE.read_text())}
    for target in targets:
        seconds, executions = said.get(target.name, (0, 0))
        target.seconds, target.executions = float(seconds), int(executions)


def write(targets):
    before, rest = PAGE.read_text().split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    PAGE.write_text(before + MARKS[0] + table(targets) + MARKS[1] + after)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=float(os.environ.get("FUZZ_SECONDS", "600")))
    parser.add_argument("--at-once", type=int, default=os.cpu_count(), help="targets at a time")
    parser.add_argument("--add", action="store_true", help="go on from the figures of docs/fuzzing.md")
    parser.add_argument("--write", action="store_true", help="write the table into docs/fuzzing.md, after every round")
    parser.add_argument("targets", nargs="*")
    given = parser.parse_args()
    cargo_fuzz("build", "-s", "none").check_returncode()
    subprocess.run(["cargo", "run", "--quiet", "--release", "--example", "fuzz-seeds"], cwd=FOLDER.parent, check=True)
    names = given.targets or cargo_fuzz("list", stdout=subprocess.PIPE, check=True).stdout.split()
    targets = [Target(name) for name in names]
    if given.add:
        add(targets)
    while due := [t for t in targets if t.seconds < given.seconds and not t.findings]:
        with ThreadPoolExecutor(given.at_once) as pool:
            list(pool.map(lambda target: target.turn(given.seconds - target.seconds), due))
        print(table(targets), flush=True)
        if given.write:
            write(targets)
    if any(target.findings for target in targets):
        raise SystemExit("findings: see above, and fuzz/artifacts")


if __name__ == "__main__":
    main()
