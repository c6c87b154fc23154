//! Samples of the scope: saved as captures, read again, exported for other programs. The page sends and receives them as
//! bytes (`crates/recording/src/samples.rs`); files are written here.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use axum::body::Bytes;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{FromRequest as _, Path, Query, Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use serde::Deserialize;
use serde_json::json;
use stickslip::Watch;

use super::connections::Connection;
use super::http::{Shared, refused};
use super::page::{CancelOnDrop, download};

/// Largest samples [bytes]: the memory of the page.
pub(super) const LARGEST_SAMPLES: usize = 256 << 20;

/// Name of a capture.
#[derive(Deserialize)]
pub(super) struct NameQuery {
    name: String,
}

/// Saves samples as a capture; the answer has the number of its run.
pub(super) async fn keep(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    query: Result<Query<NameQuery>, QueryRejection>,
    request: Request,
) -> Response {
    let bytes = match body(&shared, &connection, request).await {
        Ok(bytes) => bytes,
        Err(refusal) => return refusal,
    };
    let Ok(Query(NameQuery { name })) = query else {
        return refused(StatusCode::BAD_REQUEST, "the name of the capture is missing: ?name=NAME".into());
    };
    let kept = tokio::task::spawn_blocking(move || shared.live.keep_samples(&name, &bytes)).await;
    connection.wait();
    match kept {
        Ok(Ok(run)) => Json(json!({ "run": run })).into_response(),
        Ok(Err(error)) => refused(StatusCode::UNPROCESSABLE_ENTITY, error.to_string()),
        Err(_) => refused(StatusCode::INTERNAL_SERVER_ERROR, "the capture was not saved; please report it".into()),
    }
}

/// Samples of a saved capture.
pub(super) async fn kept(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    number: Result<Path<i64>, PathRejection>,
    request: Request,
) -> Response {
    if let Err((status, reason)) = shared.door.admit(request.headers(), None) {
        return refused(status, reason.into());
    }
    let Ok(Path(number)) = number else {
        return refused(StatusCode::NOT_FOUND, "invalid address of a capture: use /scope/captures/NUMBER".into());
    };
    connection.work();
    let bytes = tokio::task::spawn_blocking(move || shared.live.kept_samples(number)).await;
    connection.wait();
    match bytes {
        Ok(Ok(bytes)) => {
            ([(header::CONTENT_TYPE, "application/octet-stream"), (header::CACHE_CONTROL, "no-store")], bytes)
                .into_response()
        }
        Ok(Err(error)) => refused(StatusCode::NOT_FOUND, error.to_string()),
        Err(_) => refused(StatusCode::INTERNAL_SERVER_ERROR, "the capture was not read; please report it".into()),
    }
}

/// Samples as a file for other programs. One conversion runs at a time; it is cancelled when the client disconnects.
pub(super) async fn export(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    kind: Result<Path<String>, PathRejection>,
    request: Request,
) -> Response {
    let bytes = match body(&shared, &connection, request).await {
        Ok(bytes) => bytes,
        Err(refusal) => return refusal,
    };
    let Ok(Path(kind)) = kind else { return refused(StatusCode::NOT_FOUND, "use /scope/export/KIND".into()) };
    let name = format!("scope.{kind}");
    let gone = || refused(StatusCode::INTERNAL_SERVER_ERROR, "the file was not written; please report it".into());
    let Ok(_permit) = shared.exports.acquire().await else { return gone() };
    let cancelled = Arc::new(AtomicBool::new(false));
    let _cancel = CancelOnDrop(cancelled.clone());
    let live = shared.live.clone();
    let watch = Watch::new(cancelled, |_, _| {});
    match tokio::task::spawn_blocking(move || live.export_samples(&bytes, &kind, &watch)).await {
        Ok(Ok(file)) => download(&name, tokio::fs::File::from_std(file)),
        Ok(Err(error)) => refused(StatusCode::UNPROCESSABLE_ENTITY, error.to_string()),
        Err(_) => gone(),
    }
}

/// The body of an admitted request.
async fn body(shared: &Shared, connection: &Connection, request: Request) -> Result<Bytes, Response> {
    // Before the body: a client without the token sends none.
    shared.door.admit(request.headers(), None).map_err(|(status, reason)| refused(status, reason.into()))?;
    // Forms of other pages cannot send this type.
    let kind = request.headers().get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok());
    if kind != Some("application/octet-stream") {
        let message = "send bytes: Content-Type: application/octet-stream";
        return Err(refused(StatusCode::UNSUPPORTED_MEDIA_TYPE, message.into()));
    }
    connection.work();
    Bytes::from_request(request, &()).await.map_err(|rejection| refused(rejection.status(), rejection.body_text()))
}
