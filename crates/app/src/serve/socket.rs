//! The same calls over a WebSocket: answers come when they are there, the points of streams by themselves.
//!
//! A message is a call with a number, `{"id": 7, "call": "stream", "signals": ["angle"], "every": 0.01}`; its answer or
//! error has that number. Behind it points come as `{"stream": 1, "points": […]}`, all that there are, 30 times a second.
//! Whoever does not take them in time is not waited for: what he missed is counted in his next point.
//!
//! A stream of every cycle comes as binary messages, at the same times and by the same rule ([`packed`]).

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

use super::http::{LARGEST, Patience, Shared, refused};

/// From push to push: 30 pictures a second.
const PUSH: Duration = Duration::from_millis(33);
/// Calls of one client that are worked on at once.
const AT_ONCE: usize = 8;

/// What stands in the address, since a page cannot send headers with it.
#[derive(Deserialize)]
pub(super) struct Asked {
    token: Option<String>,
    client: Option<String>,
}

/// Opens one.
pub(super) async fn open(
    State(shared): State<Arc<Shared>>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response {
    if let Err((status, why)) = shared.door.admit(&headers, asked.token.as_deref()) {
        return refused(status, why.into());
    }
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(rejection) => return refused(rejection.status(), rejection.body_text()),
    };
    let Ok(room) = shared.sockets.clone().try_acquire_owned() else {
        return refused(StatusCode::SERVICE_UNAVAILABLE, "too many are connected: close a page or a script".into());
    };
    let client: String = asked.client.as_deref().unwrap_or("somebody").chars().take(64).collect();
    upgrade.max_message_size(LARGEST).on_upgrade(|socket| Conversation::new(shared, client, room).hold(socket))
}

/// One client.
struct Conversation {
    shared: Arc<Shared>,
    client: String,
    streams: Vec<u64>,
    samples: Vec<u64>,
    patience: Patience,
    _room: OwnedSemaphorePermit,
}

impl Conversation {
    fn new(shared: Arc<Shared>, client: String, room: OwnedSemaphorePermit) -> Self {
        let patience = shared.patience;
        Conversation { shared, client, streams: Vec::new(), samples: Vec::new(), patience, _room: room }
    }

    async fn hold(mut self, mut socket: WebSocket) {
        self.talk(&mut socket).await;
        // What nobody takes any more ends.
        for stream in self.streams.drain(..).chain(self.samples.drain(..)) {
            let _ = self.shared.live.call(&self.client, Call::Drop { capture: stream });
        }
    }

    /// Until one of both has enough.
    async fn talk(&mut self, socket: &mut WebSocket) {
        let (answers, mut answered) = mpsc::channel(AT_ONCE);
        let mut push = interval(PUSH);
        push.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut under_way = 0;
        let mut heard = Instant::now();
        let mut asked = Instant::now();
        loop {
            let messages = tokio::select! {
                message = socket.recv(), if under_way < AT_ONCE => {
                    let Some(Ok(message)) = message else { return };
                    heard = Instant::now();
                    let Message::Text(text) = message else { continue };
                    match self.ask(&text, &answers) {
                        Ok(()) => under_way += 1,
                        Err(error) => if self.send(socket, text_of(&error)).await.is_err() { return },
                    }
                    continue;
                }
                Some((id, answer)) = answered.recv() => {
                    under_way -= 1;
                    vec![text_of(&self.told(id, answer))]
                }
                _ = push.tick() => {
                    if heard.elapsed() > self.patience.silence {
                        return;
                    }
                    if asked.elapsed() > self.patience.silence / 3 {
                        asked = Instant::now();
                        let ping = socket.send(Message::Ping(Default::default()));
                        if !matches!(timeout(self.patience.head, ping).await, Ok(Ok(()))) {
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

    /// Sends, unless it is not taken in time.
    async fn send(&self, socket: &mut WebSocket, message: Message) -> Result<(), ()> {
        let sent = socket.send(message);
        if matches!(timeout(self.patience.head, sent).await, Ok(Ok(()))) { Ok(()) } else { Err(()) }
    }

    /// Has a call worked on; the answer comes later.
    fn ask(&self, text: &str, answers: &mpsc::Sender<(Value, Result<Answer, String>)>) -> Result<(), Value> {
        let mut call: Value =
            serde_json::from_str(text).map_err(|error| json!({ "error": format!("no JSON: {error}") }))?;
        let id = call.as_object_mut().and_then(|call| call.remove("id")).unwrap_or_default();
        if !self.shared.door.has_room_now() {
            return Err(json!({ "id": id, "error": super::door::FLOOD }));
        }
        let call = Call::from_json(call).map_err(
            |error| json!({ "id": id, "error": format!("no call: {error}. GET /api/schema describes them") }),
        )?;
        let (shared, client, answers) = (self.shared.clone(), self.client.clone(), answers.clone());
        // Parameters may be designed for seconds: not on a thread that serves others.
        tokio::task::spawn_blocking(move || {
            let answer = shared.live.call(&client, call).map_err(|error| error.to_string());
            // Who has gone meanwhile misses nothing.
            let _ = answers.blocking_send((id, answer));
        });
        Ok(())
    }

    /// The answer in words; a stream is remembered.
    fn told(&mut self, id: Value, answer: Result<Answer, String>) -> Value {
        let mut told = match answer {
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
        if let Some(told) = told.as_object_mut() {
            told.insert("id".into(), id);
        }
        told
    }

    /// What has come for the streams since the last time.
    fn points(&mut self) -> Vec<Message> {
        let mut messages = Vec::new();
        let Conversation { shared, client, streams, .. } = self;
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

    /// Every cycle since the last time, of the streams that want it.
    fn batches(&mut self) -> Vec<Message> {
        let mut messages = Vec::new();
        let Conversation { shared, samples, .. } = self;
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

/// Bytes before the columns.
const HEAD: usize = 32;

/// A batch as bytes, little-endian: number of the stream, first cycle, cycles missing before it (u64 each), cycles and
/// signals (u32 each), then signal after signal its values (f64).
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
