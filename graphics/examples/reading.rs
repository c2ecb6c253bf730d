//! How long a large SVG file takes, and what memory: `cargo run --release -p graphics --example reading`.

#![allow(clippy::print_stdout)]

use std::fmt::Write as _;
use std::time::Instant;

use messages::random::SplitMix64;

/// Bytes of the file.
const SIZE: usize = 5_000_000;

fn main() {
    for curves in [10, 1000] {
        let text = drawing(curves);
        let begin = Instant::now();
        match graphics::svg::read(text.as_bytes()) {
            Ok(graphic) => {
                let contours = graphic.shapes.iter().flat_map(|shape| &shape.contours);
                let segments: usize = contours.map(|contour| contour.segments.len()).sum();
                println!(
                    "{} bytes, {} paths, {segments} segments: {:?}, {} memory at most",
                    text.len(),
                    graphic.shapes.len(),
                    begin.elapsed(),
                    peak(),
                );
            }
            Err(error) => println!("{error}"),
        }
    }
}

/// Paths of cubic curves, so many in each.
fn drawing(curves: usize) -> String {
    let mut text = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' width='400mm' height='400mm' viewBox='0 0 400 400'>",
    );
    let mut random = SplitMix64::new(5);
    while text.len() < SIZE {
        text += "<path style='fill:none;stroke:#ff0000;stroke-width:0.1' d='M200 200";
        for _ in 0..curves {
            text.push('c');
            for _ in 0..6 {
                let _ = write!(text, " {:.3}", random.between(-5.0, 5.0));
            }
        }
        text += "'/>\n";
    }
    text + "</svg>"
}

/// The most memory that the process has had.
fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.map_or_else(|| "unknown".to_owned(), |line| line.trim().to_owned())
}
