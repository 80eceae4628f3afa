//! The scene drawn with OpenGL, in the window's own context.
//!
//! Everything is uploaded once and drawn into textures that are kept: the window repaints whenever the pointer moves, and must then only
//! show them. A picture in motion has one sample a pixel and, without a graphics card, a part of the points; the still one has four
//! samples and all points, drawn a portion a frame so that no frame takes long.
#![allow(unsafe_code, reason = "three-d draws triangles only; points and lines need its context's own calls")]

mod cloud;
mod upload;

use super::camera::{Projection, ViewSize};
use super::renderer::{CloudRequest, Layer, Lens, Placement, Progress, Request, SceneRenderer};
use crate::report::palette::Rgb;
use std::sync::Arc;
use three_d::context::{self, HasContext};
use three_d::{
    ClearState, Context, DepthTest, DepthTexture2D, Interpolation, Mat3, Mat4, Program, RenderStates, RenderTarget,
    ScissorBox, Texture2D, Vec2, Vec3, VertexBuffer, Viewport, Wrapping, WriteMask,
};
use upload::{Detail, UploadedCloud, UploadedMap, UploadedPart, UploadedPoints, states};

const SURFACE_VERT: &str = include_str!("shaders/surface.vert");
const SCALE: &str = include_str!("shaders/scale.glsl");

/// Points drawn in one frame without a graphics card: they take 40 to 60 ms.
const SOFT_POINTS: usize = 150_000;
/// Points drawn while the camera moves without a graphics card.
const SOFT_MOVING_POINTS: usize = 100_000;
/// The same with one.
const HARD_POINTS: usize = 4_000_000;
/// Samples across a pixel of a still picture.
const STILL_SAMPLES: u32 = 2;
/// A still picture has at most so many samples; beyond, one a pixel.
const MOST_SAMPLES: u32 = 24_000_000;

/// Waits until everything that was asked of OpenGL is drawn; only for measuring times. The context must be current.
pub fn finish(gl: &context::Context) {
    // SAFETY: waits, and changes nothing.
    unsafe { gl.finish() }
}

/// Draws into textures of the window's context.
pub struct GlRenderer {
    context: Context,
    programs: Programs,
    /// Corners of a triangle over everything. Drawing without any attribute would leave no vertex array bound.
    everything: VertexBuffer<[f32; 2]>,
    /// A graphics card draws, not the processor.
    card: bool,
    part: Option<UploadedPart>,
    map: Option<UploadedMap>,
    views: Vec<View>,
}

struct Programs {
    cad: Program,
    map: Program,
    points: Program,
    coloured: Program,
    lines: Program,
    compose: Program,
    show: Program,
}

/// A view's picture, and the one that is being drawn.
#[derive(Default)]
struct View {
    request: Option<Request>,
    /// The cloud without a CAD that it shows instead.
    cloud: Option<CloudRequest>,
    points: Option<UploadedPoints>,
    canvas: Option<Canvas>,
    /// Points of the request that are drawn.
    points_drawn: usize,
    done: bool,
    picture: Option<Texture2D>,
}

/// How samples become a picture.
struct Look {
    mm_per_px: f64,
    /// Jumps in depth have a line.
    outlined: bool,
    projection: Projection,
    line: Rgb,
}

struct Canvas {
    colour: Texture2D,
    depth: DepthTexture2D,
    samples: u32,
}

impl GlRenderer {
    /// In the window's context, which must be current here and in every call.
    pub fn new(gl: Arc<context::Context>) -> Result<Self, String> {
        // SAFETY: the context is current, as the caller promises; the call only asks for a name.
        let name = unsafe { gl.get_parameter_string(context::RENDERER) }.to_lowercase();
        let soft = ["llvmpipe", "softpipe", "swrast", "swiftshader", "software", "basic render"];
        let context = Context::from_gl_context(gl).map_err(|e| e.to_string())?;
        let program =
            |vertex: &str, fragment: &str| Program::from_source(&context, vertex, fragment).map_err(|e| e.to_string());
        let with_scale = |fragment: &str| format!("{SCALE}\n{fragment}");
        let programs = Programs {
            cad: program(SURFACE_VERT, include_str!("shaders/cad.frag"))?,
            map: program(
                &format!("#define WITH_VALUES\n{SURFACE_VERT}"),
                &with_scale(include_str!("shaders/map.frag")),
            )?,
            points: program(include_str!("shaders/points.vert"), &with_scale(include_str!("shaders/points.frag")))?,
            coloured: program(include_str!("shaders/coloured.vert"), include_str!("shaders/coloured.frag"))?,
            lines: program(include_str!("shaders/lines.vert"), include_str!("shaders/lines.frag"))?,
            compose: program(include_str!("shaders/screen.vert"), include_str!("shaders/compose.frag"))?,
            show: program(include_str!("shaders/screen.vert"), include_str!("shaders/show.frag"))?,
        };
        let card = !soft.iter().any(|s| name.contains(s));
        let everything = VertexBuffer::new_with_data(&context, &[[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]);
        Ok(Self { context, programs, everything, card, part: None, map: None, views: Vec::new() })
    }

    fn upload(&mut self, request: &Request) {
        if self.part.as_ref().is_none_or(|p| !Arc::ptr_eq(&p.of, &request.part)) {
            self.part = Some(UploadedPart::new(&self.context, &request.part));
        }
        match &request.map {
            Some(map) if self.map.as_ref().is_none_or(|m| !Arc::ptr_eq(&m.of, map)) => {
                self.map = Some(UploadedMap::new(&self.context, map));
            }
            _ => {}
        }
        if let (Layer::Cloud, Some(map)) = (request.layer, &mut self.map) {
            map.cloud.get_or_insert_with(|| UploadedCloud::new(&self.context, &map.of.cloud));
        }
    }

    /// Draws everything but the points.
    fn begin(&self, request: &Request, canvas: &Canvas, lens: &Lens) {
        let [r, g, b] = request.tones.background.map(unit);
        let target = canvas.target();
        target.clear(ClearState { red: Some(r), green: Some(g), blue: Some(b), alpha: Some(1.0), depth: Some(1.0) });
        let (Some(part), viewport) = (&self.part, target.viewport()) else { return };
        let detail = if request.moving && !self.card { Detail::Coarse } else { Detail::Fine };
        draw_in(&target, || match (request.layer, self.map_of(request)) {
            (Layer::Surface, Some(map)) => {
                let program = &self.programs.map;
                set_lens(program, lens);
                set_scale(program, request);
                program.use_uniform("reverse_colour", colour(request.tones.reverse));
                program.use_uniform("hatch_light", colour(request.tones.hatch[0]));
                program.use_uniform("hatch_dark", colour(request.tones.hatch[1]));
                program.use_uniform("hatch_px", (7.0 * request.px_per_point) as f32 * canvas.samples as f32);
                program.use_uniform("line_mm", (0.25 * request.scale.range_mm) as f32);
                let rows = f64::from(request.size_px[1] * canvas.samples);
                program.use_uniform("mm_per_px", (request.camera.height_mm / rows) as f32);
                part.map.draw(program, Some(&map.values), detail, viewport);
            }
            (Layer::Cloud, Some(_)) => self.lines(request, part, lens, viewport),
            _ => {
                let program = &self.programs.cad;
                set_lens(program, lens);
                program.use_uniform("cad_colour", colour(request.tones.cad));
                part.cad.draw(program, None, detail, viewport);
            }
        });
    }

    fn lines(&self, request: &Request, part: &UploadedPart, lens: &Lens, viewport: Viewport) {
        let program = &self.programs.lines;
        program.use_uniform("clip_from_scene", Mat4::from(lens.clip_from_scene));
        program.use_uniform("line_colour", colour(request.tones.outline));
        program.use_vertex_attribute("position", &part.outline);
        let count = part.outline.vertex_count() as i32;
        if count > 0 {
            // SAFETY: the bound buffer holds `count` positions.
            program.draw_with(states(), viewport, || unsafe { self.context.draw_arrays(context::LINES, 0, count) });
        }
    }

    /// Draws some of the points.
    fn points(&self, request: &Request, canvas: &Canvas, lens: &Lens, [from, to]: [usize; 2], of: usize) {
        let Some(cloud) = self.map_of(request).and_then(|m| m.cloud.as_ref()) else { return };
        let target = canvas.target();
        let viewport = target.viewport();
        let program = &self.programs.points;
        program.use_uniform("clip_from_scene", Mat4::from(lens.clip_from_scene));
        set_scale(program, request);
        program.use_uniform("flagged_colour", colour(request.tones.flagged));
        program.use_uniform("removed_colour", colour(request.tones.removed));
        program.use_uniform("shown_classes", i32::from(request.classes.0));
        let px_per_mm = f64::from(request.size_px[1]) / request.camera.height_mm;
        let point_px = point_px(request.spacing_mm * px_per_mm, cloud.count, of) * f64::from(canvas.samples);
        program.use_uniform("point_px", point_px as f32);
        draw_in(&target, || {
            program.use_vertex_attribute("position", &cloud.positions);
            program.use_vertex_attribute("deviation", &cloud.values);
            program.use_vertex_attribute("shown_class", &cloud.classes);
            // SAFETY: all three buffers hold at least `to` points.
            unsafe { self.draw_points(program, viewport, [from, to]) };
        });
    }

    /// Draws points of the buffers that are bound.
    ///
    /// # Safety
    /// Every one of the buffers holds at least `to` points.
    unsafe fn draw_points(&self, program: &Program, viewport: Viewport, [from, to]: [usize; 2]) {
        // SAFETY: as the caller says.
        program.draw_with(states(), viewport, || unsafe {
            if !self.context.version().is_embedded {
                self.context.enable(context::PROGRAM_POINT_SIZE);
            }
            self.context.draw_arrays(context::POINTS, from as i32, (to - from) as i32);
        });
    }

    /// Makes the picture that is shown out of the samples.
    fn compose(&self, look: &Look, canvas: &Canvas, lens: &Lens, picture: &Texture2D) {
        let program = &self.programs.compose;
        let target = picture.as_color_target(None);
        let near_far = lens.near_far_mm.map(|v| v as f32);
        let write = || {
            program.use_texture("colours", &canvas.colour);
            program.use_depth_texture("depths", &canvas.depth);
            program.use_uniform("samples", canvas.samples as i32);
            program.use_uniform("outline", if look.outlined { 1.0f32 } else { 0.0 });
            program.use_uniform("jump_mm", (4.0 * look.mm_per_px).max(1.5) as f32);
            program.use_uniform("near_far", Vec2::new(near_far[0], near_far[1]));
            program.use_uniform("perspective", i32::from(look.projection == Projection::Perspective));
            program.use_uniform("line_colour", colour(look.line));
            program.use_vertex_attribute("corner", &self.everything);
            program.draw_arrays(over_everything(), target.viewport(), 3);
            Ok::<(), three_d::CoreError>(())
        };
        let written = target.write(write);
        debug_assert!(written.is_ok(), "the closure cannot fail");
    }

    fn map_of(&self, request: &Request) -> Option<&UploadedMap> {
        let wanted = request.map.as_ref()?;
        self.map.as_ref().filter(|m| Arc::ptr_eq(&m.of, wanted))
    }

    fn lens(&self, request: &Request) -> Lens {
        let size = ViewSize { width: f64::from(request.size_px[0]), height: f64::from(request.size_px[1]) };
        let of_part = self.part.as_ref().map_or(1.0, |p| p.radius_mm);
        let of_map =
            if request.layer == Layer::Cloud { self.map_of(request).map_or(0.0, |m| m.radius_mm) } else { 0.0 };
        Lens::of(&request.camera, &request.part.centre, of_part.max(of_map), size)
    }
}

impl SceneRenderer for GlRenderer {
    fn draw(&mut self, view: usize, request: &Request) -> Result<Progress, String> {
        if self.views.len() <= view {
            self.views.resize_with(view + 1, View::default);
        }
        let same = self.views[view].request.as_ref().is_some_and(|r| r.same_picture(request));
        if same && self.views[view].done {
            return Ok(Progress::Done);
        }
        self.upload(request);
        let lens = self.lens(request);
        // Taken out while it is drawn, so that the rest of the renderer can be looked at.
        let mut mine = std::mem::take(&mut self.views[view]);
        if !same {
            let samples = samples(request.size_px, request.moving);
            if mine.canvas.as_ref().is_none_or(|c| !c.fits(request.size_px, samples)) {
                mine.canvas = Some(Canvas::new(&self.context, request.size_px, samples));
            }
            (mine.request, mine.cloud) = (Some(request.clone()), None);
            (mine.points_drawn, mine.done) = (0, false);
        }
        let Some(canvas) = &mine.canvas else { return Err("no picture to draw into".into()) };
        if !same {
            self.begin(request, canvas, &lens);
        }
        let all =
            if request.layer == Layer::Cloud { request.map.as_ref().map_or(0, |m| m.cloud.positions.len()) } else { 0 };
        let (portion, most) = match (self.card, request.moving) {
            (true, _) => (HARD_POINTS, all),
            (false, false) => (SOFT_POINTS, all),
            (false, true) => (SOFT_MOVING_POINTS, all.min(SOFT_MOVING_POINTS)),
        };
        if mine.points_drawn < most {
            let to = (mine.points_drawn + portion).min(most);
            self.points(request, canvas, &lens, [mine.points_drawn, to], most);
            mine.points_drawn = to;
        }
        if mine.points_drawn >= most {
            let [width, height] = request.size_px;
            if mine.picture.as_ref().is_none_or(|p| (p.width(), p.height()) != (width, height)) {
                mine.picture = Some(colour_texture(&self.context, width, height));
            }
            if let Some(picture) = &mine.picture {
                let look = Look {
                    mm_per_px: request.camera.height_mm / f64::from(request.size_px[1]),
                    outlined: request.layer != Layer::Cloud,
                    projection: request.camera.projection,
                    line: request.tones.outline,
                };
                self.compose(&look, canvas, &lens, picture);
            }
            mine.done = true;
        }
        let progress = if mine.done { Progress::Done } else { Progress::More };
        self.views[view] = mine;
        Ok(progress)
    }

    fn draw_cloud(&mut self, view: usize, request: &CloudRequest) -> Result<Progress, String> {
        self.cloud(view, request)
    }

    fn show(&mut self, view: usize, at: Placement) -> Result<(), String> {
        let Some(picture) = self.views.get(view).and_then(|v| v.picture.as_ref()) else { return Ok(()) };
        let program = &self.programs.show;
        let window = RenderTarget::screen(&self.context, at.window[0], at.window[1]);
        let [x, y, width, height] = at.clip;
        let clip = ScissorBox { x, y, width: width.max(0) as u32, height: height.max(0) as u32 };
        let [left, bottom, across, up] = at.view;
        let viewport = Viewport { x: left, y: bottom, width: across.max(0) as u32, height: up.max(0) as u32 };
        let shown = window.write_partially(clip, || {
            program.use_texture("picture", picture);
            program.use_vertex_attribute("corner", &self.everything);
            program.draw_arrays(over_everything(), viewport, 3);
            Ok::<(), three_d::CoreError>(())
        });
        shown.map(|_| ()).map_err(|e| e.to_string())
    }
}

impl Canvas {
    fn new(context: &Context, [width, height]: [u32; 2], samples: u32) -> Self {
        let (w, h) = (width * samples, height * samples);
        let depth = DepthTexture2D::new::<f32>(context, w, h, Wrapping::ClampToEdge, Wrapping::ClampToEdge);
        Self { colour: colour_texture(context, w, h), depth, samples }
    }

    fn fits(&self, [width, height]: [u32; 2], samples: u32) -> bool {
        (self.colour.width(), self.colour.height(), self.samples) == (width * samples, height * samples, samples)
    }

    fn target(&self) -> RenderTarget<'_> {
        RenderTarget::new(self.colour.as_color_target(None), self.depth.as_depth_target())
    }
}

fn samples(size_px: [u32; 2], moving: bool) -> u32 {
    let pixels = size_px[0].saturating_mul(size_px[1]);
    let fine = pixels.saturating_mul(STILL_SAMPLES * STILL_SAMPLES) <= MOST_SAMPLES;
    if moving || !fine { 1 } else { STILL_SAMPLES }
}

fn colour_texture(context: &Context, width: u32, height: u32) -> Texture2D {
    let (near, edge) = (Interpolation::Nearest, Wrapping::ClampToEdge);
    Texture2D::new_empty::<[u8; 4]>(context, width, height, near, near, None, edge, edge)
}

fn draw_in(target: &RenderTarget<'_>, draw: impl FnOnce()) {
    let written = target.write(|| {
        draw();
        Ok::<(), three_d::CoreError>(())
    });
    debug_assert!(written.is_ok(), "the closure cannot fail");
}

fn over_everything() -> RenderStates {
    RenderStates { write_mask: WriteMask::COLOR, depth_test: DepthTest::Always, ..RenderStates::default() }
}

fn set_lens(program: &Program, lens: &Lens) {
    program.use_uniform("clip_from_scene", Mat4::from(lens.clip_from_scene));
    program.use_uniform("eye_from_scene", Mat3::from(lens.eye_from_scene));
}

fn set_scale(program: &Program, request: &Request) {
    let stops = request.scale.palette.stops();
    let mut colours = [Vec3::new(0.0, 0.0, 0.0); 9];
    for (place, &stop) in colours.iter_mut().zip(stops) {
        *place = colour(stop);
    }
    program.use_uniform_array("stops", &colours);
    program.use_uniform("stop_count", stops.len().min(9) as i32);
    program.use_uniform("range_mm", request.scale.range_mm as f32);
    program.use_uniform("bands", f32::from(request.scale.bands));
}

fn colour(rgb: Rgb) -> Vec3 {
    let [r, g, b] = rgb.map(unit);
    Vec3::new(r, g, b)
}

fn unit(channel: u8) -> f32 {
    f32::from(channel) / 255.0
}

/// Size of a point, pixels, by the distance of points: fewer of them are drawn larger, so that the surface stays closed.
fn point_px(spacing_px: f64, count: usize, drawn: usize) -> f64 {
    (1.25 * spacing_px * (count as f64 / drawn.max(1) as f64).sqrt()).clamp(1.5, 9.0)
}
