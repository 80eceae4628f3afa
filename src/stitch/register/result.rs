//! What registration tells.

use crate::geometry::{Isometry3, Point3};
use crate::run::Cancelled;
use crate::stitch::StitchError;
use nalgebra::Matrix6;

/// All views placed or left out, and how well it fits.
#[derive(Debug, Clone, PartialEq)]
pub struct Registration {
    /// One of each view, in the order given.
    pub views: Vec<ViewOutcome>,
    /// All pairs that were tried, by their views' names; views are told by their places in the order given.
    pub pairs: Vec<Pair>,
    /// How pairs contradict each other around a ring.
    pub cycles: Vec<Cycle>,
    /// Motions that the overlaps do not hold.
    pub weak: Vec<Weak>,
    /// What the world's frame is.
    pub gauge: Gauge,
    /// Standard deviation of a point about the surface: the middle one of the views'.
    pub noise: f64,
}

/// What became of a view.
#[derive(Debug, Clone, PartialEq)]
pub enum ViewOutcome {
    /// It has its place.
    Placed(Box<Placed>),
    /// It is not used.
    LeftOut(LeftOut),
}

impl ViewOutcome {
    /// Where it lies, if it does.
    pub fn placed(&self) -> Option<&Placed> {
        match self {
            Self::Placed(placed) => Some(placed),
            Self::LeftOut(_) => None,
        }
    }
}

/// A view in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// The pose.
    pub world_from_view: Isometry3,
    /// Where its points' middle lies, world frame: turns of the covariance are about it.
    pub middle: Point3,
    /// Covariance of turn (rad) and shift about the middle, world frame. Motions that neither neighbours nor a prior hold have the size of the
    /// view. Zero for the view that is the gauge.
    pub covariance: Matrix6<f64>,
    /// How far its middle lies from where the prior has it, if there is one.
    pub moved: Option<f64>,
    /// How far it is turned against the prior, rad.
    pub turned_rad: Option<f64>,
    /// Share of what neighbours see in the same place that agrees with this view; no number without neighbours.
    pub agreement: f64,
}

impl Placed {
    /// Standard uncertainty of where the middle lies, the largest over all directions.
    pub fn translation_u(&self) -> f64 {
        self.largest(3)
    }

    /// Standard uncertainty of the turn, the largest over all axes, rad.
    pub fn rotation_u_rad(&self) -> f64 {
        self.largest(0)
    }

    fn largest(&self, from: usize) -> f64 {
        let block = self.covariance.fixed_view::<3, 3>(from, from).into_owned();
        crate::geometry::decompose::symmetric_eigenvalues(block).map_or(f64::NAN, |v| v.max().max(0.0).sqrt())
    }
}

/// A view that is not used.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Its name.
    pub name: String,
    /// Why, with numbers.
    pub reason: String,
}

/// Two views that may overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The one whose name comes first.
    pub a: usize,
    /// The other one.
    pub b: usize,
    /// Points of the smaller view that lie on the other one.
    pub shared: usize,
    /// Share of the smaller view's points that they are.
    pub share: f64,
    /// Root mean square of the distances, along the normal, of single points of one view from the other's surface. No number where nothing overlaps.
    pub rms: f64,
    /// Mean of the distances of `a` above `b`, towards the sensor.
    pub mean: f64,
    /// Share of what both see in the same place that agrees.
    pub agreement: f64,
    /// Whether it shares in the result.
    pub state: PairState,
}

/// Whether a pair shares in the result.
#[derive(Debug, Clone, PartialEq)]
pub enum PairState {
    /// It does, with a weight of 0 to 1 by how well it agrees with the other pairs.
    Used {
        /// The weight.
        weight: f64,
    },
    /// It does not.
    Rejected {
        /// Why, with numbers.
        why: String,
    },
}

impl Pair {
    /// Whether it shares in the result.
    pub fn is_used(&self) -> bool {
        matches!(self.state, PairState::Used { .. })
    }
}

/// A ring of pairs, each registered by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// Its views, each the neighbour of the next, the last of the first.
    pub views: Vec<usize>,
    /// Where going round the ring ends beside its beginning.
    pub translation: f64,
    /// By which angle, rad.
    pub angle_rad: f64,
    /// The translation to expect from the pairs' covariances, one standard deviation.
    pub expected_translation: f64,
    /// The angle to expect, rad.
    pub expected_angle_rad: f64,
    /// Root mean square of the closure error in its standard deviations: about one where pairs tell their uncertainty well.
    pub normalised: f64,
}

/// A motion that overlaps do not hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Weak {
    /// Whose.
    pub view: usize,
    /// Root mean square displacement of the view's points that one standard deviation of this motion is; infinite where the neighbours
    /// hold it not at all.
    pub uncertainty: f64,
    /// The motion, who holds it instead and how well.
    pub words: String,
}

/// What the world's frame is.
#[derive(Debug, Clone, PartialEq)]
pub enum Gauge {
    /// That of the priors.
    Priors,
    /// That of a view, since no pose was known before: the placed one whose name comes first.
    View(usize),
}

/// Why nothing was registered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegisterError {
    /// There are no views.
    #[error("found no view, expected at least one")]
    NoViews,
    /// There are not as many priors as views.
    #[error("found {priors} poses for {views} views, expected one of each (or none known)")]
    Priors {
        /// Priors given.
        priors: usize,
        /// Views given.
        views: usize,
    },
    /// A coordinate is no number.
    #[error("{name}: point {index} is not finite; leave such points out when the view is read")]
    NotFinite {
        /// The view.
        name: String,
        /// The point's index in it.
        index: usize,
    },
    /// A prior is no pose.
    #[error("{name}: its pose has {what}, expected finite numbers and standard uncertainties above 0")]
    Prior {
        /// The view.
        name: String,
        /// What is wrong.
        what: String,
    },
    /// An option out of its range.
    #[error("{what}")]
    Option {
        /// What is wrong.
        what: String,
    },
    /// The points are too few for their extent.
    #[error("{name}: {message}")]
    Extent {
        /// The view.
        name: String,
        /// What was found.
        message: String,
    },
    /// A view's points cannot be fetched.
    #[error("{0}")]
    NotFetched(Box<StitchError>),
    /// Somebody stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
