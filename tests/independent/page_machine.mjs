// A machine for the page: a domain with its services, and the server beside it, which can be killed and started again.

import { spawn } from "node:child_process";
import { mkdirSync } from "node:fs";
import { join } from "node:path";

const PATIENCE = 30_000;

/** Starts a program and waits until its standard error says what `pattern` finds. */
async function start(program, words, pattern, environment) {
  const child = spawn(program, words, { env: { ...process.env, ...environment }, stdio: ["ignore", "ignore", "pipe"] });
  let said = "";
  const found = await new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`${words[0]} does not start: ${said}`)), PATIENCE);
    child.stderr.on("data", (bytes) => {
      said += bytes;
      const match = pattern.exec(said);
      if (!match) return;
      clearTimeout(timer);
      resolve(match);
    });
    child.on("exit", (code) => reject(new Error(`${words[0]} ended with ${code}: ${said}`)));
  });
  return { child, found };
}

async function end(child, signal = "SIGTERM") {
  if (child.exitCode !== null || child.signalCode !== null) return;
  const ended = new Promise((resolve) => child.once("exit", resolve));
  child.kill(signal);
  await ended;
}

export class Machine {
  /** A domain of the simulated machine in `file`, with folders of its own in `folder`. */
  static async start(graver, file, folder) {
    const machine = new Machine();
    machine.graver = graver;
    machine.name = `page${process.pid}`;
    machine.environment = {};
    for (const [key, name] of [["XDG_RUNTIME_DIR", "r"], ["XDG_STATE_HOME", "state"]]) {
      machine.environment[key] = join(folder, name);
      mkdirSync(machine.environment[key], { mode: 0o700 });
    }
    const words = ["domain", "--services", "--instance", machine.name, ...(file ? ["--machine", file] : [])];
    machine.domain = (await start(graver, words, /\n/, machine.environment)).child;
    await machine.serve("127.0.0.1:0");
    return machine;
  }

  /** Starts the server; the same address may be given again. */
  async serve(address) {
    const { child, found } = await start(this.graver, ["serve", "--listen", address, "--instance", this.name], /http:\/\/([\d.]+:\d+)/, this.environment);
    this.server = child;
    [this.page, this.address] = found;
  }

  /** Kills the server as a crash would. */
  async crash() {
    await end(this.server, "SIGKILL");
  }

  async end() {
    await end(this.server);
    await end(this.domain);
  }
}
