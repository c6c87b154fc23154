//! Names of a bench that its user has given: host names, and origins of proxies.

use std::str::FromStr;

/// Names of the bench beside its address.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// Host names, valid with each port.
    pub(crate) hosts: Vec<HostName>,
    /// Origins of pages of this bench, for example of a proxy with TLS.
    pub(crate) origins: Vec<Origin>,
}

impl Known {
    /// Whether a host without its port has been given, as a name or in an origin.
    pub(super) fn has_host(&self, name: &str) -> bool {
        let origins = self.origins.iter().map(|origin| without_port(&origin.host));
        self.hosts.iter().map(|host| host.0.as_str()).chain(origins).any(|known| known.eq_ignore_ascii_case(name))
    }
}

/// A host without its port; an IPv6 address without its brackets.
pub(super) fn without_port(host: &str) -> &str {
    if let Some((address, _)) = host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        return address;
    }
    host.rsplit_once(':').map_or(host, |(name, _)| name)
}

/// A host name or address, without port.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HostName(String);

impl FromStr for HostName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_part = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
        let name = text.trim_start_matches('[').trim_end_matches(']');
        if name.parse::<std::net::IpAddr>().is_ok() || !name.is_empty() && name.chars().all(is_part) {
            return Ok(HostName(name.to_ascii_lowercase()));
        }
        Err("not a host name: give it without scheme, port and path, as in --host bench.lab; for a proxy with TLS give \
             --origin https://bench.lab"
            .into())
    }
}

/// The origin of a page as browsers send it: scheme, host and port, without the default port.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Origin {
    scheme: &'static str,
    host: String,
}

impl Origin {
    /// `None` for other schemes, paths and the text `null`.
    pub(super) fn of(text: &str) -> Option<Self> {
        let text = text.to_ascii_lowercase();
        let (scheme, host, port) = [("http", ":80"), ("https", ":443")]
            .into_iter()
            .find_map(|(scheme, port)| Some((scheme, text.strip_prefix(scheme)?.strip_prefix("://")?, port)))?;
        let is_host = !host.is_empty() && host.chars().all(|c| c.is_ascii_alphanumeric() || "-._:[]".contains(c));
        is_host.then(|| Origin { scheme, host: host.strip_suffix(port).unwrap_or(host).into() })
    }

    /// Whether it is the origin of a page that this server itself has sent as `host`.
    pub(super) fn is_of_host(&self, host: &str) -> bool {
        Origin::of(&format!("http://{host}")).as_ref() == Some(self)
    }
}

impl FromStr for Origin {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let message = "not an origin: give scheme and host, and the port if it is not the default one, as in --origin \
                       https://bench.lab:8443";
        Origin::of(text.strip_suffix('/').unwrap_or(text)).ok_or_else(|| message.into())
    }
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}://{}", self.scheme, self.host)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_origin_is_written_as_browsers_send_it() {
        for (given, sent) in [
            ("https://Bench.Lab/", "https://bench.lab"),
            ("https://bench.lab:443", "https://bench.lab"),
            ("http://bench.lab:80", "http://bench.lab"),
            ("http://bench.lab:443", "http://bench.lab:443"),
            ("https://[fd00::1]:8443", "https://[fd00::1]:8443"),
        ] {
            assert_eq!(given.parse::<Origin>().unwrap().to_string(), sent);
        }
        for given in
            ["bench.lab", "ftp://bench.lab", "https://", "https://bench.lab/page", "https://u@bench.lab", "null"]
        {
            assert!(given.parse::<Origin>().unwrap_err().contains("--origin https://bench.lab:8443"), "{given}");
        }
    }

    #[test]
    fn a_host_name_has_no_port_and_no_scheme() {
        for given in ["bench", "bench.lab", "192.168.1.7", "fd00::1", "[fd00::1]"] {
            assert!(given.parse::<HostName>().is_ok(), "{given}");
        }
        for given in ["", "bench:8080", "http://bench", "bench/page", "a b"] {
            assert!(given.parse::<HostName>().unwrap_err().contains("--host bench.lab"), "{given}");
        }
    }
}
