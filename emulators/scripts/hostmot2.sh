#!/bin/bash
# Whether masters that are not ours accept the emulated HostMot2 board: Mesa's `mesaflash` reads what it is,
# and LinuxCNC's `hm2_eth` runs it at 1 ms for SECONDS (60) without a bite of its watchdog.
#
#   sudo emulators/scripts/hostmot2.sh [SECONDS [PERIOD_NS]]
#
# Needs root for a veth pair, a network namespace and real-time priorities, and Debian's packages mesaflash,
# linuxcnc-uspace, iproute2, iptables and gcc. Takes back all that it changes.
set -u
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$here/hostmot2_bench.sh"

seconds=${1:-60} period=${2:-1000000}
bench_need mesaflash linuxcnc-uspace iproute2 iptables gcc
bench_open "$@"

machine="$here/../../machines/cartesian_steppers.toml"
bench_emulator "$scratch/report.json" --machine "$machine"

failed=0
verdict() { if [ "$1" = 0 ]; then echo "pass: $2"; else echo "FAIL: $2"; failed=1; fi; }

mesaflash --device 7i80hd-16 --addr "$board" --readhmid >"$scratch/readhmid" 2>&1
found=0
for module in WatchDog IOPort QCount StepGen PWM DPLL LED; do
    grep -q "$module" "$scratch/readhmid" || { found=1; echo "mesaflash names no $module"; }
done
verdict $found "mesaflash --readhmid lists the modules"
[ $found = 0 ] || cat "$scratch/readhmid"

bench_hal "$seconds" "$period" >"$scratch/hal.out" 2>"$scratch/hal.err"
value() { sed -n "s/^$1=//p" "$scratch/hal.out" | tail -1; }
bitten=$(value has_bit) errors=$(value packet_errors) counts=$(value counts) mirror=$(value mirror)
[ -n "$bitten" ]
verdict $? "hm2_eth registers the board"
[ "$bitten" = FALSE ]
verdict $? "no bite of the watchdog in $seconds s at $period ns (has_bit=$bitten, packet errors $errors)"
[ "${counts:-0}" -ge 2498 ] && [ "${counts:-0}" -le 2501 ]
verdict $? "stepgen 0 went to 2,500 steps (counts=$counts)"
awk -v at="${mirror:-9}" 'BEGIN { exit !(at > 0.2499 && at < 0.2501) }'
verdict $? "the mirror stands at 0.25 (posx-fb=$mirror)"
[ $failed = 0 ] || tail -30 "$scratch/hal.err"

bench_close
[ -s "$scratch/report.json" ]
verdict $? "the emulator's own account:"
sed -n '/"to_board"/,/}/p; /"bites"/,/]/p; /"steps"/,/]/p' "$scratch/report.json" | tr -d '\n '; echo
exit $failed
