//! Who may come in: the token, the host that was meant, no page of another origin, not too often.

use std::net::{IpAddr, SocketAddr};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use axum::http::{HeaderMap, StatusCode, header};

/// Calls in a second, and at once.
const RATE: f64 = 200.0;
const BURST: f64 = 400.0;

/// What who calls too often is told.
pub(super) const FLOOD: &str = "too many calls: 200 a second are taken";

/// Judges requests.
pub(super) struct Door {
    address: SocketAddr,
    token: String,
    /// Calls that may come now, and when that was counted.
    budget: Mutex<(f64, Instant)>,
}

/// Why not: status and what to do.
pub(super) type Refusal = (StatusCode, &'static str);

impl Door {
    pub(super) fn new(address: SocketAddr, token: String) -> Self {
        Door { address, token, budget: Mutex::new((BURST, Instant::now())) }
    }

    /// Whether a request may come in; `token` is one given elsewhere than in the header.
    pub(super) fn admit(&self, headers: &HeaderMap, token: Option<&str>) -> Result<(), Refusal> {
        self.admit_host(headers)?;
        let text = |name: header::HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
        let bearer = text(header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
        let name = self.cookie();
        let cookie = text(header::COOKIE)
            .and_then(|all| all.split(';').find_map(|one| one.trim().strip_prefix(&name)?.strip_prefix('=')));
        if !bearer.or(token).or(cookie).is_some_and(|given| same(given, &self.token)) {
            return Err((StatusCode::UNAUTHORIZED, "the token is missing or wrong: `stickslip serve` prints it"));
        }
        if !self.has_room_now() {
            return Err((StatusCode::TOO_MANY_REQUESTS, FLOOD));
        }
        Ok(())
    }

    /// Name of the cookie that has the token: cookies do not tell ports apart, so that it does.
    pub(super) fn cookie(&self) -> String {
        format!("stickslip-{}", self.address.port())
    }

    /// Whether this host was meant, by no page of another origin.
    pub(super) fn admit_host(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let text = |name: header::HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
        // A name that leads here by somebody else's design is not meant (DNS rebinding).
        if !text(header::HOST).is_some_and(|host| self.is_here(host)) {
            return Err((StatusCode::MISDIRECTED_REQUEST, "this address is not the bench's: use the one it printed"));
        }
        if let Some(origin) = text(header::ORIGIN)
            && !origin.strip_prefix("http://").is_some_and(|host| self.is_here(host))
        {
            return Err((StatusCode::FORBIDDEN, "a page of another origin may not use the bench"));
        }
        Ok(())
    }

    /// Whether a host with its port is this one.
    fn is_here(&self, host: &str) -> bool {
        let (name, port) = host.rsplit_once(':').unwrap_or((host, "80"));
        if port.parse() != Ok(self.address.port()) {
            return false;
        }
        let name = name.trim_start_matches('[').trim_end_matches(']');
        if name == "localhost" {
            return self.address.ip().is_loopback() || self.address.ip().is_unspecified();
        }
        // Listening everywhere, any of this machine's addresses is meant; a name that is no address never is.
        name.parse::<IpAddr>().is_ok_and(|ip| ip == self.address.ip() || self.address.ip().is_unspecified())
    }

    /// Whether one more call may come.
    pub(super) fn has_room_now(&self) -> bool {
        self.has_room(Instant::now())
    }

    fn has_room(&self, now: Instant) -> bool {
        let mut budget = self.budget.lock().unwrap_or_else(PoisonError::into_inner);
        let (left, since) = *budget;
        let left = (left + RATE * now.saturating_duration_since(since).as_secs_f64()).min(BURST);
        let room = left >= 1.0;
        *budget = (if room { left - 1.0 } else { left }, now);
        room
    }
}

/// Compares in a time that does not tell where two differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |apart, (a, b)| apart | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use axum::http::HeaderValue;

    use super::*;

    fn judged(listens: &str, host: &str, origin: Option<&str>, bearer: Option<&str>) -> Result<(), u16> {
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
    fn only_who_means_this_bench_and_has_its_token_comes_in() {
        let (here, token) = ("127.0.0.1:9740", Some("Bearer secret"));
        for (listens, host, origin, bearer, expected) in [
            (here, here, None, token, Ok(())),
            (here, "localhost:9740", Some("http://localhost:9740"), token, Ok(())),
            ("[::1]:9740", "[::1]:9740", None, token, Ok(())),
            ("0.0.0.0:9740", "192.168.1.7:9740", None, token, Ok(())),
            // A name that somebody has led here.
            (here, "evil.example:9740", None, token, Err(421)),
            ("0.0.0.0:9740", "evil.example:9740", None, token, Err(421)),
            (here, "127.0.0.1:80", None, token, Err(421)),
            (here, "127.0.0.1", None, token, Err(421)),
            // A page of somebody else.
            (here, here, Some("http://evil.example"), token, Err(403)),
            (here, here, Some("https://127.0.0.1:9740"), token, Err(403)),
            (here, here, Some("null"), token, Err(403)),
            (here, here, None, None, Err(401)),
            (here, here, None, Some("Bearer secre"), Err(401)),
            (here, here, None, Some("secret"), Err(401)),
        ] {
            assert_eq!(judged(listens, host, origin, bearer), expected, "{listens} {host} {origin:?} {bearer:?}");
        }
    }

    #[test]
    fn a_cookie_of_this_port_has_the_token_too() {
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
    fn a_flood_is_refused_and_the_next_second_is_not() {
        let door = Door::new("127.0.0.1:1".parse().unwrap(), String::new());
        let now = Instant::now();
        assert_eq!((0..1000).filter(|_| door.has_room(now)).count(), 400);
        assert_eq!((0..1000).filter(|_| door.has_room(now + Duration::from_secs(1))).count(), 200);
    }
}
