//! What is answered for metrics: the page, and whether the fleet is well.
//!
//! Next file to read: [`super::page`].

use axum::Router;
use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use axum::routing::get;

use super::page::Source;

/// What the page is, by the specification of OpenMetrics.
const OPENMETRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// `/metrics`, `/healthz` (200 while the fleet's network lives) and `/readyz` (200 while a slot can take runs).
pub fn routes(source: Source) -> Router {
    Router::new()
        .route("/metrics", get(metrics))
        .route("/healthz", get(healthy))
        .route("/readyz", get(ready))
        .with_state(source)
}

async fn metrics(State(source): State<Source>) -> Response {
    match source.page() {
        Ok(Some(page)) => ([(CONTENT_TYPE, OPENMETRICS)], page).into_response(),
        Ok(None) => (StatusCode::SERVICE_UNAVAILABLE, "the fleet is closed\n").into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response(),
    }
}

async fn healthy(State(source): State<Source>) -> (StatusCode, &'static str) {
    match source.read() {
        Some(reading) if !reading.has_ended => (StatusCode::OK, "the fleet is open\n"),
        _ => (StatusCode::SERVICE_UNAVAILABLE, "the fleet's network has ended\n"),
    }
}

async fn ready(State(source): State<Source>) -> (StatusCode, &'static str) {
    match source.read() {
        Some(reading) if reading.census.workers > reading.census.aside => {
            (StatusCode::OK, "workers take runs\n")
        }
        Some(_) => (StatusCode::SERVICE_UNAVAILABLE, "no worker takes runs\n"),
        None => (StatusCode::SERVICE_UNAVAILABLE, "the fleet is closed\n"),
    }
}
