//! The lifeline to a supervisor: a standard input that closes when the supervisor ends, however it ends.
//!
//! A worker that still dials has no connection whose end would tell it that its coordinator died; the lifeline does.

use std::io::Read;

use tokio_util::sync::CancellationToken;

/// Cancels when the standard input closes. What arrives on it is thrown away.
pub(crate) fn watch(cancel: CancellationToken) -> std::io::Result<()> {
    let wait = move || {
        let mut buffer = [0; 64];
        while matches!(std::io::stdin().read(&mut buffer), Ok(1..)) {}
        tracing::info!("the supervisor is gone");
        cancel.cancel();
    };
    std::thread::Builder::new().name("lifeline".to_owned()).spawn(wait).map(drop)
}
