//! Contents on the graphics card: uploaded once.

use crate::gui::scene::content::{Cloud, MapContent, PartContent};
use crate::gui::scene::points::Points;
use crate::gui::scene::shape::Shape;
use std::sync::Arc;
use three_d::{Context, DepthTest, ElementBuffer, Program, RenderStates, VertexBuffer, Viewport};

/// How finely a surface is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// All triangles.
    Fine,
    /// A few, while the picture moves.
    Coarse,
}

pub struct UploadedShape {
    pub positions: VertexBuffer<[f32; 3]>,
    pub normals: VertexBuffer<[f32; 3]>,
    pub triangles: ElementBuffer<u32>,
    pub coarse: ElementBuffer<u32>,
}

pub struct UploadedPart {
    pub of: Arc<PartContent>,
    pub cad: UploadedShape,
    pub map: UploadedShape,
    pub outline: VertexBuffer<[f32; 3]>,
    pub radius_mm: f64,
}

pub struct UploadedMap {
    pub of: Arc<MapContent>,
    pub values: VertexBuffer<[f32; 4]>,
    pub cloud: Option<UploadedCloud>,
    pub radius_mm: f64,
}

pub struct UploadedCloud {
    pub positions: VertexBuffer<[f32; 3]>,
    pub values: VertexBuffer<f32>,
    pub classes: VertexBuffer<u8>,
    pub count: usize,
}

/// A cloud without a CAD.
pub struct UploadedPoints {
    pub of: Arc<Points>,
    pub coloured_by: Arc<Vec<[u8; 4]>>,
    pub positions: VertexBuffer<[f32; 3]>,
    pub colours: VertexBuffer<[u8; 4]>,
    pub radius: f64,
}

impl UploadedPoints {
    pub fn new(context: &Context, of: &Arc<Points>, colours: &Arc<Vec<[u8; 4]>>) -> Self {
        Self {
            of: of.clone(),
            coloured_by: colours.clone(),
            positions: VertexBuffer::new_with_data(context, &of.positions),
            colours: VertexBuffer::new_with_data(context, colours),
            radius: radius(&of.positions),
        }
    }

    /// The same points in other colours.
    pub fn colour(&mut self, context: &Context, colours: &Arc<Vec<[u8; 4]>>) {
        if !Arc::ptr_eq(&self.coloured_by, colours) {
            self.colours = VertexBuffer::new_with_data(context, colours);
            self.coloured_by = colours.clone();
        }
    }
}

impl UploadedShape {
    fn new(context: &Context, shape: &Shape, coarse: &[u32]) -> Self {
        Self {
            positions: VertexBuffer::new_with_data(context, &shape.positions),
            normals: VertexBuffer::new_with_data(context, &shape.normals),
            triangles: ElementBuffer::new_with_data(context, &shape.triangles),
            coarse: ElementBuffer::new_with_data(context, coarse),
        }
    }

    pub fn draw(&self, program: &Program, values: Option<&VertexBuffer<[f32; 4]>>, detail: Detail, viewport: Viewport) {
        let triangles = match detail {
            Detail::Fine => &self.triangles,
            Detail::Coarse => &self.coarse,
        };
        if triangles.count() == 0 {
            return;
        }
        program.use_vertex_attribute("position", &self.positions);
        program.use_vertex_attribute("normal", &self.normals);
        if let Some(values) = values {
            program.use_vertex_attribute("value", values);
        }
        program.draw_elements(states(), viewport, triangles);
    }
}

impl UploadedPart {
    pub fn new(context: &Context, of: &Arc<PartContent>) -> Self {
        Self {
            of: of.clone(),
            cad: UploadedShape::new(context, &of.cad, &of.cad_coarse),
            map: UploadedShape::new(context, &of.map, &of.map_coarse),
            outline: VertexBuffer::new_with_data(context, &of.outline),
            radius_mm: radius(&of.cad.positions).max(radius(&of.map.positions)),
        }
    }
}

impl UploadedMap {
    pub fn new(context: &Context, of: &Arc<MapContent>) -> Self {
        let values = VertexBuffer::new_with_data(context, &of.values);
        Self { of: of.clone(), values, cloud: None, radius_mm: radius(&of.cloud.positions) }
    }
}

impl UploadedCloud {
    pub fn new(context: &Context, cloud: &Cloud) -> Self {
        Self {
            positions: VertexBuffer::new_with_data(context, &cloud.positions),
            values: VertexBuffer::new_with_data(context, &cloud.values),
            classes: VertexBuffer::new_with_data(context, &cloud.classes),
            count: cloud.positions.len(),
        }
    }
}

fn radius(positions: &[[f32; 3]]) -> f64 {
    let norm_sq = |p: &[f32; 3]| p.iter().map(|c| f64::from(*c) * f64::from(*c)).sum::<f64>();
    positions.iter().map(norm_sq).fold(1.0, f64::max).sqrt()
}

/// Nearer things hide others.
pub fn states() -> RenderStates {
    RenderStates { depth_test: DepthTest::LessOrEqual, ..RenderStates::default() }
}
