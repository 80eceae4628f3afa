//! Time and memory of adaptive merging, on generated points: 100 overlapping views of a gently curved sheet, each point with a quality that falls
//! towards the rim of its view, once with scatter and once (`smooth`) without, where every decision hangs on the one uphill of it.
//!
//! `cargo bench --no-default-features --bench merge -- 1 3 10 smooth 10` prints a row for each number of million points: judge, million points,
//! survivors, s on all cores, ns of processor time a point, most memory of the process so far (the points themselves among it), MiB.
//!
//! `... --bench merge -- views FOLDER 100` writes so many million points as 100 files with a `merge.toml` instead.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use shapeline::geometry::{LengthUnit, Point3};
use shapeline::io::write_ply_cloud;
use shapeline::run::RunContext;
use shapeline::stitch::{Points, survivors_of};
use std::path::Path;
use std::time::Instant;

/// Views, ten by ten, each half over its neighbours.
const VIEWS: usize = 100;
/// Distance of a view's points.
const PITCH: f64 = 0.05;
/// Merging radius in the distance of a view's points.
const RADIUS_GRID: f64 = 2.0;
/// How much scores scatter.
const SCATTER: f64 = 0.3;

/// Points and scores of each view.
struct Views(Vec<(Vec<Point3>, Vec<f32>)>);

impl Points for Views {
    fn parts(&self) -> usize {
        self.0.len()
    }

    fn count(&self, part: usize) -> usize {
        self.0[part].0.len()
    }

    fn position(&self, part: usize, index: usize) -> Point3 {
        self.0[part].0[index]
    }

    fn score(&self, part: usize, index: usize) -> f64 {
        f64::from(self.0[part].1[index])
    }
}

/// A view of `count` points in all views, roughly.
fn view(view: usize, count: usize, scatter_of_score: f64) -> (Vec<Point3>, Vec<f32>) {
    let side = ((count / VIEWS) as f64).sqrt() as usize;
    let step = 0.5 * side as f64 * PITCH;
    let mut rng = ChaCha8Rng::seed_from_u64(view as u64);
    let corner = [(view % 10) as f64 * step, (view / 10) as f64 * step];
    let mut positions = Vec::with_capacity(side * side);
    let mut scores = Vec::with_capacity(side * side);
    for k in 0..side * side {
        let mut scatter = || rng.random_range(-0.5..0.5) * PITCH;
        let place = [k / side, k % side].map(|i| i as f64 * PITCH);
        let (x, y) = (corner[0] + place[0] + scatter(), corner[1] + place[1] + scatter());
        positions.push(Point3::new(x, y, 5.0 * (x / 40.0).sin() * (y / 50.0).cos() + 0.3 * scatter()));
        let off = (place[0] - step).hypot(place[1] - step) / step;
        scores.push((-off + scatter_of_score * scatter() / PITCH) as f32);
    }
    (positions, scores)
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

/// A row of the table.
fn merge(million: usize, judge: &str, scatter_of_score: f64) {
    let threads = rayon::current_num_threads();
    let views = (0..VIEWS).into_par_iter().map(|k| view(k, million * 1_000_000, scatter_of_score)).collect();
    let views = Views(views);
    let count: usize = (0..VIEWS).map(|part| views.count(part)).sum();
    let (begun, taken) = (Instant::now(), processor_s());
    let kept = survivors_of(&views, RADIUS_GRID * PITCH, &RunContext::silent()).expect("it fits");
    let seconds = begun.elapsed().as_secs_f64();
    let wall = seconds * threads as f64;
    let taken = processor_s().zip(taken).map_or(wall, |(after, before)| after - before);
    let (million, each) = (count as f64 / 1e6, taken * 1e9 / count as f64);
    let (kept, peak) = (kept.len(), peak_mib().unwrap_or(f64::NAN));
    #[expect(clippy::print_stdout, reason = "what a benchmark is for")]
    {
        println!("| {judge} | {million:.2} | {kept} | {seconds:.2} | {each:.0} | {peak:.0} |");
    }
}

/// Files of views, with settings that merge them as the table does.
fn write_views(folder: &Path, million: usize) -> std::io::Result<()> {
    std::fs::create_dir_all(folder.join("views"))?;
    let radius = RADIUS_GRID * PITCH;
    let settings = format!(
        "schema = 1\nunit = \"mm\"\n[registration]\nenabled = false\n[merge]\nmetric = \"sigma_i\"\nradius = {radius}\n"
    );
    std::fs::write(folder.join("merge.toml"), settings)?;
    (0..VIEWS).into_par_iter().try_for_each(|k| {
        let (positions, scores) = view(k, million * 1_000_000, SCATTER);
        let mut file = std::fs::File::create(folder.join(format!("views/{k:03}.ply")))?;
        write_ply_cloud(&mut file, &positions, LengthUnit::Mm, None, None, &[("sigma_i", &scores)])
    })
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if let [word, folder, million] = &words[..]
        && word == "views"
    {
        let million = million.parse().expect("a number of million points");
        return write_views(Path::new(folder), million).expect("room on the disk");
    }
    let (mut judge, mut scatter) = ("scattered", SCATTER);
    for word in if words.is_empty() { ["1", "3", "10"].map(str::to_owned).to_vec() } else { words } {
        match word.parse() {
            Ok(million) => merge(million, judge, scatter),
            Err(_) => (judge, scatter) = ("smooth", 0.0),
        }
    }
}
