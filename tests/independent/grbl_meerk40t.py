"""MeerK40t without its window: marks a rectangle on its grbl device over TCP, and says what went over the wire.

usage: grbl_meerk40t.py PORT FOLDER
"""

import sys
import time
from pathlib import Path

import meerk40t.main
from meerk40t.internal_plugins import plugin
from meerk40t.kernel import Kernel

SQUARE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm" viewBox="0 0 60 60">'
    '<rect x="20" y="45" width="12" height="12" fill="none" stroke="blue"/></svg>'
)
# Longer than the job takes.
PATIENCE = 60


def main(port, folder):
    drawing = Path(folder) / "square.svg"
    drawing.write_text(SQUARE)
    kernel = Kernel("MeerK40t", "0.9.9", f"graver-{time.time()}")
    kernel.add_plugin(plugin)
    kernel.args = meerk40t.main.parser.parse_args(["-z", "-A"])
    kernel(partial=True)
    kernel.console("service device start -i grbl\n")
    device = kernel.root.device
    device.interface, device.address, device.port = "tcp", "127.0.0.1", port
    device.signal("update_interface")
    device.controller.update_connection()
    heard = []

    def hear(data, type=None):
        if type == "recv":
            heard.extend(str(data).splitlines())

    device.controller.add_watcher(hear)
    kernel.console(f"load {drawing}\n")
    kernel.console("element* classify\n")
    kernel.console("plan copy preprocess validate blob preopt optimize spool\n")
    began, ran = time.time(), False
    state = ""
    while time.time() - began < PATIENCE:
        time.sleep(0.2)
        device.controller.realtime("?")
        reports = [line for line in heard if line.startswith("<") and "|" in line]
        if reports:
            state = reports[-1][1:].split("|", 1)[0]
        ran = ran or state.startswith("Run")
        if ran and state == "Idle":
            break
    answers = [line for line in heard if line == "ok"]
    errors = [line for line in heard if "error:" in line or "ALARM" in line]
    print("validated:", device.controller.fully_validated())
    print("lines answered:", len(answers), "wrong:", errors)
    print("ran:", ran, "then:", state)
    kernel.console("quit\n")
    return 0 if ran and state == "Idle" and not errors else 1


sys.exit(main(int(sys.argv[1]), sys.argv[2]))
