//! `graver doctor`, on copies of what other computers' kernels tell, and on this computer.

#![allow(clippy::unwrap_used)]

mod support;

use serde_json::Value;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::PathBuf;
use support::{Place, assert_valid};

/// The files of a PC that is set up as the manual says, with four CPUs, the last of them isolated.
const SOUND: &[(&str, &str)] = &[
    ("proc/sys/kernel/osrelease", "6.12.48+deb13-rt-amd64\n"),
    ("proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian 6.12.48-1\n"),
    ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
    ("proc/cmdline", "quiet isolcpus=3 nohz_full=3 rcu_nocbs=3\n"),
    ("proc/cpuinfo", "processor\t: 0\nflags\t\t: fpu tsc constant_tsc\n"),
    ("proc/swaps", "Filename\tType\tSize\tUsed\tPriority\n"),
    ("proc/mounts", "tmpfs /dev/shm tmpfs rw,nosuid,nodev 0 0\n"),
    ("proc/self/status", "CapEff:\t0000000000000000\n"),
    (
        "proc/self/limits",
        "Limit                     Soft Limit           Hard Limit           Units     \n\
         Max open files            1024                 524288               files     \n\
         Max locked memory         unlimited            unlimited            bytes     \n\
         Max realtime priority     90                   90                             \n",
    ),
    (
        "proc/interrupts",
        "            CPU0       CPU1       CPU2       CPU3\n  16:          5          0          0          0  IR-PCI-MSI 524288-edge      enp3s0\n",
    ),
    ("proc/irq/16/smp_affinity_list", "0-3\n"),
    ("proc/irq/16/effective_affinity_list", "0\n"),
    ("sys/kernel/realtime", "1\n"),
    ("sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never\n"),
    ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
    ("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm\n"),
    ("sys/devices/system/cpu/online", "0-3\n"),
    ("sys/devices/system/cpu/isolated", "3\n"),
    ("sys/devices/system/cpu/nohz_full", "3\n"),
    ("sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "3\n"),
    ("sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "performance\n"),
    ("sys/devices/system/cpu/cpu3/cpufreq/scaling_driver", "intel_pstate\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state0/name", "POLL\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state0/latency", "0\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state1/name", "C1\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state1/latency", "2\n"),
];

/// A computer with these files.
fn computer(place: &Place, files: &[(&str, &str)]) -> PathBuf {
    let root = place.path("computer");
    for (path, text) in files {
        let path = root.join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let shared = root.join("dev/shm");
    std::fs::create_dir_all(&shared).unwrap();
    std::fs::set_permissions(shared, PermissionsExt::from_mode(0o1777)).unwrap();
    root
}

/// What doctor says of it.
fn examined(place: &Place, root: &std::path::Path, more: &[&str], code: i32) -> Value {
    let mut arguments = vec!["doctor", "--json", "--root", root.to_str().unwrap()];
    arguments.extend(more);
    let report = place.graver(&arguments).json(code);
    assert_valid("doctor", &report);
    report
}

fn finding<'a>(report: &'a Value, check: &str) -> &'a Value {
    let findings = report["findings"].as_array().unwrap();
    let found = findings.iter().find(|finding| finding["check"] == check);
    found.unwrap_or_else(|| panic!("no {check} in {report:#}"))
}

#[test]
fn a_pc_that_is_set_up_has_nothing_to_change() {
    let place = Place::new();
    let root = computer(&place, SOUND);
    let report = examined(&place, &root, &[], 0);
    assert_eq!((&report["verdict"], &report["core"]), (&"unknown".into(), &3.into()));
    for finding in report["findings"].as_array().unwrap() {
        // What can only be tried on the computer itself is not known.
        let tried = ["SCHED_FIFO", "mlockall", "run directory", "wake-up latency"];
        let expected =
            if tried.contains(&finding["check"].as_str().unwrap()) { "unknown" } else { "ok" };
        assert_eq!(finding["verdict"], expected, "{finding:#}");
        assert!(finding["remedy"].is_null() && !finding["why"].as_str().unwrap().is_empty());
    }
}

#[test]
fn each_thing_that_is_wrong_is_found_and_has_a_command() {
    let changed: &[(&str, &str, &str, &str, &str)] = &[
        ("kernel", "problem", "proc/sys/kernel/version", "#1 SMP Debian\n", "linux-image-rt"),
        (
            "kernel",
            "advice",
            "proc/sys/kernel/version",
            "#1 SMP PREEMPT_DYNAMIC\n",
            "linux-image-rt",
        ),
        (
            "clock source",
            "problem",
            "sys/devices/system/clocksource/clocksource0/current_clocksource",
            "hpet\n",
            "echo tsc",
        ),
        ("real-time throttle", "problem", "proc/sys/kernel/sched_rt_runtime_us", "0\n", "sysctl"),
        ("virtual machine", "advice", "proc/cpuinfo", "flags : fpu hypervisor\n", "PC"),
        ("CPU isolation", "advice", "sys/devices/system/cpu/nohz_full", "(null)\n", "nohz_full=3"),
        (
            "frequency",
            "advice",
            "sys/devices/system/cpu/cpu3/cpufreq/scaling_governor",
            "powersave\n",
            "echo performance",
        ),
        (
            "idle states",
            "advice",
            "sys/devices/system/cpu/cpu3/cpuidle/state1/latency",
            "133\n",
            "cpu_dma_latency",
        ),
        (
            "SMT",
            "advice",
            "sys/devices/system/cpu/cpu3/topology/thread_siblings_list",
            "1,3\n",
            "smt/control",
        ),
        (
            "limit of priority",
            "problem",
            "proc/self/limits",
            "Max realtime priority     0     0 \n",
            "rtprio 90",
        ),
        (
            "limit of locked memory",
            "problem",
            "proc/self/limits",
            "Max locked memory     8388608     8388608     bytes \n",
            "memlock",
        ),
        (
            "limit of open files",
            "problem",
            "proc/self/limits",
            "Max open files     64     64     files \n",
            "ulimit -n",
        ),
        (
            "swap",
            "advice",
            "proc/swaps",
            "Filename Type Size Used Priority\n/dev/sda2 partition 1 0 -2\n",
            "swapoff",
        ),
        (
            "transparent huge pages",
            "advice",
            "sys/kernel/mm/transparent_hugepage/enabled",
            "[always] madvise never\n",
            "madvise",
        ),
        ("/dev/shm", "advice", "proc/mounts", "/dev/sda1 / ext4 rw 0 0\n", "tmpfs"),
    ];
    for (check, verdict, path, text, remedy) in changed {
        let place = Place::new();
        let mut files = SOUND.to_vec();
        if *check == "kernel" {
            files.retain(|(path, _)| *path != "sys/kernel/realtime");
        }
        files.push((path, text));
        let root = computer(&place, &files);
        let code = i32::from(*verdict == "problem");
        let report = examined(&place, &root, &[], code);
        let found = finding(&report, check);
        assert_eq!(found["verdict"], *verdict, "{found:#}");
        assert!(found["remedy"].as_str().unwrap().contains(remedy), "{found:#}");
    }
}

#[test]
fn an_interrupt_on_the_core_is_named_with_its_number() {
    let place = Place::new();
    let mut files = SOUND.to_vec();
    files.push(("proc/irq/16/effective_affinity_list", "3\n"));
    let interrupts = "            CPU0       CPU1       CPU2       CPU3\n  16:          5          0          0          9  IR-PCI-MSI 524288-edge      enp3s0\n";
    files.push(("proc/interrupts", interrupts));
    let root = computer(&place, &files);
    let report = examined(&place, &root, &[], 0);
    let found = finding(&report, "interrupts");
    assert_eq!(found["found"], "to CPU 3 come 16 (enp3s0)");
    assert!(found["remedy"].as_str().unwrap().contains("for irq in 16; do echo 0 "), "{found:#}");
    assert_eq!(
        finding(&examined(&place, &root, &["--core", "0"], 0), "interrupts")["verdict"],
        "ok"
    );
    let ended = place.graver(&["doctor", "--root", root.to_str().unwrap(), "--core", "9"]);
    assert_eq!(ended.code, Some(2));
    assert!(
        ended.error.contains("--core 9") && ended.error.contains("0, 1, 2, 3"),
        "{}",
        ended.error
    );
}

#[test]
fn the_card_of_the_machine_file_is_looked_for() {
    let place = Place::new();
    let routes = "Iface Destination Gateway Flags RefCnt Use Metric Mask MTU Window IRTT\n\
                  enp3s0 000A0A0A 00000000 0001 0 0 0 00FFFFFF 0 0 0\n";
    let mut files = SOUND.to_vec();
    files.push(("proc/net/route", routes));
    files.push(("sys/class/net/enp3s0/operstate", "down\n"));
    let root = computer(&place, &files);
    std::fs::create_dir_all(root.join("sys/class/net/enp3s0/device")).unwrap();
    symlink("../../../bus/pci/drivers/igb", root.join("sys/class/net/enp3s0/device/driver"))
        .unwrap();
    let emulated = support::source("machines/hostmot2_steppers.toml");
    let report = examined(&place, &root, &["--machine", emulated.to_str().unwrap()], 0);
    assert_eq!(finding(&report, "network card")["verdict"], "ok");
    let text = std::fs::read_to_string(emulated).unwrap().replace("127.0.0.1", "10.10.10.1");
    let machine = place.file("board.toml", &text);
    let machine = ["--machine", machine.to_str().unwrap()];
    let found = examined(&place, &root, &machine, 1);
    let found = finding(&found, "network card");
    assert_eq!(
        (&found["verdict"], &found["found"]),
        (&"problem".into(), &"enp3s0, igb, down".into())
    );
    assert_eq!(found["remedy"], "sudo ip link set enp3s0 up");
    std::fs::write(root.join("proc/net/route"), "Iface Destination\n").unwrap();
    let found = examined(&place, &root, &machine, 1);
    assert_eq!(finding(&found, "network card")["found"], "none leads to 10.10.10.1");
    let without = examined(&place, &root, &[], 0);
    assert!(!without.to_string().contains("network card"));
}

#[test]
fn this_computer_is_examined_and_its_wake_ups_are_measured() {
    let place = Place::new();
    let ended = place.graver(&["doctor", "--json"]);
    let code = ended.code;
    let report = ended.json(code.unwrap());
    assert_valid("doctor", &report);
    assert_eq!(code, Some(i32::from(report["verdict"] == "problem")));
    let noise = &report["noise"];
    assert_eq!(noise["core"], report["core"]);
    assert!(noise["wakes"].as_u64().unwrap() > 0 && noise["max"].as_i64() >= noise["p50"].as_i64());
    for tried in ["SCHED_FIFO", "mlockall", "run directory"] {
        assert_ne!(finding(&report, tried)["verdict"], "unknown");
    }
}
