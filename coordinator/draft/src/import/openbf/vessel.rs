//! A vessel of a file in the units of `artery-1d` (cm, g, s), and what of it `artery-1d` does not have.

use super::file::Vessel;

/// Length of a cell in cm: a hundredth of the wavelength of the highest harmonic that a pulse has, and less.
const CELL: f64 = 0.25;

/// A vessel in cgs units.
#[derive(Debug)]
pub(super) struct Artery {
    pub(super) length: f64,
    /// Radius at both ends.
    pub(super) radius: [f64; 2],
    /// Thickness at both ends.
    pub(super) thickness: [f64; 2],
    pub(super) young: f64,
    pub(super) profile: f64,
    pub(super) cells: usize,
}

/// A Windkessel in cgs units.
#[derive(Debug)]
pub(super) struct Windkessel {
    pub(super) proximal: f64,
    pub(super) distal: f64,
    pub(super) compliance: f64,
    /// Whether the file has one resistance.
    pub(super) alone: bool,
}

/// Thickness in m that openBF gives a vessel of this radius in m without one.
fn thickness(radius: f64) -> f64 {
    radius * (0.2802 * (-505.3 * radius).exp() + 0.1324 * (-11.14 * radius).exp())
}

impl Vessel {
    /// The vessel itself.
    pub(super) fn artery(&self) -> Result<Artery, String> {
        if self.viscoelastic {
            return Err(self.lacks("`visco-elastic`: the wall's viscosity follows a fit to the radius"));
        }
        if self.old_gamma_profile.is_some() {
            let message = "`gamma profile`: some versions of openBF read it and others pass it over; write `gamma_profile`";
            return Err(self.wrong(message));
        }
        let start = self.Rp.or(self.R0).ok_or_else(|| self.wrong("no radius: give R0, or Rp and Rd"))?;
        let end = self.Rd.unwrap_or(start);
        let wall = [start, end].map(|radius| self.h0.unwrap_or_else(|| thickness(radius)));
        let numbers =
            [("L", self.L), ("E", self.E), ("Rp", start), ("Rd", end), ("h0", wall[0]), ("h0", wall[1])];
        for (key, value) in numbers {
            if !(value > 0.0 && value.is_finite()) {
                return Err(self.wrong(&format!("{key} is {value}: give a number above zero")));
            }
        }
        let profile = self.gamma_profile.unwrap_or(2.0);
        if !(profile >= 2.0 && profile.is_finite()) {
            return Err(self.wrong(&format!("gamma_profile is {profile}: give 2 for a parabola, or more")));
        }
        let length = 100.0 * self.L;
        let cells = (length / CELL).ceil().clamp(5.0, 1e6) as usize;
        Ok(Artery {
            length,
            radius: [start, end].map(|r| 100.0 * r),
            thickness: wall.map(|h| 100.0 * h),
            young: 10.0 * self.E,
            profile,
            cells,
        })
    }

    /// What follows a vessel that ends in nothing else.
    pub(super) fn windkessel(&self, density: f64) -> Result<Windkessel, String> {
        if self.Rt.is_some() || self.outlet.as_deref() == Some("reflection") {
            return Err(self.lacks("an outlet with a reflection coefficient (`Rt`)"));
        }
        if let Some(other) = self.outlet.as_deref().filter(|outlet| *outlet != "wk3") {
            return Err(self.lacks(&format!("`outlet: {other}`")));
        }
        if self.inlet_impedance_matching {
            return Err(self.lacks("`inlet_impedance_matching`: a proximal resistance that follows the wave"));
        }
        let (Some(proximal), Some(compliance)) = (self.R1, self.Cc) else {
            return Err(self.wrong(&self.without_windkessel()));
        };
        let distal = self.R2.filter(|r| *r != 0.0);
        let alone = distal.is_none();
        let distal = match distal {
            Some(distal) => distal,
            None => proximal - self.impedance(density)?,
        };
        if alone && distal <= 0.0 {
            let message = format!(
                "R1 is {proximal}, less than the impedance of its end, and there is no R2: give both"
            );
            return Err(self.wrong(&message));
        }
        for (key, value) in [("R1", proximal), ("R2", distal), ("Cc", compliance)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(self.wrong(&format!("{key} is {value}: give a number above zero")));
            }
        }
        let (proximal, distal, compliance) = (1e-5 * proximal, 1e-5 * distal, 1e5 * compliance);
        Ok(Windkessel { proximal, distal, compliance, alone })
    }

    /// What is missing of the Windkessel behind a vessel that nothing follows.
    fn without_windkessel(&self) -> String {
        let keys = [("R1", self.R1), ("R2", self.R2), ("Cc", self.Cc)];
        let named = |given: bool| -> Vec<&str> {
            keys.iter().filter(|(_, value)| value.is_some() == given).map(|(key, _)| *key).collect()
        };
        if named(true).is_empty() {
            return "nothing follows it and it has no Windkessel (R1, R2, Cc); an outlet without one is not in `artery-1d`"
                .to_owned();
        }
        format!(
            "nothing follows it, and of its Windkessel it has {} and not {}: give R1 and Cc, and R2 unless R1 is all of the resistance",
            named(true).join(" and "),
            named(false).join(" and ")
        )
    }

    /// ρc/A₀ of its end without load, in Pa s/m³: c² = β/2ρ with β = (4/3) √π E h/√A₀ (Melis 2017).
    fn impedance(&self, density: f64) -> Result<f64, String> {
        let artery = self.artery()?;
        let (radius, thickness) = (0.01 * artery.radius[1], 0.01 * artery.thickness[1]);
        let beta = 4.0 / 3.0 * self.E * thickness / radius;
        let area = std::f64::consts::PI * radius * radius;
        Ok((0.5 * density * beta).sqrt() / area)
    }

    /// Refuses what only an outlet may have.
    pub(super) fn inner(&self) -> Result<(), String> {
        let outlet =
            [self.R1, self.R2, self.Cc, self.Rt].iter().any(Option::is_some) || self.outlet.is_some();
        if outlet {
            return Err(self.wrong("it has an outlet (R1, R2, Cc, Rt, outlet), and other vessels follow it"));
        }
        Ok(())
    }

    fn wrong(&self, message: &str) -> String {
        format!("vessel `{}`: {message}", self.label)
    }

    fn lacks(&self, what: &str) -> String {
        self.wrong(&format!("{what} is not in `artery-1d`"))
    }
}
