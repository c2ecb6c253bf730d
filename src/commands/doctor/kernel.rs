//! The kernel: how it preempts, what it keeps time by, and whether it has the computer to itself.

use super::finding::Finding;
use super::host::Host;

/// Microseconds of each second that real-time tasks must have at least for the cycle to be unharmed: drives and
/// controller together take a third of a CPU at most.
const LEAST_RUNTIME: i64 = 500_000;

/// Whether the kernel preempts itself for a real-time thread.
pub(super) fn preemption(host: &Host) -> Finding {
    const CHECK: &str = "kernel";
    const WHY: &str = "a kernel that does not preempt itself lets a real-time thread wait for whatever it is doing";
    const REMEDY: &str = "sudo apt install linux-image-rt-amd64 && sudo reboot";
    let Some(release) = host.text("/proc/sys/kernel/osrelease") else {
        return Finding::unknown(CHECK, "its release cannot be read", WHY);
    };
    let version = host.text("/proc/sys/kernel/version").unwrap_or_default();
    if host.text("/sys/kernel/realtime").as_deref() == Some("1") || version.contains("PREEMPT_RT") {
        return Finding::ok(CHECK, format!("Linux {release}, PREEMPT_RT"), WHY);
    }
    if version.contains("PREEMPT_DYNAMIC") {
        let mode = dynamic_mode(host);
        let named = mode.as_deref().map_or(String::new(), |mode| format!(", {mode}"));
        let found = format!("Linux {release}, PREEMPT_DYNAMIC{named}, not PREEMPT_RT");
        return match mode.as_deref() {
            Some("none" | "voluntary") => Finding::problem(
                CHECK,
                found,
                WHY,
                format!(
                    "{REMEDY}; at once, and until the next start: echo full | sudo tee /sys/kernel/debug/sched/preempt"
                ),
            ),
            _ => Finding::advice(CHECK, found, WHY, REMEDY),
        };
    }
    if version.contains("PREEMPT") {
        return Finding::advice(
            CHECK,
            format!("Linux {release}, PREEMPT, not PREEMPT_RT"),
            WHY,
            REMEDY,
        );
    }
    Finding::problem(CHECK, format!("Linux {release}, without preemption"), WHY, REMEDY)
}

/// How a kernel preempts that can be told to when it is booted: by its debug file system, which only root may read, or
/// what it was booted with.
fn dynamic_mode(host: &Host) -> Option<String> {
    let chosen = host.text("/sys/kernel/debug/sched/preempt").and_then(|text| {
        let word = text.split_whitespace().find(|word| word.starts_with('('))?;
        Some(word.trim_matches(['(', ')']).to_owned())
    });
    chosen.or_else(|| host.boot_parameter("preempt"))
}

/// What the kernel reads the time from.
pub(super) fn clock_source(host: &Host) -> Finding {
    const CHECK: &str = "clock source";
    const WHY: &str = "the time is read several times in each cycle; of other sources than the CPU's own counter a reading takes microseconds";
    const FOLDER: &str = "/sys/devices/system/clocksource/clocksource0";
    let Some(source) = host.text(&format!("{FOLDER}/current_clocksource")) else {
        return Finding::unknown(CHECK, "it cannot be read", WHY);
    };
    let available = host.text(&format!("{FOLDER}/available_clocksource")).unwrap_or_default();
    let has_tsc = available.split_whitespace().any(|name| name == "tsc");
    match source.as_str() {
        "tsc" | "arch_sys_counter" | "kvm-clock" | "hyperv_clocksource_tsc_page" => {
            Finding::ok(CHECK, source, WHY)
        }
        _ if has_tsc => {
            let remedy = format!("echo tsc | sudo tee {FOLDER}/current_clocksource");
            Finding::problem(CHECK, source, WHY, remedy)
        }
        _ => {
            let remedy = "boot with tsc=reliable, if the counters of all CPUs are known to agree; see: sudo dmesg | grep -i tsc";
            Finding::problem(CHECK, format!("{source}; the kernel does not offer tsc"), WHY, remedy)
        }
    }
}

/// How much of each second real-time tasks may have.
pub(super) fn throttle(host: &Host) -> Finding {
    const CHECK: &str = "real-time throttle";
    const WHY: &str =
        "real-time threads that used up their share of a second stand still for the rest of it";
    const FILE: &str = "/proc/sys/kernel/sched_rt_runtime_us";
    let Some(runtime) = host.number::<i64>(FILE) else {
        return Finding::unknown(CHECK, "sched_rt_runtime_us cannot be read", WHY);
    };
    let remedy = "sudo sysctl -w kernel.sched_rt_runtime_us=950000";
    match runtime {
        -1 => Finding::ok(CHECK, "off", WHY),
        0 => Finding::problem(CHECK, "no time at all for real-time tasks", WHY, remedy),
        _ if runtime < LEAST_RUNTIME => {
            Finding::advice(CHECK, format!("{runtime} µs of each second"), WHY, remedy)
        }
        _ => Finding::ok(CHECK, format!("{runtime} µs of each second"), WHY),
    }
}

/// Whether the computer is a virtual one.
pub(super) fn virtualisation(host: &Host) -> Finding {
    const CHECK: &str = "virtual machine";
    const WHY: &str = "a hypervisor takes the CPU away for milliseconds, and nothing in the machine can prevent it";
    let Some(cpus) = host.text("/proc/cpuinfo") else {
        return Finding::unknown(CHECK, "/proc/cpuinfo cannot be read", WHY);
    };
    let flags = cpus.lines().find(|line| line.starts_with("flags"));
    let is_virtual = flags.is_some_and(|line| line.split_whitespace().any(|it| it == "hypervisor"));
    if !is_virtual {
        return Finding::ok(CHECK, "no: the kernel runs on the hardware", WHY);
    }
    let product = host.text("/sys/class/dmi/id/product_name").filter(|name| !name.is_empty());
    let named = product.map_or(String::new(), |name| format!(" ({name})"));
    let remedy = "drive a machine from a PC without a hypervisor; a simulated one runs here: `graver run` waits for late cycles";
    Finding::advice(CHECK, format!("yes{named}"), WHY, remedy)
}
