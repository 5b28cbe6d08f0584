#!/usr/bin/env bash
# What `starlings infer` takes of a long recording: seconds and memory for 600 000 and 6 000 000 rows of the example lorenz-27, with one worker
# and with two, and of two commands at once. `just infer-bench` runs it with a release build; STARLINGS names another program, UNTIL other
# lengths in s of 200 rows, REPEATS how often each is timed. Nothing is asserted.
set -euo pipefail
starlings="$(realpath "${STARLINGS:-target/release/starlings}")"
example="$(realpath "$(dirname "$0")/../examples/lorenz-27")"
repeats="${REPEATS:-5}"
folder="$(mktemp -d)"
trap 'rm -r "$folder"' EXIT
cd "$folder"
cp "$example"/*.toml "$example"/start.csv .
sed -i 's/^max_steps = .*/max_steps = 10000000000/' truth.toml
for until in ${UNTIL:-3000 30000}; do
  "$starlings" simulate truth.toml --until "$until" --step 0.005 -o data.csv 2> /dev/null
  rows="$(($(wc -l < data.csv) - 1))"
  for workers in 1 2; do
    for _ in $(seq "$repeats"); do
      rm -rf out
      # Seconds, and kilobytes of the largest process.
      command time -f '%e %M' -o took "$starlings" infer study.toml --out out --workers "$workers" > /dev/null 2>&1
      cat took
    done | sort -n | head -n 1 | awk -v rows="$rows" -v workers="$workers" \
      '{ printf "%8d rows, %d workers: %.2f s, %.1f million rows/s, %.0f MB\n", rows, workers, $1, rows / $1 / 1e6, $2 / 1024 }'
    sha256sum out/infer.json | cut -c 1-16
  done
  # Two commands with one worker each, at once: what two cores can have of one.
  for _ in $(seq "$repeats"); do
    rm -rf one two
    for out in one two; do
      command time -f '%e' -o "took-$out" "$starlings" infer study.toml --out "$out" --workers 1 > /dev/null 2>&1 &
    done
    wait
    sort -n took-one took-two | tail -n 1
  done | sort -n | head -n 1 | awk -v rows="$rows" \
    '{ printf "%8d rows, 1 worker each of two commands at once: %.2f s, %.1f million rows/s together\n", rows, $1, 2 * rows / $1 / 1e6 }'
done
