#!/usr/bin/env bash
# Tries the FEniCSx solver out, estimates both moduli and compares them with those that made the data.
# Needs `starlings` and a Python with FEniCSx and the package on the path: README.md.
set -euo pipefail
cd "$(dirname "$0")"
export PYTHONDONTWRITEBYTECODE=1
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
starlings conformance --solver "python3 beam.py" --set E_root=900 --set E_tip=500 --set force=2
starlings run study.toml --out "$out/run" --workers 2
python3 - "$out/run" <<'PYTHON'
import sys

import starlings

run = starlings.read_run(sys.argv[1])
for name, true in (("E_root", 900.0), ("E_tip", 500.0)):
    estimate, sd = run[name]["estimate"], run[name]["sd"]
    off = abs(estimate - true) / sd
    print(f"{name}: {estimate:.1f} is {off:.2f} posterior sd from {true:g}")
    assert off <= 2.0
PYTHON
