//! Which data made a parameter what it is: where its uncertainty fell, and what was observed there.
//!
//! The fall of the logarithm of the standard deviation from one analysis to the next is the information that the analysis brought, in
//! nats, for a parameter that does not drift. Next file to read: [`super::observation`].

use starlings_study::store::{Store, StoreError};

use super::digits;
use super::fleet::of_all;

/// Analyses that are named.
const NAMED: usize = 3;

/// One analysis of the last pass: pass, step, time, estimate, mean and sd in transformed units.
struct At {
    pass: u64,
    step: u64,
    time: f64,
    estimate: f64,
    mean: f64,
    sd: f64,
}

/// The answer about one parameter.
pub(super) fn why(store: &Store, name: &str) -> Result<Vec<String>, StoreError> {
    let quoted = name.replace('\'', "''");
    let course = store.rows(
        &format!(
            "SELECT e.pass, e.step, a.time, e.estimate, e.mean, e.sd FROM estimates e JOIN analyses a ON a.pass = e.pass AND a.step = e.step
             WHERE e.parameter = '{quoted}' ORDER BY e.pass, e.step"
        ),
        |row| {
            Ok(At {
                pass: row.get(0)?,
                step: row.get(1)?,
                time: row.get(2)?,
                estimate: row.get(3)?,
                mean: row.get(4)?,
                sd: row.get(5)?,
            })
        },
    )?;
    let (Some(first), Some(last)) = (course.first(), course.last()) else {
        return Ok(vec!["It has no analysis yet.".to_owned()]);
    };
    let mut says = vec![format!(
        "It went from {} to {}, {} prior sd in the units of the estimation, and {} of its prior sd is left.",
        digits(first.estimate),
        digits(last.estimate),
        digits((last.mean - first.mean) / first.sd),
        of_all(last.sd, first.sd)
    )];
    says.extend(informed(store, &course, last.pass)?);
    Ok(says)
}

/// Where the pass that ended brought the information, and by what.
fn informed(store: &Store, course: &[At], pass: u64) -> Result<Vec<String>, StoreError> {
    let own: Vec<&At> = course.iter().filter(|at| at.pass == pass).collect();
    let fall = |k: usize| (own[k - 1].sd / own[k].sd).ln();
    let falls: Vec<f64> =
        (1..own.len()).map(fall).map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 }).collect();
    let all: f64 = falls.iter().sum();
    if all <= 0.0 {
        return Ok(vec![format!(
            "No analysis of pass {pass} made it more certain: these data say nothing of it by themselves."
        )]);
    }
    let mut sum = 0.0;
    let half = falls.iter().position(|v| {
        sum += v;
        sum >= 0.5 * all
    });
    let mut says = Vec::new();
    if let Some(k) = half {
        says.push(format!("Half of what pass {pass} brought had arrived by {}.", digits(own[k + 1].time)));
    }
    let mut order: Vec<usize> = (0..falls.len()).collect();
    order.sort_by(|i, j| falls[*j].total_cmp(&falls[*i]));
    let mut named = Vec::new();
    for k in order.into_iter().take(NAMED).filter(|k| falls[*k] > 0.0) {
        let at = own[k + 1];
        let observed: Vec<String> = store.rows(
            &format!(
                "SELECT DISTINCT output || ' of ' || record FROM innovations WHERE pass = {} AND step = {}",
                at.pass, at.step
            ),
            |row| row.get(0),
        )?;
        let shown = match observed.len() {
            0 => "no observation".to_owned(),
            n if n > 3 => format!("{n} observations"),
            _ => observed.join(" and "),
        };
        named.push(format!("{} ({shown}, {} of it)", digits(at.time), of_all(falls[k], all)));
    }
    says.push(format!("The analyses that brought most: {}.", named.join("; ")));
    Ok(says)
}
