//! The times of predictions: those of the record, and regular ones between them.

use crate::Record;

/// The record's times, and with a step also its start and every multiple of the step after it up to the last time.
pub(crate) fn times_of(record: &Record, step: Option<f64>) -> Vec<f64> {
    let mut times = record.times.clone();
    let (Some(step), Some(&end)) = (step, record.times.last()) else { return times };
    let near = 1e-9 * step;
    let n = ((end - record.start) / step + 1e-9).floor().max(0.0) as usize;
    // A time of the record stands for one that is within a rounding of it.
    let is_new = |time: &f64| {
        let place = record.times.partition_point(|t| *t < time - near);
        record.times.get(place).is_none_or(|t| *t > time + near)
    };
    times.extend((0..=n).map(|k| step.mul_add(k as f64, record.start)).filter(is_new));
    times.sort_by(f64::total_cmp);
    times
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;

    #[test]
    fn a_step_fills_the_record_and_moves_none_of_its_times() {
        let record = Record {
            name: "r".to_owned(),
            start: 0.0,
            times: vec![0.3, 0.35, 0.7],
            channels: Vec::new(),
            inputs: Vec::new(),
            train: None,
            only_start: false,
            every: 1,
        };
        assert_eq!(times_of(&record, None), record.times);
        // 3 · 0.1 is not 0.3 to the last bit, and 7 · 0.1 is not 0.7: the record's own numbers stay.
        let filled = times_of(&record, Some(0.1));
        let wanted = [0.0, 0.1, 0.2, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7];
        assert_eq!(filled.len(), wanted.len());
        assert!(record.times.iter().all(|t| filled.contains(t)), "{filled:?}");
        assert!(filled.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-15), "{filled:?}");
    }
}
