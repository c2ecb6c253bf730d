"""Measures what watching pages cost the loop, and how much memory the server takes for them.

    python tests/independent/watching_pages.py GRAVER [ROUNDS]

In each round the same job is run four times beside `graver serve`, in turn: without a page, with 32 pages that watch (path, status,
latencies, and a scope of four signals over ten seconds), with 32 pages of which one never reads, and without a page again. Printed are
the percentiles of the controller's answer and of drives' wake-up as the summaries have them, as medians over the rounds, and the
largest memory of the server. Ends with 1 where 32 pages cost more than a tenth of the p99 of the loop beyond what the two runs without
pages differ by, or the server's memory is not bounded.

Needs `websockets` from PyPI. The pages are a process of their own at the lowest priority: on real machines they are on other computers.
"""

import asyncio
import json
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import websockets

PAGES = 32
SECONDS = 14.0  # that pages watch for; the job takes longer than the half of it
MEMORY = 256 << 20  # the most that the server may have [bytes]
SCOPE = {
    "type": "scope",
    "signals": ["feedback.position.x", "feedback.position.y"],
    "mode": "auto",
    "seconds": 10,
    "position": 0.5,
}


async def page(address: str, seconds: float, signals: list[str]) -> int:
    """One page that reads all that it is sent; the bytes of it."""
    received = 0
    async with websockets.connect(f"ws://{address}/api/v1/live", max_size=None) as socket_:
        await socket_.send(json.dumps(SCOPE | {"signals": signals}))
        ends = time.monotonic() + seconds
        while (left := ends - time.monotonic()) > 0:
            try:
                received += len(await asyncio.wait_for(socket_.recv(), left))
            except (TimeoutError, asyncio.TimeoutError):
                break
    return received


def deaf(address: str) -> socket.socket:
    """A page that connects and never reads."""
    host, port = address.split(":")
    stream = socket.create_connection((host, int(port)))
    stream.sendall(
        f"GET /api/v1/live HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    return stream


async def watch(address: str, count: int, seconds: float, signals: list[str]) -> list[int]:
    """Many pages at once."""
    return await asyncio.gather(*(page(address, seconds, signals) for _ in range(count)))


def memory(process: int) -> int:
    """The largest resident memory that a process has had [bytes]."""
    status = Path(f"/proc/{process}/status").read_text()
    return next(int(line.split()[1]) << 10 for line in status.splitlines() if line.startswith("VmHWM"))


def signals(address: str) -> list[str]:
    """The first four signals that the scope can show."""
    import urllib.request

    for _ in range(200):
        try:
            with urllib.request.urlopen(f"http://{address}/api/v1/signals") as answer:
                found = json.load(answer)
            found = found if isinstance(found, list) else found["signals"]
            return [it["name"] for it in found][:4]
        except OSError:
            time.sleep(0.05)
    raise SystemExit("the server knows no signals")


def run(graver: str, folder: Path, pages: int, is_deaf: bool) -> tuple[dict, int, int]:
    """One job beside a server with so many pages: the latencies, the server's memory, the bytes of a page."""
    name = f"pages-{os.getpid()}"
    server = subprocess.Popen(
        [graver, "serve", "--listen", "127.0.0.1:0", "--instance", name],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )
    try:
        address = next(line for line in server.stderr if "http://" in line).split("http://")[1].split()[0].strip("/")
        job = subprocess.Popen(
            [graver, "run", "--instance", name, "--json", "--out", str(folder / "run"), "--record", "events",
             str(folder / "job.gcode")],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        received = [0]
        silent = None
        if pages:
            names = signals(address)
            silent = deaf(address) if is_deaf else None
            watchers = subprocess.run(
                [sys.executable, __file__, "--watch", address, str(pages - is_deaf), *names],
                stdout=subprocess.PIPE, check=True, text=True, preexec_fn=lambda: os.nice(19),
            )
            received = json.loads(watchers.stdout)
        out, complaints = job.communicate()
        if job.returncode:
            raise SystemExit(complaints)
        largest = memory(server.pid)
        if silent:
            silent.close()
        return json.loads(out), largest, min(received)
    finally:
        server.terminate()
        server.wait()


def main() -> None:
    if sys.argv[1] == "--watch":
        address, pages, *names = sys.argv[2:]
        print(json.dumps(asyncio.run(watch(address, int(pages), SECONDS, names))))
        return
    graver = os.path.abspath(sys.argv[1])
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 3
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        lines = "".join(f"G1 X{5 + 40 * (row % 2)} Y{5 + row * 0.5:.1f}\n" for row in range(60))
        (folder / "job.gcode").write_text(f"G21 G90\nM4 S300\nF12000\n{lines}M5\n")
        cases = [("none", 0, False), ("32", PAGES, False), ("32, one deaf", PAGES, True), ("none again", 0, False)]
        found: dict[str, list] = {name: [] for name, _, _ in cases}
        for _ in range(rounds):
            for name, pages, is_deaf in cases:
                found[name].append(run(graver, folder, pages, is_deaf))
        p99 = {}
        for name, results in found.items():
            hop = lambda hop, key: statistics.median(it["latency"][hop][key] for it, _, _ in results) / 1e3
            p99[name] = hop("loop", "p99")
            largest = max(memory for _, memory, _ in results)
            print(
                f"{name:14} loop p50 {hop('loop', 'p50'):7.1f} p99 {hop('loop', 'p99'):7.1f} max {hop('loop', 'max'):8.1f} µs   "
                f"wake p99 {hop('wake', 'p99'):7.1f} µs   server {largest / 2**20:6.1f} MiB   "
                f"least to a page {min(it for _, _, it in results) / 2**20:.1f} MiB"
            )
            if largest > MEMORY:
                raise SystemExit(f"the server took {largest} bytes")
        best, worst = sorted([p99["none"], p99["none again"]])
        allowed = worst * 1.1
        if max(p99["32"], p99["32, one deaf"]) > allowed:
            raise SystemExit(f"p99 of the loop is beyond {allowed:.1f} µs ({best:.1f} to {worst:.1f} µs without pages)")
        print("all good")


main()
