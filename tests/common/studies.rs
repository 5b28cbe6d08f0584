//! Studies of built-in models that take their time, or have large states.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A batch fit of native runs that take about a tenth of a second each, with so many recordings.
pub(crate) fn slow(folder: &Path, records: usize) -> PathBuf {
    let data: String = (0..8).fold("time,y\n".to_owned(), |mut text, i| {
        let t = 0.5 * f64::from(i);
        let _ = writeln!(text, "{t},{}", 0.3 + 0.9 * t - 0.2 * t * t);
        text
    });
    std::fs::write(folder.join("data.csv"), data).unwrap();
    let records = (0..records).fold(String::new(), |mut text, i| {
        let channel = "{ column = \"y\", output = \"y\", noise = 0.1 }";
        let _ = write!(text, "[[records]]\nname = \"r{i}\"\nfile = \"data.csv\"\nchannels = [{channel}]\n");
        text
    });
    // The fast term costs steps of integration and moves nothing.
    let study = format!(
        r#"[study]
name = "slow"
[model]
kind = "equations"
outputs = [ {{ name = "y", value = "x" }} ]
[[model.states]]
name = "x"
initial = 0.3
rate = "a + b*t + sin(150000*t)"
[[parameters]]
name = "a"
prior = {{ transform = "linear", median = 0.5, sd = 1.0 }}
[[parameters]]
name = "b"
prior = {{ transform = "linear", median = 0.0, sd = 1.0 }}
{records}
[estimator]
kind = "batch"
"#
    );
    let file = folder.join("study.toml");
    std::fs::write(&file, study).unwrap();
    file
}

/// A tube of 20 000 rings, whose state has 320 kB, seen through the pressure at its inlet in every other of so many steps.
pub(crate) fn long_tube(folder: &Path, steps: u32) -> PathBuf {
    let text = r#"
[study]
name = "long-tube"
[model]
kind = "fsi-tube"
[model.layout]
cells = 20000
regions = 2
[[parameters]]
name = "E1"
unit = "dyn/cm^2"
prior = { transform = "log2", median = 5e6, sd = 0.5 }
[[parameters]]
name = "E2"
unit = "dyn/cm^2"
prior = { transform = "log2", median = 5e6, sd = 0.5 }
[[records]]
name = "rise"
file = "pressure.csv"
time = "time"
inputs = { flow = "flow.csv:flow" }
channels = [ { column = "p", output = "inlet_pressure", unit = "dyn/cm^2", noise = 1e4 } ]
[estimator]
passes = 1
"#;
    let (mut pressure, mut flow) = ("time,p\n".to_owned(), "time,flow\n".to_owned());
    for step in 0..=steps {
        let t = f64::from(step) * 0.001;
        writeln!(flow, "{t},{}", 3.0 * f64::from(step.min(20))).unwrap();
        if step > 0 && step % 2 == 0 {
            writeln!(pressure, "{t},{}", 106_657.6 + 4e5 * t).unwrap();
        }
    }
    std::fs::write(folder.join("study.toml"), text).unwrap();
    std::fs::write(folder.join("pressure.csv"), pressure).unwrap();
    std::fs::write(folder.join("flow.csv"), flow).unwrap();
    folder.join("study.toml")
}
