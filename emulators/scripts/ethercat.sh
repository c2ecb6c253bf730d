#!/bin/sh
# Checks the EtherCAT emulator with a master that is not ours: pysoem, the Python binding of SOEM.
#
# Needs root (a network namespace, raw sockets), iproute2, and a Python with pysoem 1.1.13: by default one that
# it makes itself. Usage: emulators/scripts/ethercat.sh [CYCLES]
#   PYTHON=...    a Python that has pysoem
#   EMULATOR=...  the emulator's program
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
cycles=${1:-1000}
space="graver-ethercat-$$"
ours="gve$$"
theirs="gvm$$"
work=$(mktemp -d)
emulator=

clean() {
    if [ -n "$emulator" ]; then
        kill "$emulator" 2>/dev/null || true
        wait "$emulator" 2>/dev/null || true
    fi
    ip link del "$ours" 2>/dev/null || true
    ip netns del "$space" 2>/dev/null || true
    rm -rf "$work"
}
trap clean EXIT
trap 'exit 1' INT TERM

if [ -z "${PYTHON:-}" ]; then
    python3 -m venv "$work/python"
    "$work/python/bin/pip" install --quiet --disable-pip-version-check pysoem==1.1.13
    PYTHON="$work/python/bin/python"
fi
if [ -z "${EMULATOR:-}" ]; then
    cargo build --quiet --manifest-path "$root/Cargo.toml" -p emulators --bin ethercat-emulator
    EMULATOR="${CARGO_TARGET_DIR:-$root/target}/debug/ethercat-emulator"
fi

# The master's end of the cable is in a namespace of its own, so that no frame takes another way.
ip netns add "$space"
ip link add "$ours" type veth peer name "$theirs" netns "$space"
ip link set "$ours" up
ip -n "$space" link set "$theirs" up

"$EMULATOR" --interface "$ours" &
emulator=$!
ip netns exec "$space" "$PYTHON" "$here/ethercat.py" "$theirs" "$cycles"
