//! The burning surface of a grain and the free volume that it leaves, against the distance burnt.
//!
//! Lengths are the caller's: metres, or radii of the bore. Ends that burn, segments and slots enter as a table. Next file to read:
//! [`super::nozzle`].

use serde::Deserialize;
use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

/// How the burning surface follows the distance burnt.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Grain {
    /// A cylindrical bore that burns on its whole surface: the surface grows with the radius.
    #[default]
    Cylinder,
    /// A surface that stays as it is at the start.
    Neutral,
    /// A surface that is given, linear between the points of a table.
    Table(Table),
}

/// Burning area against the distance burnt.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Table {
    /// Distances burnt, the first one zero, increasing.
    pub web: Vec<f64>,
    /// Burning areas there; nothing burns beyond the last one.
    pub area: Vec<f64>,
}

/// A bore at the start: its radius and π times its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bore {
    pub(crate) radius: f64,
    pub(crate) pi_length: f64,
}

/// Points of a table at most.
const MOST_POINTS: usize = 1000;

impl Grain {
    /// Refuses a table that is none.
    ///
    /// # Errors
    /// [`SetupError::Layout`] with the place.
    pub(crate) fn check(&self) -> Result<(), SetupError> {
        let Self::Table(Table { web, area }) = self else { return Ok(()) };
        let n = web.len();
        if !(2..=MOST_POINTS).contains(&n) || area.len() != n {
            let message = format!("{n} distances and {} areas: give 2 to {MOST_POINTS} of each", area.len());
            return Err(fault("grain.table", message));
        }
        let increasing = web[0].abs() < f64::MIN_POSITIVE && web.windows(2).all(|pair| pair[0] < pair[1]);
        if !increasing || !web[n - 1].is_finite() {
            return Err(fault("grain.table.web", "distances must be numbers that start at 0 and increase"));
        }
        match area.iter().position(|area| !(*area >= 0.0 && area.is_finite())) {
            Some(i) => Err(fault(
                &format!("grain.table.area[{i}]"),
                format!("the area is {}: give 0 or more", area[i]),
            )),
            None => Ok(()),
        }
    }

    /// Distances burnt at which the surface has a kink.
    pub(crate) fn kinks(&self) -> &[f64] {
        match self {
            Self::Table(table) => &table.web[1..],
            Self::Cylinder | Self::Neutral => &[],
        }
    }

    /// Burning area at a distance burnt.
    pub(crate) fn area(&self, bore: Bore, web: f64) -> f64 {
        match self {
            Self::Cylinder => 2.0 * bore.pi_length * (bore.radius + web),
            Self::Neutral => 2.0 * bore.pi_length * bore.radius,
            Self::Table(table) => table.area(web),
        }
    }

    /// Free volume at a distance burnt: that of the bore at the start, and what has burnt.
    pub(crate) fn volume(&self, bore: Bore, web: f64) -> f64 {
        let start = bore.pi_length * bore.radius * bore.radius;
        match self {
            Self::Cylinder => bore.pi_length * (bore.radius + web).powi(2),
            Self::Neutral => start + 2.0 * bore.pi_length * bore.radius * web,
            Self::Table(table) => start + table.burnt(web),
        }
    }
}

impl Table {
    fn area(&self, web: f64) -> f64 {
        match self.web.partition_point(|w| *w <= web) {
            0 => self.area[0],
            k if k == self.web.len() => 0.0,
            k => self.at(k, web),
        }
    }

    /// Area between points k − 1 and k.
    fn at(&self, k: usize, web: f64) -> f64 {
        let share = (web - self.web[k - 1]) / (self.web[k] - self.web[k - 1]);
        self.area[k - 1] + share * (self.area[k] - self.area[k - 1])
    }

    /// Integral of the area from the start.
    fn burnt(&self, web: f64) -> f64 {
        let mut sum = web.min(0.0) * self.area[0];
        for k in 1..self.web.len() {
            let from = self.web[k - 1];
            if web <= from {
                break;
            }
            let to = web.min(self.web[k]);
            sum += 0.5 * (to - from) * (self.area[k - 1] + self.at(k, to));
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BORE: Bore = Bore { radius: 2.0, pi_length: 3.0 };

    fn table(web: &[f64], area: &[f64]) -> Grain {
        Grain::Table(Table { web: web.to_vec(), area: area.to_vec() })
    }

    #[test]
    fn the_free_volume_grows_by_what_the_surface_burns() {
        let grains = [Grain::Cylinder, Grain::Neutral, table(&[0.0, 1.0, 3.0], &[12.0, 30.0, 6.0])];
        for grain in grains {
            for web in [0.1, 0.9, 1.7, 2.9] {
                let h = 1e-4;
                let rate = (grain.volume(BORE, web + h) - grain.volume(BORE, web - h)) / (2.0 * h);
                // The volume is quadratic between kinks, so that the central difference is exact but for rounding.
                assert!((rate - grain.area(BORE, web)).abs() < 1e-7, "{grain:?} at {web}: {rate}");
            }
            assert!((grain.volume(BORE, 0.0) - 12.0).abs() < 1e-14, "{grain:?}");
        }
    }

    #[test]
    fn a_table_with_the_areas_of_a_cylinder_is_the_cylinder() {
        let grain = table(&[0.0, 5.0], &[12.0, 42.0]);
        for web in [0.0, 1.3, 4.9] {
            assert!((grain.area(BORE, web) - Grain::Cylinder.area(BORE, web)).abs() < 1e-13);
            assert!((grain.volume(BORE, web) - Grain::Cylinder.volume(BORE, web)).abs() < 1e-12);
        }
        assert!(grain.area(BORE, 5.0).abs() < f64::EPSILON, "nothing burns beyond the last point");
    }

    #[test]
    fn a_table_that_is_none_is_refused_at_its_place() {
        let told = |grain: Grain| grain.check().map_err(|error| error.to_string()).unwrap_err();
        assert!(told(table(&[0.0], &[1.0])).contains("`grain.table`: 1 distances and 1 areas"));
        assert!(told(table(&[0.0, 1.0, 1.0], &[1.0; 3])).contains("`grain.table.web`"));
        assert!(told(table(&[0.5, 1.0], &[1.0; 2])).contains("start at 0"));
        assert!(told(table(&[0.0, 1.0], &[1.0, -2.0])).contains("`grain.table.area[1]`: the area is -2"));
        assert!(Grain::Cylinder.check().is_ok() && table(&[0.0, 1.0], &[1.0, 0.0]).check().is_ok());
    }
}
