//! Machines that `graver machine new` makes: of every kind, for whatever may be asked.
//!
//! `GRAVER_CASES=200 cargo test --release -p workbench --test new -- --nocapture` tries more of them.

#![allow(clippy::unwrap_used)]

use machine::Machine;
use messages::random::SplitMix64;
use workbench::catalogue::{BUILTIN, Catalogue};
use workbench::new::{Argument, Kind, Request, create};

/// All catalogues that are built in.
fn catalogue() -> Catalogue {
    BUILTIN.iter().fold(Catalogue::default(), |all, (name, text)| {
        all.and(Catalogue::parse(name, text).unwrap())
    })
}

/// Somewhere in a range, each power of ten as likely.
fn somewhere(random: &mut SplitMix64, argument: Argument) -> f64 {
    let [from, to] = argument.range.map(messages::math::ln);
    messages::math::exp(random.between(from, to))
}

fn random_request(kind: Kind, random: &mut SplitMix64) -> Request {
    Request {
        area: [somewhere(random, Argument::AREA), somewhere(random, Argument::AREA)],
        z: somewhere(random, Argument::Z),
        head: somewhere(random, Argument::HEAD),
        speed: somewhere(random, Argument::SPEED),
        acceleration: somewhere(random, Argument::ACCELERATION),
        steppers: kind.refuses_steppers().is_none() && random.fraction() < 0.4,
        ..Request::usual(kind)
    }
}

#[test]
fn machines_of_every_kind_are_sound_and_mark_their_sample() {
    let cases: usize = std::env::var("GRAVER_CASES").map_or(6, |count| count.parse().unwrap());
    let only = std::env::var("GRAVER_KIND").ok();
    let catalogue = catalogue();
    let kinds =
        Kind::ALL.into_iter().filter(|kind| only.as_ref().is_none_or(|it| it == kind.name()));
    let mut wrong = Vec::new();
    for kind in kinds {
        let seed = std::env::var("GRAVER_SEED").map_or(1, |seed| seed.parse().unwrap());
        let mut random = SplitMix64::new(seed);
        let (mut lowered, mut slowest, mut error): (usize, f64, f64) = (0, 0.0, 0.0);
        let began = std::time::Instant::now();
        for case in 0..cases {
            let request = random_request(kind, &mut random);
            match create(&request, &catalogue, "sample.toml") {
                Ok(created) => {
                    let machine = Machine::parse("machine.toml", &created.machine, &[]).unwrap();
                    assert!(machine.warnings.is_empty());
                    lowered += usize::from(!created.lowered.is_empty());
                    slowest = slowest.max(created.proof.time);
                    error = error.max(created.proof.error);
                }
                Err(refused) => wrong.push(format!("{case}: {refused}\n   {request:?}")),
            }
        }
        println!(
            "{}: {cases} machines, {lowered} asked for less, sample up to {slowest:.1} s, {:.1} um, in {:.1} s",
            kind.name(),
            error * 1e6,
            began.elapsed().as_secs_f64()
        );
    }
    assert!(wrong.is_empty(), "{} are refused:\n{}", wrong.len(), wrong.join("\n"));
}
