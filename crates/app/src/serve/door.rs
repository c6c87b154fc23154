//! Admission of requests: token, host, origin and rate.

use std::borrow::Cow;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use axum::http::{HeaderMap, HeaderName, StatusCode, header};

use super::known::{HostName, Known, Origin, without_port};

/// Limits of calls: per second, and in a burst.
const RATE: f64 = 200.0;
const BURST: f64 = 400.0;

/// Message for a client that exceeds the rate.
pub(super) const FLOOD: &str = "too many calls: the limit is 200 per second";

/// Admits or refuses requests.
pub(super) struct Door {
    address: SocketAddr,
    known: Known,
    token: String,
    /// Remaining calls, and the time of their count.
    budget: Mutex<(f64, Instant)>,
}

/// Status and message of a refusal.
pub(super) type Refusal = (StatusCode, Cow<'static, str>);

fn refusal(status: StatusCode, message: impl Into<Cow<'static, str>>) -> Refusal {
    (status, message.into())
}

/// A header as text.
fn text(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

impl Door {
    pub(super) fn new(address: SocketAddr, known: Known, token: String) -> Self {
        Door { address, known, token, budget: Mutex::new((BURST, Instant::now())) }
    }

    /// Admits a request with the token in a header, in a cookie, or given as `token`.
    pub(super) fn admit(&self, headers: &HeaderMap, token: Option<&str>) -> Result<(), Refusal> {
        self.admit_host(headers)?;
        let bearer = text(headers, header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
        let name = self.cookie();
        let cookie = text(headers, header::COOKIE)
            .and_then(|all| all.split(';').find_map(|one| one.trim().strip_prefix(&name)?.strip_prefix('=')));
        if !bearer.or(token).or(cookie).is_some_and(|token| equal_in_constant_time(token, &self.token)) {
            let message = "the token is missing or wrong: `stickslip serve` prints it";
            return Err(refusal(StatusCode::UNAUTHORIZED, message));
        }
        if !self.has_budget_now() {
            return Err(refusal(StatusCode::TOO_MANY_REQUESTS, FLOOD));
        }
        Ok(())
    }

    /// Name of the cookie with the token. It contains the port, since cookies are shared by all ports of a host.
    pub(super) fn cookie(&self) -> String {
        format!("stickslip-{}", self.address.port())
    }

    /// Admits requests that name this host and do not come from a page of another origin.
    pub(super) fn admit_host(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let host = text(headers, header::HOST).unwrap_or_default();
        // Other names that resolve to this address are refused (DNS rebinding).
        if !self.is_this_host(host) {
            let name: String = without_port(host).chars().filter(|c| !c.is_control()).take(100).collect();
            let message = format!(
                "unknown host \"{name}\": use the address that `stickslip serve` printed, or start it with --host {}",
                if name.parse::<HostName>().is_ok() { &name } else { "NAME" }
            );
            return Err(refusal(StatusCode::MISDIRECTED_REQUEST, message));
        }
        let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
        let origin = origin.to_str().unwrap_or_default();
        // A page at another port of this computer is another origin, although it has the same cookies.
        if Origin::of(origin).is_some_and(|it| it.is_of_host(host) || self.known.origins.contains(&it)) {
            return Ok(());
        }
        let shown: String = origin.chars().filter(|c| !c.is_control()).take(100).collect();
        let message = format!(
            "unknown origin \"{shown}\": if it is a proxy of this bench, start `stickslip serve` with --origin {}",
            if Origin::of(origin).is_some() { &shown } else { "URL" }
        );
        Err(refusal(StatusCode::FORBIDDEN, message))
    }

    /// Whether a host is this one, with any port: a tunnel begins at another one.
    fn is_this_host(&self, host: &str) -> bool {
        let name = without_port(host);
        // A page cannot choose these names by its own entry in the DNS.
        let is_address = name
            .parse::<IpAddr>()
            .is_ok_and(|ip| ip.is_loopback() || ip == self.address.ip() || self.address.ip().is_unspecified());
        is_address || name.eq_ignore_ascii_case("localhost") || self.known.has_host(name)
    }

    /// Counts a call; false if the rate is exceeded.
    pub(super) fn has_budget_now(&self) -> bool {
        self.has_budget(Instant::now())
    }

    fn has_budget(&self, now: Instant) -> bool {
        let mut budget = self.budget.lock().unwrap_or_else(PoisonError::into_inner);
        let (left, since) = *budget;
        let left = (left + RATE * now.saturating_duration_since(since).as_secs_f64()).min(BURST);
        let admitted = left >= 1.0;
        *budget = (if admitted { left - 1.0 } else { left }, now);
        admitted
    }
}

/// Compares two texts in a time that does not depend on the place of a difference.
fn equal_in_constant_time(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use axum::http::HeaderValue;

    use super::*;

    /// The bench is known as `bench.lab` and behind a proxy.
    fn door(listens: &str) -> Door {
        let known =
            Known { hosts: vec!["bench.lab".parse().unwrap()], origins: vec!["https://proxy.lab/".parse().unwrap()] };
        Door::new(listens.parse().unwrap(), known, "secret".into())
    }

    fn headers(host: &str, origin: Option<&str>, bearer: Option<&str>) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, HeaderValue::from_str(host).unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, HeaderValue::from_str(origin).unwrap());
        }
        if let Some(bearer) = bearer {
            headers.insert(header::AUTHORIZATION, HeaderValue::from_str(bearer).unwrap());
        }
        headers
    }

    #[test]
    fn requests_need_the_host_the_origin_and_the_token_of_this_bench() {
        let (own, token) = ("127.0.0.1:9740", Some("Bearer secret"));
        for (listens, host, origin, bearer, expected) in [
            (own, own, None, token, Ok(())),
            (own, "localhost:9740", Some("http://localhost:9740"), token, Ok(())),
            ("[::1]:9740", "[::1]:9740", None, token, Ok(())),
            ("0.0.0.0:9740", "192.168.1.7:9740", None, token, Ok(())),
            // Tunnels from another local port.
            (own, "localhost:9000", Some("http://localhost:9000"), token, Ok(())),
            (own, "127.0.0.1", Some("http://127.0.0.1"), token, Ok(())),
            ("192.168.1.7:9740", "localhost:9000", None, token, Ok(())),
            // Names that the user has given.
            (own, "bench.lab:8080", Some("http://bench.lab:8080"), token, Ok(())),
            (own, "Bench.Lab", None, token, Ok(())),
            (own, "proxy.lab", Some("https://proxy.lab"), token, Ok(())),
            (own, own, Some("https://proxy.lab"), token, Ok(())),
            // Another name that resolves to this address.
            (own, "evil.example:9740", None, token, Err(421)),
            ("0.0.0.0:9740", "evil.example:9740", None, token, Err(421)),
            (own, "evil.bench.lab", None, token, Err(421)),
            (own, "192.168.1.7:9740", None, token, Err(421)),
            (own, "", None, token, Err(421)),
            // A page of another origin.
            (own, own, Some("http://evil.example"), token, Err(403)),
            (own, own, Some("http://127.0.0.1:3000"), token, Err(403)),
            (own, own, Some("http://proxy.lab"), token, Err(403)),
            (own, own, Some("https://proxy.lab:444"), token, Err(403)),
            (own, own, Some("https://127.0.0.1:9740"), token, Err(403)),
            (own, own, Some("null"), token, Err(403)),
            (own, own, None, None, Err(401)),
            (own, own, None, Some("Bearer secre"), Err(401)),
            (own, own, None, Some("secret"), Err(401)),
        ] {
            let admitted = door(listens).admit(&headers(host, origin, bearer), None);
            let admitted = admitted.map_err(|(status, _)| status.as_u16());
            assert_eq!(admitted, expected, "{listens} {host} {origin:?} {bearer:?}");
        }
    }

    #[test]
    fn a_refusal_names_the_option_that_admits_the_request() {
        let own = "127.0.0.1:9740";
        for (host, origin, option) in [
            ("rig.lab:8080", None, "--host rig.lab"),
            ("", None, "--host NAME"),
            // Not pasted into a shell.
            ("$(reboot)", None, "--host NAME"),
            (own, Some("https://$(reboot)"), "--origin URL"),
            (own, Some("https://rig.lab"), "--origin https://rig.lab"),
            (own, Some("null"), "--origin URL"),
        ] {
            let (_, message) = door(own).admit(&headers(host, origin, None), None).unwrap_err();
            assert!(message.ends_with(option), "{message}");
        }
    }

    #[test]
    fn the_cookie_of_this_port_is_accepted_as_token() {
        let door = door("127.0.0.1:9740");
        for (cookie, admitted) in [
            ("stickslip-9740=secret", true),
            ("a=b; stickslip-9740=secret; c=d", true),
            ("stickslip-9740=secre", false),
            ("stickslip-9741=secret", false),
            ("stickslip-97400=secret", false),
            ("secret", false),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, HeaderValue::from_static("127.0.0.1:9740"));
            headers.insert(header::COOKIE, HeaderValue::from_str(cookie).unwrap());
            assert_eq!(door.admit(&headers, None).is_ok(), admitted, "{cookie}");
        }
    }

    #[test]
    fn calls_above_the_rate_are_refused_until_the_next_second() {
        let door = door("127.0.0.1:1");
        let now = Instant::now();
        assert_eq!((0..1000).filter(|_| door.has_budget(now)).count(), 400);
        assert_eq!((0..1000).filter(|_| door.has_budget(now + Duration::from_secs(1))).count(), 200);
    }
}
