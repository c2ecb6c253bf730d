//! The systemd units hold to what is wanted of them: the rights of each service, and what it may not do.

#![allow(clippy::unwrap_used)]

mod support;

use std::collections::BTreeMap;

/// The settings of a section of a unit, each with its values in order.
type Section = BTreeMap<String, Vec<String>>;

/// What no service may do.
const HARDENED: &[(&str, &str)] = &[
    ("NoNewPrivileges", "yes"),
    ("CapabilityBoundingSet", ""),
    ("ProtectSystem", "strict"),
    ("ProtectHome", "yes"),
    ("PrivateTmp", "yes"),
    ("ProtectProc", "invisible"),
    ("ProtectKernelTunables", "yes"),
    ("ProtectKernelModules", "yes"),
    ("ProtectKernelLogs", "yes"),
    ("ProtectControlGroups", "yes"),
    ("ProtectClock", "yes"),
    ("ProtectHostname", "yes"),
    ("RestrictNamespaces", "yes"),
    ("RestrictSUIDSGID", "yes"),
    ("LockPersonality", "yes"),
    ("MemoryDenyWriteExecute", "yes"),
    ("SystemCallArchitectures", "native"),
    ("SystemCallFilter", "@system-service @resources"),
    ("UMask", "0027"),
    ("User", "graver"),
    // The folder of shared memory must be the same for all, and for operators.
    ("UnsetEnvironment", "XDG_RUNTIME_DIR"),
    ("RemoveIPC", "no"),
    ("StateDirectory", "graver"),
];

/// The sections of a unit file of `deploy`.
fn sections(name: &str) -> BTreeMap<String, Section> {
    let text = std::fs::read_to_string(support::source("deploy").join(name)).unwrap();
    let mut sections = BTreeMap::<String, Section>::new();
    let mut current = String::new();
    for line in text.lines().map(str::trim) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if let Some(section) = line.strip_prefix('[') {
            current = section.strip_suffix(']').unwrap().to_owned();
            continue;
        }
        let (key, value) = line.split_once('=').unwrap_or_else(|| panic!("{name}: {line}"));
        let section = sections.entry(current.clone()).or_default();
        section.entry(key.to_owned()).or_default().push(value.to_owned());
    }
    sections
}

/// The section `Service` of a service's unit.
fn service(name: &str) -> Section {
    sections(&format!("graver-{name}@.service"))["Service"].clone()
}

fn value<'a>(section: &'a Section, key: &str) -> &'a str {
    section.get(key).map_or("", |values| values.last().unwrap())
}

#[test]
fn every_service_is_hardened() {
    for name in ["domain", "planner", "controller", "drives", "monitor", "modbus", "serve"] {
        let unit = service(name);
        for (key, wanted) in HARDENED {
            assert!(unit.contains_key(*key), "{name} lacks {key}");
            assert_eq!(value(&unit, key), *wanted, "{name}: {key}");
        }
        let command = value(&unit, "ExecStart");
        assert!(command.starts_with(&format!("graver {name} --instance %i")), "{name}: {command}");
    }
}

#[test]
fn only_the_page_and_modbus_reach_a_network_and_only_the_cycle_a_priority() {
    for name in ["domain", "planner", "monitor"] {
        let unit = service(name);
        for key in ["PrivateNetwork", "PrivateDevices", "RestrictRealtime"] {
            assert_eq!(value(&unit, key), "yes", "{name}: {key}");
        }
        assert_eq!(value(&unit, "RestrictAddressFamilies"), "AF_UNIX");
    }
    for name in ["controller", "drives"] {
        let unit = service(name);
        assert_eq!((value(&unit, "LimitRTPRIO"), value(&unit, "LimitMEMLOCK")), ("90", "infinity"));
        // Pipelines that share a CPU find each other by names of the network namespace.
        assert!(!unit.contains_key("PrivateNetwork") && !unit.contains_key("RestrictRealtime"));
        assert_eq!(value(&unit, "IPAddressDeny"), "any");
        assert_eq!(value(&unit, "RestrictAddressFamilies"), "AF_UNIX");
        assert_eq!(value(&unit, "DevicePolicy"), "closed");
        assert_eq!(value(&unit, "DeviceAllow"), "/dev/cpu_dma_latency rw");
    }
    for name in ["serve", "modbus"] {
        let unit = service(name);
        assert_eq!(value(&unit, "RestrictAddressFamilies"), "AF_UNIX AF_INET AF_INET6", "{name}");
        let allowed = (value(&unit, "IPAddressDeny"), value(&unit, "IPAddressAllow"));
        assert_eq!(allowed, ("any", "localhost"), "{name}");
        assert_eq!(value(&unit, "RestrictRealtime"), "yes", "{name}");
    }
}

#[test]
fn services_say_when_they_are_ready_and_that_they_live_but_for_the_cycle() {
    for name in ["domain", "planner", "monitor", "modbus"] {
        let unit = service(name);
        assert_eq!((value(&unit, "Type"), value(&unit, "WatchdogSec")), ("notify", "30"), "{name}");
    }
    for name in ["controller", "drives"] {
        let unit = service(name);
        assert_eq!((value(&unit, "Type"), value(&unit, "WatchdogSec")), ("notify", ""), "{name}");
    }
    for name in ["domain", "planner", "controller", "drives"] {
        assert_eq!(value(&service(name), "Restart"), "no", "{name}");
    }
    for name in ["monitor", "modbus"] {
        assert_eq!(value(&service(name), "Restart"), "on-failure", "{name}");
    }
}

#[test]
fn services_end_with_their_domain_and_the_page_does_not_end_them() {
    for name in ["planner", "controller", "drives", "monitor", "modbus"] {
        let unit = &sections(&format!("graver-{name}@.service"))["Unit"];
        assert_eq!(value(unit, "BindsTo"), "graver-domain@%i.service", "{name}");
        assert_eq!(value(unit, "PartOf"), "graver@%i.target", "{name}");
    }
    let page = &sections("graver-serve@.service")["Unit"];
    assert!(!page.contains_key("BindsTo") && !page.contains_key("Requires"));
    // Whoever wants the page says so: it listens on the network.
    let target = &sections("graver@.target")["Unit"];
    let wanted = value(target, "Wants");
    assert_eq!(wanted.split_whitespace().count(), 5);
    // Nor is there a device on Modbus beside every machine.
    assert!(!wanted.contains("serve") && !wanted.contains("modbus"));
    assert_eq!(
        value(&sections("graver-serve@.service")["Install"], "WantedBy"),
        "graver@%i.target"
    );
}

#[test]
fn what_drives_on_a_network_may_is_in_drop_ins_of_their_own() {
    let board = &sections("network/hostmot2.conf")["Service"];
    assert_eq!(value(board, "RestrictAddressFamilies"), "AF_UNIX AF_INET");
    assert!(!board.contains_key("AmbientCapabilities"));
    let devices = &sections("network/modbus.conf")["Service"];
    assert!(
        devices.contains_key("IPAddressAllow") && !devices.contains_key("CapabilityBoundingSet")
    );
    let bus = &sections("network/ethercat.conf")["Service"];
    assert_eq!(value(bus, "RestrictAddressFamilies"), "AF_UNIX AF_PACKET");
    for key in ["AmbientCapabilities", "CapabilityBoundingSet"] {
        assert_eq!(value(bus, key), "CAP_NET_RAW");
    }
}

#[test]
fn a_monitor_that_speaks_with_a_fleet_reaches_one_address_and_keeps_its_jobs_where_it_may_write() {
    let fleet = &sections("network/fleet.conf")["Service"];
    assert_eq!((value(fleet, "PrivateNetwork"), value(fleet, "IPAddressDeny")), ("no", "any"));
    assert_eq!(value(fleet, "IPAddressAllow"), "10.10.0.1");
    let commands = &fleet["ExecStart"];
    // The first clears what the unit says.
    assert_eq!((commands.len(), commands[0].as_str()), (2, ""));
    let begins = "graver monitor --instance %i --publish tls://10.10.0.1:4222 ";
    assert!(commands[1].starts_with(begins), "{}", commands[1]);
    let domain = service("domain");
    assert_eq!(value(fleet, "Environment"), value(&domain, "Environment"));
}

/// What the Debian package is made of is in the tree, but for what is made of the program.
#[test]
fn the_package_has_every_unit_and_nothing_that_is_not_there() {
    let manifest = std::fs::read_to_string(support::source("Cargo.toml")).unwrap();
    let assets = manifest.split_once("\nassets = [\n").unwrap().1.split_once("\n]").unwrap().0;
    let assets: Vec<&str> = assets.lines().map(|line| line.split('"').nth(1).unwrap()).collect();
    assert!(assets.contains(&"deploy/*.service") && assets.contains(&"deploy/*.target"));
    for asset in assets.iter().filter(|asset| !asset.starts_with("target/")) {
        let (folder, name) = asset.rsplit_once('/').unwrap_or((".", asset));
        let (begin, end) = name.split_once('*').unwrap_or((name, ""));
        let entries = std::fs::read_dir(support::source(folder)).unwrap().flatten();
        let names = entries.filter(|entry| entry.path().is_file());
        let mut names = names.map(|entry| entry.file_name().into_string().unwrap());
        let is_meant = |found: &String| {
            if name.contains('*') {
                found.starts_with(begin) && found.ends_with(end)
            } else {
                found == name
            }
        };
        assert!(names.any(|found| is_meant(&found)), "{asset}");
    }
    for script in ["postinst", "prerm", "postrm"] {
        let text = std::fs::read_to_string(support::source("deploy/debian").join(script)).unwrap();
        assert!(text.starts_with("#!/bin/sh\n") && text.contains("\nset -e\n"), "{script}");
        // A machine that runs is stopped by people; what moves is not started by an installation.
        for verb in ["start", "restart", "enable", "try-restart"] {
            assert!(!text.contains(&format!("systemctl {verb}")), "{script}: {verb}");
        }
    }
}
