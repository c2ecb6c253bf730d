//! The network card that a fieldbus or a card on the network is reached by.

use super::finding::Finding;
use super::host::Host;
use machine::drives::{DrivesKind, EthercatLink};
use runtime::ethtool::{self, Offload};
use std::net::{Ipv4Addr, ToSocketAddrs};

/// Longest that a card may keep what it received for itself [µs].
const SHORT: u32 = 10;

/// Drivers of cards that exist in software only.
const VIRTUAL: [&str; 6] = ["virtio_net", "veth", "tun", "bridge", "hv_netvsc", "vmxnet3"];

/// What the drives of a machine are reached by.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Link {
    /// This card.
    Card(String),
    /// Whatever leads to this address.
    Address(Ipv4Addr),
    /// An address that is none, as it was written.
    Nowhere(String),
}

/// What is to be said of the network that drives of this kind need; nothing where they need none.
pub(super) fn findings(host: &Host, drives: &DrivesKind) -> Vec<Finding> {
    const CHECK: &str = "network card";
    const WHY: &str = "the drives of the machine file are reached by it in every cycle";
    let link = match drives {
        DrivesKind::Simulated => return Vec::new(),
        DrivesKind::Hostmot2(card) => address(&card.address),
        DrivesKind::Ethercat(bus) => match &bus.link {
            EthercatLink::Interface(name) => Link::Card(name.clone()),
            EthercatLink::Udp(to) => address(to),
        },
    };
    let card = match link {
        Link::Card(name) => name,
        Link::Address(to) if to.is_loopback() => "lo".to_owned(),
        Link::Address(to) => match route(host, to) {
            Some(name) => name,
            None => {
                let remedy = format!("sudo ip address add {}/24 dev CARD", neighbour(to));
                return vec![Finding::problem(CHECK, format!("none leads to {to}"), WHY, remedy)];
            }
        },
        Link::Nowhere(text) => {
            let found = format!("{text:?} is no address that can be found");
            return vec![Finding::problem(CHECK, found, WHY, "correct it in the machine file")];
        }
    };
    if card == "lo" {
        return vec![Finding::ok(CHECK, "lo: the drives are on this computer", WHY)];
    }
    let folder = format!("/sys/class/net/{card}");
    let Some(state) = host.text(&format!("{folder}/operstate")) else {
        let cards = host.names("/sys/class/net").join(", ");
        let found = format!("there is no {card}; there are {cards}");
        return vec![Finding::problem(CHECK, found, WHY, "correct it in the machine file")];
    };
    let driver = host.link(&format!("{folder}/device/driver"));
    let driver = driver.as_deref().unwrap_or("unknown driver");
    let found = format!("{card}, {driver}, {state}");
    let mut findings = vec![if state == "down" {
        Finding::problem(CHECK, found, WHY, format!("sudo ip link set {card} up"))
    } else if VIRTUAL.contains(&driver) {
        let remedy = "give the machine a card of its own, such as one with an Intel I210 (igb)";
        Finding::advice(CHECK, format!("{found}: it exists in software only"), WHY, remedy)
    } else {
        Finding::ok(CHECK, found, WHY)
    }];
    if host.is_this_one() {
        findings.push(coalescing(&card, ethtool::receive_delay(&card)));
        findings.push(offload(&card, |which| ethtool::is_on(&card, which)));
    }
    findings
}

fn coalescing(card: &str, delay: std::io::Result<u32>) -> Finding {
    const CHECK: &str = "interrupt coalescing";
    const WHY: &str =
        "a card that gathers packets before it interrupts makes each answer late by that time";
    match delay {
        Err(error) => Finding::unknown(CHECK, format!("{card}: {error}"), WHY),
        Ok(delay) if delay <= SHORT => Finding::ok(CHECK, format!("{card}: {delay} µs"), WHY),
        Ok(delay) => {
            let remedy = format!("sudo ethtool -C {card} adaptive-rx off rx-usecs 0 tx-usecs 0");
            Finding::advice(CHECK, format!("{card}: {delay} µs"), WHY, remedy)
        }
    }
}

fn offload(card: &str, is_on: impl Fn(Offload) -> std::io::Result<bool>) -> Finding {
    const CHECK: &str = "offloads";
    const WHY: &str = "a kernel that joins packets waits for more of them";
    let on: Result<Vec<_>, _> = Offload::ALL
        .into_iter()
        .map(|which| Ok::<_, std::io::Error>((which, is_on(which)?)))
        .collect();
    let on = match on {
        Ok(on) => on,
        Err(error) => return Finding::unknown(CHECK, format!("{card}: {error}"), WHY),
    };
    let on: Vec<_> = on.into_iter().filter(|(_, on)| *on).map(|(which, _)| which.name()).collect();
    if on.is_empty() {
        return Finding::ok(CHECK, format!("{card}: none"), WHY);
    }
    let off: Vec<_> = on.iter().map(|name| format!("{name} off")).collect();
    let remedy = format!("sudo ethtool -K {card} {}", off.join(" "));
    Finding::advice(CHECK, format!("{card}: {}", on.join(", ")), WHY, remedy)
}

/// The address in `HOST` or `HOST:PORT`.
fn address(text: &str) -> Link {
    let with_port = if text.contains(':') { text.to_owned() } else { format!("{text}:0") };
    let found =
        with_port.to_socket_addrs().ok().into_iter().flatten().find_map(|it| match it.ip() {
            std::net::IpAddr::V4(address) => Some(address),
            std::net::IpAddr::V6(_) => None,
        });
    found.map_or_else(|| Link::Nowhere(text.to_owned()), Link::Address)
}

/// The card that packets to this address leave by: of the routes that hold, the narrowest. A default route does not
/// count: nothing that answers within a cycle is behind a gateway.
fn route(host: &Host, to: Ipv4Addr) -> Option<String> {
    let table = host.text("/proc/net/route")?;
    let routes = table.lines().skip(1).filter_map(|line| {
        let words: Vec<_> = line.split_whitespace().collect();
        // As the kernel has them in memory: the first byte of the address is the lowest.
        let number = |at: usize| u32::from_str_radix(words.get(at)?, 16).ok().map(u32::swap_bytes);
        let (network, mask) = (number(1)?, number(7)?);
        (mask != 0 && u32::from(to) & mask == network).then(|| (mask, (*words[0]).to_owned()))
    });
    routes.max_by_key(|(mask, _)| *mask).map(|(_, card)| card)
}

/// Another address of the same network.
fn neighbour(address: Ipv4Addr) -> Ipv4Addr {
    let [a, b, c, d] = address.octets();
    Ipv4Addr::new(a, b, c, if d == 1 { 2 } else { 1 })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::finding::Verdict;
    use super::*;
    use std::fs;

    fn host(folder: &std::path::Path) -> Host {
        let net = folder.join("sys/class/net/enp3s0/device");
        fs::create_dir_all(&net).unwrap();
        fs::create_dir_all(folder.join("proc/net")).unwrap();
        fs::write(folder.join("sys/class/net/enp3s0/operstate"), "up\n").unwrap();
        std::os::unix::fs::symlink("../../../bus/pci/drivers/igb", net.join("driver")).unwrap();
        let routes = "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n\
                      wlan0\t00000000\t0100A8C0\t0003\t0\t0\t0\t00000000\t0\t0\t0\n\
                      enp3s0\t000A0A0A\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n";
        fs::write(folder.join("proc/net/route"), routes).unwrap();
        Host::new(folder)
    }

    #[test]
    fn the_card_is_the_one_that_leads_to_the_drives() {
        let folder = tempfile::tempdir().unwrap();
        let host = host(folder.path());
        assert_eq!(route(&host, Ipv4Addr::new(10, 10, 10, 10)), Some("enp3s0".to_owned()));
        assert_eq!(route(&host, Ipv4Addr::new(10, 10, 11, 10)), None);
        assert_eq!(address("10.10.10.10:27181"), Link::Address(Ipv4Addr::new(10, 10, 10, 10)));
        assert!(findings(&host, &DrivesKind::Simulated).is_empty());
    }

    #[test]
    fn delay_and_offloads_of_a_card_are_told_with_the_command_that_ends_them() {
        assert_eq!(coalescing("eth0", Ok(3)).verdict, Verdict::Ok);
        let late = coalescing("eth0", Ok(50));
        assert_eq!(late.verdict, Verdict::Advice);
        assert!(late.remedy.unwrap().contains("ethtool -C eth0"));
        assert_eq!(
            coalescing("eth0", Err(std::io::ErrorKind::Unsupported.into())).verdict,
            Verdict::Unknown
        );
        assert_eq!(offload("eth0", |_| Ok(false)).verdict, Verdict::Ok);
        let joined = offload("eth0", |which| Ok(which == Offload::GenericReceive));
        assert_eq!(joined.remedy.unwrap(), "sudo ethtool -K eth0 gro off");
    }
}
