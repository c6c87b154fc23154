//! Links of the bench: to its machine, and to measurement and calibration tools.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use super::lock;
use super::protocol::XcpStatus;
use crate::xcp::a2l::Doors;
use stickslip_bench::ClockedBench;
use stickslip_bench::remote::{Counts, Traffic};
use stickslip_bench::segment::{Segment, SegmentStatus};

/// The links.
pub(super) struct Links {
    /// Seed of the noise, for the virtual machine in this process.
    pub(super) seed: Option<u64>,
    traffic: Option<Arc<Traffic>>,
    segment: Option<Arc<Segment>>,
    xcp: Mutex<Vec<XcpStatus>>,
}

impl Links {
    pub(super) fn new(seed: Option<u64>, bench: &ClockedBench) -> Self {
        Links { seed, traffic: bench.traffic(), segment: bench.segment(), xcp: Mutex::default() }
    }

    /// Whether the machine is the virtual one in this process: faults can be injected into it.
    pub(super) fn is_virtual(&self) -> bool {
        self.seed.is_some()
    }

    /// Counters of the link to the machine, if it is in another process.
    pub(super) fn counts(&self) -> Option<Counts> {
        self.traffic.as_ref().map(|traffic| traffic.counts())
    }

    /// State of the segment, if the machine is on a fieldbus.
    pub(super) fn segment(&self) -> Option<SegmentStatus> {
        self.segment.as_ref().map(|segment| segment.status())
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
