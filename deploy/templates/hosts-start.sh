# Starts workers on this machine; read by a shell that ssh started.
umask 077
folder="$HOME/.starlings/"{{ name }}
mkdir -p "$folder" || exit 2
{% if access_text is not none %}
cat > "$folder/access.json.new" << 'END_OF_ACCESS'
{{ access_text }}
END_OF_ACCESS
mv -f "$folder/access.json.new" "$folder/access.json" || exit 2
{% endif %}
{% for i in indices %}
cat > "$folder/worker-{{ i }}.sh" << 'END_OF_WORKER'
{% include "worker.sh" %}
END_OF_WORKER
STARLINGS_DEPLOYMENT={{ name }} nohup setsid sh "$folder/worker-{{ i }}.sh" {{ i }} > "$folder/worker-{{ i }}.log" 2>&1 < /dev/null &
echo "$!" > "$folder/worker-{{ i }}.pid"
{% endfor %}
