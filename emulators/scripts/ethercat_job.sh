#!/bin/sh
# Runs a job on the emulated EtherCAT bus by raw frames over a veth pair, with the machine servo_gantry.toml.
#
# Needs root (a network namespace, raw sockets) and iproute2. Usage: emulators/scripts/ethercat_job.sh [ARGUMENTS...]
# with arguments of `graver run`, such as a job and `--out FOLDER`.
#   GRAVER=...    the program, built with --features ethercat
#   EMULATOR=...  the emulator's program
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
graver=${GRAVER:-$root/target/release/graver}
emulator=${EMULATOR:-$root/target/release/ethercat-emulator}
space="graver-ethercat-$$"
ours="gve$$"
theirs="gvm$$"
work=$(mktemp -d)
line=

clean() {
    if [ -n "$line" ]; then
        kill "$line" 2>/dev/null || true
        wait "$line" 2>/dev/null || true
    fi
    ip link del "$ours" 2>/dev/null || true
    ip netns del "$space" 2>/dev/null || true
    rm -rf "$work"
}
trap clean EXIT
trap 'exit 1' INT TERM

# The master's end of the cable is in a namespace of its own, so that no frame takes another way.
ip netns add "$space"
ip link add "$ours" type veth peer name "$theirs" netns "$space"
ip link set "$ours" up
ip -n "$space" link set "$theirs" up

sed -e "s|^udp = .*|interface = \"$theirs\"|" -e "s|\"\.\./jobs/|\"$root/jobs/|" -e '/^#:schema/d' \
    "$root/machines/servo_gantry.toml" >"$work/bus.toml"
"$emulator" --interface "$ours" --machine "$work/bus.toml" &
line=$!
ip netns exec "$space" "$graver" run --machine "$work/bus.toml" "$@"
