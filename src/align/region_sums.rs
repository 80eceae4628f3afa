//! The algebra of a fit to regions: normal equations of (shift in mm, turn in mm at the part's size) about the regions' middle, with
//! freedoms that are kept as they are.

use crate::fit::hold::Twist;
use crate::geometry::{Isometry3, Point3, Vector3, decompose};
use crate::plan::{Freedom, RegionFit};
use nalgebra::{DMatrix, DVector, Matrix6, Translation3, UnitQuaternion, Vector6};

/// Below this share of the strongest motion a motion is free (`fit::hold` has the same).
const FREE: f64 = 1e-4;

/// About what the numbers are told, and which of them may change.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub middle: Point3,
    pub length_mm: f64,
    pub frozen: [bool; 6],
}

/// Normal equations: `h x = -g`, and the variance of `g`.
#[derive(Clone)]
pub(super) struct Normal {
    pub h: Matrix6<f64>,
    pub g: Vector6<f64>,
    pub variance: Matrix6<f64>,
}

impl Frame {
    pub fn of(fit: &RegionFit, length_mm: f64) -> Self {
        let frozen = Freedom::ALL.map(|(_, freedom)| fit.freeze.contains(&freedom));
        Self { middle: fit.middle(), length_mm, frozen }
    }

    /// What shift and turn do to the distance of a place to a plane.
    pub fn slope(&self, at: &Point3, normal: &Vector3) -> Vector6<f64> {
        let turn = (at - self.middle).cross(normal) / self.length_mm;
        Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z)
    }

    /// The motion of six numbers.
    pub fn motion(&self, x: &Vector6<f64>) -> Isometry3 {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x[3], x[4], x[5]) / self.length_mm);
        let shift = Translation3::from(self.middle.coords + Vector3::new(x[0], x[1], x[2]));
        Isometry3::from_parts(shift, turn) * Translation3::from(-self.middle.coords)
    }

    /// The six numbers of a motion.
    pub fn numbers(&self, motion: &Isometry3) -> Vector6<f64> {
        let shift = motion * self.middle - self.middle;
        let turn = motion.rotation.scaled_axis() * self.length_mm;
        Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
    }

    /// The same motion in words' terms.
    pub fn twist(&self, x: &Vector6<f64>) -> Twist {
        let (shift, turn) = (Vector3::new(x[0], x[1], x[2]), Vector3::new(x[3], x[4], x[5]));
        Twist { centre: self.middle, shift, turn, length_mm: self.length_mm }
    }

    /// Places of the numbers that may change.
    fn free(&self) -> Vec<usize> {
        (0..6).filter(|&k| !self.frozen[k]).collect()
    }

    /// A vector of the free numbers among six.
    fn widened(&self, values: &DVector<f64>) -> Vector6<f64> {
        let mut wide = Vector6::zeros();
        for (k, value) in self.free().into_iter().zip(values.iter()) {
            wide[k] = *value;
        }
        wide
    }

    fn block(&self, matrix: &Matrix6<f64>) -> DMatrix<f64> {
        let free = self.free();
        DMatrix::from_fn(free.len(), free.len(), |r, c| matrix[(free[r], free[c])])
    }

    /// How many times more strongly the best held of the free motions is held than the weakest, and that one.
    ///
    /// # Errors
    /// The motions that stay free.
    pub fn judged(&self, h: &Matrix6<f64>) -> Result<(f64, Twist), Vec<Twist>> {
        let Some(eigen) = decompose::symmetric_eigen(self.block(h)) else { return Err(Vec::new()) };
        let strength = |k: usize| eigen.eigenvalues[k].max(0.0).sqrt();
        let strongest = (0..eigen.eigenvalues.len()).map(strength).fold(0.0, f64::max);
        let motion = |k: usize| self.twist(&self.widened(&eigen.eigenvectors.column(k).into_owned()));
        let all = 0..eigen.eigenvalues.len();
        let free: Vec<Twist> = all.clone().filter(|&k| strength(k) <= FREE * strongest).map(motion).collect();
        let weakest = all.min_by(|&a, &b| strength(a).total_cmp(&strength(b)));
        match weakest {
            Some(weakest) if free.is_empty() => Ok((strongest / strength(weakest), motion(weakest))),
            _ => Err(free),
        }
    }

    /// The step that solves the normal equations in the free numbers; `None` where they leave one open.
    pub fn step(&self, h: &Matrix6<f64>, g: &Vector6<f64>) -> Option<Vector6<f64>> {
        let free = self.free();
        let right = DVector::from_fn(free.len(), |k, _| -g[free[k]]);
        let step = self.block(h).cholesky()?.solve(&right);
        step.iter().all(|v| v.is_finite()).then(|| self.widened(&step))
    }

    /// Independent motions, each as likely as one standard uncertainty: those of the free numbers from the scatter, and what each error
    /// of the frozen ones (motions of the whole best fit) does to all.
    pub fn uncertain_motions(&self, normal: &Normal, whole: &[Isometry3]) -> Option<Vec<Isometry3>> {
        let inverse = self.block(&normal.h).cholesky()?.inverse();
        let covariance = &inverse * self.block(&normal.variance) * inverse.transpose();
        let axes = decompose::symmetric_eigen(covariance)?;
        let from_scatter = (0..axes.eigenvalues.len()).map(|k| {
            let step = axes.eigenvectors.column(k) * axes.eigenvalues[k].max(0.0).sqrt();
            self.motion(&self.widened(&step.into_owned()))
        });
        let mut motions: Vec<Isometry3> = from_scatter.collect();
        if self.frozen.contains(&true) {
            for motion in whole {
                let numbers = self.numbers(motion);
                let kept = Vector6::from_fn(|k, _| if self.frozen[k] { numbers[k] } else { 0.0 });
                motions.push(self.motion(&(kept + self.step(&normal.h, &(normal.h * kept))?)));
            }
        }
        motions.iter().all(|m| m.translation.vector.iter().all(|v| v.is_finite())).then_some(motions)
    }
}

impl Normal {
    pub fn zero() -> Self {
        Self { h: Matrix6::zeros(), g: Vector6::zeros(), variance: Matrix6::zeros() }
    }
}
