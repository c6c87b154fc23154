//! The network card of servo drives: its settings, and the devices that answer.

use std::io::ErrorKind;
use std::path::Path;
use std::process::{Command, Stdio};

use stickslip::bench::remote::Address;
use stickslip::realtime::network::{self, Coalescing};
use stickslip::realtime::{Finding, Verdict};

use crate::failure::Failure;

const DEVICES: &str = "EtherCAT devices";
const DEVICES_COST: &str = "A bench requires two servo drives.";

/// Findings about the card at an address.
pub(super) fn findings(address: &Address) -> Result<Vec<Finding>, Failure> {
    let Address::Ethercat(interface) = address else {
        return Err(Failure::Served(format!(
            "{address} has no network card for EtherCAT. Use --io ethercat:INTERFACE."
        )));
    };
    let interface = interface.split(',').next().unwrap_or_default();
    let root = Path::new("/");
    let mut findings = network::examine(root, interface, &coalescing(interface));
    findings.push(devices(network::is_free(root, interface).then(|| scan(interface))));
    Ok(findings)
}

/// Text of `ethtool -c`.
fn coalescing(interface: &str) -> Coalescing {
    let output = Command::new("ethtool").args(["-c", interface]).stdin(Stdio::null()).output();
    match output {
        Ok(output) if output.status.success() => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        Ok(output) => {
            let error = String::from_utf8_lossy(&output.stderr);
            Err(error.lines().last().unwrap_or("ethtool failed").trim().to_string())
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {
            Err("ethtool is not installed (sudo apt install ethtool)".into())
        }
        Err(error) => Err(format!("ethtool: {error}")),
    }
}

/// Names of the devices; `None` without the main device.
type Scan = Option<Result<Vec<String>, String>>;

#[cfg(target_os = "linux")]
fn scan(interface: &str) -> Scan {
    let scan = stickslip_fieldbus::MAIN_DEVICE?.scan;
    Some(scan(interface).map(|devices| devices.into_iter().map(|device| device.name).collect()))
}

#[cfg(not(target_os = "linux"))]
fn scan(_: &str) -> Scan {
    None
}

/// The finding of a scan; `None`: no frame was sent.
fn devices(scan: Option<Scan>) -> Finding {
    let (what, costs) = (DEVICES, DEVICES_COST);
    let unknown = |found: &str| Finding { what, found: found.into(), verdict: Verdict::Unknown, costs, remedy: None };
    match scan {
        None => unknown("not scanned: the card has no link, or an address"),
        Some(None) => unknown("not scanned: the program was built without the EtherCAT main device"),
        Some(Some(Ok(names))) if names.len() >= 2 => Finding::good(what, names.join(", "), costs),
        Some(Some(Ok(names))) if names.is_empty() => {
            Finding::costs(what, "no device answers", costs, Some("check cable and supply".into()))
        }
        Some(Some(Ok(names))) => {
            let remedy = "connect drive motor and load motor; check the cables between the devices, and their supply";
            Finding::costs(what, format!("only {}", names.join(", ")), costs, Some(remedy.into()))
        }
        Some(Some(Err(reason))) => {
            Finding::costs(what, "scan failed", costs, Some(reason.trim_end_matches('.').to_string()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_result_of_a_scan_has_its_text() {
        let names = |names: &[&str]| Some(Some(Ok(names.iter().map(ToString::to_string).collect())));
        for (scan, verdict, found, remedy) in [
            (None, Verdict::Unknown, "no link, or an address", ""),
            (Some(None), Verdict::Unknown, "built without", ""),
            (names(&["motor", "load"]), Verdict::Good, "motor, load", ""),
            (names(&[]), Verdict::Costs, "no device answers", "cable"),
            (names(&["coupler"]), Verdict::Costs, "only coupler", "connect drive motor and load motor"),
            (Some(Some(Err("scan: timeout. Check the cable.".into()))), Verdict::Costs, "scan failed", "timeout"),
        ] {
            let finding = devices(scan);
            assert_eq!(finding.verdict, verdict, "{finding:?}");
            assert!(finding.found.contains(found), "{finding:?}");
            assert!(finding.remedy.clone().unwrap_or_default().contains(remedy), "{finding:?}");
        }
    }

    #[test]
    fn another_address_is_refused() {
        let refusal = findings(&"shm:axis".parse().unwrap()).unwrap_err().to_string();
        assert!(refusal.contains("--io ethercat:INTERFACE"), "{refusal}");
    }
}
