//! The program's mark as the window's icon: the bent sheet over its line, drawn here so that there is no picture to keep.

use super::theme::Theme;
use egui::{IconData, Pos2, pos2, vec2};

/// Pixels a side.
const SIDE: usize = 64;

/// The bent sheet, in units of the mark's width from its left middle; also drawn beside the program's name.
pub(super) const BEND: [[f32; 2]; 6] = [[0.0, 0.25], [0.2, 0.2], [0.4, -0.2], [0.6, -0.3], [0.8, -0.1], [1.0, 0.05]];

/// White on a square of the accent's colour with round corners.
pub(super) fn icon() -> IconData {
    let bend: Vec<Pos2> = BEND.iter().map(|[x, y]| pos2(12.0 + 40.0 * x, 30.0 + 40.0 * y)).collect();
    let line = [pos2(12.0, 50.0), pos2(52.0, 50.0)];
    let accent = Theme::LIGHT.accent;
    let mut rgba = Vec::with_capacity(4 * SIDE * SIDE);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let at = pos2(x as f32 + 0.5, y as f32 + 0.5);
            // How much of the pixel lies inside, from the distance to the edge.
            let cover = |inside: f32| (inside + 0.5).clamp(0.0, 1.0);
            let square = cover(-corner_distance(at));
            let sheet = cover(3.2 - distance(at, &bend));
            let rule = 0.7 * cover(1.6 - distance(at, &line));
            let white = sheet.max(rule);
            let mix = |c: u8| (f32::from(c) + white * (255.0 - f32::from(c))).round() as u8;
            rgba.extend([mix(accent.r()), mix(accent.g()), mix(accent.b()), (255.0 * square).round() as u8]);
        }
    }
    IconData { rgba, width: SIDE as u32, height: SIDE as u32 }
}

/// Distance to a square of the icon's size with corners of radius 12, negative inside.
fn corner_distance(at: Pos2) -> f32 {
    let half = 0.5 * SIDE as f32;
    let beyond = (at - pos2(half, half)).abs() - vec2(half - 12.0, half - 12.0);
    beyond.max(egui::Vec2::ZERO).length() + beyond.max_elem().min(0.0) - 12.0
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
}
