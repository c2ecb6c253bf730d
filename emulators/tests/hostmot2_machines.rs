//! Machines behind the board: a scan head, motors on amplifiers, and the board at a socket.

use std::net::UdpSocket;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use emulators::hostmot2::layout::{Function, PORT_WIDTH, pin_of};
use emulators::hostmot2::record::Record;
use emulators::hostmot2::rig::Rig;
use emulators::hostmot2::service::Service;
use emulators::hostmot2::spaces::Identity;
use emulators::hostmot2::wiring::Wiring;
use emulators::hostmot2::{Board, Emulator, Faults};
use machine::Machine;
use messages::Nanoseconds;

const MILLISECOND: i64 = 1_000_000;

/// A datagram that writes words, `(address, word)`.
fn writes(words: &[(u16, u32)]) -> Vec<u8> {
    let write = |(address, word): &(u16, u32)| {
        let mut bytes = 0xc281_u16.to_le_bytes().to_vec();
        bytes.extend(address.to_le_bytes());
        bytes.extend(word.to_le_bytes());
        bytes
    };
    words.iter().flat_map(write).collect()
}

/// Makes the pins of `functions` outputs of their modules.
fn connect(functions: &[Function]) -> Vec<(u16, u32)> {
    let mut masks = [0_u32; 3];
    for pin in functions.iter().filter_map(|function| pin_of(*function)) {
        masks[pin / PORT_WIDTH] |= 1 << (pin % PORT_WIDTH);
    }
    let words = masks.iter().zip([0, 4, 8]);
    words.flat_map(|(mask, port)| [(0x1200 + port, *mask), (0x1100 + port, *mask)]).collect()
}

fn machine(name: &str) -> Machine {
    let path = format!("{}/../machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Machine::load(path.as_ref(), &[]).expect("the machine")
}

fn board(machine: &Machine, wiring: &Wiring) -> Board {
    let rig = Rig::new(machine, wiring).expect("a rig");
    Board::new(Identity::default()).with_machine(rig, wiring, Record::with_way())
}

fn tool(board: &Board) -> [f64; 3] {
    board.rig().and_then(Rig::tool).expect("a tool")
}

#[test]
fn the_scan_head_takes_the_tool_along() {
    let galvo = machine("galvo");
    let full_scale = 0.25;
    let wiring = Wiring::usual(&galvo).with_scan_head(full_scale);
    let mut board = board(&galvo, &wiring);
    let lines = [1, 2, 3, 4].map(|pin| Function::Xy2mod(pin, 0));
    board.handle(Nanoseconds(0), &writes(&connect(&lines)));
    board.advance(Nanoseconds(20 * MILLISECOND));
    let start = tool(&board);
    // The first mirror to 0.01 rad in 100 ms by its velocity, as fast as 5 mm in the field take.
    let velocity = 0.1 / full_scale * 256.0 * 2_147_483_648.0 / 1e8;
    board.handle(Nanoseconds(20 * MILLISECOND), &writes(&[(0x5200, velocity as u32)]));
    board.handle(Nanoseconds(120 * MILLISECOND), &writes(&[(0x5200, 0)]));
    board.advance(Nanoseconds(200 * MILLISECOND));
    let end = tool(&board);
    assert!(!board.rig().expect("a rig").fault().is_some());
    // The light turns by twice the mirror's angle: 250 mm × 0.02, the lens' distortion and the field's
    // turn apart.
    let moved = ((end[0] - start[0]) * (end[0] - start[0])
        + (end[1] - start[1]) * (end[1] - start[1]))
        .sqrt();
    assert!((moved - 5e-3).abs() < 0.1e-3, "{start:?} {end:?}");
}

#[test]
fn an_amplifier_turns_its_motor_and_the_encoder_counts_it() {
    let cartesian = machine("cartesian");
    let wiring = Wiring::usual(&cartesian);
    let mut board = board(&cartesian, &wiring);
    let pins: Vec<Function> = (1..=2)
        .flat_map(|unit| {
            [Function::Pwmgen(1, unit), Function::Pwmgen(2, unit), Function::PwmEnable(unit)]
        })
        .collect();
    let mut words = connect(&pins);
    words.extend([
        (0x4200, 20_000),
        (0x4104, 3),
        (0x4108, 3),
        (0x4400, 0b110),
        (0x0c00, 9_999_999),
    ]);
    board.handle(Nanoseconds(0), &writes(&words));
    board.advance(Nanoseconds(20 * MILLISECOND));
    let start = tool(&board);
    // A fifth of the supply on the first motor for 40 ms.
    board.handle(Nanoseconds(20 * MILLISECOND), &writes(&[(0x4004, 820 << 16)]));
    board.advance(Nanoseconds(60 * MILLISECOND));
    let read = [0x81, 0x42, 0x00, 0x30];
    let reply = board.handle(Nanoseconds(60 * MILLISECOND), &read).unwrap_or(&[]).to_vec();
    let count = i16::from_le_bytes([reply[0], reply[1]]);
    let moved = tool(&board)[0] - start[0];
    assert!(moved.abs() > 1e-4 && count.unsigned_abs() > 10, "{moved} m, {count} counts");
    let actuator = &cartesian.actuators[0];
    let turned = f64::from(count) / actuator.encoder.counts * core::f64::consts::TAU;
    assert!((turned * actuator.ratio - moved).abs() < 0.2e-3, "{turned} rad, {moved} m");
    // Nobody feeds the watchdog of 100 ms: the amplifier loses its enable, and brakes.
    board.advance(Nanoseconds(400 * MILLISECOND));
    assert_eq!(board.record().bites, [Nanoseconds(100 * MILLISECOND)]);
    let rest = tool(&board);
    board.advance(Nanoseconds(500 * MILLISECOND));
    assert!((tool(&board)[0] - rest[0]).abs() < 1e-6);
}

#[test]
fn what_the_board_lacks_is_named() {
    let steppers = machine("cartesian_steppers");
    let mut wiring = Wiring::usual(&steppers);
    wiring.actuators[1].encoder = Some(9);
    let error = Rig::new(&steppers, &wiring).expect_err("no such encoder");
    assert_eq!(error.to_string(), "actuator 1 is on encoder 9, and the board has 6");
    wiring.actuators.pop();
    let error = Rig::new(&steppers, &wiring).expect_err("one too few");
    assert_eq!(error.to_string(), "1 actuators are connected, and the machine has 2");
}

#[test]
fn it_answers_at_a_socket() {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    let address = socket.local_addr().expect("its address");
    let emulator =
        Emulator::new(Board::new(Identity::default()), &Faults::default(), Nanoseconds(0));
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut service = Service::new(emulator, socket).expect("a service");
            service.run(|| done.load(Ordering::Relaxed)).expect("it serves");
        });
        let master = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        master.set_read_timeout(Some(Duration::from_secs(20))).expect("a time-out");
        master.send_to(&[0x01, 0x42, 0x00, 0x01], address).expect("sent");
        let mut reply = [0; 16];
        let received = master.recv(&mut reply);
        done.store(true, Ordering::Relaxed);
        assert_eq!(received.ok(), Some(4));
        assert_eq!(reply[..4], 0x55aa_cafe_u32.to_le_bytes());
    });
}
