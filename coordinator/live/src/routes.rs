//! What is answered over HTTP: the page, its stream, the newest view alone, the report; to whoever has the token in the address.
//!
//! Next file to read: [`mod@super::serve`].

use std::convert::Infallible;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, LOCATION, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
    X_FRAME_OPTIONS,
};
use axum::http::{HeaderName, HeaderValue, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::sse::{Event, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tokio_stream::StreamExt;
use tokio_stream::wrappers::WatchStream;

use super::page::{CSS, HTML, SCRIPT};
use super::serve::Live;

/// Of everything: nothing is fetched from anywhere but here, kept, shown in a frame, or told to others.
const HEADERS: [(HeaderName, HeaderValue); 4] = [
    (CACHE_CONTROL, HeaderValue::from_static("no-store")),
    (REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    (X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
];

/// Of the page: its own style, script and stream.
const POLICY: &str = "default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'; img-src data:; base-uri 'none'; \
                      form-action 'none'; frame-ancestors 'none'";

/// Of the report, which has its style and script in itself.
const REPORT_POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; base-uri 'none'; \
                             form-action 'none'; frame-ancestors 'none'";

/// All of it.
pub(crate) fn routes(live: Live) -> Router {
    Router::new()
        .route("/{token}", get(with_slash))
        .route("/{token}/", get(async || text("text/html; charset=utf-8", HTML)))
        .route("/{token}/page.css", get(async || text("text/css; charset=utf-8", CSS)))
        .route("/{token}/page.js", get(async || text("text/javascript; charset=utf-8", SCRIPT)))
        .route("/{token}/stream", get(stream))
        .route("/{token}/now", get(now))
        .route("/{token}/report", get(report))
        .layer(from_fn_with_state(live.clone(), only_with_token))
        .with_state(live)
}

/// Refuses every address that does not begin with the token.
async fn only_with_token(State(live): State<Live>, request: Request, next: Next) -> Response {
    let offered = request.uri().path().trim_start_matches('/').split('/').next().unwrap_or_default();
    let mut response = if live.token().is(offered.as_bytes()) {
        next.run(request).await
    } else {
        let says =
            "This address lacks the token of the run: take the whole address that the command printed.\n";
        (StatusCode::FORBIDDEN, says).into_response()
    };
    let headers = response.headers_mut();
    headers.extend(HEADERS);
    headers.entry(CONTENT_SECURITY_POLICY).or_insert(HeaderValue::from_static(POLICY));
    response
}

/// The page's own addresses are relative.
async fn with_slash(State(live): State<Live>) -> Response {
    (StatusCode::PERMANENT_REDIRECT, [(LOCATION, format!("/{}/", live.token().digits()))]).into_response()
}

fn text(kind: &'static str, content: &'static str) -> Response {
    ([(CONTENT_TYPE, kind)], content).into_response()
}

/// A view whenever there is something new and the viewer has room for it, until the command is over.
async fn stream(State(live): State<Live>) -> Response {
    let Some(heard) = live.subscribe() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many look at this page\n").into_response();
    };
    // No generation has this number: the first view comes with all points.
    let (mut mark, mut is_over) = ((u64::MAX, 0), false);
    let views = WatchStream::from_changes(heard).map_while(move |()| {
        if is_over {
            return None;
        }
        let sent = live.since(mark);
        (mark, is_over) = (sent.mark, sent.is_last);
        Some(Ok::<_, Infallible>(Event::default().data(sent.text)))
    });
    Sse::new(views).into_response()
}

/// The newest view, for programs.
async fn now(State(live): State<Live>) -> Response {
    // Texts and numbers always have JSON.
    let view = serde_json::to_string(&live.now()).unwrap_or_default();
    ([(CONTENT_TYPE, "application/json")], view).into_response()
}

async fn report(State(live): State<Live>) -> Response {
    let policy = (CONTENT_SECURITY_POLICY, REPORT_POLICY);
    match live.report() {
        Some(Ok(page)) => ([(CONTENT_TYPE, "text/html; charset=utf-8"), policy], page).into_response(),
        Some(Err(error)) => (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response(),
        None => (StatusCode::NOT_FOUND, "there is no report yet\n").into_response(),
    }
}
