# Sourced by the scripts here: a veth pair whose far end, in a namespace, is the emulated board, and LinuxCNC
# on the near one.

near=hm2near far=hm2far space=hm2board board=10.99.0.2 host=10.99.0.1
# LinuxCNC's own values; both are passed by a computer that stands still for more than 5 ms.
watchdog=5000000 limit=10
[ -z "${PATIENT:-}" ] || watchdog=50000000 limit=200
scratch=$(mktemp -d) emulator_pid= softirqs=

bench_need() {
    local missing=()
    for package in "$@"; do
        dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q "ok installed" || missing+=("$package")
    done
    if [ ${#missing[@]} -gt 0 ]; then
        echo "missing Debian packages: apt-get install ${missing[*]}" >&2
        exit 2
    fi
    [ "$(id -u)" = 0 ] || { echo "run it as root: it makes a veth pair and a namespace" >&2; exit 2; }
}

# The chain by which hm2_eth keeps other traffic off its interface stays behind when it is killed.
bench_firewall() {
    local tables
    for tables in iptables ip6tables; do
        while $tables -D OUTPUT -j hm2-eth-rules-output 2>/dev/null; do :; done
        $tables -F hm2-eth-rules-output 2>/dev/null
        $tables -X hm2-eth-rules-output 2>/dev/null
    done
    true
}

bench_close() {
    if [ -n "$emulator_pid" ]; then
        kill -TERM "$emulator_pid" 2>/dev/null
        wait "$emulator_pid" 2>/dev/null
        emulator_pid=
    fi
    for thread in $softirqs; do chrt -o -p 0 "$thread" 2>/dev/null; done
    softirqs=
    bench_firewall
    ip link del "$near" 2>/dev/null
    ip netns del "$space" 2>/dev/null
    true
}

bench_open() {
    trap 'bench_close; rm -rf "$scratch"' EXIT
    trap 'exit 130' INT TERM
    bench_close
    ip netns add "$space"
    ip link add "$near" type veth peer name "$far" netns "$space"
    ip addr add "$host/24" dev "$near"
    ip link set "$near" up
    ip -n "$space" addr add "$board/24" dev "$far"
    ip -n "$space" link set "$far" up
    ip -n "$space" link set lo up
    # On a busy machine the kernel hands frames over in threads that compete with everything else. They come
    # before it while this runs.
    softirqs=$(pgrep -x 'ksoftirqd/[0-9]+')
    for thread in $softirqs; do chrt -f -p 91 "$thread"; done
    mac=$(ip -n "$space" -o link show "$far" | sed 's/.*ether \([0-9a-f:]*\).*/\1/')
    # hm2_eth asks for a permanent entry.
    ip neigh replace "$board" lladdr "$mac" dev "$near" nud permanent
    ip -n "$space" neigh replace "$host" lladdr "$(cat "/sys/class/net/$near/address")" dev "$far" nud permanent
    local root="$here/../.."
    emulator=${EMULATOR:-$root/target/debug/hostmot2-emulator}
    [ -x "$emulator" ] || (cd "$root" && cargo build -p emulators --bin hostmot2-emulator) || exit 2
    # A virtual machine without CAP_SYS_RESOURCE refuses to raise the limits that LinuxCNC raises first, and
    # lets it have its real-time priority all the same.
    cat >"$scratch/limits.c" <<'C'
#define _GNU_SOURCE
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
int setrlimit(__rlimit_resource_t resource, const struct rlimit *limit) {
    syscall(SYS_prlimit64, 0, resource, limit, 0);
    return 0;
}
int setrlimit64(__rlimit_resource_t resource, const struct rlimit64 *limit) {
    syscall(SYS_prlimit64, 0, resource, limit, 0);
    return 0;
}
C
    gcc -shared -fPIC -o "$scratch/limits.so" "$scratch/limits.c"
}

# bench_emulator REPORT [OPTIONS]
bench_emulator() {
    local report=$1
    shift
    ip netns exec "$space" chrt -f 90 taskset -c 0 "$emulator" --udp "$board:27181" --mac "$mac" --report "$report" "$@" \
        2>"$scratch/emulator.err" &
    emulator_pid=$!
    sleep 1
    kill -0 "$emulator_pid" 2>/dev/null || { cat "$scratch/emulator.err" >&2; exit 2; }
}

# bench_hal SECONDS PERIOD_NS: runs hm2_eth, moves a stepgen and a mirror, and puts what came of it into
# $scratch/values. BENCH_EXTRA are further lines of HAL; BENCH_SAMPLES lines of its sampler go to $scratch/samples.
bench_hal() {
    local seconds=$1 period=$2 name=hm2_7i80.0
    cat >"$scratch/board.hal" <<HAL
loadrt hostmot2
loadrt hm2_eth board_ip=$board
loadrt threads name1=servo period1=$period
addf $name.read servo
addf $name.write servo
setp $name.stepgen.00.position-scale 1000
setp $name.stepgen.00.steplen 2000
setp $name.stepgen.00.stepspace 2000
setp $name.stepgen.00.maxvel 100
setp $name.stepgen.00.maxaccel 1000
setp $name.stepgen.00.enable 1
setp $name.xy2mod.00.enable 1
setp $name.xy2mod.00.posx-cmd 0.25
setp $name.packet-read-timeout 80
setp $name.watchdog.timeout_ns $watchdog
setp $name.packet-error-limit $limit
${BENCH_EXTRA:-}
start
${BENCH_SAMPLES:+loadusr halsampler -n $BENCH_SAMPLES $scratch/samples}
loadusr -w sleep 1
setp $name.stepgen.00.position-cmd 2.5
loadusr -w sleep $seconds
loadusr -w $scratch/show.sh
stop
HAL
    cat >"$scratch/show.sh" <<SHOW
#!/bin/sh
# LinuxCNC writes into the same output as it likes, so this goes elsewhere.
exec >$scratch/values
get() { echo "\$1=\$(halcmd -s show pin $name.\$2 | awk '{ print \$4; exit }')"; }
get has_bit watchdog.has_bit
get packet_errors packet-error-total
get counts stepgen.00.counts
get mirror xy2mod.00.posx-fb
SHOW
    chmod 755 "$scratch/show.sh"
    # LinuxCNC started by root gives its rights away: the directory is for whom it becomes.
    mkdir -p "$scratch/home"
    chmod 755 "$scratch"
    chmod 777 "$scratch/home"
    : >"$scratch/values"
    : >"$scratch/samples"
    chmod 666 "$scratch/values" "$scratch/samples"
    HOME="$scratch/home" RTAPI_UID=65534 RTAPI_FIFO_PATH="$scratch/home/.rtapi_fifo" \
        LINUXCNC_FORCE_REALTIME=1 LD_PRELOAD="$scratch/limits.so" \
        timeout $((seconds + 30)) halrun -f "$scratch/board.hal"
}
