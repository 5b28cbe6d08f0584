//! Memory and disk of long recordings: `starlings run` and `starlings explain` on 40 000 rows, as processes of their own.
//!
//! Prints the peak resident memory of the coordinating process (`VmHWM` of /proc, so Linux only; workers not included) and the
//! size of `run.db`. `cargo bench --bench memory`, with another number of rows as an argument.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A mass on a spring whose force is not quite linear: the study lacks the cube.
const STUDY: &str = include_str!("../coordinator/tests/study_kit/spring.toml");

fn main() {
    let rows = std::env::args().find_map(|a| a.parse().ok()).unwrap_or(40_000);
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    let span = format!("train = [0.0, {}]\n", 0.008 * rows as f64);
    fs::write(&study, format!("{STUDY}{span}")).unwrap();
    fs::write(folder.path().join("driven.csv"), recording(rows)).unwrap();
    println!("{rows} rows, two parameters, two workers");
    println!("{:8} {:>12} {:>12} {:>9}", "command", "peak memory", "run.db", "time");
    for command in ["run", "explain"] {
        let out = folder.path().join(command);
        let began = Instant::now();
        let peak = peak_of(command, &study, &out);
        let size = fs::metadata(out.join("run.db")).unwrap().len();
        let (peak, size) = (peak as f64 / 1024.0, size as f64 / 1e6);
        println!("{command:8} {peak:>8.1} MiB {size:>9.1} MB {:>7.1} s", began.elapsed().as_secs_f64());
    }
}

/// Peak resident memory in KiB. The figure only grows, so the last one that was seen is the peak but for what the last
/// hundredth of a second adds.
fn peak_of(command: &str, study: &Path, out: &Path) -> u64 {
    let mut child = Command::new(env!("CARGO_BIN_EXE_starlings"))
        .args([command.as_ref(), study.as_os_str(), "--out".as_ref(), out.as_os_str()])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut peak = 0;
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "{command}: {status}");
            return peak;
        }
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak = line.and_then(|l| l.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(peak);
        sleep(Duration::from_millis(10));
    }
}

/// The mass driven by two frequencies, by steps of a symplectic rule ten times finer than the rows, with noise.
fn recording(rows: usize) -> String {
    let force = |t: f64| (1.3 * t).sin() + 0.5 * (3.1 * t + 0.4).sin();
    let (mut x, mut v, mut state) = (0.08_f64, 0.0, 1_u64);
    let mut noise = || {
        // Twelve uniform numbers have variance one.
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    };
    let mut text = "time,F,position\n".to_owned();
    for i in 0..rows {
        let t = 0.01 * i as f64;
        writeln!(text, "{t:.2},{:.8},{:.8}", force(t), x + 0.002 * noise()).unwrap();
        for k in 0..10 {
            v += 1e-3 * (force(t + 1e-3 * f64::from(k)) - 40.0 * x - v - 300.0 * x.powi(3));
            x += 1e-3 * v;
        }
    }
    text
}
