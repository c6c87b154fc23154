//! The page: its files, and the way in. The printed address has the token; it becomes a cookie that no script sees.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::body::Body;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use stickslip::Watch;
use tokio::io::AsyncRead;
use tokio_util::io::ReaderStream;

use super::http::Shared;

/// A year [s]: the token lives as long as its project.
const COOKIE_AGE: u32 = 31_536_000;

/// What the page may do: its own files, its own bench, nothing inline, in nobody's frame.
const POLICY: &str = "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; \
                      form-action 'none'; frame-ancestors 'none'";

/// A report stands alone: its own style and script, nothing from elsewhere, and no way to the bench.
const ALONE: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; \
                     base-uri 'none'; form-action 'none'; frame-ancestors 'none'; sandbox allow-scripts allow-downloads";

/// What stands in the printed address.
#[derive(Deserialize)]
pub(super) struct Printed {
    token: Option<String>,
}

/// A window of the page or one of its files.
pub(super) async fn get(
    State(shared): State<Arc<Shared>>,
    Query(printed): Query<Printed>,
    uri: Uri,
    headers: HeaderMap,
) -> Response {
    secured(answer(&shared, &printed, uri.path(), &headers), POLICY)
}

/// The page of a run's report.
pub(super) async fn report(
    State(shared): State<Arc<Shared>>,
    run: Result<Path<u64>, PathRejection>,
    headers: HeaderMap,
) -> Response {
    let text = |status: StatusCode, text: String| (status, text).into_response();
    let answer = match (shared.door.admit(&headers, None), run) {
        (Err((status, why)), _) => text(status, stranger(why)),
        (_, Err(_)) => text(StatusCode::NOT_FOUND, "a report has the number of its run\n".into()),
        (_, Ok(Path(run))) => match shared.live.report_page(run) {
            Ok(page) => ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], page).into_response(),
            Err(error) => text(StatusCode::NOT_FOUND, format!("{error}\n")),
        },
    };
    secured(answer, ALONE)
}

/// As what a file of a run leaves.
#[derive(Deserialize)]
pub(super) struct Wanted {
    /// The end of the name that another tool wants: `parquet`, `csv`, `mat` or `mcap`.
    r#as: Option<String>,
}

/// A file of a run, to take along: as long as it is, a piece at a time; its record also for other tools.
pub(super) async fn run_file(
    State(shared): State<Arc<Shared>>,
    asked: Result<Path<(i64, String)>, PathRejection>,
    wanted: Result<Query<Wanted>, QueryRejection>,
    headers: HeaderMap,
) -> Response {
    let text = |status: StatusCode, text: String| (status, text).into_response();
    let answer = match (shared.door.admit(&headers, None), asked, wanted) {
        (Err((status, why)), ..) => text(status, stranger(why)),
        (_, Err(_), _) => text(StatusCode::NOT_FOUND, "a file has the number of its run and a name\n".into()),
        (_, _, Err(_)) => text(StatusCode::NOT_FOUND, "a record leaves as one kind of file: ?as=parquet\n".into()),
        (_, Ok(Path((number, file))), Ok(Query(wanted))) => {
            let name = format!("run-{number}-{}", file.rsplit('/').next().unwrap_or_default());
            match wanted.r#as {
                None => match shared.live.run_file(number, &file) {
                    Err(error) => text(StatusCode::NOT_FOUND, format!("{error}\n")),
                    Ok(path) => match tokio::fs::File::open(&path).await {
                        Ok(opened) => leaving(&name, opened),
                        Err(error) => {
                            text(StatusCode::NOT_FOUND, format!("{} cannot be opened ({error})\n", path.display()))
                        }
                    },
                },
                Some(kind) => match converted(&shared, number, file, &kind).await {
                    Ok(file) => leaving(&std::path::Path::new(&name).with_extension(kind).to_string_lossy(), file),
                    Err(why) => text(StatusCode::NOT_FOUND, why),
                },
            }
        }
    };
    secured(answer, ALONE)
}

/// What leaves under this name.
fn leaving(name: &str, from: impl AsyncRead + Send + 'static) -> Response {
    // Of a name only what needs no quotes.
    let name: String = name.chars().filter(|c| c.is_ascii_alphanumeric() || "-_.".contains(*c)).collect();
    let known = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
        (header::CACHE_CONTROL, "no-store".into()),
    ];
    (known, Body::from_stream(ReaderStream::new(from))).into_response()
}

/// The record `file` of a run as another kind of file, one at a time; given up where nobody waits for it any more.
async fn converted(shared: &Arc<Shared>, number: i64, file: String, kind: &str) -> Result<tokio::fs::File, String> {
    let unavailable = || "the bench is ending; ask again once it runs\n".to_owned();
    let _turn = shared.exports.acquire().await.map_err(|_| unavailable())?;
    let cancelled = Arc::new(AtomicBool::new(false));
    let _gone = Gone(cancelled.clone());
    let (shared, kind) = (shared.clone(), kind.to_owned());
    let work = tokio::task::spawn_blocking(move || {
        shared.live.export_run(number, &file, &kind, &Watch::new(cancelled, |_, _| {}))
    });
    let exported = work.await.map_err(|_| unavailable())?;
    exported.map(tokio::fs::File::from_std).map_err(|error| format!("{error}\n"))
}

/// Cancels the work for somebody who is gone.
struct Gone(Arc<AtomicBool>);

impl Drop for Gone {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// A file of what runs, to take along.
pub(super) async fn implementation(
    State(shared): State<Arc<Shared>>,
    file: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
) -> Response {
    let text = |status: StatusCode, text: String| (status, text).into_response();
    let answer = match (shared.door.admit(&headers, None), file) {
        (Err((status, why)), _) => text(status, stranger(why)),
        (_, Err(_)) => text(StatusCode::NOT_FOUND, "a file has a name\n".into()),
        (_, Ok(Path(file))) => {
            let asked = file.clone();
            // Code is generated for it: not on a thread that serves others.
            match tokio::task::spawn_blocking(move || shared.live.implementation_file(&asked)).await {
                Ok(Ok(bytes)) => {
                    let name = file.rsplit('/').next().unwrap_or_default();
                    let kind = if name.ends_with(".svg") { "image/svg+xml" } else { "application/octet-stream" };
                    let known = [
                        (header::CONTENT_TYPE, kind.to_owned()),
                        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
                        (header::CACHE_CONTROL, "no-store".into()),
                    ];
                    (known, bytes).into_response()
                }
                Ok(Err(error)) => text(StatusCode::NOT_FOUND, format!("{error}\n")),
                Err(_) => text(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be made; report it\n".into()),
            }
        }
    };
    secured(answer, ALONE)
}

/// What nobody else may do with it.
fn secured(mut response: Response, policy: &'static str) -> Response {
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

fn answer(shared: &Shared, printed: &Printed, path: &str, headers: &HeaderMap) -> Response {
    let text = |status: StatusCode, text: String| (status, text).into_response();
    if let Err((status, why)) = shared.door.admit_host(headers) {
        return text(status, format!("{why}\n"));
    }
    let file = stickslip_page::file(path);
    // Its files are the same for everybody, and say nothing of this bench.
    if let Some(file) = file.filter(|file| file.path != "index.html") {
        return sent(file, headers);
    }
    if let Some(token) = &printed.token {
        return match shared.door.admit(headers, Some(token)) {
            Ok(()) => {
                let (name, age) = (shared.door.cookie(), COOKIE_AGE);
                let cookie = format!("{name}={token}; HttpOnly; SameSite=Strict; Path=/; Max-Age={age}");
                let place = [(header::SET_COOKIE, cookie), (header::LOCATION, path.to_owned())];
                (StatusCode::SEE_OTHER, place, "").into_response()
            }
            Err((status, why)) => text(status, stranger(why)),
        };
    }
    if let Err((status, why)) = shared.door.admit(headers, None) {
        return text(status, stranger(why));
    }
    match (file, stickslip_page::missing()) {
        (Some(file), _) => sent(file, headers),
        (None, Some(why)) => text(StatusCode::OK, headless(why)),
        (None, None) => text(StatusCode::NOT_FOUND, "there is no such file\n".into()),
    }
}

/// A file of the page, compressed for browsers that accept it.
fn sent(file: &stickslip_page::File, headers: &HeaderMap) -> Response {
    let accepted = headers.get(header::ACCEPT_ENCODING).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let accepts = |name: &str| accepted.split(',').any(|one| one.split(';').next().is_some_and(|n| n.trim() == name));
    let (encoding, bytes) =
        if accepts("gzip") { (Some("gzip"), Cow::Borrowed(file.gzip)) } else { (None, Cow::Owned(file.plain())) };
    let cache = if file.is_immutable() { "public, max-age=31536000, immutable" } else { "no-cache" };
    let known = [
        (header::CONTENT_TYPE, file.content_type()),
        (header::CACHE_CONTROL, cache),
        (header::VARY, "Accept-Encoding"),
    ];
    let mut response = (known, bytes).into_response();
    if let Some(encoding) = encoding {
        response.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static(encoding));
    }
    response
}

/// For who has no token.
fn stranger(why: &str) -> String {
    format!(
        "This is a stickslip bench, and it does not know you yet: {why}.\n\n\
         Open the address that the program printed when it was started, http://…/?token=…\n\
         This browser is then known to it, also after a restart.\n"
    )
}

/// For a program without a page.
fn headless(why: &str) -> String {
    format!(
        "This stickslip was built without its page: {why}.\n\n\
         The bench works all the same, from a terminal (stickslip bench --help) or by calls:\n\
         POST /api with the header Authorization: Bearer TOKEN and a JSON body, as /api/schema describes it,\n\
         or the same over a WebSocket, /api/live?token=TOKEN, where streams come by themselves.\n"
    )
}
