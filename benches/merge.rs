//! Time and memory of adaptive merging, on generated points: 100 overlapping views of a gently curved sheet, each point with a quality that falls
//! towards the rim of its view and scatters.
//!
//! `cargo bench --no-default-features --bench merge -- 1 3 10` prints a row for each number of million points: million points, survivors, s on all
//! cores, ns of processor time a point, most memory of the process so far (the points themselves among it), MiB.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use shapeline::geometry::Point3;
use shapeline::run::RunContext;
use shapeline::stitch::{Rank, survivors};
use std::time::Instant;

/// Views, ten by ten, each half over its neighbours.
const VIEWS: usize = 100;
/// Distance of a view's points.
const PITCH: f64 = 0.05;
/// Merging radius in the distance of a view's points.
const RADIUS_GRID: f64 = 2.0;

/// Points of all views and their ranks. `count` in all, roughly.
fn points(count: usize) -> (Vec<Point3>, Vec<Rank>) {
    let side = ((count / VIEWS) as f64).sqrt() as usize;
    let step = 0.5 * side as f64 * PITCH;
    let view = |view: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(view as u64);
        let corner = [(view % 10) as f64 * step, (view / 10) as f64 * step];
        let mut one = |k: usize| {
            let mut scatter = || rng.random_range(-0.5..0.5) * PITCH;
            let place = [k / side, k % side].map(|i| i as f64 * PITCH);
            let (x, y) = (corner[0] + place[0] + scatter(), corner[1] + place[1] + scatter());
            let z = 5.0 * (x / 40.0).sin() * (y / 50.0).cos() + 0.3 * scatter();
            let off = (place[0] - step).hypot(place[1] - step) / step;
            let score = -off + 0.3 * scatter() / PITCH;
            (Point3::new(x, y, z), Rank { score: f64::from(score as f32), view: view as u32, index: k as u32 })
        };
        (0..side * side).map(&mut one).collect::<Vec<_>>()
    };
    (0..VIEWS).into_par_iter().flat_map_iter(view).unzip()
}

/// Most memory that the process had, MiB, where the system tells it.
fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| kib / 1024.0)
}

/// Processor time that the process has taken, s, where the system tells it: other programs on the machine do not count in it.
fn processor_s() -> Option<f64> {
    const TICKS_A_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let after_name = stat.rsplit(')').next()?;
    let ticks: Option<Vec<f64>> =
        after_name.split_whitespace().skip(11).take(2).map(|word| word.parse().ok()).collect();
    Some(ticks?.iter().sum::<f64>() / TICKS_A_SECOND)
}

fn main() {
    let millions: Vec<usize> = std::env::args().filter_map(|word| word.parse().ok()).collect();
    let threads = rayon::current_num_threads();
    for million in if millions.is_empty() { vec![1, 3, 10] } else { millions } {
        let (positions, ranks) = points(million * 1_000_000);
        let (begun, taken) = (Instant::now(), processor_s());
        let kept = survivors(&positions, &ranks, RADIUS_GRID * PITCH, &RunContext::silent()).expect("it fits");
        let seconds = begun.elapsed().as_secs_f64();
        let wall = seconds * threads as f64;
        let taken = processor_s().zip(taken).map_or(wall, |(after, before)| after - before);
        let each = taken * 1e9 / positions.len() as f64;
        #[expect(clippy::print_stdout, reason = "what a benchmark is for")]
        {
            println!(
                "| {:.2} | {} | {seconds:.2} | {each:.0} | {:.0} |",
                positions.len() as f64 / 1e6,
                kept.len(),
                peak_mib().unwrap_or(f64::NAN)
            );
        }
    }
}
