//! A cloud without a CAD: points in colours of their own.

use super::super::renderer::{CloudRequest, Lens, Progress};
use super::upload::UploadedPoints;
use super::{
    Canvas, ClearState, GlRenderer, HARD_POINTS, Look, Mat4, SOFT_MOVING_POINTS, SOFT_POINTS, View, ViewSize,
    colour_texture, draw_in, point_px, samples, unit,
};
use std::sync::Arc;

impl GlRenderer {
    /// Goes on with the picture of a view.
    pub(super) fn cloud(&mut self, view: usize, request: &CloudRequest) -> Result<Progress, String> {
        if self.views.len() <= view {
            self.views.resize_with(view + 1, View::default);
        }
        // Taken out while it is drawn, so that the rest of the renderer can be looked at.
        let mut mine = std::mem::take(&mut self.views[view]);
        let same = mine.cloud.as_ref().is_some_and(|r| r.same_picture(request));
        let drawn = if same && mine.done { Ok(Progress::Done) } else { self.go_on(&mut mine, request, same) };
        self.views[view] = mine;
        drawn
    }

    fn go_on(&self, mine: &mut View, request: &CloudRequest, same: bool) -> Result<Progress, String> {
        match &mut mine.points {
            Some(points) if Arc::ptr_eq(&points.of, &request.points) => points.colour(&self.context, &request.colours),
            points => *points = Some(UploadedPoints::new(&self.context, &request.points, &request.colours)),
        }
        if !same {
            let samples = samples(request.size_px, request.moving);
            if mine.canvas.as_ref().is_none_or(|c| !c.fits(request.size_px, samples)) {
                mine.canvas = Some(Canvas::new(&self.context, request.size_px, samples));
            }
            (mine.request, mine.cloud) = (None, Some(request.clone()));
            (mine.points_drawn, mine.done) = (0, false);
        }
        let View { canvas: Some(canvas), points: Some(points), .. } = mine else {
            return Err("no picture to draw into".into());
        };
        let [width, height] = request.size_px;
        let size = ViewSize { width: f64::from(width), height: f64::from(height) };
        let lens = Lens::of(&request.camera, &crate::geometry::Point3::origin(), points.radius, size);
        if !same {
            let [r, g, b] = request.background.map(unit);
            let clear = ClearState { red: Some(r), green: Some(g), blue: Some(b), alpha: Some(1.0), depth: Some(1.0) };
            canvas.target().clear(clear);
        }
        let all = request.points.positions.len();
        let (portion, most) = match (self.card, request.moving) {
            (true, _) => (HARD_POINTS, all),
            (false, false) => (SOFT_POINTS, all),
            (false, true) => (SOFT_MOVING_POINTS, all.min(SOFT_MOVING_POINTS)),
        };
        if mine.points_drawn < most {
            let to = (mine.points_drawn + portion).min(most);
            self.coloured(request, canvas, points, &lens, [mine.points_drawn, to], most);
            mine.points_drawn = to;
        }
        if mine.points_drawn >= most {
            if mine.picture.as_ref().is_none_or(|p| (p.width(), p.height()) != (width, height)) {
                mine.picture = Some(colour_texture(&self.context, width, height));
            }
            if let Some(picture) = &mine.picture {
                let look = Look {
                    mm_per_px: request.camera.height_mm / f64::from(height),
                    outlined: false,
                    projection: request.camera.projection,
                    line: request.background,
                };
                self.compose(&look, canvas, &lens, picture);
            }
            mine.done = true;
        }
        Ok(if mine.done { Progress::Done } else { Progress::More })
    }

    /// Draws some of the points.
    fn coloured(
        &self,
        request: &CloudRequest,
        canvas: &Canvas,
        points: &UploadedPoints,
        lens: &Lens,
        [from, to]: [usize; 2],
        of: usize,
    ) {
        let target = canvas.target();
        let viewport = target.viewport();
        let program = &self.programs.coloured;
        program.use_uniform("clip_from_scene", Mat4::from(lens.clip_from_scene));
        let px = f64::from(request.size_px[1]) / request.camera.height_mm;
        let point_px = point_px(request.points.spacing * px, request.points.positions.len(), of);
        program.use_uniform("point_px", (point_px * f64::from(canvas.samples)) as f32);
        draw_in(&target, || {
            program.use_vertex_attribute("position", &points.positions);
            program.use_vertex_attribute("shown_colour", &points.colours);
            // SAFETY: both buffers hold at least `to` points.
            unsafe { self.draw_points(program, viewport, [from, to]) };
        });
    }
}
