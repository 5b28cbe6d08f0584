//! The signals by which a region is described: a track, its absolute value, or the time, with one value per residual.
//!
//! Next file to read: [`super::scan`].

use starlings_study::Study;

use super::Track;
use super::residuals::Residuals;
use super::result::ends;

/// Signals of the simulation that are tried at most, which limits the time that a field of many components takes.
pub(super) const MOST_TRACKS: usize = 24;

/// What a signal stands for, which decides how it is put in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A track as it is.
    Track,
    /// The absolute value of a track.
    Size,
    /// The time over all records.
    Time,
    /// The time of one record, missing elsewhere.
    RecordTime {
        /// Name of the record.
        record: String,
    },
}

/// One value per residual; NaN where the signal does not exist.
pub(super) struct Signal {
    pub(super) kind: Kind,
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) values: Vec<f64>,
    /// Largest less smallest value.
    pub(super) range: f64,
}

impl Signal {
    fn new(kind: Kind, name: &str, unit: &str, values: Vec<f64>) -> Self {
        let [lo, hi] = ends(values.iter().copied());
        let range = if hi > lo { hi - lo } else { 0.0 };
        Self { kind, name: name.to_owned(), unit: unit.to_owned(), values, range }
    }
}

/// The values of a track at every residual.
pub(super) fn along(track: &Track, group: &Residuals) -> Vec<f64> {
    let of =
        |(r, s): (&usize, &usize)| track.values.get(*r).and_then(|v| v.get(*s)).copied().unwrap_or(f64::NAN);
    group.record.iter().zip(&group.step).map(of).collect()
}

/// Tracks first, then their sizes where the sign changes, then the time; without those that do not vary.
pub(super) fn signals(tracks: &[Track], study: &Study, group: &Residuals) -> Vec<Signal> {
    let mut signals = Vec::new();
    let mut sizes = Vec::new();
    for track in tracks.iter().take(MOST_TRACKS) {
        let values = along(track, group);
        let (below, above) = (values.iter().any(|v| *v < 0.0), values.iter().any(|v| *v > 0.0));
        if below && above {
            let size = values.iter().map(|v| v.abs()).collect();
            sizes.push(Signal::new(Kind::Size, &track.name, &track.unit, size));
        }
        signals.push(Signal::new(Kind::Track, &track.name, &track.unit, values));
    }
    signals.append(&mut sizes);
    let unit = &study.time_unit;
    let mut records = group.record.clone();
    records.dedup();
    signals.push(Signal::new(Kind::Time, "t", unit, group.time.clone()));
    for &record in records.iter().filter(|_| records.len() > 1) {
        let own = |(t, r): (&f64, &usize)| if *r == record { *t } else { f64::NAN };
        let values = group.time.iter().zip(&group.record).map(own).collect();
        let kind = Kind::RecordTime { record: study.records[record].name.clone() };
        signals.push(Signal::new(kind, "t", unit, values));
    }
    signals.retain(|s| s.range > 0.0);
    signals
}
