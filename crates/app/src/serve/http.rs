//! The HTTP server: calls, their schema, the WebSocket, the page and files.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use stickslip::BenchError;
use stickslip::LiveError;

use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, FromRequest as _, Request, State};
use axum::http::{HeaderMap, HeaderName, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router};
use hyper::service::{Service as _, service_fn};
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

use super::connections::{Connection, Connections};
use super::door::Door;
use super::known::Known;
use super::scope::{self, LARGEST_SAMPLES};
use super::{Place, PlaceFile, page, socket};

/// Largest call [bytes].
pub(super) const LARGEST: usize = 256 << 10;
/// Limits of simultaneous connections and of WebSockets.
const CONNECTIONS: usize = 128;
const SOCKETS: usize = 64;
/// Header with the name of the client.
const CLIENT: HeaderName = HeaderName::from_static("stickslip-client");
/// Time limit of a call.
const CALL: Duration = Duration::from_secs(120);

/// Time limits for clients.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timeouts {
    /// For the head of a request, and for each message that is sent.
    pub(crate) head: Duration,
    /// For a whole connection, bodies and answers included.
    pub(crate) whole: Duration,
    /// Without a message of the client on a WebSocket.
    pub(crate) silence: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        Timeouts { head: Duration::from_secs(5), whole: Duration::from_secs(150), silence: Duration::from_secs(30) }
    }
}

/// The server of a running bench.
pub(crate) struct Server {
    /// Address and token.
    pub(crate) place: Place,
    live: Arc<Live>,
    runtime: tokio::runtime::Runtime,
    stop: watch::Sender<bool>,
    xcp: Option<Xcp>,
    _file: PlaceFile,
}

pub(super) struct Shared {
    pub(super) live: Arc<Live>,
    pub(super) door: Door,
    pub(super) timeouts: Timeouts,
    pub(super) sockets: Arc<Semaphore>,
    /// Limits simultaneous exports: each one uses a processor and a disk fully.
    pub(super) exports: Semaphore,
}

impl Server {
    /// Serves a bench at the first free one of these addresses, under its known names; port 0 selects a free one. Address and token are written
    /// into the project's folder.
    ///
    /// # Errors
    /// The address, the folder or a thread is not available.
    pub(crate) fn start(
        live: Live,
        listen: &[SocketAddr],
        known: Known,
        project: &Path,
        timeouts: Timeouts,
    ) -> std::io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
        let listener = runtime.block_on(TcpListener::bind(listen))?;
        std::fs::create_dir_all(project)?;
        let place = Place { address: listener.local_addr()?, token: super::token(project)? };
        let file = place.write(project)?;
        let live = Arc::new(live);
        let shared = Arc::new(Shared {
            live: live.clone(),
            door: Door::new(place.address, known, place.token.clone()),
            timeouts,
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
            .route("/scope/captures", post(scope::keep).layer(DefaultBodyLimit::max(LARGEST_SAMPLES)))
            .route("/scope/captures/{number}", get(scope::kept))
            .route("/scope/export/{kind}", post(scope::export).layer(DefaultBodyLimit::max(LARGEST_SAMPLES)))
            .fallback_service(get(page::get).with_state(shared.clone()))
            .layer(DefaultBodyLimit::max(LARGEST))
            .with_state(shared);
        let (stop, stopped) = watch::channel(false);
        runtime.spawn(accept(listener, router, timeouts, stopped));
        Ok(Server { place, live, runtime, stop, xcp: None, _file: file })
    }

    /// Accepts measurement and calibration tools; returns the addresses.
    ///
    /// # Errors
    /// An address is not available.
    pub(crate) fn open_xcp(&mut self, requested: Doors) -> std::io::Result<Doors> {
        Ok(self.xcp.insert(Xcp::open(&self.live, requested, PATIENCE)?).doors)
    }

    /// Whether a client has ended the program.
    pub(crate) fn closed(&self) -> bool {
        self.live.closed()
    }

    /// Stops the server and the bench; returns the timing report.
    pub(crate) fn stop(self) -> Option<TimingReport> {
        self.xcp.into_iter().for_each(Xcp::stop);
        // Connections end with the runtime.
        let _ = self.stop.send(true);
        self.runtime.shutdown_timeout(Duration::from_secs(2));
        Arc::into_inner(self.live).and_then(Live::stop)
    }
}

/// Accepts connections until the server stops.
async fn accept(listener: TcpListener, router: Router, timeouts: Timeouts, mut stopped: watch::Receiver<bool>) {
    let connections = Connections::new(CONNECTIONS);
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            _ = stopped.changed() => return,
        };
        let Ok((stream, _)) = accepted else {
            // Usually out of file descriptors: try again later.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let (connection, place) = tokio::select! {
            entered = connections.enter() => entered,
            _ = stopped.changed() => return,
        };
        let router = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let service = service_fn(|mut request: hyper::Request<hyper::body::Incoming>| {
                connection.wait();
                request.extensions_mut().insert(connection.clone());
                router.call(request)
            });
            let mut builder = hyper::server::conn::http1::Builder::new();
            builder.timer(TokioTimer::new()).header_read_timeout(timeouts.head).max_buf_size(64 << 10);
            let served = builder.serve_connection(TokioIo::new(stream), service).with_upgrades();
            // Ignored: the client disconnected, exceeded the time limit or made room for another.
            tokio::select! {
                _ = tokio::time::timeout(timeouts.whole, served) => {}
                () = connection.closed() => {}
            }
            drop(place);
        });
    }
}

/// The schema of calls and answers, for authors of clients.
async fn schema() -> Json<serde_json::Value> {
    Json(protocol::schema(false))
}

async fn call(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    request: Request,
) -> Response {
    // Before the body: a client without the token sends none.
    let client = match client(&shared, request.headers()) {
        Ok(client) => client,
        Err(refusal) => return refusal,
    };
    let body = match Bytes::from_request(request, &()).await {
        Ok(body) => body,
        Err(rejection) => return refused(rejection.status(), rejection.body_text()),
    };
    connection.work();
    let response = answer(shared, client, &body).await;
    connection.wait();
    response
}

/// The name of a client whose call is admitted by its headers.
#[expect(clippy::result_large_err, reason = "a response, made once in a refusal")]
fn client(shared: &Shared, headers: &HeaderMap) -> Result<String, Response> {
    shared.door.admit(headers, None).map_err(|(status, message)| refused(status, message.into()))?;
    let text = |name: HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
    // Forms of other pages cannot send this type.
    let kind = text(header::CONTENT_TYPE).and_then(|kind| kind.split(';').next());
    if kind != Some("application/json") {
        let message = "send JSON: Content-Type: application/json";
        return Err(refused(StatusCode::UNSUPPORTED_MEDIA_TYPE, message.into()));
    }
    Ok(text(CLIENT).unwrap_or("unnamed client").chars().take(64).collect())
}

/// The response to a call.
async fn answer(shared: Arc<Shared>, client: String, body: &[u8]) -> Response {
    let value = serde_json::from_slice(body).map_err(|error| error.to_string());
    let call = match value.and_then(Call::from_json) {
        Ok(call) => call,
        Err(error) => {
            let message = format!("invalid call: {error}. GET /api/schema describes the calls");
            return refused(StatusCode::BAD_REQUEST, message);
        }
    };
    if matches!(call, Call::Samples { .. }) {
        let message = "`samples` sends binary messages: call it over the WebSocket, ws://…/api/live";
        return refused(StatusCode::UNPROCESSABLE_ENTITY, message.into());
    }
    // The design of parameters may take seconds: it must not block other clients.
    let answer = tokio::task::spawn_blocking(move || shared.live.call(&client, call));
    match tokio::time::timeout(CALL, answer).await {
        Ok(Ok(Ok(answer))) => Json(answer.to_json()).into_response(),
        Ok(Ok(Err(error))) => refused(status(&error), error.to_string()),
        Ok(Err(_)) => refused(
            StatusCode::INTERNAL_SERVER_ERROR,
            "internal error of the bench in this call; please report it".into(),
        ),
        Err(_) => refused(StatusCode::GATEWAY_TIMEOUT, "the call takes longer than two minutes".into()),
    }
}

/// The response for a refused request.
pub(super) fn refused(status: StatusCode, error: String) -> Response {
    (status, Json(json!({ "error": error }))).into_response()
}

/// The HTTP status of an error.
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
