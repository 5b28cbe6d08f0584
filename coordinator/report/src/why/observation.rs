//! What one observation did: how far it lay from what was expected, and which estimates it moved.
//!
//! Next file to read: [`super::fleet`].

use starlings_study::store::{Store, StoreError};

use super::digits;

/// The nearest observation of an output to a time, or the most surprising one without a time: what it is, and the answer.
pub(super) fn why(
    store: &Store,
    output: &str,
    time: Option<f64>,
) -> Result<(String, Vec<String>), StoreError> {
    let quoted = output.replace('\'', "''");
    let order = time.map_or("abs(innovation / sd) DESC".to_owned(), |time| format!("abs(time - {time:?})"));
    let rows: Vec<(u64, u64, String, f64, f64, f64)> = store.rows(
        &format!(
            "SELECT pass, step, record, time, innovation, sd FROM innovations WHERE output = '{quoted}'
             AND pass = (SELECT max(pass) FROM innovations) AND sd > 0 ORDER BY {order}, rowid LIMIT 1"
        ),
        |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?, row.get(5)?)),
    )?;
    let Some((pass, step, record, time_of, innovation, sd)) = rows.into_iter().next() else {
        return Ok((format!("observation {output}"), vec!["No analysis used it.".to_owned()]));
    };
    let about = format!("observation {output} of {record} at {}", digits(time_of));
    let which = if time.is_some() { "" } else { "Of all in the last pass it surprised the filter most. " };
    let (size, side) = (innovation.abs() / sd, if innovation > 0.0 { "above" } else { "below" });
    let mut says = vec![format!(
        "{which}It lay {} {side} what was expected, {} of the sd that the filter expected of that difference.",
        digits(innovation.abs()),
        digits(size)
    )];
    let moved: Vec<(String, f64)> = store.rows(
        &format!(
            "SELECT e.parameter, (e.mean - b.mean) / b.sd FROM estimates e JOIN estimates b ON b.parameter = e.parameter AND b.pass = e.pass
             AND b.step = e.step - 1 WHERE e.pass = {pass} AND e.step = {step} AND b.sd > 0 ORDER BY abs((e.mean - b.mean) / b.sd) DESC LIMIT 3"
        ),
        |row| Ok((row.get(0)?, row.get(1)?)),
    )?;
    if !moved.is_empty() {
        let words = moved.iter().map(|(name, by)| format!("{name} by {}", digits(*by)));
        says.push(format!(
            "The analysis that used it moved {} of the sd that each had before.",
            words.collect::<Vec<_>>().join(", ")
        ));
    }
    let others: Vec<u64> = store
        .rows(&format!("SELECT count(*) FROM innovations WHERE pass = {pass} AND step = {step}"), |row| {
            row.get(0)
        })?;
    if let Some(n) = others.first().filter(|n| **n > 1) {
        says.push(format!("That analysis used {} others with it.", n - 1));
    }
    Ok((about, says))
}
