"""Gives exported profiles to Rayforge's own readers: of its devices, and of LightBurn's .lbdev.

python3 -m venv v && v/bin/pip install rayforge      (or without what needs GTK: --no-deps, and what it then asks for)
GRAVER=target/debug/graver v/bin/python tests/independent/profiles.py machines/corexy.toml machines/gantry.toml
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from rayforge.machine.device.lightburn_importer import convert_to_profile
from rayforge.machine.device.profile import DeviceProfile
from rayforge.machine.driver import get_driver_cls


def export(form, machine, out):
    command = [os.environ.get("GRAVER", "graver"), "machine", "export", form, "--machine", machine]
    command += ["--out", str(out), "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)["profile"]


def check(machine):
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        told = export("--rayforge", machine, folder / "device")
        size = (told["width"] * 1e3, told["depth"] * 1e3)
        same = lambda read: all(abs(a - b) < 1e-6 for a, b in zip(read, size))

        device = DeviceProfile.from_path(folder / "device")
        config = device.machine_config
        assert device.meta.name == told["name"], device.meta
        assert same(config.axis_extents), config.axis_extents
        assert config.origin.value == "bottom_left"
        assert abs(config.max_cut_speed - told["speed"] * 60e3) <= 1, config.max_cut_speed
        assert config.home_on_start == told["homes"]
        assert config.heads[0]["max_power"] == told["full_scale"]
        driver = get_driver_cls(config.driver)
        assert driver.__name__ == "GrblTelnetDriver"
        driver.precheck(**config.driver_args)
        known = {var.key for var in driver.get_setup_vars()}
        assert set(config.driver_args) <= known, (config.driver_args, known)

        export("--lbdev", machine, folder / "machine.lbdev")
        device, summary = convert_to_profile(folder / "machine.lbdev")
        assert device.meta.name == told["name"]
        assert same(device.machine_config.axis_extents)
        assert summary.origin == "bottom_left" and summary.driver == "GrblSerialDriver"
        assert summary.home_on_start == told["homes"]
    print("ok", machine)


for machine in sys.argv[1:]:
    check(machine)
