//! Links of the bench: to its machine, and to measurement and calibration tools.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use super::lock;
use super::protocol::XcpStatus;
use crate::xcp::a2l::Doors;
use stickslip_bench::remote::{Counts, Traffic};

/// The links.
pub(super) struct Links {
    /// Seed of the noise, for the virtual machine in this process.
    pub(super) seed: Option<u64>,
    traffic: Option<Arc<Traffic>>,
    xcp: Mutex<Vec<XcpStatus>>,
}

impl Links {
    pub(super) fn new(seed: Option<u64>, traffic: Option<Arc<Traffic>>) -> Self {
        Links { seed, traffic, xcp: Mutex::default() }
    }

    /// Whether the machine is the virtual one in this process: faults can be injected into it.
    pub(super) fn is_virtual(&self) -> bool {
        self.seed.is_some()
    }

    /// Counters of the link to the machine, if it is in another process.
    pub(super) fn counts(&self) -> Option<Counts> {
        self.traffic.as_ref().map(|traffic| traffic.counts())
    }

    /// The addresses for measurement and calibration tools.
    pub(super) fn xcp(&self) -> Vec<XcpStatus> {
        lock(&self.xcp).clone()
    }

    /// Replaces the status of one of these addresses.
    pub(super) fn set_xcp_status(&self, status: XcpStatus) {
        let mut all = lock(&self.xcp);
        match all.iter_mut().find(|other| other.transport == status.transport) {
            Some(other) => *other = status,
            None => all.push(status),
        }
    }

    /// The same addresses, for the A2L description.
    pub(super) fn doors(&self) -> Doors {
        let all = lock(&self.xcp);
        let door = |transport: &str| -> Option<SocketAddr> {
            all.iter().find(|one| one.transport == transport)?.address.parse().ok()
        };
        Doors { udp: door("udp"), tcp: door("tcp") }
    }
}
