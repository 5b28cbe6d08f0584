//! What a run costs beyond starting its program. `cargo test -p starlings-solver --test command -- --ignored --nocapture`

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::{Bench, job};

/// Runs that are timed.
const RUNS: u32 = 300;

fn median(mut one: impl FnMut()) -> Duration {
    let mut spent: Vec<Duration> = (0..RUNS)
        .map(|_| {
            let started = Instant::now();
            one();
            started.elapsed()
        })
        .collect();
    spent.sort();
    spent[spent.len() / 2]
}

#[test]
#[ignore = "a measurement"]
fn a_run_costs_at_most_3_ms_beyond_fork_and_exec() {
    let bench = Bench::new("", &[("tip", "column:-:1")]).command(&["/bin/echo", "{k}"]);
    let forward = bench.forward().unwrap();
    let job = job(1.5, &[1.0], 1, &[0.0]);
    let bare = median(|| {
        let mut command = Command::new("/bin/echo");
        command.arg("1.5").stdin(Stdio::null()).stderr(Stdio::null());
        assert!(command.output().unwrap().status.success());
    });
    let run = median(|| assert_eq!(forward.run(&job).unwrap().outputs, [1.5]));
    println!("fork and exec {bare:?}, a run {run:?}, beyond it {:?}", run.saturating_sub(bare));
    assert!(run.saturating_sub(bare) <= Duration::from_millis(3));
}
