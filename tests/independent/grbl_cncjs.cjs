// CNCjs without its window: opens the terminal of --grbl-tty as its serial port, runs a job with a hold, and says what it
// saw.
//
// usage: grbl_cncjs.cjs NODE_MODULES TERMINAL FOLDER

const { spawn } = require("node:child_process");
const { join } = require("node:path");
const { writeFileSync } = require("node:fs");

const [modules, terminal, folder] = process.argv.slice(2);
const { connect } = { connect: require(join(modules, "socket.io-client")) };

const JOB = "G21 G90\nM4 S500\nG0 X30 Y30\nG1 X50 F1200\nG1 Y50\nG1 X30\nG1 Y30\nM5\n";
const PATIENCE = 90_000;
const pause = (time) => new Promise((done) => setTimeout(done, time));

/** Starts CNCjs on a port of its own, and gives its address. */
async function start() {
    const port = 20_000 + (process.pid % 20_000);
    const settings = join(folder, "cncrc.json");
    writeFileSync(settings, JSON.stringify({ secret: "of this test" }));
    const program = join(modules, "cncjs", "bin", "cncjs");
    const server = spawn(process.execPath, [program, "--host", "127.0.0.1", "--port", String(port), "--config", settings], {
        stdio: "ignore",
    });
    const address = `http://127.0.0.1:${port}`;
    for (let tries = 0; tries < 100; tries += 1) {
        await pause(200);
        try {
            const answer = await fetch(`${address}/api/signin`, {
                method: "POST",
                headers: { "content-type": "application/json" },
                body: '{"token":""}',
            });
            return { server, address, token: (await answer.json()).token };
        } catch {
            // Not up yet.
        }
    }
    throw new Error("CNCjs does not come up");
}

async function main() {
    const { server, address, token } = await start();
    const states = [];
    const wrong = [];
    let finished = null;
    let count = 0;
    try {
        const socket = connect(address, { query: `token=${token}` });
        const opened = new Promise((done, fail) => {
            socket.on("serialport:open", done);
            socket.on("serialport:error", (error) => fail(new Error(JSON.stringify(error))));
        });
        socket.on("controller:state", (_, state) => {
            const now = state?.status?.activeState;
            if (now && states.at(-1) !== now) states.push(now);
        });
        socket.on("controller:settings", (_, settings) => {
            count = Math.max(count, Object.keys(settings?.settings ?? {}).length);
        });
        socket.on("serialport:read", (line) => {
            if (/error|ALARM/.test(line)) wrong.push(line);
        });
        socket.on("sender:status", (status) => {
            if (status.finishTime) finished = status;
        });
        socket.on("connect", () => socket.emit("open", terminal, { baudrate: 115200, controllerType: "Grbl" }));
        await opened;
        await pause(4000);
        socket.emit("command", terminal, "gcode:load", "job.gcode", JOB, {}, () => {});
        await pause(800);
        socket.emit("command", terminal, "gcode:start");
        await pause(1800);
        socket.emit("command", terminal, "feedhold");
        await pause(1000);
        socket.emit("command", terminal, "cyclestart");
        const began = Date.now();
        while (!(finished && states.at(-1) === "Idle") && Date.now() - began < PATIENCE) await pause(100);
        console.log("settings:", count);
        console.log("lines sent:", finished?.sent, "answered:", finished?.received, "of", finished?.total);
        console.log("states:", states.join(" "), wrong.length ? `wrong: ${wrong.join(", ")}` : "");
        socket.close();
    } finally {
        server.kill();
    }
    const all = ["Run", "Hold", "Idle"].every((state) => states.includes(state));
    return all && finished && finished.received === finished.total && !wrong.length ? 0 : 1;
}

main().then(
    (code) => process.exit(code),
    (error) => {
        console.error(String(error));
        process.exit(1);
    },
);
