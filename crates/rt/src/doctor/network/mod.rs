//! A network card for EtherCAT: link, driver, interrupt coalescing, permission, addresses.

mod coalescing;
#[cfg(all(test, unix))]
mod tests;

use std::path::Path;

use super::scheduler::{NET_RAW, capability};
use super::{Files, Finding};

/// Text of `ethtool -c INTERFACE`, or why there is none.
pub type Coalescing = Result<String, String>;

/// Findings about an interface, for the files below `root`.
pub fn examine(root: &Path, interface: &str, coalescing: &Coalescing) -> Vec<Finding> {
    let files = Files::below(root);
    let card = Card { files: &files, interface };
    vec![card.link(), card.driver(), coalescing::finding(interface, coalescing), raw_sockets(&files), card.address()]
}

/// Whether a main device may send frames there: the link is up, and no address belongs to it.
pub fn is_free(root: &Path, interface: &str) -> bool {
    let files = Files::below(root);
    let card = Card { files: &files, interface };
    card.exists() && card.is_up() && card.addresses().is_empty()
}

struct Card<'a> {
    files: &'a Files,
    interface: &'a str,
}

impl Card<'_> {
    fn read(&self, file: &str) -> Option<String> {
        self.files.read(&format!("sys/class/net/{}/{file}", self.interface))
    }

    fn exists(&self) -> bool {
        let listed = self.files.read("proc/net/dev").unwrap_or_default();
        listed.lines().any(|line| line.trim_start().strip_prefix(self.interface).is_some_and(|l| l.starts_with(':')))
            || self.read("operstate").is_some()
    }

    /// Whether it has a link; an interface that another namespace shows only counts as one.
    fn is_up(&self) -> bool {
        !matches!(self.read("operstate").as_deref(), Some("down" | "lowerlayerdown" | "notpresent"))
    }

    fn link(&self) -> Finding {
        let interface = self.interface;
        let (what, costs) =
            ("network link", "EtherCAT requires a link of 100 Mbit/s in both directions at the same time.");
        if !self.exists() {
            let remedy = "`ip link` lists the interfaces";
            return Finding::costs(what, format!("no interface {interface}"), costs, Some(remedy.into()));
        }
        let Some(state) = self.read("operstate") else { return Finding::unknown(what, costs) };
        // An interface that is off has no carrier to read.
        match (state.as_str(), self.read("carrier").as_deref()) {
            ("down", None) => {
                return Finding::costs(what, "switched off", costs, Some(format!("sudo ip link set {interface} up")));
            }
            ("down" | "lowerlayerdown" | "notpresent", _) => {
                let remedy = "check the cable to the IN port of the first device, and the supply of the device";
                return Finding::costs(what, "no link", costs, Some(remedy.into()));
            }
            _ => {}
        }
        let speed = self.read("speed").and_then(|speed| speed.parse::<i64>().ok()).filter(|speed| *speed > 0);
        let duplex = self.read("duplex").unwrap_or_default();
        match speed {
            Some(100) if duplex == "half" => {
                let remedy = "check the cable; both ends must negotiate: `sudo ethtool -s INTERFACE autoneg on`";
                let remedy = remedy.replace("INTERFACE", interface);
                Finding::costs(what, "100 Mbit/s, half duplex", costs, Some(remedy))
            }
            Some(100) => Finding::good(what, "100 Mbit/s", costs),
            // A pair of virtual interfaces.
            Some(speed) if self.driver_name().is_none() => {
                Finding::good(what, format!("{speed} Mbit/s, virtual"), costs)
            }
            Some(speed) => {
                let found = format!("{speed} Mbit/s: the other end is a switch or a computer, not an EtherCAT device");
                let remedy = "connect the card to the IN port of the first device, without a switch";
                Finding::costs(what, found, costs, Some(remedy.into()))
            }
            None => Finding::good(what, "up, speed not reported", costs),
        }
    }

    fn driver_name(&self) -> Option<String> {
        let link = self.files.root.join(format!("sys/class/net/{}/device/driver", self.interface));
        let target = std::fs::read_link(link).ok()?;
        Some(target.file_name()?.to_string_lossy().into_owned())
    }

    fn driver(&self) -> Finding {
        let (what, costs) = ("network driver", "The driver and the bus of the card delay each frame.");
        let has = |file: &str| self.files.root.join(format!("sys/class/net/{}/{file}", self.interface)).exists();
        let Some(driver) = self.driver_name() else {
            return if has("operstate") {
                Finding::good(what, "virtual interface, for tests without hardware", costs)
            } else {
                Finding::unknown(what, costs)
            };
        };
        let device = self.files.root.join(format!("sys/class/net/{}/device", self.interface));
        let bus = std::fs::read_link(device.join("subsystem")).ok();
        let remedy = Some("use a card on PCI Express, for example with the driver igb, igc or e1000e".to_string());
        if has("wireless") || has("phy80211") {
            Finding::costs(what, format!("{driver}, wireless"), costs, remedy)
        } else if bus.is_some_and(|bus| bus.ends_with("usb")) {
            Finding::costs(what, format!("{driver}, an adapter on USB: frames wait for its polls"), costs, remedy)
        } else if driver.starts_with("virtio") || driver == "vmxnet3" || driver.starts_with("hv_") {
            Finding::costs(what, format!("{driver}, of a virtual machine: the host delays frames"), costs, remedy)
        } else {
            Finding::good(what, driver, costs)
        }
    }

    /// Addresses of the interface, as text; an IPv6 address that the kernel gives each interface does not count.
    fn addresses(&self) -> Vec<String> {
        let mut found = Vec::new();
        let routes = self.files.read("proc/net/route").unwrap_or_default();
        for line in routes.lines().skip(1) {
            let words: Vec<&str> = line.split_whitespace().collect();
            if let [interface, destination, ..] = words[..]
                && interface == self.interface
            {
                let is_default = destination == "00000000";
                found.push(if is_default { "the route to all other networks" } else { "an IPv4 network" }.to_string());
            }
        }
        let addresses = self.files.read("proc/net/if_inet6").unwrap_or_default();
        found.extend(addresses.lines().filter_map(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let is_own = words.last() == Some(&self.interface) && words.get(3).is_some_and(|scope| *scope == "00");
            is_own.then(|| "a global IPv6 address".to_string())
        }));
        found.dedup();
        found
    }

    fn address(&self) -> Finding {
        let (what, costs) = (
            "network address",
            "A card with an address probably leads to the office network: EtherCAT frames must not go there, and frames of \
             other programs disturb the devices.",
        );
        if self.files.read("proc/net/route").is_none() {
            return Finding::unknown(what, costs);
        }
        let interface = self.interface;
        match self.addresses() {
            found if found.is_empty() => Finding::good(what, "none", costs),
            found => {
                let remedy = format!(
                    "use another card; or, if only devices are connected: sudo nmcli device set {interface} managed no && \
                     sudo ip address flush dev {interface}"
                );
                Finding::costs(what, format!("{interface} has {}", found.join(", ")), costs, Some(remedy))
            }
        }
    }
}

fn raw_sockets(files: &Files) -> Finding {
    let (what, costs) = ("raw sockets", "Without this permission no EtherCAT frame can be sent.");
    match capability(files, NET_RAW) {
        Some(true) => Finding::good(what, "permitted", costs),
        Some(false) => {
            let remedy = "sudo setcap cap_net_raw,cap_sys_nice,cap_ipc_lock+ep \"$(command -v stickslip)\"";
            Finding::costs(what, "not permitted (CAP_NET_RAW)", costs, Some(remedy.into()))
        }
        None => Finding::unknown(what, costs),
    }
}
