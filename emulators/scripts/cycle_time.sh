#!/bin/bash
# What a cycle costs on the emulated HostMot2 board: LinuxCNC's hm2_eth, and our bridge beside it.
#
#   sudo emulators/scripts/cycle_time.sh [SECONDS [PERIOD_NS [MACHINE]]]
#
# hm2_eth: the time of its read (request and reply) and of its write, sampled in every cycle by LinuxCNC's own
# sampler. Our bridge: the exchange of a cycle, one request with its reply, from `graver run` of the sample job of
# MACHINE (machines/hostmot2_steppers.toml) on this board. Needs what hostmot2.sh needs, and target/release/graver or
# GRAVER=...
set -u
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
PATIENT=1
. "$here/hostmot2_bench.sh"

seconds=${1:-20} period=${2:-1000000}
own=${3:-$here/../../machines/hostmot2_steppers.toml}
graver=${GRAVER:-$here/../../target/release/graver}
bench_need linuxcnc-uspace iproute2 iptables gcc
bench_open
bench_emulator "$scratch/report.json" --machine "$here/../../machines/cartesian_steppers.toml"

# LinuxCNC counts in ticks of the processor.
ticks=$(awk '/^cpu MHz/ { print $4; exit }' /proc/cpuinfo)
# percentiles COLUMN: of the samples, in µs.
percentiles() {
    awk -v column="$1" -v ticks="$ticks" 'NF >= 2 { print $column / ticks }' "$scratch/samples" | sort -n |
        awk '{ at[NR] = $1 } END {
            if (NR == 0) { print "no samples"; exit }
            printf "p50 %.1f us, p99 %.1f us, longest %.1f us (%d cycles)\n",
                at[int(0.5 * (NR - 1)) + 1], at[int(0.99 * (NR - 1)) + 1], at[NR], NR }'
}

name=hm2_7i80.0
BENCH_EXTRA="loadrt sampler depth=100000 cfg=ss
addf sampler.0 servo
net read-time $name.read.time sampler.0.pin.0
net write-time $name.write.time sampler.0.pin.1"
BENCH_SAMPLES=$((seconds * (1000000000 / period)))
bench_hal "$seconds" "$period" >"$scratch/hal.err" 2>&1
bench_close
echo "hm2_eth at $period ns, $seconds s:"
echo "  read   $(percentiles 1)"
echo "  write  $(percentiles 2)"
[ -s "$scratch/samples" ] || grep -v "IO Pin\|fallback_uid" "$scratch/hal.err" | tail -20

bench_open
bench_emulator "$scratch/own.json" --machine "$own"
echo "graver run on the same board:"
"$graver" run --machine "$own" --set "machine.drives.hostmot2.address=\"$board\"" --out "$scratch/run" \
    >"$scratch/run.out" 2>&1
grep -E "^(outcome|drives|link|latency exchange|cycles) " "$scratch/run.out" || tail -20 "$scratch/run.out"
