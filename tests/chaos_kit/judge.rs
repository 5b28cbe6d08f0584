//! What the store of a run says, and what is asked of it.

use std::collections::HashSet;
use std::path::Path;

use rusqlite::{Connection, OpenFlags};
use starlings_proto::convert::ended;

fn open(out: &Path) -> rusqlite::Result<Connection> {
    Connection::open_with_flags(out.join("run.db"), OpenFlags::SQLITE_OPEN_READ_ONLY)
}

/// A number that the store knows.
pub(crate) fn count(out: &Path, sql: &str) -> Option<i64> {
    open(out).and_then(|db| db.query_row(sql, [], |row| row.get(0))).ok()
}

/// Runs that are stored.
pub(crate) fn progress(out: &Path) -> i64 {
    count(out, "SELECT (SELECT count(*) FROM jobs) + (SELECT count(*) FROM arrived_runs)").unwrap_or(0)
}

/// Runs that are acknowledged and in no analysis yet, each by the processor time that it took: a run that was made again took
/// another time.
pub(crate) fn acknowledged(out: &Path) -> rusqlite::Result<HashSet<u64>> {
    let db = open(out)?;
    let mut select = db.prepare("SELECT body FROM arrived_runs")?;
    let bodies = select.query_map([], |row| row.get::<_, Vec<u8>>(0))?.collect::<Result<Vec<_>, _>>()?;
    let cost =
        |body: Vec<u8>| ended::decode(&body).unwrap().0.ok().map(|prediction| prediction.cost.to_bits());
    Ok(bodies.into_iter().filter_map(cost).collect())
}

/// Those of them that no analysis used.
pub(crate) fn lost(out: &Path, acknowledged: &HashSet<u64>) -> rusqlite::Result<usize> {
    let db = open(out)?;
    let mut select = db.prepare("SELECT cost_s FROM jobs")?;
    let costs = select.query_map([], |row| row.get::<_, f64>(0))?;
    let used = costs.map(|cost| cost.map(f64::to_bits)).collect::<Result<HashSet<_>, _>>()?;
    Ok(acknowledged.difference(&used).count())
}
