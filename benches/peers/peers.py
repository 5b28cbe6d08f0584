"""The peers: how each makes a batch of runs on so many workers of one slot, in the way that its manual shows.

    python3 peers.py NAME SIZES       prints what was measured as JSON; SIZES is JSON as compare.py writes it

A batch ends when all its results are here. A state goes out with its task and comes back as its result. One class a peer; what
a peer cannot do is None.
"""

import json
import statistics
import sys
import time

from tasks import VALUES, spin, still


class ProcessPool:
    """concurrent.futures.ProcessPoolExecutor of the standard library."""

    def __init__(self, workers, program):
        from concurrent.futures import ProcessPoolExecutor

        self.pool = ProcessPoolExecutor(workers)

    def run(self, seconds):
        return list(self.pool.map(spin, seconds))

    def states(self, states):
        return list(self.pool.map(still, states))

    def close(self):
        self.pool.shutdown()


class Mpi:
    """mpi4py.futures.MPIPoolExecutor; this process is started by mpiexec with a rank for itself."""

    def __init__(self, workers, program):
        from mpi4py.futures import MPICommExecutor
        from mpi4py import MPI

        self.executor = MPICommExecutor(MPI.COMM_WORLD, root=0)
        self.pool = self.executor.__enter__()

    def run(self, seconds):
        return list(self.pool.map(spin, seconds))

    def states(self, states):
        return list(self.pool.map(still, states))

    def close(self):
        self.executor.__exit__(None, None, None)


class Dask:
    """dask.distributed, a LocalCluster of processes with one thread each."""

    def __init__(self, workers, program):
        from distributed import Client, LocalCluster

        self.cluster = LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0
        )
        self.client = Client(self.cluster)
        self.client.wait_for_workers(workers)

    def run(self, seconds):
        return self.client.gather(self.client.map(spin, seconds, pure=False))

    def states(self, states):
        return self.client.gather(self.client.map(still, self.client.scatter(states, hash=False), pure=False))

    def close(self):
        self.client.close()
        self.cluster.close()


class Ray:
    """Ray tasks."""

    def __init__(self, workers, program):
        import logging

        import ray

        self.ray = ray
        # Room for all states twice, there and back.
        ray.init(
            num_cpus=workers,
            include_dashboard=False,
            logging_level=logging.ERROR,
            object_store_memory=2_000_000_000,
        )
        self.spin, self.still = ray.remote(spin), ray.remote(still)

    def run(self, seconds):
        return self.ray.get([self.spin.remote(s) for s in seconds])

    def states(self, states):
        return self.ray.get([self.still.remote(self.ray.put(state)) for state in states])

    def close(self):
        self.ray.shutdown()


class Parsl:
    """Parsl's HighThroughputExecutor."""

    def __init__(self, workers, program):
        import tempfile

        import parsl
        from parsl.config import Config
        from parsl.executors import HighThroughputExecutor
        from parsl.providers import LocalProvider

        self.parsl = parsl
        executor = HighThroughputExecutor(
            max_workers_per_node=workers,
            cores_per_worker=1e-6,
            encrypted=False,
            address="127.0.0.1",
            provider=LocalProvider(init_blocks=1, max_blocks=1),
        )
        self.folder = tempfile.TemporaryDirectory()
        parsl.load(Config(executors=[executor], run_dir=self.folder.name, initialize_logging=False))
        self.spin = parsl.python_app(spin, cache=False)
        self.still = parsl.python_app(still, cache=False)

    def run(self, seconds):
        return [future.result() for future in [self.spin(s) for s in seconds]]

    def states(self, states):
        return [future.result() for future in [self.still(state) for state in states]]

    def close(self):
        self.parsl.dfk().cleanup()
        self.parsl.clear()
        self.folder.cleanup()


class HyperQueue:
    """HyperQueue: a program per task, which is what it schedules; it carries no states."""

    def __init__(self, workers, program):
        import logging

        from hyperqueue import LocalCluster
        from hyperqueue.cluster import WorkerConfig

        logging.disable(logging.WARNING)
        self.program = program
        self.cluster = LocalCluster()
        for _ in range(workers):
            self.cluster.start_worker(WorkerConfig(cores=1))
        self.client = self.cluster.client()

    def run(self, seconds):
        from hyperqueue import Job

        job = Job()
        for s in seconds:
            job.program([self.program, "--spin", str(s)], stdout=None, stderr=None)
        self.client.wait_for_jobs([self.client.submit(job)])

    states = None

    def close(self):
        self.cluster.stop()


PEERS = {
    "ProcessPoolExecutor": ProcessPool,
    "mpi4py.futures": Mpi,
    "Dask": Dask,
    "Ray": Ray,
    "Parsl": Parsl,
    "HyperQueue": HyperQueue,
}


def timed(work, *args):
    began = time.perf_counter()
    done = work(*args)
    return time.perf_counter() - began, done


def measure(peer, sizes):
    """Wall times, seconds."""
    import numpy as np

    nothing = [0.0] * sizes["particles"]
    for _ in range(3):
        peer.run(nothing)
    found = {"cycles": []}
    # No more cycles than fit into a few seconds; the median needs no more.
    end = time.perf_counter() + sizes["patience"]
    while len(found["cycles"]) < sizes["cycles"] and (time.perf_counter() < end or len(found["cycles"]) < 3):
        found["cycles"].append(timed(peer.run, nothing)[0])
    # A bag as large as the others', where that takes no minutes.
    rate = sizes["particles"] / statistics.median(found["cycles"])
    bag = min(sizes["bag"], max(100, int(rate * sizes["patience"])))
    found["bag"] = timed(peer.run, [0.0] * bag)[0] * sizes["bag"] / bag
    found["spins"] = timed(peer.run, sizes["spins"])[0]
    found["spread"] = timed(peer.run, sizes["spread"])[0]
    found["states"] = []
    if peer.states is not None:
        for k in range(sizes["states"] + 1):
            states = [np.arange(VALUES, dtype=np.float64) + i + k for i in range(sizes["particles"])]
            wall, back = timed(peer.states, states)
            if not all(one[0] == i + k and one.size == VALUES for i, one in enumerate(back)):
                raise SystemExit("a state is not the one that was sent")
            # The first one warms up.
            if k > 0:
                found["states"].append(wall)
            del states, back
    return found


def main():
    name, sizes = sys.argv[1], json.loads(sys.argv[2])
    peer = PEERS[name](sizes["workers"], sizes["program"])
    if name == "mpi4py.futures" and peer.pool is None:
        # A rank that works; it comes here when the pool has been closed.
        return peer.close()
    found = measure(peer, sizes)
    peer.close()
    print("\n" + json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
