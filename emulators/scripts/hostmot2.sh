#!/bin/bash
# Whether masters that are not ours accept the emulated HostMot2 board: Mesa's `mesaflash` reads what it is,
# and LinuxCNC's `hm2_eth` runs it at 1 ms for SECONDS (60) without a bite of its watchdog.
#
#   sudo emulators/scripts/hostmot2.sh [SECONDS [PERIOD_NS]]
#
# On a computer that stands still for more than 5 ms now and then, as a busy virtual machine does, the watchdog bites
# and the driver gives up, whatever is on the other end. PATIENT=1 gives it a watchdog of 50 ms and a packet-error-limit
# of 200 in place of 10.
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

# Its driver, as Debian has it, dies of a segmentation fault now and then while it starts.
for attempt in 1 2 3; do
    bench_hal "$seconds" "$period" >"$scratch/hal.err" 2>&1
    grep -q "caught signal 11" "$scratch/hal.err" && [ ! -s "$scratch/values" ] || break
    echo "hm2_eth fell with signal 11 while it started, attempt $attempt"
done
value() { sed -n "s/^$1=//p" "$scratch/values" 2>/dev/null | tail -1; }
bitten=$(value has_bit) errors=$(value packet_errors) counts=$(value counts) mirror=$(value mirror)
[ -n "$bitten" ]
verdict $? "hm2_eth registers the board"
[ "$bitten" = FALSE ]
verdict $? "no bite of the watchdog in $seconds s at $period ns, watchdog $watchdog ns (has_bit=$bitten, packet errors $errors)"
[ "${counts:-0}" -ge 2498 ] && [ "${counts:-0}" -le 2501 ]
verdict $? "stepgen 0 went to 2,500 steps (counts=$counts)"
awk -v at="${mirror:-9}" 'BEGIN { exit !(at > 0.2499 && at < 0.2501) }'
verdict $? "the mirror stands at 0.25 (posx-fb=$mirror)"
[ $failed = 0 ] || grep -v "IO Pin\|fallback_uid" "$scratch/hal.err" | tail -20

bench_close
# The driver bites of its own will as it is unloaded; after an error it looks at neither bites nor counts.
awk -v RS='[],[ \n]+' -v least="$((seconds * 1900000000 / period / 1000 * 1000))" '
    /"time":/ { field = "time"; next }
    /"to_board":/ { board = 1; next }
    /"sent":/ { field = board ? "frames" : ""; board = 0; next }
    /"bites":/ { list = 1; next }
    /"[a-z_]+":/ { list = 0; field = ""; next }
    field != "" { value[field] = $0; field = "" }
    list && /^[0-9.]+$/ { bites[++count] = $0 }
    END {
        for (index_ = 1; index_ <= count; index_++) if (bites[index_] < value["time"] - 1.5) early++
        printf "      by the board: %d bites while it ran, %d frames\n", early, value["frames"]
        exit !(early == 0 && value["frames"] >= least) }' "$scratch/report.json"
verdict $? "the board saw the same: no bite, and a read and a write in each cycle"
[ -s "$scratch/report.json" ]
verdict $? "the emulator's own account, in seconds:"
grep -v '^[{}]' "$scratch/report.json" | tr -d ' \n'; echo
exit $failed
