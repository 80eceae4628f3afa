//! A fringe-projection endoscope with the magnitudes of the paper (Hinz, Kästner, Reithmeier 2020): many small overlapping views, points of
//! different quality, the error of every point known.
//!
//! **Errors.** A point is wrong along the camera's ray through its pixel. Its random part has a plateau and grows as the signal falls; a
//! smooth part, the deviation of the camera model, is a function of the place in the measuring volume, the same in all views of one sensor, and
//! grows with the distance to the nearest calibrated feature; where there is hardly any signal left some points have a wrong phase.
//!
//! Lengths are in the unit of the [`SensorModel`]: µm for the paper's sensor, mm for the large one. View frame: camera in the origin, looking
//! along z, columns along x, rows along y.

mod bias;
pub mod calibration;
pub mod files;
pub mod poses;
pub mod scene;
pub mod sensor;
pub mod surface;
pub mod view;

pub use calibration::{CalibratedVolume, CalibrationMark};
pub use files::{Dataset, write_dataset};
pub use poses::{PriorError, facing};
pub use scene::{Scene, Station};
pub use sensor::SensorModel;
pub use surface::{Pocket, Shape, Surface};
pub use view::SimulatedView;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What a stream of random numbers is for; each use has its own.
#[derive(Debug, Clone, Copy)]
enum Stream {
    Boards,
    Bias,
    Poses,
    Priors,
    /// View and row.
    Row(usize, u32),
}

/// The random numbers for one use.
fn stream(seed: u64, of: Stream) -> ChaCha8Rng {
    let index = match of {
        Stream::Boards => 0,
        Stream::Bias => 1,
        Stream::Poses => 2,
        Stream::Priors => 3,
        Stream::Row(view, row) => (1 << 60) | ((view as u64) << 24) | u64::from(row),
    };
    // Away from the streams of the conveyor's rig.
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x656e_646f_7363_6f70);
    rng.set_stream(index);
    rng
}
