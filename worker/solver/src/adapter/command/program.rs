//! One program from its start to its end: written to, listened to, waited for.
//!
//! Its standard output is read while it runs, since a full pipe would stop it. Next file to read: [`super::super::super::process`].

use std::io::{Read, Write};
use std::process::ExitStatus;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use starlings_models::Stop;

use crate::process::Process;
use crate::stopwatch::{Stopwatch, Time};

/// Bytes of standard output that are remembered.
pub(super) const LIMIT: usize = 64 * 1024 * 1024;

/// How often a program that keeps its standard output open is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// How often it is looked whether anybody still wants the answer.
const STOP_LOOK: Duration = Duration::from_millis(100);
/// How long a program that has closed its standard output and ended may leave that output unread.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// What a program wrote to its standard output.
#[derive(Default)]
pub(super) struct Output {
    pub(super) bytes: Vec<u8>,
    /// Whether more came than is remembered.
    pub(super) cut: bool,
}

/// How a program ended that was waited for.
#[derive(Clone, Copy)]
pub(super) enum End {
    /// By itself, or by somebody's signal.
    Ended(ExitStatus),
    /// It took longer than it may.
    Late,
    /// Somebody stopped it for as long as it may take.
    Stopped,
    /// Nobody wanted its answer any more.
    Unwanted,
}

/// Runs a started program to its end: `input` goes to its standard input.
pub(super) fn to_its_end(
    process: &mut Process,
    input: Vec<u8>,
    patience: Duration,
    stop: Option<&Stop>,
) -> (End, Output) {
    let mut watch = Stopwatch::start(patience, Instant::now());
    if let Some(mut pipe) = process.input() {
        // A program that reads nothing is none the worse: its pipe breaks when it ends.
        std::thread::spawn(move || drop(pipe.write_all(&input)));
    }
    let output = Arc::new(Mutex::new(Output::default()));
    let read_up = drain(process, &output);
    let mut is_open = true;
    let end = loop {
        if stop.is_some_and(Stop::is_set) {
            break End::Unwanted;
        }
        let left = match watch.look(Instant::now(), || process.is_stopped()) {
            Time::Left(left) => left,
            Time::Up => break End::Late,
            Time::Stopped => break End::Stopped,
        };
        if is_open {
            // Most programs close their output by ending, which wakes this at once.
            is_open = matches!(read_up.recv_timeout(LOOK.min(left)), Err(RecvTimeoutError::Timeout));
        }
        let status = if is_open { process.ended() } else { process.wait(left.min(STOP_LOOK)) };
        if let Some(status) = status {
            break End::Ended(status);
        }
    };
    if is_open && matches!(end, End::Ended(_)) {
        // Something that the program started holds the pipe: asking for the tail ends the whole group.
        process.tail();
        let _ = read_up.recv_timeout(LAST_WORDS);
    }
    let output = std::mem::take(&mut *output.lock().unwrap_or_else(PoisonError::into_inner));
    (end, output)
}

/// Reads the standard output on a thread; the receiver wakes when it is closed.
fn drain(process: &mut Process, output: &Arc<Mutex<Output>>) -> Receiver<()> {
    let (done, read_up) = channel();
    if let Some(mut pipe) = process.output() {
        let output = Arc::clone(output);
        std::thread::spawn(move || {
            let mut piece = vec![0; 64 * 1024];
            while let Ok(n) = pipe.read(&mut piece) {
                if n == 0 {
                    break;
                }
                let mut output = output.lock().unwrap_or_else(PoisonError::into_inner);
                let room = LIMIT - output.bytes.len();
                output.cut |= n > room;
                output.bytes.extend_from_slice(&piece[..n.min(room)]);
            }
            drop(done);
        });
    }
    read_up
}
