//! Closed ports on the way of datagrams.

use std::io;
use std::net::UdpSocket;

/// Makes a socket without a peer report a closed port of a receiver: the next call of it returns `ConnectionRefused`.
///
/// Linux reports it by default only to connected sockets, which reject all other senders. Windows reports it always,
/// other systems never.
///
/// # Errors
/// Errors of the operating system.
pub fn report_closed_ports(socket: &UdpSocket) -> io::Result<()> {
    crate::system::report_closed_ports(socket)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn a_closed_port_is_reported_to_a_socket_without_a_peer() {
        for address in ["127.0.0.1:0", "[::1]:0"] {
            // A computer without IPv6.
            let Ok(socket) = UdpSocket::bind(address) else { continue };
            socket.set_read_timeout(Some(Duration::from_secs(20))).expect("a socket takes a time limit");
            report_closed_ports(&socket).expect("the option exists");
            let closed = UdpSocket::bind(address).and_then(|socket| socket.local_addr()).expect("a free port");
            socket.send_to(b"x", closed).expect("the first datagram is sent");
            let error = socket.recv(&mut [0; 8]).expect_err("nothing is received");
            assert_eq!(error.kind(), io::ErrorKind::ConnectionRefused, "{address}");
        }
    }
}
