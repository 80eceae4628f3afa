//! Patches picked so that the pose stays held (after Gelfand, Rusinkiewicz, Ikemoto and Levoy 2003).

use super::matches::row;
use super::surface::Surface;
use crate::geometry::{Point3, Vector3, decompose};
use nalgebra::{Matrix6, Vector6};

/// Of candidates, in rising order, `most` at most: half of them evenly along the list, the others those that hold the weakest motions best.
pub(super) fn picked(surface: &Surface, candidates: &[u32], most: usize) -> Vec<u32> {
    if candidates.len() <= most {
        return candidates.to_vec();
    }
    let mut taken = vec![false; candidates.len()];
    let even = most / 2;
    for k in 0..even {
        taken[k * candidates.len() / even] = true;
    }
    holding(surface, candidates, &mut taken, most - even);
    candidates.iter().zip(&taken).filter(|(_, taken)| **taken).map(|(k, _)| *k).collect()
}

/// Takes as many more that hold what is held least so far.
fn holding(surface: &Surface, candidates: &[u32], taken: &mut [bool], wanted: usize) {
    let centres = || candidates.iter().map(|k| surface.patches[*k as usize].centre);
    let first = surface.patches[candidates[0] as usize].centre;
    let middle: Point3 = first + centres().map(|c| c - first).sum::<Vector3>() / candidates.len() as f64;
    let extent = (centres().map(|c| (c - middle).norm_squared()).sum::<f64>() / candidates.len() as f64).sqrt();
    let lever = 1.0 / extent.max(f64::MIN_POSITIVE);
    let rows: Vec<Vector6<f64>> = candidates
        .iter()
        .map(|k| &surface.patches[*k as usize])
        .map(|p| row(&((p.centre - middle) * lever), &p.normal))
        .collect();
    let matrix = rows.iter().fold(Matrix6::zeros(), |sum, r| sum + r * r.transpose());
    let Some(eigen) = decompose::symmetric_eigen(matrix) else { return };
    let strengths: Vec<Vector6<f64>> =
        rows.iter().map(|r| (eigen.eigenvectors.transpose() * r).map(|s| s * s)).collect();
    let mut order: [Vec<u32>; 6] = std::array::from_fn(|_| (0..candidates.len() as u32).collect());
    for (k, list) in order.iter_mut().enumerate() {
        list.sort_by(|a, b| strengths[*b as usize][k].total_cmp(&strengths[*a as usize][k]));
    }
    let mut next = [0; 6];
    let mut held = Vector6::zeros();
    strengths.iter().zip(taken.iter()).filter(|(_, taken)| **taken).for_each(|(s, _)| held += s);
    for _ in 0..wanted {
        let weakest = held.imin();
        while taken[order[weakest][next[weakest]] as usize] {
            next[weakest] += 1;
        }
        let chosen = order[weakest][next[weakest]] as usize;
        taken[chosen] = true;
        held += strengths[chosen];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::RunContext;
    use crate::stitch::register::synthetic_tests::{Part, look};

    /// A sheet that is flat but for one dent: few patches hold it in its plane, and these must be among those picked.
    #[test]
    fn a_dent_in_a_flat_sheet_is_picked() {
        let view = look(&Part::dented(), "v", [0.0, 0.0], 20.0, 0.3, 0.001, 3).view;
        let surface = Surface::new(&view, None, &RunContext::silent()).ok().unwrap();
        let all: Vec<u32> = (0..surface.patches.len() as u32).collect();
        let picked = picked(&surface, &all, all.len() / 5);
        assert!(picked.len() == all.len() / 5 && picked.is_sorted());
        let even: Vec<u32> = all.iter().step_by(5).copied().collect();
        assert!(weakest(&surface, &picked) > 2.0 * weakest(&surface, &even));
    }

    /// How strongly patches hold the motion that they hold least.
    fn weakest(surface: &Surface, list: &[u32]) -> f64 {
        let row_of = |k: &u32| {
            let patch = &surface.patches[*k as usize];
            row(&((patch.centre - surface.middle) / surface.extent), &patch.normal)
        };
        let matrix = list.iter().map(row_of).fold(Matrix6::zeros(), |sum, r| sum + r * r.transpose());
        decompose::symmetric_eigenvalues(matrix).unwrap().min()
    }
}
