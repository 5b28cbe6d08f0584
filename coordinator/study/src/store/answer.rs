//! What the store keeps of the answer of a run: enough to say whether another run gives the same bits, and if not by how much.
//!
//! The outputs themselves would be larger than everything else that a run leaves behind. Next file to read: [`super::inputs`].

use serde::Serialize;
use starlings_fleet::Held;
use starlings_models::Prediction;
use starlings_proto::convert::state;

/// Bytes of the hash that are kept: two answers that differ look the same once in 2⁶⁴ cases.
const KEPT: usize = 8;

/// A short hash of outputs and end state, and the sum of the outputs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Of the bits of all outputs and of the end state.
    #[serde(serialize_with = "hexadecimal")]
    hash: [u8; KEPT],
    /// Sum of the outputs, which have various units: to tell how far two answers are apart.
    pub sum: f64,
}

impl Answer {
    /// That of a run, before anything is taken from its outputs.
    pub(crate) fn of(prediction: &Prediction<Held>) -> Self {
        let mut hasher = blake3::Hasher::new();
        for value in &prediction.outputs {
            hasher.update(&value.to_le_bytes());
        }
        // By its name, which is a hash of its values, wherever it stands.
        hasher.update(&match &prediction.state {
            Held::Values(values) => state::name(values),
            Held::Stored(state) => state.id(),
        });
        let mut hash = [0; KEPT];
        hash.copy_from_slice(&hasher.finalize().as_bytes()[..KEPT]);
        Self { hash, sum: prediction.outputs.iter().sum() }
    }

    /// Whether outputs and end state have the same bits.
    pub fn is_same(&self, other: &Self) -> bool {
        self.hash == other.hash && self.sum.to_bits() == other.sum.to_bits()
    }

    /// Its bytes in the store: hash, then sum.
    pub(super) fn bytes(&self) -> [u8; KEPT + 8] {
        let mut bytes = [0; KEPT + 8];
        bytes[..KEPT].copy_from_slice(&self.hash);
        bytes[KEPT..].copy_from_slice(&self.sum.to_le_bytes());
        bytes
    }

    /// From these bytes; `None` where there are not as many.
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (hash, sum) = bytes.split_first_chunk::<KEPT>()?;
        Some(Self { hash: *hash, sum: f64::from_le_bytes(sum.try_into().ok()?) })
    }
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde gives a reference
fn hexadecimal<S: serde::Serializer>(hash: &[u8; KEPT], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&format!("{:016x}", u64::from_be_bytes(*hash)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prediction(outputs: &[f64], state: &[f64]) -> Prediction<Held> {
        Prediction { outputs: outputs.to_vec(), state: Held::Values(state.to_vec()), cost: 1.0 }
    }

    #[test]
    fn every_bit_of_outputs_and_end_state_counts_and_the_bytes_give_it_back() {
        let one = Answer::of(&prediction(&[1.0, 2.5], &[3.0]));
        assert!(one.is_same(&Answer::of(&Prediction { cost: 7.0, ..prediction(&[1.0, 2.5], &[3.0]) })));
        let next = f64::from_bits(3.0_f64.to_bits() + 1);
        for other in
            [prediction(&[1.0, 2.5], &[next]), prediction(&[2.5, 1.0], &[3.0]), prediction(&[3.5], &[3.0])]
        {
            assert!(!one.is_same(&Answer::of(&other)), "{other:?}");
        }
        assert_eq!(one.sum.to_bits(), 3.5_f64.to_bits());
        assert_eq!(Answer::from_bytes(&one.bytes()), Some(one));
        assert_eq!(Answer::from_bytes(&one.bytes()[1..]), None);
    }
}
