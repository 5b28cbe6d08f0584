# Says of every worker on this machine whether it runs{% if cancels %}, and ends it{% endif %}.

folder="$HOME/.starlings/"{{ name }}
for i in {{ indices|join(" ") }}; do
  # An old number may be that of another process by now; what has the name of the deployment in its environment is ours.
  pid="$(cat "$folder/worker-$i.pid" 2> /dev/null)"
  since="$(stat -c %Y "$folder/worker-$i.pid" 2> /dev/null || echo 0)"
  if [ -z "$pid" ]; then
    echo "starlings $i unknown 0 0"
  elif tr '\0' '\n' < "/proc/$pid/environ" 2> /dev/null | grep -qx "STARLINGS_DEPLOYMENT={{ name }}"; then
    echo "starlings $i running $since 0"
{% if cancels %}
    kill -TERM "$pid"
{% endif %}
  else
    echo "starlings $i ended $(stat -c %Y "$folder/worker-$i.code" 2> /dev/null || echo "$since") $(cat "$folder/worker-$i.code" 2> /dev/null || echo 1)"
    tail -n 20 "$folder/worker-$i.log" 2> /dev/null | sed 's/^/log /'
  fi
done
