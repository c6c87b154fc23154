//! Calls over a WebSocket. Answers are sent when they are available, the points of streams automatically.
//!
//! A message is a call with a number, `{"id": 7, "call": "stream", "signals": ["angle"], "every": 0.01}`; its answer or
//! error has that number. All new points follow as `{"stream": 1, "points": […]}`, 30 times a second. Slow readers do not
//! block the bench: lost points are counted in the next one.
//!
//! A stream of every cycle has binary messages, at the same times and by the same rule ([`packed`]).

use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Query, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use serde::Deserialize;
use serde_json::{Value, json};
use stickslip::capture::Batch;
use stickslip::live::protocol::{Answer, Call};
use tokio::sync::{OwnedSemaphorePermit, mpsc};
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};

use super::http::{LARGEST, Shared, Timeouts, refused};

/// Interval between messages of streams: 30 a second.
const PUSH: Duration = Duration::from_millis(33);
/// Largest number of simultaneous calls of a client.
const AT_ONCE: usize = 8;

/// Query of the address: a page cannot send headers when it opens a WebSocket.
#[derive(Deserialize)]
pub(super) struct SocketQuery {
    token: Option<String>,
    client: Option<String>,
}

/// Opens a WebSocket.
pub(super) async fn open(
    State(shared): State<Arc<Shared>>,
    Query(query): Query<SocketQuery>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response {
    if let Err((status, message)) = shared.door.admit(&headers, query.token.as_deref()) {
        return refused(status, message.into());
    }
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(rejection) => return refused(rejection.status(), rejection.body_text()),
    };
    let Ok(permit) = shared.sockets.clone().try_acquire_owned() else {
        return refused(StatusCode::SERVICE_UNAVAILABLE, "too many connections: close a page or a script".into());
    };
    let client: String = query.client.as_deref().unwrap_or("unnamed client").chars().take(64).collect();
    upgrade.max_message_size(LARGEST).on_upgrade(|socket| Connection::new(shared, client, permit).serve(socket))
}

/// The connection of a client.
struct Connection {
    shared: Arc<Shared>,
    client: String,
    streams: Vec<u64>,
    samples: Vec<u64>,
    timeouts: Timeouts,
    _permit: OwnedSemaphorePermit,
}

impl Connection {
    fn new(shared: Arc<Shared>, client: String, permit: OwnedSemaphorePermit) -> Self {
        let timeouts = shared.timeouts;
        Connection { shared, client, streams: Vec::new(), samples: Vec::new(), timeouts, _permit: permit }
    }

    async fn serve(mut self, mut socket: WebSocket) {
        self.exchange_messages(&mut socket).await;
        // Streams end with their connection.
        for stream in self.streams.drain(..).chain(self.samples.drain(..)) {
            let _ = self.shared.live.call(&self.client, Call::Drop { capture: stream });
        }
    }

    /// Exchanges messages until one side closes the connection or a time limit is exceeded.
    async fn exchange_messages(&mut self, socket: &mut WebSocket) {
        let (answers, mut finished) = mpsc::channel(AT_ONCE);
        let mut push = interval(PUSH);
        push.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut pending = 0;
        let mut last_message = Instant::now();
        let mut last_ping = Instant::now();
        loop {
            let messages = tokio::select! {
                message = socket.recv(), if pending < AT_ONCE => {
                    let Some(Ok(message)) = message else { return };
                    last_message = Instant::now();
                    let Message::Text(text) = message else { continue };
                    match self.start_call(&text, &answers) {
                        Ok(()) => pending += 1,
                        Err(error) => if self.send(socket, text_of(&error)).await.is_err() { return },
                    }
                    continue;
                }
                Some((id, answer)) = finished.recv() => {
                    pending -= 1;
                    vec![text_of(&self.answer(id, answer))]
                }
                _ = push.tick() => {
                    if last_message.elapsed() > self.timeouts.silence {
                        return;
                    }
                    if last_ping.elapsed() > self.timeouts.silence / 3 {
                        last_ping = Instant::now();
                        let ping = socket.send(Message::Ping(Default::default()));
                        if !matches!(timeout(self.timeouts.head, ping).await, Ok(Ok(()))) {
                            return;
                        }
                    }
                    let mut messages = self.points();
                    messages.extend(self.batches());
                    messages
                }
            };
            for message in messages {
                if self.send(socket, message).await.is_err() {
                    return;
                }
            }
        }
    }

    /// Sends a message within the time limit.
    async fn send(&self, socket: &mut WebSocket, message: Message) -> Result<(), ()> {
        let sent = socket.send(message);
        if matches!(timeout(self.timeouts.head, sent).await, Ok(Ok(()))) { Ok(()) } else { Err(()) }
    }

    /// Starts a call; the answer follows later.
    fn start_call(&self, text: &str, answers: &mpsc::Sender<(Value, Result<Answer, String>)>) -> Result<(), Value> {
        let mut call: Value =
            serde_json::from_str(text).map_err(|error| json!({ "error": format!("invalid JSON: {error}") }))?;
        let id = call.as_object_mut().and_then(|call| call.remove("id")).unwrap_or_default();
        if !self.shared.door.has_budget_now() {
            return Err(json!({ "id": id, "error": super::door::FLOOD }));
        }
        let call = Call::from_json(call).map_err(
            |error| json!({ "id": id, "error": format!("invalid call: {error}. GET /api/schema describes the calls") }),
        )?;
        let (shared, client, answers) = (self.shared.clone(), self.client.clone(), answers.clone());
        // The design of parameters may take seconds: it must not block other clients.
        tokio::task::spawn_blocking(move || {
            let answer = shared.live.call(&client, call).map_err(|error| error.to_string());
            // Ignored: the client may have disconnected.
            let _ = answers.blocking_send((id, answer));
        });
        Ok(())
    }

    /// The answer as JSON; new streams are registered.
    fn answer(&mut self, id: Value, answer: Result<Answer, String>) -> Value {
        let mut message = match answer {
            Ok(answer) => {
                if let Answer::Capture { capture, stage } = &answer
                    && stage == "streaming"
                    && !self.streams.contains(capture)
                {
                    self.streams.push(*capture);
                }
                if let Answer::Samples { capture } = &answer {
                    self.samples.push(*capture);
                }
                answer.to_json()
            }
            Err(error) => json!({ "error": error }),
        };
        if let Some(message) = message.as_object_mut() {
            message.insert("id".into(), id);
        }
        message
    }

    /// New points of the streams since the last time.
    fn points(&mut self) -> Vec<Message> {
        let mut messages = Vec::new();
        let Connection { shared, client, streams, .. } = self;
        streams.retain(|stream| match shared.live.call(client, Call::Points { capture: *stream }) {
            Ok(Answer::Points { points }) => {
                if !points.is_empty() {
                    messages.push(text_of(&json!({ "stream": stream, "points": points })));
                }
                true
            }
            // Dropped by a call.
            _ => false,
        });
        messages
    }

    /// New cycles of the streams of every cycle since the last time.
    fn batches(&mut self) -> Vec<Message> {
        let mut messages = Vec::new();
        let Connection { shared, samples, .. } = self;
        samples.retain(|stream| {
            loop {
                match shared.live.batch(*stream) {
                    Ok(Some(batch)) => messages.push(Message::Binary(packed(*stream, &batch).into())),
                    Ok(None) => return true,
                    // Dropped by a call.
                    Err(_) => return false,
                }
            }
        });
        messages
    }
}

fn text_of(message: &Value) -> Message {
    Message::Text(message.to_string().into())
}

/// Length of the head before the columns [bytes].
const HEAD: usize = 32;

/// A batch as bytes, little-endian: number of the stream, first cycle, number of missing cycles before it (u64 each),
/// numbers of cycles and signals (u32 each), then the values of each signal in turn (f64).
fn packed(stream: u64, batch: &Batch) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEAD + batch.rows() * batch.signals() * size_of::<f64>());
    for word in [stream, batch.from, batch.missing] {
        bytes.extend(word.to_le_bytes());
    }
    for word in [batch.rows() as u32, batch.signals() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    for signal in 0..batch.signals() {
        bytes.extend(batch.column(signal).flat_map(f64::to_le_bytes));
    }
    bytes
}
