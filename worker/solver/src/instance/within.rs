//! An answer in time, as long as anybody wants it.

use std::pin::pin;
use std::time::{Duration, Instant};

use starlings_models::Stop;

use super::How;
use crate::process::Process;
use crate::stopwatch::{Stopwatch, Time};

/// How often it is looked whether anybody still wants the answer.
const STOP_LOOK: Duration = Duration::from_millis(100);

/// An answer within so much time, in which the program was not stopped.
pub(super) async fn within<T>(
    patience: Duration,
    stop: Option<&Stop>,
    process: Option<&Process>,
    answer: impl Future<Output = T>,
) -> Result<T, How> {
    let mut watch = Stopwatch::start(patience, Instant::now());
    let mut answer = pin!(answer);
    loop {
        if stop.is_some_and(Stop::is_set) {
            return Err(How::Unwanted);
        }
        match watch.look(Instant::now(), || process.is_some_and(Process::is_stopped)) {
            Time::Left(left) => {
                if let Ok(answer) = tokio::time::timeout(left.min(STOP_LOOK), &mut answer).await {
                    return Ok(answer);
                }
            }
            Time::Up => return Err(How::Silent),
            Time::Stopped => return Err(How::Stopped),
        }
    }
}
