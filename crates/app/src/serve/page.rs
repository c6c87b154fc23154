//! The page: its files and its access. The printed address has the token, which becomes a cookie that scripts cannot read.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::Extension;
use axum::body::Body;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use stickslip::Watch;
use tokio::io::AsyncRead;
use tokio_util::io::ReaderStream;

use super::connections::Connection;
use super::http::Shared;

/// Lifetime of the cookie [s]: a year. The token of a project does not change.
const COOKIE_AGE: u32 = 31_536_000;

/// Content security policy of the page: only its own files and its own bench, nothing inline, no frames.
const PAGE_POLICY: &str = "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; \
                      form-action 'none'; frame-ancestors 'none'";

/// Content security policy of a report: only its inline style and script, no other sources, no access to the bench.
const REPORT_POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; \
                     base-uri 'none'; form-action 'none'; frame-ancestors 'none'; sandbox allow-scripts allow-downloads";

/// Query of the printed address.
#[derive(Deserialize)]
pub(super) struct TokenQuery {
    token: Option<String>,
}

/// The page or one of its files.
pub(super) async fn get(
    State(shared): State<Arc<Shared>>,
    Query(query): Query<TokenQuery>,
    uri: Uri,
    headers: HeaderMap,
) -> Response {
    with_security_headers(answer(&shared, &query, uri.path(), &headers), PAGE_POLICY)
}

/// The page of a run's report.
pub(super) async fn report(
    State(shared): State<Arc<Shared>>,
    run: Result<Path<u64>, PathRejection>,
    headers: HeaderMap,
) -> Response {
    let text = |status: StatusCode, text: String| (status, text).into_response();
    let answer = match (shared.door.admit(&headers, None), run) {
        (Err((status, reason)), _) => text(status, access_denied(&reason)),
        (_, Err(_)) => text(StatusCode::NOT_FOUND, "invalid address of a report: use /report/NUMBER\n".into()),
        (_, Ok(Path(run))) => match shared.live.report_page(run) {
            Ok(page) => ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], page).into_response(),
            Err(error) => text(StatusCode::NOT_FOUND, format!("{error}\n")),
        },
    };
    with_security_headers(answer, REPORT_POLICY)
}

/// File type of an export.
#[derive(Deserialize)]
pub(super) struct ExportQuery {
    /// Ending of the file name: `parquet`, `csv`, `mat` or `mcap`.
    r#as: Option<String>,
}

/// Download of a file of a run, in pieces of limited size; its record also converted for other tools.
pub(super) async fn run_file(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    path: Result<Path<(i64, String)>, PathRejection>,
    query: Result<Query<ExportQuery>, QueryRejection>,
    headers: HeaderMap,
) -> Response {
    let text = |status: StatusCode, text: String| (status, text).into_response();
    let answer = match (shared.door.admit(&headers, None), path, query) {
        (Err((status, reason)), ..) => text(status, access_denied(&reason)),
        (_, Err(_), _) => text(StatusCode::NOT_FOUND, "invalid address of a file: use /run/NUMBER/NAME\n".into()),
        (_, _, Err(_)) => text(StatusCode::NOT_FOUND, "invalid query: name one file type, as in ?as=parquet\n".into()),
        (_, Ok(Path((number, file))), Ok(Query(query))) => {
            // A download may take long.
            connection.work();
            let name = format!("run-{number}-{}", file.rsplit('/').next().unwrap_or_default());
            match query.r#as {
                None => match shared.live.run_file(number, &file) {
                    Err(error) => text(StatusCode::NOT_FOUND, format!("{error}\n")),
                    Ok(path) => match tokio::fs::File::open(&path).await {
                        Ok(opened) => download(&name, opened),
                        Err(error) => {
                            text(StatusCode::NOT_FOUND, format!("cannot open {} ({error})\n", path.display()))
                        }
                    },
                },
                Some(kind) => match converted(&shared, number, file, &kind).await {
                    Ok(file) => download(&std::path::Path::new(&name).with_extension(kind).to_string_lossy(), file),
                    Err(message) => text(StatusCode::NOT_FOUND, message),
                },
            }
        }
    };
    with_security_headers(answer, REPORT_POLICY)
}

/// The response for a download with this file name.
pub(super) fn download(name: &str, from: impl AsyncRead + Send + 'static) -> Response {
    // Only characters that require no quotes.
    let name: String = name.chars().filter(|c| c.is_ascii_alphanumeric() || "-_.".contains(*c)).collect();
    let (kind, place) = shown(&name);
    let fields = [
        (header::CONTENT_TYPE, kind.to_owned()),
        (header::CONTENT_DISPOSITION, format!("{place}; filename=\"{name}\"")),
        (header::CACHE_CONTROL, "no-store".into()),
    ];
    (fields, Body::from_stream(ReaderStream::new(from))).into_response()
}

/// Type and disposition of a file: a browser shows a figure, and saves other files.
pub(super) fn shown(name: &str) -> (&'static str, &'static str) {
    if name.ends_with(".svg") { ("image/svg+xml", "inline") } else { ("application/octet-stream", "attachment") }
}

/// The record `file` of a run as another type of file. One conversion runs at a time; it is cancelled when the client
/// disconnects.
async fn converted(shared: &Arc<Shared>, number: i64, file: String, kind: &str) -> Result<tokio::fs::File, String> {
    let unavailable = || "the bench is shutting down; try again after its restart\n".to_owned();
    let _permit = shared.exports.acquire().await.map_err(|_| unavailable())?;
    let cancelled = Arc::new(AtomicBool::new(false));
    let _cancel = CancelOnDrop(cancelled.clone());
    let (shared, kind) = (shared.clone(), kind.to_owned());
    let work = tokio::task::spawn_blocking(move || {
        shared.live.export_run(number, &file, &kind, &Watch::new(cancelled, |_, _| {}))
    });
    let exported = work.await.map_err(|_| unavailable())?;
    exported.map(tokio::fs::File::from_std).map_err(|error| format!("{error}\n"))
}

/// Cancels the work when the client disconnects.
pub(super) struct CancelOnDrop(pub(super) Arc<AtomicBool>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Download of a file of the implementation that runs.
pub(super) async fn implementation(
    State(shared): State<Arc<Shared>>,
    file: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
) -> Response {
    let text = |status: StatusCode, text: String| (status, text).into_response();
    let answer = match (shared.door.admit(&headers, None), file) {
        (Err((status, reason)), _) => text(status, access_denied(&reason)),
        (_, Err(_)) => text(StatusCode::NOT_FOUND, "invalid address of a file: use /implementation/NAME\n".into()),
        (_, Ok(Path(file))) => {
            let requested = file.clone();
            // The generation of code must not block other clients.
            match tokio::task::spawn_blocking(move || shared.live.implementation_file(&requested)).await {
                Ok(Ok(bytes)) => {
                    let name = file.rsplit('/').next().unwrap_or_default();
                    let fields = [
                        (header::CONTENT_TYPE, shown(name).0.to_owned()),
                        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
                        (header::CACHE_CONTROL, "no-store".into()),
                    ];
                    (fields, bytes).into_response()
                }
                Ok(Err(error)) => text(StatusCode::NOT_FOUND, format!("{error}\n")),
                Err(_) => text(
                    StatusCode::INTERNAL_SERVER_ERROR,
                    "internal error while generating the file; please report it\n".into(),
                ),
            }
        }
    };
    with_security_headers(answer, REPORT_POLICY)
}

/// Adds the headers that restrict what the browser does with a response.
fn with_security_headers(mut response: Response, policy: &'static str) -> Response {
    let all = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ] {
        all.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn answer(shared: &Shared, query: &TokenQuery, path: &str, headers: &HeaderMap) -> Response {
    let text = |status: StatusCode, text: String| (status, text).into_response();
    if let Err((status, reason)) = shared.door.admit_host(headers) {
        return text(status, format!("{reason}\n"));
    }
    let file = stickslip_page::file(path);
    // These files contain nothing about this bench and require no token.
    if let Some(file) = file.filter(|file| file.path != "index.html") {
        return page_file(file, headers);
    }
    if let Some(token) = &query.token {
        return match shared.door.admit(headers, Some(token)) {
            Ok(()) => {
                let (name, age) = (shared.door.cookie(), COOKIE_AGE);
                let cookie = format!("{name}={token}; HttpOnly; SameSite=Strict; Path=/; Max-Age={age}");
                let place = [(header::SET_COOKIE, cookie), (header::LOCATION, path.to_owned())];
                (StatusCode::SEE_OTHER, place, "").into_response()
            }
            Err((status, reason)) => text(status, access_denied(&reason)),
        };
    }
    if let Err((status, reason)) = shared.door.admit(headers, None) {
        return text(status, access_denied(&reason));
    }
    match (file, stickslip_page::missing()) {
        (Some(file), _) => page_file(file, headers),
        (None, Some(reason)) => text(StatusCode::OK, without_page(reason)),
        (None, None) => text(StatusCode::NOT_FOUND, "file not found\n".into()),
    }
}

/// A file of the page, compressed for browsers that accept it.
fn page_file(file: &stickslip_page::File, headers: &HeaderMap) -> Response {
    let accepted = headers.get(header::ACCEPT_ENCODING).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let accepts = |name: &str| accepted.split(',').any(|one| one.split(';').next().is_some_and(|n| n.trim() == name));
    let (encoding, bytes) =
        if accepts("gzip") { (Some("gzip"), Cow::Borrowed(file.gzip)) } else { (None, Cow::Owned(file.plain())) };
    let cache = if file.is_immutable() { "public, max-age=31536000, immutable" } else { "no-cache" };
    let fields = [
        (header::CONTENT_TYPE, file.content_type()),
        (header::CACHE_CONTROL, cache),
        (header::VARY, "Accept-Encoding"),
    ];
    let mut response = (fields, bytes).into_response();
    if let Some(encoding) = encoding {
        response.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static(encoding));
    }
    response
}

/// Text for a client without a valid token.
fn access_denied(reason: &str) -> String {
    format!(
        "This is a stickslip bench. Access denied: {reason}.\n\n\
         Open the address that the program printed when it was started, http://…/?token=…\n\
         The browser then keeps its access, also after a restart of the program.\n"
    )
}

/// Text of a program without its page.
fn without_page(reason: &str) -> String {
    format!(
        "This stickslip was built without its page: {reason}.\n\n\
         Control the bench from a terminal (stickslip bench --help) or by calls:\n\
         POST /api with the header Authorization: Bearer TOKEN and a JSON body, as /api/schema describes it,\n\
         or the same calls over a WebSocket, /api/live?token=TOKEN, which also sends streams.\n"
    )
}
