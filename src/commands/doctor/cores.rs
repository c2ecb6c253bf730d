//! The CPU that drives and controller share: who else is on it, and how fast it wakes up.

use super::finding::Finding;
use super::host::{Host, cpu_list};
use runtime::fitness;
use std::collections::BTreeMap;

/// Longest exit from an idle state that leaves a cycle unharmed [µs].
const SHALLOW: u64 = 10;

/// Interrupts that are told by name.
const NAMED: usize = 4;

/// Whether the core is kept free of everything else.
pub(super) fn isolation(host: &Host, core: usize) -> Finding {
    const CHECK: &str = "CPU isolation";
    const WHY: &str = "what the scheduler, its tick and the kernel's housekeeping do on the core comes before or into the cycle";
    let online = host.cpus("/sys/devices/system/cpu/online").unwrap_or_default();
    if online.len() == 1 {
        let remedy = "drive a machine from a PC with at least two CPUs";
        return Finding::advice(CHECK, "there is one CPU for everything", WHY, remedy);
    }
    let isolated = host.cpus("/sys/devices/system/cpu/isolated").unwrap_or_default();
    let tickless = host.cpus("/sys/devices/system/cpu/nohz_full").unwrap_or_default();
    // The kernel's callbacks move away from tickless CPUs by themselves.
    let offloaded = host.boot_parameter("rcu_nocbs").and_then(|list| cpu_list(&list));
    let offloaded = offloaded.unwrap_or_else(|| tickless.clone());
    let wanted = [("isolcpus", &isolated), ("nohz_full", &tickless), ("rcu_nocbs", &offloaded)];
    let has = |(_, cpus): &&(&str, &Vec<usize>)| cpus.contains(&core);
    let names = |list: Vec<&(&'static str, &Vec<usize>)>| {
        list.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
    };
    let present = names(wanted.iter().filter(has).collect());
    let missing = names(wanted.iter().filter(|it| !has(it)).collect());
    if missing.is_empty() {
        return Finding::ok(CHECK, format!("CPU {core} has {present}"), WHY);
    }
    let present = if present.is_empty() { "none of it".to_owned() } else { present };
    let remedy = format!(
        "echo 'GRUB_CMDLINE_LINUX_DEFAULT=\"$GRUB_CMDLINE_LINUX_DEFAULT isolcpus={core} nohz_full={core} \
         rcu_nocbs={core}\"' | sudo tee /etc/default/grub.d/graver.cfg && sudo update-grub && sudo reboot"
    );
    Finding::advice(CHECK, format!("CPU {core} has {present}, and lacks {missing}"), WHY, remedy)
}

/// Whether the core's frequency stays where it is.
pub(super) fn governor(host: &Host, core: usize) -> Finding {
    const CHECK: &str = "frequency";
    const WHY: &str =
        "a core that was slowed down while it slept computes the next cycle at that speed";
    let folder = format!("/sys/devices/system/cpu/cpu{core}/cpufreq");
    let Some(governor) = host.text(&format!("{folder}/scaling_governor")) else {
        return Finding::ok(CHECK, format!("the kernel does not scale that of CPU {core}"), WHY);
    };
    let driver = host.text(&format!("{folder}/scaling_driver")).unwrap_or_default();
    let found = format!("governor {governor}, driver {driver}");
    match governor.as_str() {
        "performance" => Finding::ok(CHECK, found, WHY),
        _ => {
            let remedy = format!("echo performance | sudo tee {folder}/scaling_governor");
            Finding::advice(CHECK, found, WHY, remedy)
        }
    }
}

/// Whether the core wakes up without delay.
pub(super) fn idle_states(host: &Host, core: usize) -> Finding {
    const CHECK: &str = "idle states";
    const WHY: &str = "a core needs up to hundreds of microseconds to leave a deep sleep; Graver keeps it out of them where it may write /dev/cpu_dma_latency";
    let folder = format!("/sys/devices/system/cpu/cpu{core}/cpuidle");
    let states: Vec<_> = host
        .names(&folder)
        .into_iter()
        .filter_map(|state| {
            let at = |key: &str| format!("{folder}/{state}/{key}");
            let is_off = host.text(&at("disable")).as_deref() == Some("1");
            let latency: u64 = host.number(&at("latency"))?;
            let name = host.text(&at("name"));
            (!is_off).then(|| (latency, name.unwrap_or(state)))
        })
        .collect();
    let Some((latency, name)) = states.into_iter().max() else {
        return Finding::ok(CHECK, format!("the kernel has none for CPU {core}"), WHY);
    };
    let found = format!("deepest {name}, {latency} µs to leave");
    if latency <= SHALLOW {
        return Finding::ok(CHECK, found, WHY);
    }
    if fitness::may_write(&host.path("/dev/cpu_dma_latency")) {
        return Finding::ok(CHECK, format!("{found}; /dev/cpu_dma_latency may be written"), WHY);
    }
    let remedy = "echo 'KERNEL==\"cpu_dma_latency\", GROUP=\"graver\", MODE=\"0660\"' | sudo tee \
                  /etc/udev/rules.d/90-graver.rules && sudo udevadm trigger --name-match=cpu_dma_latency";
    Finding::advice(CHECK, format!("{found}; /dev/cpu_dma_latency may not be written"), WHY, remedy)
}

/// Whether the core's execution units are its own.
pub(super) fn siblings(host: &Host, core: usize) -> Finding {
    const CHECK: &str = "SMT";
    const WHY: &str =
        "two CPUs that share a core slow each other down, and isolating one of them is not enough";
    let file = format!("/sys/devices/system/cpu/cpu{core}/topology/thread_siblings_list");
    let Some(siblings) = host.cpus(&file) else {
        return Finding::unknown(CHECK, format!("the siblings of CPU {core} cannot be read"), WHY);
    };
    let others: Vec<_> = siblings.into_iter().filter(|cpu| *cpu != core).collect();
    if others.is_empty() {
        return Finding::ok(CHECK, format!("CPU {core} has its core to itself"), WHY);
    }
    let found = format!("CPU {core} shares its core with CPU {}", list(&others));
    Finding::advice(CHECK, found, WHY, "echo off | sudo tee /sys/devices/system/cpu/smt/control")
}

/// Which interrupts come to the core.
pub(super) fn interrupts(host: &Host, core: usize) -> Finding {
    const CHECK: &str = "interrupts";
    const WHY: &str =
        "the handler of a device's interrupt runs before the cycle, whatever its priority";
    let numbers: Vec<u32> =
        host.names("/proc/irq").iter().filter_map(|name| name.parse().ok()).collect();
    if numbers.is_empty() {
        return Finding::unknown(CHECK, "/proc/irq cannot be read", WHY);
    }
    let counts = counts(host, core);
    // Those that have come at least once: one that only may come is moved together with them.
    let here: Vec<_> = numbers
        .into_iter()
        .filter(|number| {
            let at = |key: &str| host.cpus(&format!("/proc/irq/{number}/{key}"));
            let cpus = at("effective_affinity_list").filter(|cpus| !cpus.is_empty());
            cpus.or_else(|| at("smp_affinity_list")).is_some_and(|cpus| cpus.contains(&core))
        })
        .filter_map(|number| {
            counts.get(&number).filter(|(count, _)| *count > 0).map(|it| (number, it))
        })
        .collect();
    if here.is_empty() {
        return Finding::ok(CHECK, format!("none of a device comes to CPU {core}"), WHY);
    }
    let mut named: Vec<_> =
        here.iter().take(NAMED).map(|(number, (_, name))| format!("{number} ({name})")).collect();
    if here.len() > NAMED {
        named.push(format!("{} more", here.len() - NAMED));
    }
    let online = host.cpus("/sys/devices/system/cpu/online").unwrap_or_default();
    let Some(other) = online.into_iter().find(|cpu| *cpu != core) else {
        return Finding::unknown(CHECK, format!("all come to CPU {core}, the only one"), WHY);
    };
    let all = here.iter().map(|(number, _)| number.to_string()).collect::<Vec<_>>().join(" ");
    let remedy = format!(
        "for irq in {all}; do echo {other} | sudo tee /proc/irq/$irq/smp_affinity_list; done; keep irqbalance \
         away: IRQBALANCE_BANNED_CPULIST={core} in /etc/default/irqbalance"
    );
    Finding::advice(CHECK, format!("to CPU {core} come {}", named.join(", ")), WHY, remedy)
}

/// How often each numbered interrupt came to the core, and its name; proc_interrupts(5).
fn counts(host: &Host, core: usize) -> BTreeMap<u32, (u64, String)> {
    let text = host.text("/proc/interrupts").unwrap_or_default();
    let mut lines = text.lines();
    let header: Vec<_> = lines.next().unwrap_or_default().split_whitespace().collect();
    let column = header.iter().position(|name| **name == format!("CPU{core}"));
    let Some(column) = column else { return BTreeMap::new() };
    let read = |line: &str| {
        let (number, rest) = line.split_once(':')?;
        let words: Vec<_> = rest.split_whitespace().collect();
        let count = words.get(column)?.parse().ok()?;
        // After the counts: the controller, the kind of trigger, the device.
        let name = words.get(header.len()..)?.last().map_or(String::new(), |it| (*it).to_owned());
        Some((number.trim().parse().ok()?, (count, name)))
    };
    lines.filter_map(read).collect()
}

fn list(cpus: &[usize]) -> String {
    cpus.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
