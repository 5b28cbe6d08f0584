set -u

program={{ program|sh }}
{% if is_copied %}
access="$HOME/.starlings/{{ name }}/access.json"
{% else %}
access={{ access|sh }}
{% endif %}
{% if scratch is none %}
base="${TMPDIR:-/tmp}"
{% else %}
base={{ scratch|sh }}
{% endif %}

say() { printf 'starlings: %s: %s\n' "$(uname -n)" "$*" >&2; }

{% if keeps_code %}
# How this ends is all that is known of it afterwards.
scratch=
trap 'code=$?; [ -z "$scratch" ] || rm -rf -- "$scratch"; echo "$code" > "$HOME/.starlings/{{ name }}/worker-$1.code"' EXIT
{% endif %}
if [ ! -x "$program" ]; then
  say "there is no program $program on this node: put it where the nodes see it, or name it with --program"
  exit 2
fi
if ! scratch="$(mktemp -d "$base/{{ name }}-XXXXXX" 2> /dev/null)"; then
  say "no scratch folder can be made in $base: is it there, and may you write in it? Name another with --scratch"
  exit 2
fi
{% if not keeps_code %}
trap 'rm -rf -- "$scratch"' EXIT
{% endif %}
export TMPDIR="$scratch"

# The engine may have told the worker itself: a second word at once would end it without order.
worker=
stopped=
stop() {
  stopped=yes
  sleep 1
  [ -z "$worker" ] || kill -TERM "$worker" 2> /dev/null
}
trap stop TERM INT

"$program" worker --access "$access" --stay --idle {{ idle|sh }} --slots "{{ slots }}"{% if is_solver %} --solver-from {{ study|sh }}{% endif %} &
worker=$!
{% if processes is not none %}
# By this the worker is found among those of the coordinator.
echo "$(uname -n)/$worker" > {{ processes|sh }}"/worker-${SLURM_ARRAY_TASK_ID:-0}.process" || true
{% endif %}
[ -z "$stopped" ] || kill -TERM "$worker" 2> /dev/null

# A signal interrupts `wait` before the worker has ended.
while :; do
  wait "$worker"
  code=$?
  kill -0 "$worker" 2> /dev/null || break
done
exit "$code"
