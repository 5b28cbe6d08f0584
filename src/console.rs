//! What people read on a terminal: text on standard output, aligned tables, numbers of the digits they deserve.
//!
//! Every command writes to standard output through `line`, `text` or `lost`: a reader that stops early, as `head`
//! does, ends the command quietly. What is for people only goes to standard error through [`note`]. Next file to read: [`mod@fitted`].

mod fitted;

use std::fmt::Display;
use std::io::{self, ErrorKind, IsTerminal, Write};

pub(crate) use self::fitted::fitted;
use crate::failure::Failure;
pub(crate) use crate::note::note;
use crate::plain::Plain;

/// Writes a line to standard output.
pub(crate) fn line(content: impl Display) -> Result<(), Failure> {
    text(format_args!("{content}\n"))
}

/// Writes to standard output, without an end of line of its own.
pub(crate) fn text(content: impl Display) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    // What goes into a file or another program arrives as it is.
    let written =
        if out.is_terminal() { write!(out, "{}", Plain(content)) } else { write!(out, "{content}") };
    written.and_then(|()| out.flush()).map_err(|e| lost(&e))
}

/// What a failed write to standard output means.
pub(crate) fn lost(error: &io::Error) -> Failure {
    match error.kind() {
        ErrorKind::BrokenPipe => Failure::Unread,
        _ => Failure::run(format!("cannot write to standard output: {error}")),
    }
}

/// A table with aligned columns: the first row is the heading, columns after the first are right-aligned when `numeric`.
pub(crate) fn table(rows: &[Vec<String>], numeric: bool) -> String {
    let n = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width: Vec<usize> = (0..n)
        .map(|c| rows.iter().filter_map(|r| r.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> = row
            .iter()
            .enumerate()
            .map(|(c, cell)| {
                let pad = " ".repeat(width[c] - cell.chars().count());
                if numeric && c > 0 { format!("{pad}{cell}") } else { format!("{cell}{pad}") }
            })
            .collect();
        text.push_str("  ");
        text.push_str(cells.join("  ").trim_end());
        text.push('\n');
    }
    text
}

/// A number with as many significant digits as `sd` justifies (two digits of the sd), or five without one.
pub(crate) fn number(value: f64, sd: Option<f64>) -> String {
    let magnitude = |v: f64| v.abs().log10().floor() as i32;
    let decimals = match sd {
        Some(sd) if sd > 0.0 && sd.is_finite() => 1 - magnitude(sd),
        _ if value.abs() > 0.0 => 4 - magnitude(value),
        _ => 0,
    };
    if value.abs() > 0.0 && !(-4..6).contains(&magnitude(value)) {
        let digits = (decimals + magnitude(value)).clamp(1, 12) as usize;
        format!("{value:.digits$e}")
    } else {
        format!("{value:.*}", decimals.clamp(0, 12) as usize)
    }
}

/// Cancels the token on Ctrl-C or a termination signal; a second one ends the process at once.
pub(crate) fn cancel_on_signal(token: &tokio_util::sync::CancellationToken) {
    let token = token.clone();
    std::thread::spawn(move || {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else { return };
        runtime.block_on(async {
            signal().await;
            token.cancel();
            signal().await;
            std::process::exit(130);
        });
    });
}

#[cfg(unix)]
async fn signal() {
    use tokio::signal::unix::{SignalKind, signal};
    let (Ok(mut terminate), Ok(mut hangup)) = (signal(SignalKind::terminate()), signal(SignalKind::hangup()))
    else {
        return std::future::pending().await;
    };
    tokio::select! {
        _ = tokio::signal::ctrl_c() => {}
        _ = terminate.recv() => {}
        _ = hangup.recv() => {}
    }
}

#[cfg(not(unix))]
async fn signal() {
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}
