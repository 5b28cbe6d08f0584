//! Ctrl-C, and the signals by which systems end programs: what was started is ended, and the exit code says which it was.
//!
//! The first signal cancels the work of the fleet, so that the command ends in order; before there is a fleet, and at the
//! second signal, the process ends at once, and the guard ends its solvers. Next file to read: [`crate::fleet_session`].

use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Mutex, Once, PoisonError, mpsc};

use tokio_util::sync::CancellationToken;

use crate::console::note;
use crate::failure::Failure;

/// What a shell adds to the number of the signal that ended a program: 130 for Ctrl-C.
const ENDED_BY: u8 = 128;

/// Number of the first signal; zero before it.
static ASKED: AtomicU8 = AtomicU8::new(0);

/// What the first signal cancels.
static WORK: Mutex<Option<CancellationToken>> = Mutex::new(None);

/// From here on signals end this command in order.
pub(crate) fn watch() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let (ready, is_ready) = mpsc::channel();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            // Without a runtime a signal ends the process, as if nobody watched.
            let Ok(runtime) = runtime else { return };
            runtime.block_on(wait(&ready));
        });
        // An error means that nobody watches.
        let _ = is_ready.recv();
    });
}

/// From here on the end of standard input ends this command in order too: whoever started it is gone.
pub(crate) fn at_end_of_stdin() {
    watch();
    std::thread::spawn(|| {
        // What arrives there is nobody's: a command that reads standard input is not started so.
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        first(HANGUP);
    });
}

/// The first signal cancels this from now on.
pub(crate) fn cancels(token: &CancellationToken) {
    watch();
    *WORK.lock().unwrap_or_else(PoisonError::into_inner) = Some(token.clone());
    if ASKED.load(Ordering::SeqCst) > 0 {
        token.cancel();
    }
}

/// The end of a command whose work was cancelled, with the way to go on.
pub(crate) fn failure(remedy: &str) -> Failure {
    let signal = match ASKED.load(Ordering::SeqCst) {
        0 => INTERRUPT,
        signal => signal,
    };
    let message =
        format!("interrupted by {}: everything that was started is ended\n  {remedy}", name(signal));
    Failure::Interrupted { message, code: ENDED_BY + signal }
}

fn first(signal: u8) {
    ASKED.store(signal, Ordering::SeqCst);
    if let Some(token) = &*WORK.lock().unwrap_or_else(PoisonError::into_inner) {
        token.cancel();
        return;
    }
    note(format_args!("error: interrupted by {} before anything was computed: start again", name(signal)));
    std::process::exit((ENDED_BY + signal).into());
}

const HANGUP: u8 = 1;
const INTERRUPT: u8 = 2;

fn name(signal: u8) -> &'static str {
    match signal {
        HANGUP => "SIGHUP",
        15 => "SIGTERM",
        _ => "Ctrl-C",
    }
}

#[cfg(unix)]
async fn wait(ready: &mpsc::Sender<()>) {
    use tokio::signal::unix::{SignalKind, signal};
    let kinds = [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()];
    let [Ok(mut interrupt), Ok(mut terminate), Ok(mut hangup)] = kinds.map(signal) else { return };
    // Whoever waits has ended otherwise.
    let _ = ready.send(());
    let mut next = async || {
        tokio::select! {
            _ = interrupt.recv() => INTERRUPT,
            _ = terminate.recv() => 15,
            _ = hangup.recv() => HANGUP,
        }
    };
    first(next().await);
    let second = next().await;
    std::process::exit((ENDED_BY + second).into());
}

#[cfg(not(unix))]
async fn wait(ready: &mpsc::Sender<()>) {
    let _ = ready.send(());
    if tokio::signal::ctrl_c().await.is_ok() {
        first(INTERRUPT);
        let _ = tokio::signal::ctrl_c().await;
        std::process::exit((ENDED_BY + INTERRUPT).into());
    }
}
