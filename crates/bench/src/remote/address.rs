//! Address of a machine, as text.

use std::fmt;
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::str::FromStr;

/// Address of a machine: `udp:127.0.0.1:9750`, `shm:axis` on the same computer, `serial:/dev/ttyACM0`, or servo drives on
/// a network interface: `ethercat:eth0`, or `ethercat:eth0,drives.toml` with a file that describes them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// Datagrams.
    Udp(SocketAddr),
    /// Shared memory, by its name; a name with a slash is the path of a file.
    Shm(String),
    /// A serial port, by its file.
    Serial(PathBuf),
    /// Servo drives on EtherCAT: interface, and the file that describes them.
    Ethercat(String),
}

impl Address {
    /// The file of a shared memory.
    pub(super) fn file(name: &str) -> PathBuf {
        let memory = PathBuf::from("/dev/shm");
        let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
        if name.contains('/') { name.into() } else { folder.join(format!("stickslip-{name}")) }
    }
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("udp", address)) => {
                let resolved = address.to_socket_addrs().map_err(|error| format!("{address}: {error}"))?.next();
                resolved.map(Address::Udp).ok_or_else(|| format!("{address} has no address"))
            }
            Some(("shm", name)) if !name.is_empty() => Ok(Address::Shm(name.into())),
            Some(("serial", path)) if !path.is_empty() => Ok(Address::Serial(path.into())),
            Some(("ethercat", interface)) if !interface.is_empty() => Ok(Address::Ethercat(interface.into())),
            _ => Err("use udp:ADDRESS:PORT, shm:NAME, serial:PORT or ethercat:INTERFACE, for example \
                      udp:127.0.0.1:9750, shm:axis, serial:/dev/ttyACM0 or ethercat:eth0"
                .into()),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Udp(address) => write!(f, "udp:{address}"),
            Address::Shm(name) => write!(f, "shm:{name}"),
            Address::Serial(path) => write!(f, "serial:{}", path.display()),
            Address::Ethercat(interface) => write!(f, "ethercat:{interface}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_invalid_address_is_refused() {
        let refusal = |text: &str| text.parse::<Address>().unwrap_err();
        assert!(refusal("127.0.0.1:9").contains("use udp:"));
        assert!(refusal("shm:").contains("shm:NAME"));
        assert!(refusal("udp:127.0.0.1").contains("127.0.0.1"));
        for text in ["udp:127.0.0.1:9750", "shm:axis", "shm:./axis", "serial:/dev/ttyACM0", "ethercat:eth0"] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn a_name_with_a_slash_is_a_file() {
        assert_eq!(Address::file("./axis"), PathBuf::from("./axis"));
        assert!(Address::file("axis").ends_with("stickslip-axis"));
    }
}
