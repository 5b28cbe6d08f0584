//! Curves over the observation times, one per parameter, as JSON holds them: `{ "time": [...], "R": [...], ... }`.

use serde::ser::{Serialize, SerializeMap, Serializer};

/// One value per observation time and parameter; times of several records follow each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Observation times.
    pub time: Vec<f64>,
    /// Name and values of each parameter; `None` where there is no such curve.
    pub curves: Vec<(String, Option<Vec<f64>>)>,
}

impl Serialize for Series {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(1 + self.curves.len()))?;
        map.serialize_entry("time", &self.time)?;
        for (name, curve) in &self.curves {
            // The key of the times is taken.
            let key = if name == "time" { "parameter time" } else { name };
            match curve {
                Some(values) => map.serialize_entry(key, values)?,
                None => map.serialize_entry(key, &vec![None::<f64>; self.time.len()])?,
            }
        }
        map.end()
    }
}
