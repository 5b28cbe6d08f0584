//! Why a search for damage gives no answer.
//!
//! A layout that a model refuses is a [`starlings_models_core::SetupError`] and not here. Next file to read: [`crate::plate`].

/// Why a search for damage gives no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StructureError {
    /// The recording does not have the shape of the arrangement.
    #[error(
        "the recording is {rows} x {columns}: the arrangement has {sensors} sensors and {samples} samples"
    )]
    Shape {
        /// Rows of the recording.
        rows: usize,
        /// Columns of the recording.
        columns: usize,
        /// Sensors of the arrangement.
        sensors: usize,
        /// Samples of its force.
        samples: usize,
    },
    /// A value of the recording is no finite number.
    #[error("sample {sample} of sensor {sensor} is {value}: leave out what was not recorded")]
    NotFinite {
        /// Sensor, from 0.
        sensor: usize,
        /// Sample, from 0.
        sample: usize,
        /// What was found.
        value: f64,
    },
    /// A noise standard deviation is not positive and finite, or there is not one for every sensor.
    #[error("the noise of the sensors must be one positive standard deviation each, {sensors} in all")]
    Noise {
        /// Sensors of the arrangement.
        sensors: usize,
    },
    /// No place of the grid answers the recording with a loss of stiffness.
    #[error("no loss of stiffness at any of the {cells} places tried makes the recording likelier")]
    NothingFound {
        /// Places of the grid.
        cells: usize,
    },
    /// The recording does not tell place and severity apart.
    #[error("the recording does not determine place and severity of the damage")]
    NotDetermined,
}
