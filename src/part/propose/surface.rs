//! A surface point where the click meets the CAD.

use super::{NoProposal, Picker, Proposal, Ray};
use crate::plan::Geometry;

impl Picker {
    /// A surface point: the place that is hit, with the CAD's normal.
    ///
    /// # Errors
    /// The ray passes the part.
    pub fn surface_point(&self, ray: &Ray) -> Result<Proposal, NoProposal> {
        let hit = self.hit(ray)?;
        let mut proposal = Proposal::new(Geometry::Surface { position: hit.point, direction: hit.normal });
        if hit.sharp {
            proposal.note = Some("beside a sharp bend: the direction is that of one facet of the CAD".to_owned());
        }
        Ok(proposal)
    }
}
