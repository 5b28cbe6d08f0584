//! The pieces of a state: sent one after the other, or written into the shared folder or shared memory and read from there.

use starlings_models::StateValues;
use starlings_pieces::{Folder, PieceName, Sealed, SharedMemory};
use starlings_proto::convert::floats;
use starlings_proto::convert::piece_names::{NAMES, encode_names};
use starlings_proto::convert::state::{CHUNK_BYTES, CHUNK_VALUES, PutHead, encode_chunk};
use starlings_proto::generated::Chunk;
use starlings_proto::{StateId, StateNaming, digest};
use tokio::sync::mpsc::Sender;

/// What was sent.
pub(crate) enum Sent {
    /// A state of this name.
    Named(StateId),
    /// A state that was not named here.
    Unnamed,
    /// Not all of it: the stream ended before.
    Ended,
}

/// Sends a state piece by piece, and names it where it is to be compared.
pub(crate) fn send(pieces: &Sender<Chunk>, head: PutHead, values: &[f64], is_compared: bool) -> Sent {
    let mut naming = is_compared.then(|| StateNaming::of(values.len()));
    if pieces.blocking_send(head.encode()).is_err() {
        return Sent::Ended;
    }
    for piece in values.chunks(CHUNK_VALUES) {
        let bytes = floats::encode(piece);
        if let Some(naming) = &mut naming {
            naming.piece(&digest(&bytes));
        }
        if pieces.blocking_send(encode_chunk(bytes)).is_err() {
            return Sent::Ended;
        }
    }
    naming.map_or(Sent::Unnamed, |naming| Sent::Named(naming.finish()))
}

/// Sends the names of the pieces of a state, and names it by them.
pub(crate) fn send_names(pieces: &Sender<Chunk>, head: PutHead, names: &[PieceName]) -> Sent {
    let mut naming = StateNaming::of(head.n_state);
    if pieces.blocking_send(head.encode()).is_err() {
        return Sent::Ended;
    }
    for names in names.chunks(NAMES) {
        for name in names {
            naming.piece(name);
        }
        if pieces.blocking_send(encode_names(names)).is_err() {
            return Sent::Ended;
        }
    }
    Sent::Named(naming.finish())
}

/// Writes a state into the folder, of which nobody else looks at the values: the names of its pieces.
pub(crate) fn write(folder: &Folder, values: &[f64]) -> Result<Vec<PieceName>, String> {
    let piece = |values: &[f64]| {
        if let Some(spoiled) = values.iter().find(|value| !value.is_finite()) {
            return Err(format!("{spoiled} is a value of the state"));
        }
        let bytes = floats::encode(values);
        let name = digest(&bytes);
        folder.put(&name, &bytes).map(|()| name).map_err(|error| error.to_string())
    };
    values.chunks(CHUNK_VALUES).map(piece).collect()
}

/// Reads a state of so many values from the folder into memory that is empty.
pub(crate) fn read(
    folder: &Folder,
    names: &[PieceName],
    n_state: usize,
    mut values: Vec<f64>,
) -> Result<Vec<f64>, String> {
    for name in names {
        let bytes = folder.read(name).map_err(|error| error.to_string())?;
        values.extend(bytes.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)));
    }
    if values.len() == n_state {
        Ok(values)
    } else {
        Err(format!("{} values where {n_state} belong", values.len()))
    }
}

/// Writes a state into memory that was lent, as `write` writes bytes from a byte on.
pub(crate) fn fill(
    values: &[f64],
    write: impl Fn(&[u8], usize) -> std::io::Result<()>,
) -> std::io::Result<()> {
    if cfg!(target_endian = "little") {
        return write(bytemuck::cast_slice(values), 0);
    }
    let mut pieces = values.chunks(CHUNK_VALUES).enumerate();
    pieces.try_for_each(|(index, values)| write(&floats::encode(values), index * CHUNK_BYTES))
}

/// The values of a state that stands in memory which nobody changes: where it is, or a copy where that cannot be.
pub(crate) fn seen(memory: &SharedMemory, n_state: usize) -> std::io::Result<StateValues> {
    if cfg!(target_endian = "little")
        && let Ok(sealed) = memory.see()
    {
        return Ok(StateValues::of(InPlace(sealed)));
    }
    let mut values = vec![0.0_f64; n_state];
    memory.read(bytemuck::cast_slice_mut(&mut values), 0)?;
    if cfg!(target_endian = "big") {
        for value in &mut values {
            *value = f64::from_bits(value.to_bits().swap_bytes());
        }
    }
    Ok(values.into())
}

/// Values that stand in memory of another process.
struct InPlace(Sealed);

impl AsRef<[f64]> for InPlace {
    fn as_ref(&self) -> &[f64] {
        bytemuck::cast_slice(self.0.bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sealed_state_is_read_where_it_stands_and_outlives_its_descriptor() {
        let values = [1.5, -0.0, f64::MAX];
        let memory = SharedMemory::of(24).expect("room");
        fill(&values, |bytes, at| memory.write(bytes, at)).expect("it is not sealed");
        let copied = seen(&memory, 3).expect("it is there");
        assert!(copied == values && copied.into_own().is_some(), "what may change is copied");
        memory.seal().expect("nobody has mapped it");
        let state = seen(&memory, 3).expect("it is there");
        drop(memory);
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&state), bits(&values));
        assert!(state.into_own().is_none(), "nothing was copied");
    }
}
