use super::*;

const EXACT: PriorError = PriorError { shift: 0.0, turn_rad: 0.0 };

/// Signed distance of a world place from the scene's shape.
fn off(scene: &Scene, p: &Point3) -> f64 {
    match scene.surface.shape {
        Shape::Plane => p.z,
        Shape::Sphere { radius } => p.coords.norm() - radius,
        Shape::Cylinder { radius } => p.y.hypot(p.z) - radius,
        Shape::Mesh(_) => f64::NAN,
    }
}

#[test]
fn views_have_the_papers_size_and_true_places_lie_on_the_surface() {
    for scene in [Scene::cylinder(EXACT, 3), Scene::plane(EXACT, 3), Scene::sphere(EXACT, 3)] {
        for k in 0..scene.stations.len() {
            let view = scene.view(k);
            let count = view.positions.len();
            assert!((25_000..36_500).contains(&count), "{}: {count} points", scene.name);
            for i in (0..count).step_by(97) {
                let place = scene.stations[k].world_from_view * view.true_position(i);
                // Errors are kept as f32: of 300 µm to 2e-5 µm.
                assert!(off(&scene, &place).abs() < 1e-3, "{}: {}", scene.name, off(&scene, &place));
            }
        }
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / count).sqrt()
}

#[test]
fn noise_falls_with_the_signal_and_bias_grows_with_the_distance_to_features() {
    let mut random = [Vec::new(), Vec::new()];
    let mut smooth = [Vec::new(), Vec::new()];
    for seed in 0..8 {
        let scene = Scene::sphere(EXACT, seed);
        let view = scene.view(0);
        for i in 0..view.positions.len() {
            let noise = f64::from(view.error[i] - view.bias[i]);
            match view.sigma_i[i] {
                s if s > 0.02 => random[0].push(noise),
                s if s < 0.002 => random[1].push(noise),
                _ => {}
            }
            match view.d_cal[i] {
                d if d < 100.0 => smooth[0].push(f64::from(view.bias[i])),
                d if d > 200.0 => smooth[1].push(f64::from(view.bias[i])),
                _ => {}
            }
        }
    }
    let of = |values: &[f64]| rms(values.iter().copied());
    // 5.5 µm, and (10 * 0.002 / 0.02)² on top at most: up to 5.59; 100,000 points tell that to 0.02.
    assert!((5.47..5.62).contains(&of(&random[0])), "{}", of(&random[0]));
    assert!(of(&random[1]) > 11.0, "{}", of(&random[1]));
    // 10 µm at 150 µm, with the square: below 4.4 µm, from 17.8 µm on; eight calibrations of some ten independent places each tell it to a fifth.
    assert!(of(&smooth[0]) < 4.5 && of(&smooth[1]) > 12.0, "{} {}", of(&smooth[0]), of(&smooth[1]));
}

/// Neighbouring pixels share the bias, not the noise.
#[test]
fn bias_is_smooth_and_noise_is_not() {
    let view = Scene::plane(EXACT, 5).view(0);
    let (mut bias_steps, mut noise_steps) = (Vec::new(), Vec::new());
    for i in 1..view.positions.len() {
        if view.pixels[i][0] == view.pixels[i - 1][0] && view.pixels[i][1] == view.pixels[i - 1][1] + 1 {
            bias_steps.push(f64::from(view.bias[i] - view.bias[i - 1]));
            let noise = |k: usize| f64::from(view.error[k] - view.bias[k]);
            noise_steps.push(noise(i) - noise(i - 1));
        }
    }
    let bias = rms(view.bias.iter().map(|b| f64::from(*b)));
    // A pitch of 9.25 µm against features 150 µm and waves 500 µm apart.
    assert!(rms(bias_steps.iter().copied()) < 0.25 * bias);
    let noise = rms(view.error.iter().zip(&view.bias).map(|(e, b)| f64::from(e - b)));
    let ratio = rms(noise_steps.iter().copied()) / noise;
    assert!((ratio - std::f64::consts::SQRT_2).abs() < 0.1, "{ratio}");
}

#[test]
fn the_same_seed_gives_the_same_view_with_any_number_of_threads() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let a = one.install(|| Scene::cylinder(EXACT, 9).view(1));
    let b = Scene::cylinder(EXACT, 9).view(1);
    assert_eq!(a, b);
    assert_ne!(a.positions, Scene::cylinder(EXACT, 10).view(1).positions);
}

/// Every place of the part is seen, most of them twice; wrong views see the other part and are named.
#[test]
fn a_hundred_views_cover_the_part() {
    let prior = PriorError { shift: 0.5, turn_rad: 1f64.to_radians() };
    let scene = Scene::part(100, 2, prior, 1);
    assert_eq!(scene.stations.len(), 102);
    let wrong: Vec<usize> = (0..102).filter(|k| scene.stations[*k].is_wrong).collect();
    assert_eq!(wrong.len(), 2);
    let mut counts = Vec::new();
    let mut seen = vec![0_u32; 0];
    let Shape::Mesh(mesh) = &scene.surface.shape else { panic!("the part is a mesh") };
    seen.resize(mesh.mesh.vertices.len(), 0);
    for station in scene.stations.iter().filter(|s| !s.is_wrong) {
        let view_from_world = station.world_from_view.inverse();
        for (count, vertex) in seen.iter_mut().zip(&mesh.mesh.vertices) {
            let p = view_from_world * vertex;
            let reach = scene.sensor.field_radius * p.z / scene.sensor.working_distance;
            *count += u32::from(p.x.hypot(p.y) < reach);
        }
        let turn = (station.prior * view_from_world).rotation.angle();
        assert!((turn - prior.turn_rad).abs() < 1e-9);
    }
    assert!(seen.iter().all(|n| *n >= 1) && seen.iter().filter(|n| **n >= 2).count() * 20 > seen.len() * 19);
    for k in [0, 37, wrong[0], 101] {
        counts.push(scene.view(k).positions.len());
    }
    assert!(counts.iter().all(|n| *n > 8_000), "{counts:?}");
}
