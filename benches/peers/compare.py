"""The same cycles through Starlings and through what others use, one after the other, round after round, on this machine.

    python3 benches/peers/compare.py [--rounds N] [--more] [--write]

Makes a virtual environment in target/peers with what pip gives, builds the release bench, measures, prints a table; with --write the
table goes into docs/fleet.md. With --more the rounds of earlier calls count too, so that a long measurement can be made in parts;
--rounds 0 prepares and tells, and measures nothing. What cannot be installed or fails is named with its reason. Next file to read:
peers.py.
"""

import argparse
import contextlib
import json
import os
import platform
import random
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
VENV = ROOT / "target" / "peers"
PAGE = ROOT / "docs" / "fleet.md"
MARKS = ("<!-- peers: written by benches/peers/compare.py -->", "<!-- /peers -->")

#: Packages of pip by the name of their peer.
PACKAGES = {
    "ProcessPoolExecutor": [],
    "mpi4py.futures": ["mpi4py"],
    "Dask": ["distributed"],
    "Ray": ["ray"],
    "Parsl": ["parsl"],
    "HyperQueue": ["hyperqueue"],
}
OWN = "Starlings"
#: Longest time for one peer in one round, seconds.
LIMIT = 90
#: Letters of a line.
WIDTH = 140
#: What was measured, round after round.
KEPT = VENV / "rounds.json"


def sizes():
    draw = random.Random(1)
    return {
        "workers": 2,
        "particles": 22,
        "cycles": 300,
        "bag": 10_000,
        "spins": [0.01] * 200,
        # Tenfold: between 2 and 20 ms, even in the logarithm.
        "spread": [0.002 * 10 ** draw.random() for _ in range(200)],
        "states": 12,
        "patience": 3.0,
    }


def install():
    """The interpreter of the environment, and why peers are missing, by name."""
    python = VENV / "bin" / "python3"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(VENV)], check=True)
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, "numpy"], check=True)
    missing = {}
    for peer, packages in PACKAGES.items():
        done = subprocess.run([*pip, *packages], capture_output=True, text=True) if packages else None
        if done is not None and done.returncode != 0:
            missing[peer] = "pip cannot install it: " + (done.stderr.strip().splitlines() or ["no words"])[-1]
    if shutil.which("mpiexec") is None:
        missing.setdefault("mpi4py.futures", "there is no mpiexec (Debian: openmpi-bin)")
    return python, missing


def build():
    """The program of the bench."""
    command = ["cargo", "bench", "--workspace", "--bench", "peers", "--no-run", "--message-format", "json"]
    built = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    for line in built.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message.get("target", {}).get("name") == "peers":
            return message["executable"]
    raise SystemExit("cargo built no bench of the name `peers`")


def command_of(peer, python, program, given):
    if peer == OWN:
        lists = {name: ",".join(map(repr, given[name])) for name in ("spins", "spread")}
        numbers = {name: str(given[name]) for name in ("workers", "particles", "cycles", "bag", "states")}
        return [program, *(word for name, value in {**numbers, **lists}.items() for word in (f"--{name}", value))]
    command = [str(python), str(HERE / "peers.py"), peer, json.dumps({**given, "program": program})]
    if peer == "mpi4py.futures":
        ranks = str(given["workers"] + 1)
        # Ranks that wait give their core away, as is usual where there are more of them than cores.
        yields = ["--mca", "mpi_yield_when_idle", "1"]
        return ["mpiexec", "--allow-run-as-root", "--oversubscribe", *yields, "-n", ranks, *command]
    return command


def measured(command):
    """What a peer measured, or why it did not."""
    path = f"{VENV / 'bin'}:{os.environ['PATH']}"
    # Workers of peers find the tasks wherever they run.
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(HERE), "OMP_NUM_THREADS": "1"}
    # Into files: what a peer leaves behind would hold a pipe open.
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        started = subprocess.Popen(
            command, cwd=HERE, stdout=out, stderr=err, env=environment, start_new_session=True
        )
        try:
            code = started.wait(LIMIT)
        except subprocess.TimeoutExpired:
            return None, f"it took more than {LIMIT} s"
        finally:
            # All that it started, also where it ended well.
            with contextlib.suppress(ProcessLookupError):
                os.killpg(started.pid, signal.SIGKILL)
            started.wait()
        out.seek(0)
        err.seek(0)
        told, said = out.read(), err.read()
    lines = [line for line in told.splitlines() if line.startswith("{")]
    if code != 0 or not lines:
        words = (said.strip() or told.strip() or "no words").splitlines()[-1]
        return None, f"exit code {code}: {words[:200]}"
    return json.loads(lines[-1]), None


def figures(found, given):
    """The figures of one round."""
    bytes_moved = 2 * 8e6 * given["particles"]
    capacity = given["workers"]
    return {
        "cycle": 1e3 * statistics.median(found["cycles"]),
        "bag": given["bag"] / found["bag"],
        "spins": 100 * sum(given["spins"]) / capacity / found["spins"],
        "spread": 100 * sum(given["spread"]) / capacity / found["spread"],
        "states": bytes_moved / statistics.median(found["states"]) / 1e9 if found["states"] else None,
    }


def machine():
    model = next((l.split(":")[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), "?")
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    load = os.getloadavg()[0]
    return f"{os.cpu_count()} cores ({model}), {memory:.0f} GiB, Linux {platform.release()}, load {load:.1f} at the start"


def kind_of(program):
    """What rounds have in common that are counted together."""
    return [machine().rsplit(",", 1)[0], program, Path(program).stat().st_mtime]


def versions(python):
    code = (
        "import importlib.metadata as m\n"
        "for name in ['mpi4py', 'distributed', 'ray', 'parsl', 'hyperqueue', 'numpy']:\n"
        "    try: print(name, m.version(name))\n"
        "    except m.PackageNotFoundError: pass\n"
    )
    told = subprocess.run([str(python), "-c", code], capture_output=True, text=True, check=True)
    return "Python " + platform.python_version() + ", " + ", ".join(told.stdout.strip().splitlines())


COLUMNS = [
    ("cycle", "no-op cycle p50, ms", True),
    ("bag", "bag, runs/s", False),
    ("spins", "10 ms runs, %", False),
    ("spread", "2 to 20 ms, %", False),
    ("states", "states, GB/s", False),
]


def table(rounds, missing, about, given):
    """The table, medians over the rounds, each with the ratio by which Starlings is better."""
    def median(peer, key):
        values = [figures[key] for figures in rounds[peer] if figures[key] is not None]
        return statistics.median(values) if values else None

    own = {key: median(OWN, key) for key, _, _ in COLUMNS}
    lines = ["| | " + " | ".join(title for _, title, _ in COLUMNS) + " |", "|---|" + "---|" * len(COLUMNS)]
    for peer in rounds:
        if not rounds[peer]:
            continue
        cells = []
        for key, _, less_is_better in COLUMNS:
            value = median(peer, key)
            if value is None:
                cells.append("–")
                continue
            shown = f"{value:.3g}" if value < 1000 else f"{value:.0f}"
            if peer != OWN and own[key]:
                ratio = value / own[key] if less_is_better else own[key] / value
                times = f"{ratio:.3g}" if ratio < 1000 else f"{ratio:.0f}"
                shown += f" ({times}×)" if key in ("cycle", "bag", "states") else ""
            cells.append(shown)
        lines.append(f"| {peer} | " + " | ".join(cells) + " |")
    n = max(len(found) for found in rounds.values())
    text = (
        f"Medians of {n} rounds, in each of which every peer is started, measured and ended; in brackets how many times better "
        f"Starlings is. {about}. {given['workers']} workers of one slot; a cycle is {given['particles']} runs and the wait for the "
        f"last, a bag {given['bag']} runs; efficiency is computing time over wall time of {len(given['spins'])} runs on all slots; "
        f"{given['particles']} states of 8 MB go out and come back. Others run a function of Python, Starlings a "
        f"model in Rust. HyperQueue starts a program per run, and its Python client looks once a second."
    )
    text = textwrap.fill(text, WIDTH) + "\n\n"
    failed = "".join(f"\nNot measured: {peer}, {reason}." for peer, reason in missing.items())
    return text + "\n".join(lines) + "\n" + failed


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--more", action="store_true", help="count the rounds of earlier calls too")
    parser.add_argument("--write", action="store_true", help="write the table into docs/fleet.md")
    options = parser.parse_args()
    python, missing = install()
    program, given = build(), sizes()
    about = f"{machine()}; {versions(python)}"
    peers = [OWN, *(peer for peer in PACKAGES if peer not in missing)]
    rounds = {peer: [] for peer in peers}
    if options.more and KEPT.exists():
        kept = json.loads(KEPT.read_text())
        # Of another machine, program or size they say nothing here.
        if kept["of"] == [kind_of(program), given]:
            rounds |= kept["rounds"]
            about = kept["about"]
    begun = max(len(found) for found in rounds.values())
    for number in range(begun, begun + options.rounds):
        # Each round begins with another one.
        turn = number % len(peers)
        for peer in peers[turn:] + peers[:turn]:
            found, reason = measured(command_of(peer, python, program, given))
            if found is None:
                missing[peer] = reason
                print(f"round {number + 1}: {peer}: {reason}", file=sys.stderr)
                continue
            rounds[peer].append(figures(found, given))
            print(f"round {number + 1}: {peer}: {rounds[peer][-1]}", file=sys.stderr)
        KEPT.write_text(json.dumps({"of": [kind_of(program), given], "about": about, "rounds": rounds}))
    if not any(rounds.values()):
        print("nothing is measured yet", file=sys.stderr)
        return
    if not rounds[OWN]:
        raise SystemExit(f"Starlings itself was not measured: {missing.get(OWN)}")
    text = table(rounds, {p: r for p, r in missing.items() if not rounds.get(p)}, about, given)
    print(text)
    if options.write:
        page = PAGE.read_text()
        before, _, rest = page.partition(MARKS[0])
        _, _, after = rest.partition(MARKS[1])
        if not after:
            raise SystemExit(f"{PAGE} lacks the lines {MARKS}")
        PAGE.write_text(f"{before}{MARKS[0]}\n{text}{MARKS[1]}{after}")


if __name__ == "__main__":
    main()
