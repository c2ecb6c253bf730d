#!/bin/sh
# Lets programs that speak grbl operate a pipeline, and prints what each of them saw; ends with 1 where one of them did not
# get what it wanted.
#
#   tests/independent/grbl_clients.sh GRAVER [raydriver|meerk40t|cncjs …]
#
# Needs Python 3 with venv, and node and npm for cncjs. raydriver 0.5.1 (the driver of Rayforge) and MeerK40t 0.9.9100 come
# from PyPI, CNCjs 1.11.5 from npm, into a temporary folder; CLIENTS names one to keep. MeerK40t and raydriver connect over
# TCP, CNCjs opens the terminal of --grbl-tty as its serial port.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
graver=$(realpath "$1")
shift
[ $# -gt 0 ] || set -- raydriver meerk40t cncjs
work=$(mktemp -d /tmp/gXXXX)
clients=${CLIENTS:-$work/clients}
mkdir -p "$clients" "$work/state" "$work/home"
pid=
trap '[ -z "$pid" ] || kill "$pid" 2>/dev/null && wait "$pid" || true; rm -rf "$work"' EXIT
trap 'exit 2' INT TERM

python() {
    [ -x "$clients/venv/bin/python" ] || python3 -m venv "$clients/venv"
    "$clients/venv/bin/python" -m pip install --quiet --disable-pip-version-check "$@" >&2
}

XDG_RUNTIME_DIR=$work XDG_STATE_HOME=$work/state
export XDG_RUNTIME_DIR XDG_STATE_HOME
: >"$work/graver.log"
(cd "$work" && exec "$graver" domain --services --no-realtime --machine "$here/../../machines/diode_corexy.toml" \
    --grbl 127.0.0.1:0 --grbl-tty "$work/port" 2>"$work/graver.log") &
pid=$!
port=
for _ in $(seq 200); do
    port=$(sed -n 's/.*grbl at 127\.0\.0\.1:\([0-9]*\).*/\1/p' "$work/graver.log")
    [ -n "$port" ] && [ -e "$work/port" ] && break
    sleep 0.1
done
[ -n "$port" ] || { cat "$work/graver.log" >&2; exit 2; }

failed=0
for client in "$@"; do
    echo "== $client"
    case $client in
    raydriver)
        python raydriver==0.5.1
        timeout 120 "$clients/venv/bin/python" "$here/grbl_raydriver.py" "$port" || failed=1
        ;;
    meerk40t)
        python meerk40t==0.9.9100 pillow
        HOME=$work/home timeout 120 "$clients/venv/bin/python" "$here/grbl_meerk40t.py" "$port" "$work" || failed=1
        ;;
    cncjs)
        [ -d "$clients/node_modules/cncjs" ] ||
            (cd "$clients" && npm init --yes >/dev/null && npm install --no-audit --no-fund cncjs@1.11.5 socket.io-client@2 >&2)
        HOME=$work/home timeout 180 node "$here/grbl_cncjs.cjs" "$clients/node_modules" "$work/port" "$work" || failed=1
        ;;
    *)
        echo "no client is called $client" >&2
        exit 2
        ;;
    esac
done
echo "== jobs of the pipeline"
"$graver" queue list
exit $failed
