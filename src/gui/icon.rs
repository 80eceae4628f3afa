//! The program's mark, the bent sheet over its line: the window's icon, and the pictures of the packages, drawn from one shape.

use super::theme::Theme;
use egui::{IconData, Pos2, pos2, vec2};

/// Units a side of the mark's square; the window's icon has so many pixels.
const SIDE: usize = 64;
/// Half the widths of the sheet and of the line below it, in those units.
const HALF_WIDTHS: [f32; 2] = [3.2, 1.6];
/// How much of the line's white is seen.
const LINE_SHARE: f32 = 0.7;
/// Radius of the square's corners.
const CORNER: f32 = 12.0;

/// The bent sheet, in units of the mark's width from its left middle; also drawn beside the program's name.
pub(super) const BEND: [[f32; 2]; 6] = [[0.0, 0.25], [0.2, 0.2], [0.4, -0.2], [0.6, -0.3], [0.8, -0.1], [1.0, 0.05]];

/// The window's icon.
pub(super) fn icon() -> IconData {
    IconData { rgba: pixels(SIDE), width: SIDE as u32, height: SIDE as u32 }
}

/// The mark as a PNG file of so many pixels a side.
pub fn mark_png(side: u32) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&pixels(side as usize))?;
    Ok(bytes)
}

/// The mark as an SVG file.
pub fn mark_svg() -> String {
    let line = |points: &[Pos2]| points.iter().map(|p| format!("{} {}", p.x, p.y)).collect::<Vec<_>>().join(" L");
    let [sheet, rule] = HALF_WIDTHS.map(|half| 2.0 * half);
    let accent = Theme::LIGHT.accent;
    let [r, g, b] = [accent.r(), accent.g(), accent.b()];
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{SIDE}\" height=\"{SIDE}\" viewBox=\"0 0 {SIDE} {SIDE}\">\n\
         <rect width=\"{SIDE}\" height=\"{SIDE}\" rx=\"{CORNER}\" fill=\"#{r:02x}{g:02x}{b:02x}\"/>\n\
         <g fill=\"none\" stroke=\"#ffffff\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n\
         <path stroke-width=\"{sheet}\" d=\"M{}\"/>\n\
         <path stroke-width=\"{rule}\" stroke-opacity=\"{LINE_SHARE}\" d=\"M{}\"/>\n\
         </g>\n</svg>\n",
        line(&bend()),
        line(&LINE)
    )
}

/// The sheet in units of the mark.
fn bend() -> [Pos2; 6] {
    BEND.map(|[x, y]| pos2(12.0 + 40.0 * x, 30.0 + 40.0 * y))
}

/// The line below it.
const LINE: [Pos2; 2] = [pos2(12.0, 50.0), pos2(52.0, 50.0)];

/// White on a square of the accent's colour with round corners; RGBA, row by row.
fn pixels(side: usize) -> Vec<u8> {
    let bend = bend();
    let [sheet_half, line_half] = HALF_WIDTHS;
    let accent = Theme::LIGHT.accent;
    let scale = side as f32 / SIDE as f32;
    let mut rgba = Vec::with_capacity(4 * side * side);
    for y in 0..side {
        for x in 0..side {
            let at = pos2((x as f32 + 0.5) / scale, (y as f32 + 0.5) / scale);
            // How much of the pixel lies inside, from the distance to the edge.
            let cover = |inside: f32| (inside * scale + 0.5).clamp(0.0, 1.0);
            let square = cover(-corner_distance(at));
            let sheet = cover(sheet_half - distance(at, &bend));
            let rule = LINE_SHARE * cover(line_half - distance(at, &LINE));
            let white = sheet.max(rule);
            let mix = |c: u8| (f32::from(c) + white * (255.0 - f32::from(c))).round() as u8;
            rgba.extend([mix(accent.r()), mix(accent.g()), mix(accent.b()), (255.0 * square).round() as u8]);
        }
    }
    rgba
}

/// Distance to a square of the icon's size with round corners, negative inside.
fn corner_distance(at: Pos2) -> f32 {
    let half = 0.5 * SIDE as f32;
    let beyond = (at - pos2(half, half)).abs() - vec2(half - CORNER, half - CORNER);
    beyond.max(egui::Vec2::ZERO).length() + beyond.max_elem().min(0.0) - CORNER
}

/// Distance to a line of several pieces.
fn distance(at: Pos2, line: &[Pos2]) -> f32 {
    let piece = |[a, b]: [Pos2; 2]| {
        let along = b - a;
        let share = ((at - a).dot(along) / along.length_sq()).clamp(0.0, 1.0);
        (at - (a + share * along)).length()
    };
    line.windows(2).map(|w| piece([w[0], w[1]])).fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_icon_has_the_mark_in_its_middle_and_nothing_in_its_corners() {
        let icon = icon();
        let pixel = |x: usize, y: usize| &icon.rgba[4 * (y * SIDE + x)..][..4];
        assert_eq!(icon.rgba.len(), 4 * SIDE * SIDE);
        assert_eq!([pixel(0, 0)[3], pixel(63, 63)[3], pixel(32, 4)[3]], [0, 0, 255]);
        // The sheet's crest: a point of the mark itself.
        assert_eq!(pixel(36, 18), [255, 255, 255, 255]);
    }

    #[test]
    fn the_packages_pictures_are_of_this_mark() {
        assert_eq!(include_str!("../../packaging/icons/shapeline.svg"), mark_svg());
        let files: [(u32, &[u8]); 4] = [
            (16, include_bytes!("../../packaging/icons/16.png")),
            (48, include_bytes!("../../packaging/icons/48.png")),
            (128, include_bytes!("../../packaging/icons/128.png")),
            (256, include_bytes!("../../packaging/icons/256.png")),
        ];
        for (side, file) in files {
            let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
            let mut found = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut found).unwrap();
            // A rounding of another machine may differ by one step.
            let same = found.iter().zip(pixels(side as usize)).all(|(a, b)| a.abs_diff(b) <= 1);
            assert!(same && found.len() == 4 * (side * side) as usize, "{side}: run the example make_icons");
        }
    }
}
