//! Each finding about a network card, on simulated computers.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;

use super::*;
use crate::doctor::Verdict::{self, Costs, Good, Unknown};
use crate::doctor::tests::machine;

const DEV: (&str, &str) = ("proc/net/dev", "Inter-|   Receive\n face |bytes\n    lo: 0 0\n  eth1: 0 0\n");
const OFF: &str =
    "Coalesce parameters for eth1:\nAdaptive RX: off  TX: off\nrx-usecs: 0\nrx-usecs-irq: 5\ntx-usecs: 0\n";

/// Checks a finding about eth1: verdict, part of the value, part of the remedy.
fn check(root: &Path, coalescing: &Coalescing, what: &str, verdict: Verdict, found: &str, remedy: &str) {
    let findings = examine(root, "eth1", coalescing);
    let finding = findings.iter().find(|finding| finding.what == what).expect("each finding is listed");
    assert_eq!(finding.verdict, verdict, "{finding:?}");
    assert!(finding.found.contains(found), "{finding:?}");
    assert!(finding.costs.ends_with('.'), "{finding:?}");
    assert!(finding.remedy.clone().unwrap_or_default().contains(remedy), "{finding:?}");
    assert_eq!(finding.remedy.is_some(), !remedy.is_empty(), "{finding:?}");
}

/// Files of eth1, by their names.
fn card(files: &[(&str, &str)]) -> tempfile::TempDir {
    let paths: Vec<(String, &str)> =
        files.iter().map(|(name, text)| (format!("sys/class/net/eth1/{name}"), *text)).collect();
    let mut all = vec![DEV];
    all.extend(paths.iter().map(|(path, text)| (path.as_str(), *text)));
    machine(&all)
}

/// Gives eth1 a driver on a bus.
fn drive(root: &Path, driver: &str, bus: &str) {
    let device = root.join("sys/class/net/eth1/device");
    fs::create_dir_all(&device).expect("the folder takes folders");
    symlink(PathBuf::from("/sys/bus/drivers").join(driver), device.join("driver")).expect("the folder takes links");
    symlink(PathBuf::from("/sys/bus").join(bus), device.join("subsystem")).expect("the folder takes links");
}

fn off() -> Coalescing {
    Ok(OFF.into())
}

#[test]
fn the_link_is_up_at_100_megabits_or_the_reason_is_stated() {
    let link = |files: &[(&str, &str)], driver: Option<&str>, verdict, found, remedy| {
        let root = card(files);
        driver.iter().for_each(|driver| drive(root.path(), driver, "pci"));
        check(root.path(), &off(), "network link", verdict, found, remedy);
    };
    link(&[], None, Unknown, "not reported", "");
    link(&[("operstate", "down")], Some("igb"), Costs, "switched off", "sudo ip link set eth1 up");
    link(&[("operstate", "down"), ("carrier", "0")], Some("igb"), Costs, "no link", "IN port of the first device");
    let up = |speed, duplex| [("operstate", "up"), ("carrier", "1"), ("speed", speed), ("duplex", duplex)];
    link(&up("100", "full"), Some("igb"), Good, "100 Mbit/s", "");
    link(&up("100", "half"), Some("igb"), Costs, "half duplex", "ethtool -s eth1 autoneg on");
    link(&up("1000", "full"), Some("igb"), Costs, "1000 Mbit/s: the other end is a switch", "without a switch");
    link(&up("10000", "full"), None, Good, "10000 Mbit/s, virtual", "");
    link(&up("-1", "unknown"), Some("igb"), Good, "speed not reported", "");
}

#[test]
fn an_interface_that_does_not_exist_is_named() {
    let root = machine(&[("proc/net/dev", "  eth10: 0 0\n")]);
    check(root.path(), &off(), "network link", Costs, "no interface eth1", "ip link");
    assert!(!is_free(root.path(), "eth1"));
}

#[test]
fn slow_buses_are_named_with_the_driver() {
    let driver = |driver: &str, bus: &str, extra: &[(&str, &str)], verdict, found, remedy| {
        let root = card(extra);
        drive(root.path(), driver, bus);
        check(root.path(), &off(), "network driver", verdict, found, remedy);
    };
    driver("igb", "pci", &[], Good, "igb", "");
    driver("r8152", "usb", &[], Costs, "r8152, an adapter on USB", "PCI Express");
    driver("iwlwifi", "pci", &[("wireless/status", "0")], Costs, "iwlwifi, wireless", "PCI Express");
    driver("virtio_net", "virtio", &[], Costs, "of a virtual machine", "PCI Express");
    let virtual_one = card(&[("operstate", "up")]);
    check(virtual_one.path(), &off(), "network driver", Good, "virtual interface", "");
    check(card(&[]).path(), &off(), "network driver", Unknown, "not reported", "");
}

#[test]
fn coalescing_is_switched_off_by_a_command_with_what_is_on() {
    let coalescing = |text: &str, verdict, found, remedy| {
        check(machine(&[DEV]).path(), &Ok(text.into()), "interrupt coalescing", verdict, found, remedy);
    };
    coalescing(OFF, Good, "off", "");
    let on = "Adaptive RX: on  TX: off\nrx-usecs: 3\nrx-frames: 0\ntx-usecs: n/a\n";
    coalescing(on, Costs, "adaptive-rx on, rx-usecs 3 µs", "sudo ethtool -C eth1 adaptive-rx off rx-usecs 0");
    coalescing("Adaptive RX: n/a  TX: n/a\nrx-usecs: n/a\n", Unknown, "not reported by the driver", "");
    let missing = Err("ethtool is not installed (sudo apt install ethtool)".into());
    let root = machine(&[DEV]);
    check(
        root.path(),
        &missing,
        "interrupt coalescing",
        Unknown,
        "apt install ethtool); `ethtool -c eth1` shows it",
        "",
    );
}

#[test]
fn raw_sockets_need_a_capability() {
    let status = |set: &str| machine(&[DEV, ("proc/self/status", &format!("CapEff:\t{set}\n"))]);
    check(status("0000000000002000").path(), &off(), "raw sockets", Good, "permitted", "");
    check(status("0000000000000000").path(), &off(), "raw sockets", Costs, "not permitted", "setcap cap_net_raw");
    check(machine(&[]).path(), &off(), "raw sockets", Unknown, "not reported", "");
}

#[test]
fn a_card_of_another_network_is_reported_and_not_free() {
    let head = "Iface\tDestination\tGateway\n";
    let address = |route: &str, six: &str, verdict, found, remedy| {
        let root = machine(&[DEV, ("proc/net/route", &format!("{head}{route}")), ("proc/net/if_inet6", six)]);
        check(root.path(), &off(), "network address", verdict, found, remedy);
        assert_eq!(is_free(root.path(), "eth1"), verdict == Good);
    };
    let local = "fe80000000000000 02 40 20 80 eth1\n";
    address("eth10\t00000000\t0101A8C0\n", local, Good, "none", "");
    address("eth1\t0001A8C0\t00000000\n", "", Costs, "eth1 has an IPv4 network", "ip address flush dev eth1");
    address("eth1\t00000000\t0101A8C0\n", "", Costs, "the route to all other networks", "use another card");
    address(
        "",
        "20010db800000000 02 40 00 80 eth1\n",
        Costs,
        "a global IPv6 address",
        "nmcli device set eth1 managed no",
    );
    check(machine(&[DEV]).path(), &off(), "network address", Unknown, "not reported", "");
}
