//! Calls from another terminal.

use std::path::Path;
use std::time::Duration;

use stickslip::live::protocol::{Answer, Call, Status};

use super::Place;
use crate::failure::Failure;

/// A bench that is served somewhere.
pub(crate) struct Client {
    place: Place,
    agent: ureq::Agent,
    name: String,
}

impl Client {
    /// The one of a project.
    ///
    /// # Errors
    /// None is served.
    pub(crate) fn of(project: &Path) -> Result<Self, Failure> {
        Ok(Client::at(Place::find(project)?))
    }

    /// The one at a place.
    pub(crate) fn at(place: Place) -> Self {
        let config = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .proxy(None)
            .timeout_global(Some(Duration::from_secs(130)))
            .build();
        let user = std::env::var("USER").or_else(|_| std::env::var("USERNAME"));
        let name = format!("terminal of {}", user.as_deref().unwrap_or("somebody"));
        Client { place, agent: config.into(), name }
    }

    /// Asks or orders something.
    ///
    /// # Errors
    /// The bench cannot be reached, or refuses: with its own words.
    pub(crate) fn call(&self, call: &Call) -> Result<Answer, Failure> {
        let failed = |error: ureq::Error| {
            let address = self.place.address;
            Failure::Served(format!(
                "the bench at {address} does not answer ({error}). Does `stickslip serve` still run?"
            ))
        };
        let mut response = self
            .agent
            .post(format!("http://{}/api", self.place.address))
            .header("Authorization", format!("Bearer {}", self.place.token))
            .header("Stickslip-Client", &self.name)
            .send_json(call.to_json())
            .map_err(failed)?;
        let text = response.body_mut().with_config().limit(256 << 20).read_to_string().map_err(failed)?;
        if response.status().is_success() {
            let read = serde_json::from_str(&text).map_err(|error| error.to_string());
            return read
                .and_then(Answer::from_json)
                .map_err(|error| Failure::Served(format!("an answer of another version of stickslip ({error})")));
        }
        let refused: Option<serde_json::Value> = serde_json::from_str(&text).ok();
        let why = refused.as_ref().and_then(|body| body["error"].as_str()).unwrap_or(&text);
        Err(Failure::Served(why.into()))
    }

    /// How the bench is.
    ///
    /// # Errors
    /// As [`call`](Self::call).
    pub(crate) fn status(&self) -> Result<Status, Failure> {
        match self.call(&Call::Status {})? {
            Answer::Status(status) => Ok(*status),
            other => Err(unexpected(&other)),
        }
    }
}

/// An answer to another call.
pub(crate) fn unexpected(answer: &Answer) -> Failure {
    Failure::Served(format!("the bench answers something else: {answer:?}"))
}
