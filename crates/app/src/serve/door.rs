//! Admission of requests: token, host, origin and rate.

use std::net::{IpAddr, SocketAddr};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use axum::http::{HeaderMap, StatusCode, header};

/// Limits of calls: per second, and in a burst.
const RATE: f64 = 200.0;
const BURST: f64 = 400.0;

/// Message for a client that exceeds the rate.
pub(super) const FLOOD: &str = "too many calls: the limit is 200 per second";

/// Admits or refuses requests.
pub(super) struct Door {
    address: SocketAddr,
    token: String,
    /// Remaining calls, and the time of their count.
    budget: Mutex<(f64, Instant)>,
}

/// Status and message of a refusal.
pub(super) type Refusal = (StatusCode, &'static str);

impl Door {
    pub(super) fn new(address: SocketAddr, token: String) -> Self {
        Door { address, token, budget: Mutex::new((BURST, Instant::now())) }
    }

    /// Admits a request with the token in a header, in a cookie, or given as `token`.
    pub(super) fn admit(&self, headers: &HeaderMap, token: Option<&str>) -> Result<(), Refusal> {
        self.admit_host(headers)?;
        let text = |name: header::HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
        let bearer = text(header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
        let name = self.cookie();
        let cookie = text(header::COOKIE)
            .and_then(|all| all.split(';').find_map(|one| one.trim().strip_prefix(&name)?.strip_prefix('=')));
        if !bearer.or(token).or(cookie).is_some_and(|token| equal_in_constant_time(token, &self.token)) {
            return Err((StatusCode::UNAUTHORIZED, "the token is missing or wrong: `stickslip serve` prints it"));
        }
        if !self.has_budget_now() {
            return Err((StatusCode::TOO_MANY_REQUESTS, FLOOD));
        }
        Ok(())
    }

    /// Name of the cookie with the token. It contains the port, since cookies are shared by all ports of a host.
    pub(super) fn cookie(&self) -> String {
        format!("stickslip-{}", self.address.port())
    }

    /// Admits requests that name this host and do not come from a page of another origin.
    pub(super) fn admit_host(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let text = |name: header::HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
        // Other names that resolve to this address are refused (DNS rebinding).
        if !text(header::HOST).is_some_and(|host| self.is_this_host(host)) {
            return Err((
                StatusCode::MISDIRECTED_REQUEST,
                "unknown host: use the address that `stickslip serve` printed",
            ));
        }
        if let Some(origin) = text(header::ORIGIN)
            && !origin.strip_prefix("http://").is_some_and(|host| self.is_this_host(host))
        {
            return Err((StatusCode::FORBIDDEN, "requests of a page of another origin are refused"));
        }
        Ok(())
    }

    /// Whether a host with its port is this one.
    fn is_this_host(&self, host: &str) -> bool {
        let (name, port) = host.rsplit_once(':').unwrap_or((host, "80"));
        if port.parse() != Ok(self.address.port()) {
            return false;
        }
        let name = name.trim_start_matches('[').trim_end_matches(']');
        if name == "localhost" {
            return self.address.ip().is_loopback() || self.address.ip().is_unspecified();
        }
        // A server on all interfaces accepts each address of this computer, but no other names.
        name.parse::<IpAddr>().is_ok_and(|ip| ip == self.address.ip() || self.address.ip().is_unspecified())
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

    fn admission(listens: &str, host: &str, origin: Option<&str>, bearer: Option<&str>) -> Result<(), u16> {
        let door = Door::new(listens.parse().unwrap(), "secret".into());
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, HeaderValue::from_str(host).unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, HeaderValue::from_str(origin).unwrap());
        }
        if let Some(bearer) = bearer {
            headers.insert(header::AUTHORIZATION, HeaderValue::from_str(bearer).unwrap());
        }
        door.admit(&headers, None).map_err(|(status, _)| status.as_u16())
    }

    #[test]
    fn requests_need_the_host_the_origin_and_the_token_of_this_bench() {
        let (own, token) = ("127.0.0.1:9740", Some("Bearer secret"));
        for (listens, host, origin, bearer, expected) in [
            (own, own, None, token, Ok(())),
            (own, "localhost:9740", Some("http://localhost:9740"), token, Ok(())),
            ("[::1]:9740", "[::1]:9740", None, token, Ok(())),
            ("0.0.0.0:9740", "192.168.1.7:9740", None, token, Ok(())),
            // Another name that resolves to this address.
            (own, "evil.example:9740", None, token, Err(421)),
            ("0.0.0.0:9740", "evil.example:9740", None, token, Err(421)),
            (own, "127.0.0.1:80", None, token, Err(421)),
            (own, "127.0.0.1", None, token, Err(421)),
            // A page of another origin.
            (own, own, Some("http://evil.example"), token, Err(403)),
            (own, own, Some("https://127.0.0.1:9740"), token, Err(403)),
            (own, own, Some("null"), token, Err(403)),
            (own, own, None, None, Err(401)),
            (own, own, None, Some("Bearer secre"), Err(401)),
            (own, own, None, Some("secret"), Err(401)),
        ] {
            assert_eq!(admission(listens, host, origin, bearer), expected, "{listens} {host} {origin:?} {bearer:?}");
        }
    }

    #[test]
    fn the_cookie_of_this_port_is_accepted_as_token() {
        let door = Door::new("127.0.0.1:9740".parse().unwrap(), "secret".into());
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
        let door = Door::new("127.0.0.1:1".parse().unwrap(), String::new());
        let now = Instant::now();
        assert_eq!((0..1000).filter(|_| door.has_budget(now)).count(), 400);
        assert_eq!((0..1000).filter(|_| door.has_budget(now + Duration::from_secs(1))).count(), 200);
    }
}
