//! The colours and sizes of the window, light and dark; nothing else in the window names a colour.
//!
//! The palette of deviations is `report::palette`, the same on paper.

use crate::inspect::Verdict;
use egui::Color32;

const fn rgb(hex: u32) -> Color32 {
    Color32::from_rgb((hex >> 16) as u8, (hex >> 8) as u8, hex as u8)
}

/// Sizes of text in points: the whole scale of the window.
pub mod size {
    /// Notes and axes.
    pub const NOTE: f32 = 12.0;
    /// Tables.
    pub const TABLE: f32 = 13.0;
    /// Running text.
    pub const BODY: f32 = 14.0;
    /// Titles of bars.
    pub const BAR: f32 = 16.0;
    /// Titles of forms and cards.
    pub const CARD: f32 = 18.0;
    /// The verdict in a header, and the worst points.
    pub const HEADER: f32 = 24.0;
    /// What runs now, and the verdict's sentence.
    pub const NOW: f32 = 32.0;
}

/// The roles of colours. Contrasts and distances between verdicts are held by tests.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Theme {
    /// Whether it is the dark one.
    pub dark: bool,
    /// Behind the cards.
    pub window: Color32,
    /// Cards and bars.
    pub panel: Color32,
    /// Buttons, grids, empty bars.
    pub raised: Color32,
    /// Behind a 3D view.
    pub scene: Color32,
    /// Thin lines.
    pub stroke: Color32,
    /// Frames of controls.
    pub strong_stroke: Color32,
    /// Text.
    pub text: Color32,
    /// Text of less weight.
    pub quiet: Color32,
    /// Focus, choice, what goes on.
    pub accent: Color32,
    /// Text on the accent.
    pub on_accent: Color32,
    /// Behind what is chosen.
    pub choice: Color32,
    /// In tolerance.
    pub pass: Color32,
    /// Out of tolerance.
    pub fail: Color32,
    /// Cannot be decided: as a shape.
    pub undecided: Color32,
    /// Cannot be decided: as text.
    pub undecided_text: Color32,
    /// Not measured, incomplete, refused.
    pub unmeasured: Color32,
    /// Behind a pass.
    pub pass_fill: Color32,
    /// Behind a fail.
    pub fail_fill: Color32,
    /// Behind an undecided part.
    pub undecided_fill: Color32,
    /// Behind what was not measured.
    pub unmeasured_fill: Color32,
    /// The features of the alignment.
    pub feature: Color32,
    /// What a click snaps to.
    pub snap: Color32,
    /// A direction that leads out of the sheet.
    pub outward: Color32,
    /// The mark on a filled shape.
    pub mark: Color32,
    /// The mark on the undecided shape.
    pub mark_undecided: Color32,
}

impl Theme {
    /// For bright rooms.
    pub const LIGHT: Theme = Theme {
        dark: false,
        window: rgb(0xF1F3F5),
        panel: rgb(0xFFFFFF),
        raised: rgb(0xE6EAEE),
        scene: rgb(0xEEF1F4),
        stroke: rgb(0xCBD2D9),
        strong_stroke: rgb(0x8B96A3),
        text: rgb(0x171D24),
        quiet: rgb(0x4E5965),
        accent: rgb(0x1D5C9E),
        on_accent: rgb(0xFFFFFF),
        choice: rgb(0xD9E7F5),
        pass: rgb(0x00808A),
        fail: rgb(0xC02F1D),
        undecided: rgb(0xE0A000),
        undecided_text: rgb(0x7A5600),
        unmeasured: rgb(0x2B3038),
        pass_fill: rgb(0xD8EFF0),
        fail_fill: rgb(0xFBE3DF),
        undecided_fill: rgb(0xFCF0CF),
        unmeasured_fill: rgb(0xE4E7EB),
        feature: rgb(0x1E7B45),
        snap: rgb(0xE0A000),
        outward: rgb(0xC02F1D),
        mark: rgb(0xFFFFFF),
        mark_undecided: rgb(0x241A00),
    };

    /// For dark rooms.
    pub const DARK: Theme = Theme {
        dark: true,
        window: rgb(0x12161B),
        panel: rgb(0x1B2027),
        raised: rgb(0x272E37),
        scene: rgb(0x20262E),
        stroke: rgb(0x39424D),
        strong_stroke: rgb(0x6B7785),
        text: rgb(0xE8ECF0),
        quiet: rgb(0xA9B4C0),
        accent: rgb(0x7DB4EE),
        on_accent: rgb(0x0E1317),
        choice: rgb(0x223B57),
        pass: rgb(0x23A3A9),
        fail: rgb(0xF2553A),
        undecided: rgb(0xF5B400),
        undecided_text: rgb(0xF5B400),
        unmeasured: rgb(0xF2F5F8),
        pass_fill: rgb(0x16393D),
        fail_fill: rgb(0x43201B),
        undecided_fill: rgb(0x3A2F0E),
        unmeasured_fill: rgb(0x2B323B),
        feature: rgb(0x5BD08C),
        snap: rgb(0xF5B400),
        outward: rgb(0xF2553A),
        mark: rgb(0x0E1317),
        mark_undecided: rgb(0x241A00),
    };

    /// The theme that egui shows now.
    pub fn of(ctx: &egui::Context) -> &'static Theme {
        match ctx.theme() {
            egui::Theme::Light => &Self::LIGHT,
            egui::Theme::Dark => &Self::DARK,
        }
    }

    /// The colour of a verdict's shape.
    pub fn verdict(&self, verdict: Verdict) -> Color32 {
        match verdict {
            Verdict::Pass => self.pass,
            Verdict::Undecided => self.undecided,
            Verdict::NotMeasured => self.unmeasured,
            Verdict::Fail => self.fail,
        }
    }

    /// The colour of a verdict's word.
    pub fn verdict_text(&self, verdict: Verdict) -> Color32 {
        if verdict == Verdict::Undecided { self.undecided_text } else { self.verdict(verdict) }
    }

    /// The colour behind a verdict.
    pub fn verdict_fill(&self, verdict: Verdict) -> Color32 {
        match verdict {
            Verdict::Pass => self.pass_fill,
            Verdict::Undecided => self.undecided_fill,
            Verdict::NotMeasured => self.unmeasured_fill,
            Verdict::Fail => self.fail_fill,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of sRGB, as WCAG 2 defines it.
    fn luminance(colour: Color32) -> f64 {
        let linear = |c: u8| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(colour.r()) + 0.7152 * linear(colour.g()) + 0.0722 * linear(colour.b())
    }

    fn contrast(a: Color32, b: Color32) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// WCAG 2 asks 4.5 of text and 3 of large text and of signs.
    #[test]
    fn text_and_signs_can_be_read_on_what_is_behind_them() {
        for theme in [&Theme::LIGHT, &Theme::DARK] {
            for text in [theme.text, theme.quiet, theme.accent, theme.undecided_text] {
                assert!(contrast(text, theme.panel) >= 4.5, "{text:?} on {:?}", theme.panel);
            }
            for behind in [theme.pass_fill, theme.fail_fill, theme.undecided_fill, theme.unmeasured_fill, theme.window]
            {
                assert!(contrast(theme.text, behind) >= 4.5 && contrast(theme.quiet, behind) >= 4.5, "{behind:?}");
            }
            assert!(contrast(theme.on_accent, theme.accent) >= 4.5);
            for verdict in [Verdict::Pass, Verdict::Undecided, Verdict::NotMeasured, Verdict::Fail] {
                let behind = theme.verdict_fill(verdict);
                assert!(contrast(theme.verdict_text(verdict), behind) >= 3.0, "{verdict:?} dark {}", theme.dark);
            }
            for filled in [theme.pass, theme.fail, theme.unmeasured] {
                assert!(contrast(theme.mark, filled) >= 3.0, "{filled:?}");
            }
            assert!(contrast(theme.mark_undecided, theme.undecided) >= 3.0);
        }
    }
}
