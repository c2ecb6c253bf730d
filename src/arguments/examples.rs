//! Examples below the help of a command.

pub(super) const RUN_EXAMPLES: &str = "\
Examples:
  graver run                                        the letters NASO, 20 mm, on a CoreXY
  graver run jobs/square_arcs.ngc --machine machines/cartesian.toml
  graver run --set letters.text=S --set letters.height=\"10 mm\" --out runs/s
  graver run --set plant.axis.a.friction.coulomb=\"7 mN m\"   a plant that differs from the plan
  graver run logo.svg --frame                       round the box of the job, in the dark
  graver run plate.ngc --dry-run                    the same motion, never lit
  graver run plate.ngc --from-line 120              as if the lines before had been read
  graver run --json > summary.json                  for scripts

While it runs, from another terminal: graver hold, resume, override, stop, status.";

pub(super) const SIMULATE_EXAMPLES: &str = "\
Examples:
  graver simulate                                   what `graver run` would mark
  graver simulate jobs/square_arcs.ngc --out runs/a with recording, picture and report
  graver simulate --set machine.path.jerk=\"1000 m/s^3\" --json";

pub(super) const PLAN_EXAMPLES: &str = "\
Examples:
  graver plan jobs/square_arcs.ngc                  time, length, limits, notes
  graver plan logo.svg --preview logo-preview.svg   what is marked, as a drawing
  graver plan --samples setpoints.csv               every setpoint, one row a millisecond
  graver plan --machine twin.toml --pulses p.csv    every step pulse with its time and count
  graver plan --ideal --set letters.style=h2        within the limits of the path only
  graver plan --ideal --profile trapezoid           the time by the source's profile beside it
  graver plan --machine machines/mcm.toml --path-check check.csv";

pub(super) const CHECK_EXAMPLES: &str = "\
Examples:
  graver check --machine machines/cartesian.toml    the machine file alone
  graver check jobs/square_arcs.ngc                 and whether the machine can do the job";

pub(super) const KINEMATICS_EXAMPLES: &str = "\
Examples, one object a line in and out, SI units and radians:
  forward    {\"q\": [0.2, 0]}
  inverse    {\"pose\": {\"position\": [0.1, 0.1]}}
  jacobian   {\"q\": [0.2, 0]}
  dynamics   {\"q\": [0.2, 0], \"qd\": [0, 0], \"qdd\": [10, 10]}
  ellipse    {\"q\": [0.2, 0]}

A line that asks for an impossible pose or motion gets {\"error\": {\"code\", \"detail\", ..}}, and
the next line is answered; a line that is not such an object ends the command with exit code 2.";

pub(super) const FIGURES_EXAMPLES: &str = "\
Examples:
  graver figures                                    all figures of source 003, into figures/
  graver figures ellipses modes --machine machines/five_bar.toml
  graver figures torque jobs/letters.toml --machine machines/corexy.toml --out pictures";

pub(super) const EXPORT_EXAMPLES: &str = "\
Examples:
  graver export runs/20261127-134500-NASO > samples.csv
  graver export runs/a/samples.mcap --out samples.csv
  graver export runs/old --format mcap --out old.mcap   a recording of an earlier version

SI units and radians, one line a cycle; a field that was not known is empty.";

pub(super) const REPLAY_EXAMPLES: &str = "\
Examples:
  graver simulate jobs/letters.toml --out runs/a
  graver replay runs/a                              controller and drives, bit for bit as recorded
  graver replay runs/b --json                       of a run in real time: its controller

Exit code 1 when an output differs: the first difference is told by its cycle, field and values.";

pub(super) const SIZE_EXAMPLES: &str = "\
Examples:
  graver size --machine machines/cartesian.toml     what its sample job needs
  graver size job.ngc --machine mine.toml --motors mine-motors.toml --out new.toml
  graver size --machine mine.toml --motors dc --gears keep --axis x
  graver size --machine mine.toml --motors dc --motors gears --by power --margin 1.5

A catalogue is a TOML file, or one of thesis, dc, bldc, steppers and gears, which are built in.
--out writes the machine file with the motors; its comments stay.";

pub(super) const NEW_EXAMPLES: &str = "\
Examples:
  graver machine new corexy                         asks for the rest on a terminal
  graver machine new cartesian_lift --area \"300 x 200 mm\" --z \"60 mm\" --head \"0.8 kg\" --yes
  graver machine new five_bar --speed \"0.5 m/s\" --acceleration \"20 m/s^2\" --out mine.toml
  graver machine new prrrp --steppers --motors my-motors.toml --motors gears

The file is written only if `graver check` has nothing to say of it and its sample is marked in
simulation. Where no motor is enough, speed or acceleration is lowered, and the file says so.";

pub(super) const PROFILE_EXAMPLES: &str = "\
Examples:
  graver machine export --lbdev --machine mine.toml
  graver machine export --rayforge --machine mine.toml --host laser.local --out my-laser

Size, speeds, homing and the S word of full power are the machine file's.";

pub(super) const CALIBRATE_EXAMPLES: &str = "\
Examples:
  graver calibrate poses.csv --machine mine.toml --out calibrated.toml
  graver calibrate poses.csv --machine mine.toml --free legs,base

poses.csv has the columns xD,yD,xE,yE,xF,yF (where the motors say the feet are) and
x,y,z,qw,qx,qy,qz (the measured pose of the tool, with base free in the instrument's own frame), in
metres, a pose a line.";

pub(super) const COMPARE_EXAMPLES: &str = "\
Examples:
  graver compare                                    the four machines of source 003 on its letters
  graver compare jobs/letters.toml --machine machines/cartesian.toml --machine machines/corexy.toml
  graver compare --machine a.toml --machine b.toml --weight time=5 --weight mass=0 --out comparison

Each job is planned, simulated, and simulated on --seeds plants that are other than the file says.";

pub(super) const TABLES_EXAMPLES: &str = "\
Examples:
  graver tables                                     all ten, on the terminal
  graver tables 5-2 7-1 --format csv                for a spreadsheet
  graver tables --out tables                        a page, and a CSV file for each table

Each value as printed, as the source's own numbers give it, with the errata applied, and as planned.";

pub(super) const SUBMIT_EXAMPLES: &str = "\
Examples:
  graver submit job.ngc                             and follow it to its end
  graver submit job.ngc --detach                    its number, at once; it outlives this terminal
  graver submit jobs/letters.toml --set letters.text=S --json

Ctrl-C stops the job that is followed; a second one leaves it to come to rest alone. A terminal
that is closed leaves the job to go on.";

pub(super) const QUEUE_EXAMPLES: &str = "\
Examples:
  graver queue list                                 what has ended, what runs, what waits
  graver queue cancel 12
  graver queue move 12 1                            job 12 is the next
  graver queue repeat 9                             job 9 once more
  graver queue start                                begin what waits after a restart, a fault or a stop

The jobs are kept on disk. After a start of the pipeline, a fault or `graver stop` those that
wait begin only when a person starts the queue.";

pub(super) const SERVE_EXAMPLES: &str = "\
Examples:
  graver serve                                      the live page at http://127.0.0.1:7180
  graver serve --listen 0.0.0.0:7180 --host laser.local   for other computers, by a token
  graver serve --grbl 7123                          LightBurn, UGS, Rayforge … on this computer
  graver serve --grbl 192.168.1.5:7123 --grbl-from 192.168.1.0/24
  graver serve --grbl-tty /tmp/graver               for software that speaks to a serial port only
  graver domain --services --machine mine.toml --grbl 7123   the same in one command

docs/grbl.md says how to connect each program, docs/http.md what the page and the HTTP interface are.";

pub(super) const DOCTOR_EXAMPLES: &str = "\
Examples:
  graver doctor                                     this PC, as this user
  graver doctor --machine mine.toml --core 3        with its network card, for that CPU
  sudo -u graver graver doctor --json               as the user of the services, for scripts

It changes nothing. Exit code 1 where there is a problem; advice alone is 0.";

#[cfg(feature = "watch")]
pub(super) const WATCH_EXAMPLES: &str = "\
Examples:
  graver watch                                      the pipeline `default`
  ssh -t laser sudo -u graver graver watch --instance cell1

NO_COLOR=1 leaves colours away. Leaving the view changes nothing on the machine.";

pub(super) const SERVICES: &str = "\
Examples:
  graver domain --services --machine mine.toml      on one's own computer: all that takes jobs
  graver domain --machine mine.toml                 for services that systemd starts

The services are graver drives, controller, planner and monitor with the same --instance, and
modbus where the machine file has such devices; machine and drives are the domain's. deploy/ has
systemd units. SIGTERM or Ctrl-C ends it with the machine at rest; a terminal that is closed does not.";

pub(super) const FLEET_EXAMPLES: &str = "\
Examples:
  graver domain --services --publish tls://hall:4222 --publish-credentials cell1.creds --jobs-of lasers
  graver fleet status tls://hall:4222 --credentials me.creds
  graver fleet submit tls://hall:4222 plate.svg --group lasers --set marking.power=\"30 %\"";
