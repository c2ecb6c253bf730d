"""Runs a thousand simulations with HyperQueue, each as a process of its own, and compares each with the same simulation run directly.

python3 -m venv v && v/bin/pip install hyperqueue
GRAVER=target/release/graver v/bin/python tests/independent/many_simulations.py [COUNT]

The recipe for thousands, on more than one computer: docs/scale.md.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from hyperqueue import Job
from hyperqueue.cluster import LocalCluster, WorkerConfig

NAMED = os.environ.get("GRAVER", "graver")
GRAVER = shutil.which(NAMED) or sys.exit(f"{NAMED} is not there: build it, and name it in GRAVER")
GRAVER = os.path.abspath(GRAVER)
COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
CORES = len(os.sched_getaffinity(0))


def command(number):
    """One letter, from 10 mm to 20 mm high."""
    height = 10 + 10 * number / COUNT
    return [GRAVER, "simulate", "--json", "--set", "letters.text=S", "--set", f"letters.height={height:.4f} mm"]


def directly(number):
    done = subprocess.run(command(number), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True)
    return json.loads(done.stdout)["digest"]


with tempfile.TemporaryDirectory() as folder, LocalCluster() as cluster:
    folder = Path(folder)
    cluster.start_worker(WorkerConfig(cores=CORES))
    client, job = cluster.client(), Job()
    for number in range(COUNT):
        job.program(command(number), stdout=str(folder / f"{number}.json"))
    began = time.monotonic()
    client.wait_for_jobs([client.submit(job)])
    queued = time.monotonic() - began
    summaries = [json.loads((folder / f"{number}.json").read_text()) for number in range(COUNT)]

for summary in summaries:
    assert summary["outcome"] == "completed", summary
    assert summary["marks"]["missing"] < 1e-4, summary["marks"]

began = time.monotonic()
with ThreadPoolExecutor(CORES) as pool:
    digests = list(pool.map(directly, range(COUNT)))
direct = time.monotonic() - began
differing = [number for number in range(COUNT) if summaries[number]["digest"] != digests[number]]
assert not differing, f"digests differ from a direct run: {differing}"
# Another height is another stream of commands.
assert len(set(digests)) == COUNT, f"{len(set(digests))} digests of {COUNT} simulations"
# Larger letters take longer.
assert summaries[-1]["time"] > summaries[0]["time"], summaries[-1]["time"]
print(
    f"ok {COUNT} simulations on {CORES} CPUs: {queued:.1f} s by HyperQueue, {direct:.1f} s directly, "
    f"every digest equal; {sum(summary['time'] for summary in summaries):.0f} s of machine time"
)
