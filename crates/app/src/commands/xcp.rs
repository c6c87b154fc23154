//! Where the bench is open to measurement and calibration tools.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use clap::Args;
use stickslip::xcp::a2l::Doors;

/// Where tools expect it.
pub(super) const PORT: &str = "5555";

/// Which doors.
#[derive(Args)]
pub(crate) struct XcpDoors {
    /// Open the bench to XCP masters such as CANape, INCA or pyxcp by UDP [at 127.0.0.1:5555 unless told otherwise; port
    /// 0 takes a free one]. XCP knows no token: who reaches the address can operate the bench.
    #[arg(long, value_name = "[ADDRESS:]PORT", num_args = 0..=1, default_missing_value = PORT, value_parser = address)]
    xcp_udp: Option<SocketAddr>,
    /// The same by TCP.
    #[arg(long, value_name = "[ADDRESS:]PORT", num_args = 0..=1, default_missing_value = PORT, value_parser = address)]
    xcp_tcp: Option<SocketAddr>,
}

impl XcpDoors {
    pub(crate) fn doors(&self) -> Doors {
        Doors { udp: self.xcp_udp, tcp: self.xcp_tcp }
    }

    /// Those that are named, or both as they are by default.
    pub(crate) fn doors_or_both(&self) -> Doors {
        let here = Some(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 5555));
        match self.doors() {
            Doors { udp: None, tcp: None } => Doors { udp: here, tcp: here },
            named => named,
        }
    }
}

/// An address with a port, or a port of this machine alone.
pub(super) fn address(text: &str) -> Result<SocketAddr, String> {
    match text.parse::<u16>() {
        Ok(port) => Ok(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)),
        Err(_) => text.parse().map_err(|_| "write it as PORT or ADDRESS:PORT, for example 127.0.0.1:5555".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_of_this_machine_alone() {
        assert_eq!(address("5556").unwrap().to_string(), "127.0.0.1:5556");
        assert_eq!(address("[::1]:0").unwrap().to_string(), "[::1]:0");
        assert!(address("localhost").unwrap_err().contains("127.0.0.1:5555"));
        assert_eq!(address(PORT).map(|address| address.port()), Ok(5555));
    }
}
