//! The server: one address for calls, one for their schema.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use stickslip::BenchError;
use stickslip::LiveError;

use axum::extract::rejection::BytesRejection;
use axum::extract::{DefaultBodyLimit, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde_json::json;
use stickslip::Error;
use stickslip::bench::TimingReport;
use stickslip::live::Live;
use stickslip::live::protocol::{self, Call};
use stickslip::xcp::a2l::Doors;
use stickslip::xcp::ethernet::{PATIENCE, Xcp};
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, watch};

use super::door::Door;
use super::{Left, Place, page, socket};

/// Largest call [bytes].
pub(super) const LARGEST: usize = 256 << 10;
/// Connections at once, and of those that stay open.
const CONNECTIONS: usize = 128;
const SOCKETS: usize = 64;
/// How long a call may take.
const CALL: Duration = Duration::from_secs(120);

/// How long a client may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    /// For the head of a request.
    pub(crate) head: Duration,
    /// For a connection as a whole, bodies and answers included.
    pub(crate) whole: Duration,
    /// Without a sign of life, where the connection stays open.
    pub(crate) silence: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Patience { head: Duration::from_secs(5), whole: Duration::from_secs(150), silence: Duration::from_secs(30) }
    }
}

/// A bench that is served.
pub(crate) struct Server {
    /// Where.
    pub(crate) place: Place,
    live: Arc<Live>,
    runtime: tokio::runtime::Runtime,
    stop: watch::Sender<bool>,
    xcp: Option<Xcp>,
    _left: Left,
}

pub(super) struct Shared {
    pub(super) live: Arc<Live>,
    pub(super) door: Door,
    pub(super) patience: Patience,
    pub(super) sockets: Arc<Semaphore>,
    /// Records that are being written for other tools: each fills a processor and a disk.
    pub(super) exports: Semaphore,
}

impl Server {
    /// Serves a bench at the first of these addresses that is free; port 0 takes a free one. The place is left in the
    /// project's folder.
    ///
    /// # Errors
    /// The system refuses the address, the folder or a thread.
    pub(crate) fn start(
        live: Live,
        listen: &[SocketAddr],
        project: &Path,
        patience: Patience,
    ) -> std::io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
        let listener = runtime.block_on(TcpListener::bind(listen))?;
        std::fs::create_dir_all(project)?;
        let place = Place { address: listener.local_addr()?, token: super::token(project)? };
        let left = place.leave(project)?;
        let live = Arc::new(live);
        let shared = Arc::new(Shared {
            live: live.clone(),
            door: Door::new(place.address, place.token.clone()),
            patience,
            sockets: Arc::new(Semaphore::new(SOCKETS)),
            exports: Semaphore::new(1),
        });
        let router = Router::new()
            .route("/api", post(call))
            .route("/api/live", get(socket::open))
            .route("/api/schema", get(schema))
            .route("/report/{run}", get(page::report))
            .route("/implementation/{*file}", get(page::implementation))
            .route("/run/{number}/{*file}", get(page::run_file))
            .fallback_service(get(page::get).with_state(shared.clone()))
            .layer(DefaultBodyLimit::max(LARGEST))
            .with_state(shared);
        let (stop, stopped) = watch::channel(false);
        runtime.spawn(accept(listener, router, patience, stopped));
        Ok(Server { place, live, runtime, stop, xcp: None, _left: left })
    }

    /// Opens the bench to measurement and calibration tools, and says where.
    ///
    /// # Errors
    /// The system refuses an address.
    pub(crate) fn open_xcp(&mut self, wanted: Doors) -> std::io::Result<Doors> {
        Ok(self.xcp.insert(Xcp::open(&self.live, wanted, PATIENCE)?).doors)
    }

    /// Ends it.
    pub(crate) fn stop(self) -> Option<TimingReport> {
        self.xcp.into_iter().for_each(Xcp::stop);
        // Whoever listens hears it; connections end with the runtime.
        let _ = self.stop.send(true);
        self.runtime.shutdown_timeout(Duration::from_secs(2));
        Arc::into_inner(self.live).and_then(Live::stop)
    }
}

/// Takes connections, so many at once.
async fn accept(listener: TcpListener, router: Router, patience: Patience, mut stopped: watch::Receiver<bool>) {
    let room = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let Ok(permit) = room.clone().acquire_owned().await else { return };
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            _ = stopped.changed() => return,
        };
        let Ok((stream, _)) = accepted else {
            // Out of file descriptors, mostly: the next one may do.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let service = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let mut builder = hyper::server::conn::http1::Builder::new();
            builder.timer(TokioTimer::new()).header_read_timeout(patience.head).max_buf_size(64 << 10);
            let connection = builder.serve_connection(TokioIo::new(stream), service).with_upgrades();
            // A client that breaks off, or takes for ever, is its own affair.
            let _ = tokio::time::timeout(patience.whole, connection).await;
            drop(permit);
        });
    }
}

/// The schema of calls and answers, for whoever writes a client.
async fn schema() -> Json<serde_json::Value> {
    Json(protocol::schema(false))
}

async fn call(
    State(shared): State<Arc<Shared>>,
    headers: HeaderMap,
    body: Result<axum::body::Bytes, BytesRejection>,
) -> Response {
    if let Err((status, why)) = shared.door.admit(&headers, None) {
        return refused(status, why.into());
    }
    let text = |name: header::HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
    // Nothing that a form of another page could send.
    let kind = text(header::CONTENT_TYPE).and_then(|kind| kind.split(';').next());
    if kind != Some("application/json") {
        return refused(StatusCode::UNSUPPORTED_MEDIA_TYPE, "send JSON: Content-Type: application/json".into());
    }
    let body = match body {
        Ok(body) => body,
        Err(rejection) => return refused(rejection.status(), rejection.body_text()),
    };
    let read = serde_json::from_slice(&body).map_err(|error| error.to_string());
    let call = match read.and_then(Call::from_json) {
        Ok(call) => call,
        Err(error) => {
            let why = format!("no call: {error}. GET /api/schema describes them");
            return refused(StatusCode::BAD_REQUEST, why);
        }
    };
    if matches!(call, Call::Samples { .. }) {
        let why = "every cycle comes in binary messages: call it over the WebSocket, ws://…/api/live";
        return refused(StatusCode::UNPROCESSABLE_ENTITY, why.into());
    }
    let client = headers.get("stickslip-client").and_then(|value| value.to_str().ok());
    let client: String = client.unwrap_or("somebody").chars().take(64).collect();
    // Parameters may be designed for seconds: not on a thread that serves others.
    let answer = tokio::task::spawn_blocking(move || shared.live.call(&client, call));
    match tokio::time::timeout(CALL, answer).await {
        Ok(Ok(Ok(answer))) => Json(answer.to_json()).into_response(),
        Ok(Ok(Err(error))) => refused(status(&error), error.to_string()),
        Ok(Err(_)) => refused(StatusCode::INTERNAL_SERVER_ERROR, "the call failed within the bench; report it".into()),
        Err(_) => refused(StatusCode::GATEWAY_TIMEOUT, "it takes longer than two minutes".into()),
    }
}

/// Why not, and what to do.
pub(super) fn refused(status: StatusCode, error: String) -> Response {
    (status, Json(json!({ "error": error }))).into_response()
}

/// What a failure is for HTTP.
fn status(error: &Error) -> StatusCode {
    match error.of() {
        Some(LiveError::Operated { .. }) => return StatusCode::FORBIDDEN,
        Some(LiveError::Busy { .. } | LiveError::NothingToEnd { .. } | LiveError::RunGone { .. }) => {
            return StatusCode::CONFLICT;
        }
        Some(LiveError::NoRun { .. }) => return StatusCode::NOT_FOUND,
        Some(LiveError::Catalogue { .. }) => return StatusCode::INTERNAL_SERVER_ERROR,
        _ => {}
    }
    match (error, error.of()) {
        (Error::Refused(_), _) | (_, Some(BenchError::NothingToUndo { .. })) => StatusCode::CONFLICT,
        (Error::BenchFault { .. } | Error::File { .. }, _) => StatusCode::INTERNAL_SERVER_ERROR,
        _ => StatusCode::UNPROCESSABLE_ENTITY,
    }
}
