//! Where the program's closed loop differs from the imported one, it is by the program's own steps: its scheme written out gives its digits,
//! and goes to the same waveforms in smaller steps.

use std::process::Command;

use super::{Table, VESSEL, difference, file, results, table};

/// What the scheme of svZeroDSolver computes in so many steps per period.
fn in_steps(steps: u32) -> Table {
    let mut python = Command::new("python3");
    python.arg(file("svzerodsolver/closed_loop_scheme.py")).arg(steps.to_string());
    let done = python.env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    table(&String::from_utf8(done.stdout).unwrap())
}

#[test]
fn the_programs_closed_loop_differs_by_its_steps() {
    let fine = std::fs::read_to_string(file("svzerodsolver/closedLoopHeart_singleVessel_fine.csv")).unwrap();
    let fine = table(&fine);
    let [own, quarter] = [in_steps(99), in_steps(396)];
    for column in ["flow_in", "pressure_in", "pressure_out"] {
        let (times, wanted) = results("closedLoopHeart_singleVessel", VESSEL, column);
        let most = difference(&own, column, &times, &wanted);
        assert!(most < 1e-9, "{column}: the scheme is off its results by {most}");
        let [coarse, closer] =
            [&own, &quarter].map(|of| difference(of, column, &fine["time"], &fine[column]));
        assert!(coarse > 0.1 && closer < 0.1 * coarse, "{column}: {coarse}, then {closer}");
    }
}
