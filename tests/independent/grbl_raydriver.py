"""Rayforge's driver: connects, reads the settings, homes, jogs, runs a job with a hold, and says what it saw.

usage: grbl_raydriver.py PORT
"""

import asyncio
import sys

from raydriver.grbl import GrblSession

JOB = "G21 G90\nM4 S500\nG0 X30 Y30\nG1 X50 F1200\nG1 Y50\nG1 X30\nG1 Y30\nM5\n"
DIALECT = {
    "home_all": "$H",
    "home_axis": "$H{axis_letter}",
    "clear_alarm": "$X",
    "laser_on": "M4 S{power:.0f}",
    "laser_off": "M5",
}


async def main(port):
    seen = []

    def note(event):
        if "StateChanged" in type(event).__name__:
            state = event.state.status.name
            if seen[-1:] != [state]:
                seen.append(state)

    config = {"host": "127.0.0.1", "tcp_host": "127.0.0.1", "tcp_port": port}
    session = GrblSession(config=config, dialect=DIALECT, event_callback=note)
    await session.connect()
    await asyncio.sleep(1)
    print("receive buffer:", session.rx_buffer_size)
    settings = await session.read_settings()
    print("settings:", len(settings))
    await session.home()
    print("homed")
    await session.jog(1200, [("X", 20.0)])
    for _ in range(100):
        await asyncio.sleep(0.1)
        if seen[-2:] == ["JOG", "IDLE"]:
            break
    job = asyncio.ensure_future(session.run(JOB))
    await asyncio.sleep(1.5)
    await session.set_hold(True)
    await asyncio.sleep(1)
    await session.set_hold(False)
    await asyncio.wait_for(job, 30)
    for _ in range(300):
        await asyncio.sleep(0.1)
        if seen[-2:] == ["RUN", "IDLE"]:
            break
    print("job done; states:", " ".join(seen))
    await session.disconnect()
    wanted = {"IDLE", "JOG", "RUN", "HOLD"}
    return 0 if wanted <= {state.split(":")[0].upper() for state in seen} and len(settings) > 20 else 1


sys.exit(asyncio.run(main(int(sys.argv[1]))))
