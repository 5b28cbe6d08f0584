//! The same states in a folder that the workers share: their way there and back, and X T by the workers or here.

use std::time::{Duration, Instant};

use nalgebra::DMatrix;
use starlings_fleet::{
    CHUNK_VALUES, Fleet, GrpcFleet, Piece, PlaceName, Recombine, StateError, StateStore, StateWriter,
    StoredState, n_chunks,
};
use starlings_models::Setup;
use starlings_proto::convert::floats;
use starlings_proto::digest;

use super::{Failure, LARGE, PARTICLES, VALUES, fleet, median, peak_mb, run, start};

/// The number of the run.
pub(super) const RUN: [u8; 16] = [7; 16];

/// The place that a worker is told of.
pub(super) fn place(args: &[String]) -> Result<Option<PlaceName>, Failure> {
    let named = args.iter().skip_while(|arg| *arg != "--states").nth(1);
    Ok(named.map(|name| name.parse()).transpose()?)
}

/// All rows; the larger states first, since the memory that is told is the most of all times.
pub(super) fn bench(cycles: usize, large: bool) -> Result<(), Failure> {
    if large {
        let (_, mixed, _) = cycle(LARGE, 4, 1, false)?;
        let gb = 2.0 * 8.0 * 4.0 * LARGE as f64 / 1e9 / mixed.as_secs_f64();
        println!(
            "4 states of 256 MB mixed by workers: {gb:.2} GB/s, peak of the coordinator {} MB",
            peak_mb()
        );
    }
    let (ran, mixed, here) = cycle(VALUES, PARTICLES, cycles, true)?;
    let rate = |wall: Duration| (2 * 8 * VALUES * PARTICLES) as f64 / wall.as_secs_f64() / 1e9;
    println!("{PARTICLES} states of 8 MB in a shared folder, GB/s both ways, p50");
    println!("  there and back {:.2}", rate(ran));
    println!("  mixed by workers {:.2}, here {:.2}", rate(mixed), rate(here));
    println!("  peak of the coordinator {} MB", peak_mb());
    Ok(())
}

/// Median times of runs, of mixing by workers, and of mixing here.
fn cycle(
    values: usize,
    particles: usize,
    cycles: usize,
    here: bool,
) -> Result<(Duration, Duration, Duration), Failure> {
    let scratch = tempfile::tempdir()?;
    let name = scratch.path().to_str().ok_or("a folder with a name")?;
    let store = StateStore::shared(name.parse::<PlaceName>()?.of_run(&RUN));
    let (mut fleet, workers) = fleet(&store, Some(name))?;
    let setup = fleet.install(&Setup::default())?;
    let mut now = (0..particles).map(|k| start(&store, values, k)).collect::<Result<Vec<_>, Failure>>()?;
    let t = DMatrix::from_fn(particles, particles, |i, j| if i == j { 0.5 } else { 0.5 / particles as f64 });
    let mut walls = [vec![], vec![], vec![]];
    for _ in 0..=cycles {
        let mut time = |which: usize, work: &mut dyn FnMut() -> Result<Vec<StoredState>, Failure>| {
            let started = Instant::now();
            let made = work()?;
            walls[which].push(started.elapsed());
            Ok::<_, Failure>(made)
        };
        now = time(0, &mut || run(&mut fleet, setup, &now))?;
        let mixed = time(1, &mut || by_workers(&mut fleet, &now, &t))?;
        if here {
            let own = time(2, &mut || by_itself(&store, &now, &t))?;
            if !own.iter().map(StoredState::id).eq(mixed.iter().map(StoredState::id)) {
                return Err("the workers mix otherwise".into());
            }
        }
        now = mixed;
    }
    drop(workers);
    fleet.close();
    for walls in &mut walls {
        walls.sort_unstable();
    }
    let [ran, mixed, own] = &walls;
    let own = if own.is_empty() { Duration::ZERO } else { median(own) };
    Ok((median(ran), median(mixed), own))
}

fn by_workers(
    fleet: &mut GrpcFleet,
    columns: &[StoredState],
    t: &DMatrix<f64>,
) -> Result<Vec<StoredState>, Failure> {
    let own = |index| block(columns, t, index);
    let mixed = fleet.recombine(&Recombine { columns, transform: t.as_slice(), own: &own })?;
    mixed.ok_or_else(|| "no worker shares the folder".into())
}

pub(super) fn by_itself(
    store: &StateStore,
    columns: &[StoredState],
    t: &DMatrix<f64>,
) -> Result<Vec<StoredState>, Failure> {
    let n_state = columns[0].n_state();
    let mut writers: Vec<StateWriter> = columns.iter().map(|_| store.writer_for_workers(n_state)).collect();
    for index in 0..n_chunks(n_state) {
        for (writer, (name, bytes)) in writers.iter_mut().zip(block(columns, t, index)?) {
            writer.push_named(name, bytes)?;
        }
    }
    Ok(writers.into_iter().map(StateWriter::finish).collect::<Result<_, _>>()?)
}

fn block(columns: &[StoredState], t: &DMatrix<f64>, index: usize) -> Result<Vec<Piece>, StateError> {
    let rows = CHUNK_VALUES.min(columns[0].n_state() - index * CHUNK_VALUES);
    let mut x = DMatrix::zeros(rows, columns.len());
    for (values, state) in x.as_mut_slice().chunks_mut(rows).zip(columns) {
        state.read(index, values)?;
    }
    starlings_estimators::recombine(&mut x, t);
    let piece = |values: &[f64]| {
        let bytes = floats::encode(values);
        (digest(&bytes), bytes)
    };
    Ok(x.as_slice().chunks(rows).map(piece).collect())
}
