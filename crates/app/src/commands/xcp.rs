//! Addresses for measurement and calibration tools (XCP).

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use clap::Args;
use stickslip::xcp::a2l::Doors;

/// Default port of XCP.
pub(super) const PORT: &str = "5555";

/// Addresses for XCP.
#[derive(Args)]
pub(crate) struct XcpDoors {
    /// Accept XCP masters such as CANape, INCA or pyxcp on UDP [default: 127.0.0.1:5555; port 0 selects a free one]. XCP
    /// has no token: anyone who can reach the address can control the bench.
    #[arg(long, value_name = "[ADDRESS:]PORT", num_args = 0..=1, default_missing_value = PORT, value_parser = address)]
    xcp_udp: Option<SocketAddr>,
    /// Accept XCP masters on TCP, like --xcp-udp.
    #[arg(long, value_name = "[ADDRESS:]PORT", num_args = 0..=1, default_missing_value = PORT, value_parser = address)]
    xcp_tcp: Option<SocketAddr>,
}

impl XcpDoors {
    pub(crate) fn doors(&self) -> Doors {
        Doors { udp: self.xcp_udp, tcp: self.xcp_tcp }
    }

    /// The given addresses; default: UDP and TCP at the default port.
    pub(crate) fn doors_or_both(&self) -> Doors {
        let local = Some(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 5555));
        match self.doors() {
            Doors { udp: None, tcp: None } => Doors { udp: local, tcp: local },
            given => given,
        }
    }
}

/// An address with a port, or a port on the loopback address.
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
    fn a_port_without_address_is_on_the_loopback_address() {
        assert_eq!(address("5556").unwrap().to_string(), "127.0.0.1:5556");
        assert_eq!(address("[::1]:0").unwrap().to_string(), "[::1]:0");
        assert!(address("localhost").unwrap_err().contains("127.0.0.1:5555"));
        assert_eq!(address(PORT).map(|address| address.port()), Ok(5555));
    }
}
