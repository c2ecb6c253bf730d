"""Runs eight simulations at once with HyperQueue, each as a process of its own, and looks at what they say.

python3 -m venv v && v/bin/pip install hyperqueue
GRAVER=target/release/graver v/bin/python tests/independent/many_simulations.py

The recipe for thousands, on more than one computer: docs/scale.md.
"""

import json
import os
import shutil
import tempfile
import time
from pathlib import Path

from hyperqueue import Job
from hyperqueue.cluster import LocalCluster, WorkerConfig

GRAVER = shutil.which(os.environ.get("GRAVER", "graver")) or os.path.abspath(os.environ["GRAVER"])
HEIGHTS = range(10, 18)

with tempfile.TemporaryDirectory() as folder, LocalCluster() as cluster:
    folder = Path(folder)
    cluster.start_worker(WorkerConfig(cores=os.cpu_count()))
    client, job = cluster.client(), Job()
    for height in HEIGHTS:
        command = [GRAVER, "simulate", "--json", "--set", "letters.text=S"]
        command += ["--set", f"letters.height={height} mm"]
        job.program(command, stdout=str(folder / f"{height}.json"))
    began = time.monotonic()
    client.wait_for_jobs([client.submit(job)])
    took = time.monotonic() - began

    times = []
    for height in HEIGHTS:
        summary = json.loads((folder / f"{height}.json").read_text())
        assert summary["outcome"] == "completed", summary
        assert summary["marks"]["missing"] < 1e-4, summary["marks"]
        times.append(summary["time"])
    # Larger letters take longer.
    assert times == sorted(times), times
    print(f"ok {len(times)} simulations in {took:.2f} s")
