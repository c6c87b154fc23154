//! One may change something, all may look.

use std::time::{Duration, Instant};

/// Without a sign of life for so long an operator has gone.
const LEASE: Duration = Duration::from_secs(10);

/// A request for the operator's place that was not answered for so long is forgotten.
const PATIENCE: Duration = Duration::from_secs(60);

/// Who operates.
#[derive(Clone, Debug, Default)]
pub(super) struct Operator {
    now: Option<(String, Instant)>,
    /// Who asks for the place, and since when.
    asks: Option<(String, Instant)>,
    /// The last sign of life of one who has left.
    before: Option<Instant>,
}

impl Operator {
    /// Who operates at this moment.
    pub(super) fn name(&self, now: Instant) -> Option<&str> {
        let (name, seen) = self.now.as_ref()?;
        (now.saturating_duration_since(*seen) < LEASE).then_some(name)
    }

    /// A sign of life of somebody.
    pub(super) fn seen(&mut self, client: &str, now: Instant) {
        if self.name(now) == Some(client) {
            self.now = Some((client.into(), now));
        }
    }

    /// Somebody wants to change something, and is the operator from now on where nobody else is.
    ///
    /// # Errors
    /// The one who is.
    pub(super) fn claim(&mut self, client: &str, now: Instant) -> Result<(), String> {
        match self.name(now) {
            Some(other) if other != client => Err(other.into()),
            _ => {
                self.take(client, now);
                Ok(())
            }
        }
    }

    /// Somebody has gone, and operates no more.
    pub(super) fn left(&mut self, client: &str) {
        if let Some((_, seen)) = self.now.take_if(|(name, _)| name == client) {
            self.before = Some(seen);
        }
    }

    /// How long the one who operates, or did last, is silent; none where nobody ever did.
    pub(super) fn silent(&self, now: Instant) -> Option<Duration> {
        let seen = self.now.as_ref().map(|(_, seen)| *seen).or(self.before)?;
        Some(now.saturating_duration_since(seen))
    }

    /// Somebody asks for the operator's place; where nobody is there, he has it.
    pub(super) fn ask(&mut self, client: &str, now: Instant) {
        match self.name(now) {
            Some(other) if other != client => self.asks = Some((client.into(), now)),
            _ => self.take(client, now),
        }
    }

    /// Who asks, unless that was long ago.
    pub(super) fn asks(&self, now: Instant) -> Option<&str> {
        let (name, since) = self.asks.as_ref()?;
        (now.saturating_duration_since(*since) < PATIENCE).then_some(name)
    }

    /// Who asks has the place from now on, or not now.
    pub(super) fn hand_over(&mut self, grant: bool, now: Instant) {
        let asks = self.asks(now).map(str::to_owned);
        self.asks = None;
        if let Some(name) = asks.filter(|_| grant) {
            self.take(&name, now);
        }
    }

    /// Somebody is the operator from now on.
    pub(super) fn take(&mut self, client: &str, now: Instant) {
        self.asks.take_if(|(name, _)| name == client);
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
        operator.seen("ann", at(8));
        operator.seen("bob", at(9));
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
    fn who_asks_waits_for_an_answer_and_not_for_ever() {
        let mut operator = Operator::default();
        let begin = Instant::now();
        let at = |seconds: u64| begin + Duration::from_secs(seconds);
        operator.ask("ann", at(0));
        assert_eq!((operator.name(at(0)), operator.asks(at(0))), (Some("ann"), None), "nobody was there");
        operator.ask("bob", at(1));
        assert_eq!((operator.name(at(1)), operator.asks(at(1))), (Some("ann"), Some("bob")));
        operator.hand_over(false, at(2));
        assert_eq!((operator.name(at(2)), operator.asks(at(2))), (Some("ann"), None));
        operator.ask("bob", at(3));
        assert_eq!(operator.asks(at(63)), None);
        operator.seen("ann", at(4));
        operator.hand_over(true, at(5));
        assert_eq!((operator.name(at(5)), operator.asks(at(5))), (Some("bob"), None));
    }
}
