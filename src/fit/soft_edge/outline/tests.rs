use super::*;
use crate::fit::soft_edge::normal;

fn check_distance_derivatives<O: Outline>(outline: &O) {
    let d = 1e-6;
    for place in [[5.3, 0.4], [-1.2, 3.9], [6.1, -2.2], [-7.0, 1.0], [0.2, -1.1]] {
        let mut gradient = [0.0; MAX_SHAPE];
        outline.signed_mm(place, &mut gradient);
        for k in 0..O::SHAPE {
            let mut step = [0.0; MAX_SHAPE];
            let mut shifted = |by: f64| {
                step[k] = by;
                outline.moved(&step).signed_mm(place, &mut [0.0; MAX_SHAPE])
            };
            let slope = (shifted(d) - shifted(-d)) / (2.0 * d);
            // Central differences: rounding 1e-16/1e-6 * 10 mm, truncation 1e-12.
            assert!((slope - gradient[k]).abs() < 1e-7, "parameter {k} at {place:?}: {slope} {}", gradient[k]);
        }
    }
}

/// Void moments summed on a fine grid of the window against the closed form, and derivatives against differences.
fn check_void<O: Outline>(outline: &O, u: [f64; 2], v: [f64; 2], tau: f64) {
    let steps = 700;
    let (du, dv) = ((u[1] - u[0]) / steps as f64, (v[1] - v[0]) / steps as f64);
    let mut sum = [0.0; 3];
    for i in 0..steps {
        for j in 0..steps {
            let place = [u[0] + (i as f64 + 0.5) * du, v[0] + (j as f64 + 0.5) * dv];
            let s = outline.signed_mm(place, &mut [0.0; MAX_SHAPE]);
            let weight = (1.0 - normal::distribution_and_density(s / tau).0) * du * dv;
            sum = [sum[0] + weight, sum[1] + weight * place[0], sum[2] + weight * place[1]];
        }
    }
    let (moments, by) = outline.void(tau);
    for k in 0..3 {
        // Midpoint sums of a function blurred over tau > 10 steps are good to 1e-6 of the area.
        assert!((sum[k] - moments[k]).abs() < 2e-4, "moment {k}: {} {}", sum[k], moments[k]);
    }
    let d = 1e-6;
    for p in 0..=O::SHAPE {
        let shifted = |by: f64| {
            let mut step = [0.0; MAX_SHAPE];
            if p < O::SHAPE {
                step[p] = by;
                outline.moved(&step).void(tau).0
            } else {
                outline.void(tau + by).0
            }
        };
        let (up, down) = (shifted(d), shifted(-d));
        let analytic = if p < O::SHAPE { by[p] } else { by[MAX_SHAPE] };
        for k in 0..3 {
            assert!(((up[k] - down[k]) / (2.0 * d) - analytic[k]).abs() < 1e-6, "parameter {p} moment {k}");
        }
    }
}

#[test]
fn circle_distance_and_area() {
    let circle = Circle { centre: [0.3, -0.2], radius: 4.0 };
    check_distance_derivatives(&circle);
    check_void(&circle, [-7.0, 7.0], [-7.0, 7.0], 0.3);
}

#[test]
fn slot_distance_and_area() {
    let slot = Slot { centre: [0.3, -0.2], angle: 0.4, half_straight: 4.0, radius: 2.0 };
    check_distance_derivatives(&slot);
    check_void(&slot, [-9.0, 9.0], [-8.0, 8.0], 0.3);
    assert_eq!((slot.length_mm(), slot.width_mm()), (12.0, 4.0));
}

#[test]
fn places_around_an_outline_are_numbered_by_its_length() {
    let slot = Slot { centre: [1.0, 2.0], angle: 0.0, half_straight: 4.0, radius: 2.0 };
    let length = TAU * 2.0 + 16.0;
    let at = |x: f64, y: f64| slot.along([1.0 + x, 2.0 + y]) * length;
    let arc = PI * 2.0;
    for (place, expected) in [
        ((6.5, 0.0), 0.0),
        ((4.0, 2.2), 0.5 * arc),
        ((0.0, 2.0), 0.5 * arc + 4.0),
        ((-4.0 - 1e-9, 2.0), 0.5 * arc + 8.0),
        ((-6.0, 0.0), arc + 8.0),
        ((0.0, -2.0), 1.5 * arc + 12.0),
    ] {
        assert!((at(place.0, place.1) - expected).abs() < 1e-6, "{place:?}");
    }
    let circle = Circle { centre: [1.0, 2.0], radius: 3.0 };
    assert_eq!(circle.along([1.0, 7.0]), 0.25);
}

fn check_places<O: Outline>(outline: &O) {
    for k in 0..40 {
        let along = (f64::from(k) + 0.5) / 40.0;
        let place = outline.place_at(along);
        assert!(outline.signed_mm(place, &mut [0.0; MAX_SHAPE]).abs() < 1e-12, "{along}: {place:?}");
        // An angle is told to 4e-8 rad.
        assert!((outline.along(place) - along).abs() < 1e-8, "{along}: {place:?}");
    }
}

#[test]
fn places_on_an_outline_are_found_by_their_number() {
    check_places(&Circle { centre: [1.0, 2.0], radius: 3.0 });
    check_places(&Slot { centre: [1.0, 2.0], angle: 0.7, half_straight: 4.0, radius: 2.0 });
    check_places(&Edge { offset: 0.4, slope: 0.05, along: [-2.0, 1.5], outer_mm: 4.0 });
}

#[test]
fn edge_distance_and_area() {
    let edge = Edge { offset: 0.4, slope: 0.05, along: [-2.0, 1.5], outer_mm: 4.0 };
    check_distance_derivatives(&edge);
    check_void(&edge, [-2.0, 1.5], [-5.0, 4.0], 0.3);
}

#[test]
fn the_quick_angle_is_that_of_the_library() {
    for k in 0..4000 {
        let (sin, cos) = (f64::from(k) * 0.001_6 - 3.2).sin_cos();
        for size in [1e-9, 1.0, 30.0] {
            let (y, x) = (size * sin, size * cos);
            assert!((super::quick_angle(y, x) - y.atan2(x)).abs() < 5e-8, "{y} {x}");
        }
    }
    assert_eq!(super::quick_angle(0.0, 0.0), 0.0);
}
