"""An independent master (pysoem) brings the emulated segment to OP and moves an axis by CSP.

Usage: ethercat.py INTERFACE [CYCLES]
"""

import struct
import sys
import time

import pysoem

CYCLE = 0.002
TRAVEL = 2000  # counts
SPEED = 4000  # counts/s

# What a drive shall exchange: 6040, 607A, 6060; 6041, 6064, 6061, 60F4.
OUTPUTS = (0x60400010, 0x607A0020, 0x60600008)
INPUTS = (0x60410010, 0x60640020, 0x60610008, 0x60F40020)


def fail(text):
    print("FAIL:", text)
    sys.exit(1)


def map_list(slave, assignment, index, entries):
    """Empties a list and its assignment, and fills both again."""
    slave.sdo_write(assignment, 0, struct.pack("B", 0))
    slave.sdo_write(index, 0, struct.pack("B", 0))
    for sub, entry in enumerate(entries, 1):
        slave.sdo_write(index, sub, struct.pack("<I", entry))
    slave.sdo_write(index, 0, struct.pack("B", len(entries)))
    slave.sdo_write(assignment, 1, struct.pack("<H", index))
    slave.sdo_write(assignment, 0, struct.pack("B", 1))


def set_up(master):
    """What is set in PRE-OP, before the process data is mapped."""
    drives = []
    for position, slave in enumerate(master.slaves):
        print(f"slave {position + 1}: {slave.name}, product {slave.id:#06x}, state {slave.state}")
        if slave.id == 0x0402:
            drives.append(slave)
            name = slave.sdo_read(0x1008, 0).decode()
            identity = [struct.unpack("<I", slave.sdo_read(0x1018, sub))[0] for sub in range(1, 5)]
            print(f"  {name}, identity {identity}")

            def configure(_position, slave=slave):
                map_list(slave, 0x1C12, 0x1600, OUTPUTS)
                map_list(slave, 0x1C13, 0x1A00, INPUTS)
                # Python is no real-time master: the watchdog alone judges late targets.
                slave.sdo_write(0x10F1, 2, struct.pack("<H", 0))
                slave.dc_sync(True, int(CYCLE * 1e9))
                return 0

            slave.config_func = lambda position, configure=configure: configure(position)
    if not drives:
        fail("no drives")
    return drives


def refusals(slave):
    """What the drive must refuse."""
    for index, sub, data, code in [
        (0x1018, 1, b"\0\0\0\0", 0x06010002),
        (0x9999, 0, b"\0", 0x06020000),
        (0x1600, 1, struct.pack("<I", 0x60400010), 0x06010003),
        (0x6098, 0, b"\x63", 0x06090030),
    ]:
        try:
            slave.sdo_write(index, sub, data)
        except pysoem.SdoError as error:
            if error.abort_code != code:
                fail(f"{index:04x}:{sub} refused with {error.abort_code:08x}, not {code:08x}")
        else:
            fail(f"{index:04x}:{sub} was not refused")
    print("refused with the right codes: what is read-only, missing, mapped, out of range")


class Drives:
    """The process data of the drives."""

    def __init__(self, master, drives):
        self.master, self.drives, self.wrong = master, drives, 0
        # SOEM's own count leaves out a slave of a single output bit.
        self.expected = sum(
            2 * bool(slave.output) + bool(slave.input) for slave in master.slaves
        )

    def cycle(self, word, targets):
        for drive, target in zip(self.drives, targets):
            drive.output = struct.pack("<Hib", word, target, 8)
        self.master.send_processdata()
        if self.master.receive_processdata(20_000) != self.expected:
            self.wrong += 1
        time.sleep(CYCLE)
        return [struct.unpack("<Hibi", drive.input) for drive in self.drives]

    def until(self, word, mask, wanted, seconds=1.0):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            now = self.cycle(word, [it[1] for it in self.inputs()])
            if all(it[0] & mask == wanted for it in now):
                return
        fail(f"status {[hex(it[0]) for it in now]} instead of {wanted:#x} after {word:#x}")

    def inputs(self):
        return [struct.unpack("<Hibi", drive.input) for drive in self.drives]


def main():
    interface = sys.argv[1]
    cycles = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    master = pysoem.Master()
    master.open(interface)
    count = master.config_init()
    print(f"{count} slaves")
    if count <= 0:
        fail("no slaves")
    drives = set_up(master)
    refusals(drives[0])
    print("distributed clocks:", "yes" if master.config_dc() else "no")
    print("process data:", master.config_map(), "bytes")
    if master.state_check(pysoem.SAFEOP_STATE, 50_000) != pysoem.SAFEOP_STATE:
        fail("no SAFE-OP: " + states(master))
    master.send_processdata()
    master.receive_processdata(20_000)
    master.state = pysoem.OP_STATE
    master.write_state()
    for _ in range(200):
        master.send_processdata()
        master.receive_processdata(20_000)
        if master.state_check(pysoem.OP_STATE, 5_000) == pysoem.OP_STATE:
            break
    else:
        fail("no OP: " + states(master))
    axes = Drives(master, drives)
    print("all in OP, working counter", axes.expected)
    axes.cycle(0x00, [it[1] for it in axes.inputs()])
    for word, mask, wanted in [(0x06, 0x6F, 0x21), (0x07, 0x6F, 0x23), (0x0F, 0x6F, 0x27)]:
        axes.until(word, mask, wanted)
    start = [it[1] for it in axes.inputs()]
    print("enabled at", start)
    target, step, largest = 0, int(SPEED * CYCLE), 0
    for _ in range(cycles):
        target = min(target + step, TRAVEL)
        now = axes.cycle(0x0F, [start[0] + target] + start[1:])
        largest = max(largest, abs(now[0][3]))
    moved = now[0][1] - start[0]
    print(f"{cycles} cycles, axis 1 moved by {moved} counts of {TRAVEL}, following error {largest} at most,")
    print(f"{axes.wrong} wrong working counters")
    if abs(moved - TRAVEL) > 20:
        fail("the axis is not where it should be")
    if any(abs(it[1] - there) > 20 for it, there in zip(now[1:], start[1:])):
        fail("another axis has moved")
    axes.until(0x02, 0x4F, 0x40)
    print("quick stop: power off")
    # Nothing more is sent: the watchdogs of the outputs expire.
    time.sleep(0.3)
    master.read_state()
    print("after 0.3 s without frames:", states(master))
    if axes.wrong:
        fail("frames with a wrong working counter")
    for slave in master.slaves:
        expected = 0x1B if slave.output else 0
        if slave.al_status != expected:
            fail(f"{slave.name} has code {slave.al_status:#06x}, not {expected:#06x}")
    master.state = pysoem.INIT_STATE
    master.write_state()
    master.close()
    print("PASS")


def states(master):
    master.read_state()
    return ", ".join(
        f"{position + 1}: {slave.state:#x}/{slave.al_status:#06x}"
        for position, slave in enumerate(master.slaves)
    )


main()
