//! Client of a running bench, for the commands.

use std::path::Path;
use std::time::Duration;

use stickslip::live::protocol::{Answer, Call, Status};

use super::Place;
use crate::failure::Failure;

/// Connection to a running bench.
pub(crate) struct Client {
    place: Place,
    agent: ureq::Agent,
    name: String,
}

impl Client {
    /// The client for the bench of a project.
    ///
    /// # Errors
    /// No bench is running for the project.
    pub(crate) fn of(project: &Path) -> Result<Self, Failure> {
        Ok(Client::at(Place::find(project)?))
    }

    /// The client for the bench at an address.
    pub(crate) fn at(place: Place) -> Self {
        let config = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .proxy(None)
            .timeout_global(Some(Duration::from_secs(130)))
            .build();
        let user = std::env::var("USER").or_else(|_| std::env::var("USERNAME"));
        let name = format!("terminal of {}", user.as_deref().unwrap_or("unknown user"));
        Client { place, agent: config.into(), name }
    }

    /// Makes a call.
    ///
    /// # Errors
    /// The bench cannot be reached, or refuses the call; the message is that of the bench.
    pub(crate) fn call(&self, call: &Call) -> Result<Answer, Failure> {
        let unreachable = |error: ureq::Error| {
            let address = self.place.address;
            Failure::Served(format!(
                "the bench at {address} does not answer ({error}). Check that `stickslip serve` is running."
            ))
        };
        let mut response = self
            .agent
            .post(format!("http://{}/api", self.place.address))
            .header("Authorization", format!("Bearer {}", self.place.token))
            .header("Stickslip-Client", &self.name)
            .send_json(call.to_json())
            .map_err(unreachable)?;
        let text = response.body_mut().with_config().limit(256 << 20).read_to_string().map_err(unreachable)?;
        if response.status().is_success() {
            let value = serde_json::from_str(&text).map_err(|error| error.to_string());
            return value.and_then(Answer::from_json).map_err(|error| {
                Failure::Served(format!("the answer is from another version of stickslip ({error})"))
            });
        }
        let body: Option<serde_json::Value> = serde_json::from_str(&text).ok();
        let message = body.as_ref().and_then(|body| body["error"].as_str()).unwrap_or(&text);
        Err(Failure::Served(message.into()))
    }

    /// Status of the bench.
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

/// The error for an answer to another call.
pub(crate) fn unexpected(answer: &Answer) -> Failure {
    Failure::Served(format!("unexpected answer of the bench: {answer:?}"))
}
