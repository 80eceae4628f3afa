//! The colours of a scene that are not deviations.

use super::legend::HATCH;
use super::renderer::Tones;
use crate::gui::theme::Theme;
use crate::report::palette::Rgb;
use egui::Color32;

/// The colours of a theme for the renderer.
pub fn tones(theme: &Theme) -> Tones {
    let rgb = |c: Color32| -> Rgb { [c.r(), c.g(), c.b()] };
    Tones {
        background: rgb(theme.scene),
        outline: if theme.dark { [0x0A, 0x0D, 0x10] } else { [0x39, 0x42, 0x4D] },
        cad: if theme.dark { [0xB4, 0xBC, 0xC6] } else { [0xB9, 0xC2, 0xCD] },
        reverse: [0xA6, 0xAD, 0xB5],
        hatch: HATCH,
        flagged: if theme.dark { [0xE8, 0xEC, 0xF0] } else { [0x2B, 0x30, 0x38] },
        removed: [0x8B, 0x96, 0xA3],
    }
}
