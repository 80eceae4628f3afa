//! Voids beside a rim, put there or not.

use super::data::Region;
use super::jackknife::{self, Estimate, SECTORS};
use super::newton::refine;
use super::outline::MAX_SHAPE;
use super::sectors::{Raster, sector};
use super::simulated::{CLEAN, Pattern, scatter};
use super::voids::Cut;
use super::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const H: f64 = CLEAN.spacing;

fn points_around<O: Outline>(outline: &O, pattern: &Pattern, seed: u64, reach: f64) -> Vec<[f64; 2]> {
    let mut points = scatter(outline, 7.0, pattern, &mut ChaCha8Rng::seed_from_u64(seed));
    points.retain(|p| p[0].hypot(p[1]) < reach);
    points
}

const HOLE: Circle = Circle { centre: [0.0, 0.0], radius: 4.0 };
const REACH: f64 = 5.5;

fn fit(points: &[[f64; 2]]) -> SoftEdgeFit<Circle> {
    fit_soft_edge(points, &Window::disc(REACH), &HOLE, &SoftEdgeSettings::new(H)).unwrap()
}

#[test]
fn a_void_at_the_rim_is_cut_out_and_does_not_pull() {
    let mut pull = Vec::new();
    for seed in 0..10 {
        let all = points_around(&HOLE, &Pattern { dropout: 0.2, ..CLEAN }, seed, REACH);
        // A round void of 2.5 mm about a place of the rim takes 5 of its 25 mm.
        let void: Vec<[f64; 2]> = all.iter().filter(|p| (p[0] - 4.0).hypot(p[1]) > 2.5).copied().collect();
        let (whole, cut) = (fit(&all), fit(&void));
        assert!(whole.kept.is_none() && whole.outline_seen == 1.0);
        // What is cut out is longer by two squares of 1.5 spacings at either end at most: 6.1 mm.
        assert!(cut.kept.is_some() && (0.75..0.81).contains(&cut.outline_seen), "{}", cut.outline_seen);
        // A fifth of the rim taken away moves the centre by less than three times what is left uncertain.
        let moved = cut.outline.centre[0] - whole.outline.centre[0];
        assert!(moved.abs() < 3.0 * cut.information[(0, 0)].sqrt(), "{moved}");
        // Of the same points without the cut the void pulls the outline to its side.
        let pulled = refine_soft_edge(&void, &Window::disc(REACH), &HOLE, &SoftEdgeSettings::new(H)).unwrap();
        pull.push(pulled.outline.centre[0] - cut.outline.centre[0]);
    }
    // Nine tenths of the rim hold it against the force of `lambda0` per mm of the void's stretch: by `2 tau L_void / 0.9 L`, half of that in
    // the centre: 0.008 mm for a blur of 0.04 mm. The same points in both, the pull hardly scatters.
    assert!(pull.iter().all(|p| (0.001..0.012).contains(p)), "{pull:?}");
}

#[test]
fn a_void_off_the_rim_costs_no_outline() {
    let all = points_around(&HOLE, &CLEAN, 3, REACH + 1.0);
    let void: Vec<[f64; 2]> = all.into_iter().filter(|p| (p[0] - 5.6).hypot(p[1]) > 0.8).collect();
    let window = Window::disc(REACH + 1.0);
    let fit = fit_soft_edge(&void, &window, &HOLE, &SoftEdgeSettings::new(H)).unwrap();
    let kept = fit.kept.unwrap();
    // All squares of a disc of 0.8 mm, and those next to them: 2 to 6 mm².
    let taken = window.moments[0] - kept.moments[0];
    assert!(fit.outline_seen == 1.0 && (2.0..6.0).contains(&taken), "{} {taken}", fit.outline_seen);
    // The density is that of the lattice, to three standard errors of a Poisson count of 1,500.
    assert!((fit.density_per_mm2 * H * H - 1.0).abs() < 3.0 / 1500_f64.sqrt(), "{}", fit.density_per_mm2 * H * H);
}

#[test]
fn chance_is_no_void() {
    for pattern in [CLEAN, Pattern { dropout: 0.3, ..CLEAN }, Pattern { lattice: false, ..CLEAN }] {
        let fits: Vec<_> = (0..30).map(|seed| fit(&points_around(&HOLE, &pattern, seed, REACH))).collect();
        let cut = fits.iter().filter(|fit| fit.kept.is_some()).count();
        // Of windows of independent points one in ten may show a void: 3 of 30, and three standard deviations. None costs much of the rim.
        assert!(cut <= if pattern.lattice { 0 } else { 8 }, "{cut}");
        assert!(fits.iter().all(|fit| fit.outline_seen > 0.9));
    }
}

#[test]
fn where_half_the_rim_is_hidden_half_of_it_is_told_as_seen() {
    let points = points_around(&HOLE, &CLEAN, 5, REACH);
    let half: Vec<[f64; 2]> = points.into_iter().filter(|p| p[0] > 0.0).collect();
    let seen = fit(&half).outline_seen;
    // To a square of 1.5 spacings at either end, and a stretch: 0.75 mm of 25 mm each.
    assert!((0.42..0.52).contains(&seen), "{seen}");
}

/// Squares of a fine raster beside one sector after the other.
fn without_sector<O: Outline>(raster: &Raster, outline: &O, left_out: usize) -> Cut {
    let beside = |place: [f64; 2]| sector(outline.along(place), SECTORS) == left_out;
    let cells = raster.cells.iter().map(|c| c.part > 0.0 && beside(c.place)).collect();
    Cut { cells, outline_left: 1.0 - 1.0 / SECTORS as f64 }
}

/// Sums of squares over sectors and seeds, for each parameter: of the jackknife's steps, of what fits without the sector move by, and of
/// the differences.
fn steps_and_fits<O: Outline>(truth: &O, window: &Window, inside: impl Fn(&[f64; 2]) -> bool) -> [[f64; 3]; MAX_SHAPE] {
    // A rim blurred by half a spacing; at a sharper one single points decide, and a step may lead too far.
    let pattern = Pattern { dropout: 0.2, noise: 0.08, ..CLEAN };
    let settings = SoftEdgeSettings { tolerance: 1e-6, ..SoftEdgeSettings::new(H) };
    let region = Region::whole(window);
    let mut squares = [[0.0; 3]; MAX_SHAPE];
    for seed in 0..8 {
        let mut points = scatter(truth, 7.0, &pattern, &mut ChaCha8Rng::seed_from_u64(seed));
        points.retain(&inside);
        let whole = refine(&points, &region, truth, &settings).unwrap();
        let fine = Raster::new(&points, window, truth, 0.2 * H);
        let estimate = Estimate {
            points: &points,
            region: &region,
            raster: &Raster::new(&points, window, truth, 1.5 * H),
            cut: None,
            state: &whole.state,
            clutter: settings.clutter,
            gradient_sigma: settings.gradient_sigma,
            free: &whole.free,
        };
        for (j, step) in jackknife::moves(&estimate, 1.0).unwrap().into_iter().enumerate() {
            let cut = without_sector(&fine, &whole.state.outline, j);
            let left = cut.region(window, &fine, H);
            let again = refine(&cut.kept(&points, &fine), &left, &whole.state.outline, &settings).unwrap();
            let (from, to) = (whole.state.outline.parameters(), again.state.outline.parameters());
            for k in 0..O::SHAPE {
                let moved = to[k] - from[k];
                squares[k] = [
                    squares[k][0] + step[k].powi(2),
                    squares[k][1] + moved.powi(2),
                    squares[k][2] + (moved - step[k]).powi(2),
                ];
            }
        }
    }
    squares
}

#[test]
fn a_step_without_a_sector_leads_where_a_fit_without_it_ends() {
    let check = |squares: [[f64; 3]; MAX_SHAPE], parameters: usize, [size, apart]: [f64; 2]| {
        for (k, [step, moved, difference]) in squares.map(|s| s.map(f64::sqrt)).iter().enumerate().take(parameters) {
            assert!((step / moved).ln().abs() < size, "parameter {k}: {step} against {moved}");
            assert!(difference < &(apart * moved), "parameter {k}: {difference} of {moved}");
        }
    };
    // The step leaves out how the information changes on the way: with a twelfth of the rim some twelfth of it, twice that for
    // what few sectors tell.
    let disc = |reach: f64| (Window::disc(reach), move |p: &[f64; 2]| p[0].hypot(p[1]) < reach);
    let (window, inside) = disc(5.5);
    check(steps_and_fits(&HOLE, &window, inside), 3, [0.1, 0.2]);
    let (window, inside) = disc(6.5);
    let slot = Slot { centre: [0.0, 0.0], angle: 0.3, half_straight: 3.0, radius: 2.0 };
    // Its place along is held by the two ends alone, a sector or two each.
    check(steps_and_fits(&slot, &window, inside), 5, [0.25, 0.7]);
    // A twelfth of an edge of 60 spacings are four points, of which one may decide: as large on the whole, each less alike.
    let edge = Edge { offset: 0.0, slope: 0.0, along: [-5.0, 5.0], outer_mm: 1.0 };
    let inside = |p: &[f64; 2]| p[0].abs() < 5.0 && (-1.5..1.0).contains(&p[1]);
    check(steps_and_fits(&edge, &Window::rectangle([-5.0, -1.5], [5.0, 1.0]), inside), 2, [0.25, 0.7]);
}
