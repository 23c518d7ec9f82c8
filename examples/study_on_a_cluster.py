"""The same study on processes, threads and a Dask cluster: the same bits everywhere.

python examples/study_on_a_cluster.py [--smoke] [--out DIR] [--scheduler tcp://host:8786]

Without a scheduler, a small cluster of two workers is started here. With MPI, the same study is
mpiexec -n 3 python -m mpi4py.futures -m carom eos study.toml
"""

# %% Arguments: --smoke makes everything small, --out says where the results go.
import argparse
import contextlib
from pathlib import Path

import carom

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and collisions")
parser.add_argument("--out", type=Path, default=Path("cluster"), help="folder of the studies")
parser.add_argument("--scheduler", help="address of a Dask scheduler")
args = parser.parse_args()
n, error = (108, 2e-2) if args.smoke else (1000, 5e-4)


# %% One function, because Dask's own workers import this file, too.
def study(where, folder):
    found = carom.equation_of_state(
        [0.2, 0.3, 0.4], n=n, relative_error=error, executor=where, out=args.out / folder
    )
    print(f"{found.engine or folder}: {found.seconds:.1f} s, {len(found.records)} runs")
    return found


def numbers(found):
    return [record["result"] for record in found.records]


def main():
    # %% Here: a process a core, and threads, which the engine lets run side by side.
    reference = study("processes", "processes")
    assert numbers(study("threads", "threads")) == numbers(reference)
    reference.plot(args.out / "pressure.png")

    # %% A cluster. On other hosts: `dask scheduler` on one, `dask worker tcp://head:8786` on the others.
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        print("Dask is not installed; pip install 'carom[dask]' for the last part.")
        return
    with contextlib.ExitStack() as stack:
        address = args.scheduler
        if address is None:
            cluster = LocalCluster(
                n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(args.out)
            )
            address = stack.enter_context(cluster).scheduler_address
        client = stack.enter_context(Client(address))
        assert numbers(study(client, "dask")) == numbers(reference)
    print("All engines gave the same bits.")


# %% Dask's way to start workers here needs this; Carom's own does not.
if __name__ == "__main__":
    main()
