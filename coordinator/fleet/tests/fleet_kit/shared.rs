//! A fleet whose states stand in a folder that its workers share.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::mpsc::Receiver;

use nalgebra::DMatrix;
use starlings_fleet::{
    CHUNK_VALUES, Fleet, FleetError, FleetEvent, GrpcFleet, Piece, PlaceName, Recombine, StateError,
    StateStore, StoredState,
};
use starlings_proto::convert::floats;
use starlings_proto::digest;
use starlings_worker::Factory;
use tempfile::TempDir;

use super::{ThreadWorker, any_port, await_event, listen_with};

/// Values of a state that is no multiple of a piece: 13 pieces.
pub const N: usize = 400_003;

/// A coordinator with its folder.
pub struct Shared {
    pub fleet: GrpcFleet,
    pub events: Receiver<FleetEvent>,
    pub store: StateStore,
    pub place: PlaceName,
    /// The folder of the run.
    pub path: PathBuf,
    pub scratch: TempDir,
}

impl Shared {
    pub fn new() -> Self {
        let scratch = tempfile::tempdir().unwrap();
        let place: PlaceName = scratch.path().to_str().unwrap().parse().unwrap();
        let (mut store, mut path) = (None, None);
        let (fleet, events, _) = listen_with(any_port(), |config| {
            let folder = place.of_run(&config.identity.id);
            path = Some(folder.path().to_owned());
            config.states = StateStore::shared(folder);
            store = Some(config.states.clone());
        });
        Self { fleet, events, store: store.unwrap(), place, path: path.unwrap(), scratch }
    }

    /// A worker that sees the folder; it has said so when this returns.
    pub fn worker(&self, factory: Factory) -> ThreadWorker {
        let place = self.place.clone();
        let worker = ThreadWorker::start_with(self.fleet.address().unwrap(), factory, |config| {
            config.states = Some(place);
        });
        self.await_sharing();
        worker
    }

    pub fn await_sharing(&self) {
        await_event(&self.events, |event| matches!(event, FleetEvent::SharesStates { .. }));
    }

    /// Names of the files in the folder of the run.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.path).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    /// The states of five particles.
    pub fn states(&self) -> Vec<StoredState> {
        let value = |i: usize, j: usize| ((i * 31 + j * 17) % 1009) as f64 / 7.0 - 60.0;
        let state = |j: usize| (0..N).map(|i| value(i, j)).collect::<Vec<_>>();
        (0..5).map(|j| self.store.keep(&state(j)).unwrap()).collect()
    }
}

pub fn transform() -> DMatrix<f64> {
    DMatrix::from_fn(5, 5, |i, j| (1.0 + i as f64) / (1 + i + 2 * j) as f64 - 0.3)
}

/// What the caller of a recombination makes, and which blocks it did.
pub struct Own {
    columns: Vec<StoredState>,
    pub made: Mutex<Vec<usize>>,
}

impl Own {
    pub fn of(columns: &[StoredState]) -> Self {
        Self { columns: columns.to_vec(), made: Mutex::default() }
    }

    /// A block as the caller makes it.
    pub fn block(&self, block: usize) -> Result<Vec<Piece>, StateError> {
        let rows = CHUNK_VALUES.min(N - block * CHUNK_VALUES);
        let mut x = DMatrix::zeros(rows, self.columns.len());
        for (values, state) in x.as_mut_slice().chunks_mut(rows).zip(&self.columns) {
            state.read(block, values)?;
        }
        starlings_estimators::recombine(&mut x, &transform());
        let piece = |values: &[f64]| {
            let bytes = floats::encode(values);
            (digest(&bytes), bytes)
        };
        Ok(x.as_slice().chunks(rows).map(piece).collect())
    }

    /// Has the fleet make all blocks.
    pub fn on(&self, fleet: &mut GrpcFleet) -> Result<Option<Vec<StoredState>>, FleetError> {
        let own = |block| {
            self.made.lock().unwrap().push(block);
            self.block(block)
        };
        let transform = transform();
        fleet.recombine(&Recombine { columns: &self.columns, transform: transform.as_slice(), own: &own })
    }

    /// Asserts that states are, piece by piece, what the caller would have made.
    pub fn assert_same(&self, mixed: &[StoredState]) {
        for block in 0..mixed[0].pieces().len() {
            let own: Vec<_> = self.block(block).unwrap().into_iter().map(|(name, _)| name).collect();
            let made: Vec<_> = mixed.iter().map(|state| state.pieces()[block]).collect();
            assert!(own == made, "block {block}");
        }
    }
}
