#!/usr/bin/env bash
# Writes the recordings: motors with noise of their states, and sensors with noise. `STARLINGS` is the program, `starlings` by default.
set -euo pipefail
cd "$(dirname "$0")"
starlings="${STARLINGS:-starlings}"
make() { # study, file, end, step, noise, and values
  local study="$1" file="$2" end="$3" step="$4" noise="$5"
  shift 5
  [ -e "$file" ] || printf 'time,pressure\n0,1\n1,1\n' > "$file"
  "$starlings" simulate "$study" --until "$end" --step "$step" --noise "$noise" --seed 3 "$@" -o "$file.partial"
  cut -d, -f1,2 "$file.partial" > "$file"
  rm "$file.partial"
}
make study.toml miss.csv 14 0.02 0.0002 --set alpha=0.002 --set beta=0.0001 --set delta=0.00042
make false-alarm.toml cloud.csv 14 0.02 0.0002 --set change=-0.15 --set tau_f=0.6
make table-1-4.toml ignition.csv 0.5 0.001 0 --set a=1101.75
