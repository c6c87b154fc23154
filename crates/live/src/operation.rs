//! Operation: one client at a time may change the bench, all others read.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use super::protocol::Answer;
use super::{LiveError, lock};
use stickslip_base::Error;

/// After this time without a call, the operator loses its role.
const LEASE: Duration = Duration::from_secs(10);

/// After this time without an answer, a request to become the operator is dropped.
const REQUEST_LIMIT: Duration = Duration::from_secs(60);

/// The operator, and its timeout while the axis moves.
pub(super) struct Operation {
    operator: Mutex<Operator>,
    /// Timeout; `None`: unlimited.
    silence: Option<Duration>,
}

impl Operation {
    /// With a timeout of the operator [s].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a timeout outside 0.1 … 3600 s.
    pub(super) fn new(silence: Option<f64>) -> Result<Self, Error> {
        let checked = |value: f64| {
            let [minimum, maximum] = [0.1, 3600.0];
            if (minimum..=maximum).contains(&value) {
                return Ok(Duration::from_secs_f64(value));
            }
            let remedy = "Choose at least the polling interval of the client; the page polls ten times per second.";
            Err(Error::OutOfRange { name: "the operator's time", value, unit: "s", minimum, maximum, remedy })
        };
        Ok(Operation { operator: Mutex::default(), silence: silence.map(checked).transpose()? })
    }

    /// Admits a call of a client; a call that changes the bench makes it the operator.
    ///
    /// # Errors
    /// [`LiveError::Operated`] if another client operates.
    pub(super) fn admit(&self, client: &str, changes: bool) -> Result<(), Error> {
        let (mut operator, now) = (lock(&self.operator), Instant::now());
        operator.note_activity(client, now);
        if changes {
            operator.claim(client, now).map_err(|by| LiveError::Operated { by })?;
        }
        Ok(())
    }

    /// Notes activity of a client.
    pub(super) fn note_activity(&self, client: &str) {
        lock(&self.operator).note_activity(client, Instant::now());
    }

    /// Notes that a client has disconnected.
    pub(super) fn left(&self, client: &str) {
        lock(&self.operator).left(client);
    }

    /// Handles a client's request to become the operator; granted if it insists or if there is no other operator.
    pub(super) fn request_role(&self, client: &str, insists: bool) -> Answer {
        let (mut operator, now) = (lock(&self.operator), Instant::now());
        if insists {
            operator.take(client, now);
        } else {
            operator.request_role(client, now);
        }
        Answer::Done {}
    }

    pub(super) fn hand_over(&self, grant: bool) -> Answer {
        lock(&self.operator).hand_over(grant, Instant::now());
        Answer::Done {}
    }

    /// The operator, and the client that requests to become the operator.
    pub(super) fn names(&self) -> (Option<String>, Option<String>) {
        let (operator, now) = (lock(&self.operator), Instant::now());
        (operator.name(now).map(str::to_owned), operator.requester(now).map(str::to_owned))
    }

    /// Whether the timeout of the operator has passed.
    pub(super) fn is_silent(&self) -> bool {
        let Some(limit) = self.silence else { return false };
        lock(&self.operator).silent(Instant::now()).is_some_and(|silent| silent > limit)
    }

    /// The reason for a stop by the timeout of the operator.
    pub(super) fn silence(&self) -> String {
        let limit = self.silence.unwrap_or_default().as_secs_f64();
        format!(
            "The bench stopped: the operator was silent for more than {limit} s. Poll more often, or set a longer \
             `--operator-time`."
        )
    }
}

/// The operator, and the client that requests to replace it.
#[derive(Clone, Debug, Default)]
struct Operator {
    now: Option<(String, Instant)>,
    /// The requesting client, and the time of its request.
    request: Option<(String, Instant)>,
    /// Last activity of an operator that has disconnected.
    before: Option<Instant>,
}

impl Operator {
    /// Name of the present operator.
    fn name(&self, now: Instant) -> Option<&str> {
        let (name, last_activity) = self.now.as_ref()?;
        (now.saturating_duration_since(*last_activity) < LEASE).then_some(name)
    }

    /// Notes activity of a client.
    fn note_activity(&mut self, client: &str, now: Instant) {
        if self.name(now) == Some(client) {
            self.now = Some((client.into(), now));
        }
    }

    /// Makes a client the operator, unless another client is.
    ///
    /// # Errors
    /// The name of the operator.
    fn claim(&mut self, client: &str, now: Instant) -> Result<(), String> {
        match self.name(now) {
            Some(other) if other != client => Err(other.into()),
            _ => {
                self.take(client, now);
                Ok(())
            }
        }
    }

    /// Notes that a client has disconnected; it is no longer the operator.
    fn left(&mut self, client: &str) {
        if let Some((_, last_activity)) = self.now.take_if(|(name, _)| name == client) {
            self.before = Some(last_activity);
        }
    }

    /// Time since the last activity of the present or last operator; `None` before the first one.
    fn silent(&self, now: Instant) -> Option<Duration> {
        let last_activity = self.now.as_ref().map(|(_, last_activity)| *last_activity).or(self.before)?;
        Some(now.saturating_duration_since(last_activity))
    }

    /// Makes a client the operator; if another client is, notes the request.
    fn request_role(&mut self, client: &str, now: Instant) {
        match self.name(now) {
            Some(other) if other != client => self.request = Some((client.into(), now)),
            _ => self.take(client, now),
        }
    }

    /// The requesting client, unless the request has expired.
    fn requester(&self, now: Instant) -> Option<&str> {
        let (name, since) = self.request.as_ref()?;
        (now.saturating_duration_since(*since) < REQUEST_LIMIT).then_some(name)
    }

    /// Grants or refuses the request.
    fn hand_over(&mut self, grant: bool, now: Instant) {
        let requester = self.requester(now).map(str::to_owned);
        self.request = None;
        if let Some(name) = requester.filter(|_| grant) {
            self.take(&name, now);
        }
    }

    /// Makes a client the operator.
    fn take(&mut self, client: &str, now: Instant) {
        self.request.take_if(|(name, _)| name == client);
        self.now = Some((client.into(), now));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_operates_until_silent_or_relieved() {
        let mut operator = Operator::default();
        let begin = Instant::now();
        let at = |seconds: u64| begin + Duration::from_secs(seconds);
        assert_eq!(operator.name(at(0)), None);
        assert_eq!(operator.claim("ann", at(0)), Ok(()));
        assert_eq!(operator.claim("bob", at(5)), Err("ann".into()));
        operator.note_activity("ann", at(8));
        operator.note_activity("bob", at(9));
        assert_eq!(operator.claim("bob", at(17)), Err("ann".into()));
        assert_eq!(operator.claim("bob", at(18)), Ok(()), "silent for ten seconds");
        operator.take("ann", at(19));
        assert_eq!(operator.name(at(19)), Some("ann"));
        operator.left("bob");
        assert_eq!(operator.name(at(19)), Some("ann"));
        operator.left("ann");
        assert_eq!(operator.claim("bob", at(19)), Ok(()));
    }

    #[test]
    fn a_request_waits_for_an_answer_and_expires() {
        let mut operator = Operator::default();
        let begin = Instant::now();
        let at = |seconds: u64| begin + Duration::from_secs(seconds);
        operator.request_role("ann", at(0));
        assert_eq!((operator.name(at(0)), operator.requester(at(0))), (Some("ann"), None), "there was no operator");
        operator.request_role("bob", at(1));
        assert_eq!((operator.name(at(1)), operator.requester(at(1))), (Some("ann"), Some("bob")));
        operator.hand_over(false, at(2));
        assert_eq!((operator.name(at(2)), operator.requester(at(2))), (Some("ann"), None));
        operator.request_role("bob", at(3));
        assert_eq!(operator.requester(at(63)), None);
        operator.note_activity("ann", at(4));
        operator.hand_over(true, at(5));
        assert_eq!((operator.name(at(5)), operator.requester(at(5))), (Some("bob"), None));
    }
}
