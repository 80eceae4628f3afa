//! Colours of views: the same on paper and on the screen.
//!
//! Views that lie beside each other mostly have numbers near each other, so that the list is made for neighbours: each next colour is the one that
//! stands off those before it the furthest, the last ten of them twice as far, for normal and for colour-blind eyes. All lie in the middle of
//! lightness, so that they are seen on white paper, and on the light and on the dark ground of the window. A unit test holds what is said here.

use super::palette::Rgb;

/// Points that are the mean of several views', and what was not measured.
pub const GREY: Rgb = [0xA6, 0xAD, 0xB5];

#[rustfmt::skip]
const VIEWS: [u32; 128] = [
    0x4284C6, 0xC62C16, 0x9A426E, 0x849A58, 0xC69A00, 0x6E58DC, 0x845842, 0xC6169A,
    0x00B084, 0xC684F2, 0xB09AC6, 0x2C842C, 0x586EC6, 0xB04216, 0xC66E9A, 0xF2586E,
    0x84B000, 0xC69A58, 0x426E42, 0xB02C84, 0x58B084, 0xC66EF2, 0x9A6EB0, 0x849ADC,
    0x4258C6, 0x008400, 0x9A586E, 0xC62C42, 0x9A9A16, 0xC68458, 0xF26EB0, 0xB04284,
    0x42B0C6, 0x9A6EF2, 0x9A58B0, 0x849AF2, 0x6E9A84, 0x426E00, 0xF22C6E, 0xB04242,
    0x9A8416, 0x008458, 0xF28442, 0xDC429A, 0xDC84C6, 0x426EF2, 0x8442B0, 0x9A84DC,
    0xC69A6E, 0x845816, 0xC66E84, 0x848442, 0x589A16, 0x166E58, 0xC60058, 0x6E6E9A,
    0x2CB0B0, 0x006EDC, 0xF26E2C, 0xDC6EDC, 0xF2846E, 0x84582C, 0xC68484, 0xC65884,
    0x84B042, 0x9A5800, 0xDC2C58, 0x6E589A, 0xB084B0, 0x6E6EDC, 0xDC6E00, 0x009ADC,
    0x428458, 0xB0422C, 0xDC8484, 0xDC4284, 0x42B02C, 0x6EB058, 0xC64200, 0x9A589A,
    0x849AC6, 0x006EC6, 0xB08400, 0x9A84F2, 0x6E8458, 0xC6002C, 0xB09A84, 0x426E6E,
    0xDC6E42, 0x2CB058, 0xC6006E, 0xF242B0, 0x16B0DC, 0x6E58B0, 0xC6849A, 0xB06E00,
    0x6E6E42, 0x5884F2, 0x6E9A6E, 0x426E84, 0xB09A00, 0x9A9A42, 0xB02C6E, 0xDC6EC6,
    0xF22C58, 0x6E58C6, 0x00B09A, 0x9A6E16, 0x586E2C, 0x429AF2, 0xF25884, 0x426E9A,
    0xC68400, 0xB09A42, 0x2C9A58, 0x9A84C6, 0x426E58, 0xDC4242, 0x58B09A, 0xC65816,
    0xB058C6, 0xB04258, 0x9A6E84, 0x9A4284, 0xDC846E, 0xC69A42, 0x589A58, 0xC684DC,
];

/// Colour of a view by its place among the files; after 128 they come again. Below 0, for a mean over several, grey.
pub fn view_colour(view: i32) -> Rgb {
    let Ok(view) = usize::try_from(view) else { return GREY };
    let [_, red, green, blue] = VIEWS[view % VIEWS.len()].to_be_bytes();
    [red, green, blue]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::palette::tests::{lab, luminance, visions};

    /// The least difference (CIELAB, 1976) between one of the first colours and one of those before it, so many back at most.
    fn least(vision: &nalgebra::Matrix3<f64>, count: i32, back: i32) -> f64 {
        let pairs = (0..count).flat_map(|k| ((k - back).max(0)..k).map(move |j| [j, k]));
        pairs
            .map(|pair| pair.map(|v| lab(view_colour(v), vision)))
            .map(|[a, b]| (a - b).norm())
            .fold(f64::INFINITY, f64::min)
    }

    /// About 2 is what the eye just tells of areas side by side. Half of the scale's promise (`palette`) is asked of a dozen views for every eye,
    /// more for normal ones; of a hundred, whose colours fill all of the room that lightness leaves, several times what is just told.
    #[test]
    fn a_hundred_views_are_told_apart_and_neighbours_by_every_eye() {
        for (name, vision) in visions() {
            let [dozen, neighbours] = [least(&vision, 12, 12), least(&vision, 128, 10)];
            assert!(dozen >= 13.0, "{name}, the first dozen: {dozen:.1}");
            assert!(neighbours >= 9.0, "{name}, ten beside each other: {neighbours:.1}");
        }
        let (_, normal) = visions()[0];
        let [dozen, neighbours, all] = [(12, 12), (128, 10), (128, 128)].map(|(n, back)| least(&normal, n, back));
        assert!(dozen >= 25.0 && neighbours >= 18.0 && all >= 9.0, "{dozen:.1} {neighbours:.1} {all:.1}");
        assert_eq!((view_colour(-1), view_colour(128)), (GREY, view_colour(0)));
    }

    /// The contrast ratio of WCAG against paper and both grounds of the window; 2 is where an area begins to stand out, 3 what a thin line needs.
    #[test]
    fn every_view_is_seen_on_paper_and_on_both_grounds() {
        for ground in [[0xFF, 0xFF, 0xFF], [0xEE, 0xF1, 0xF4], [0x20, 0x26, 0x2E]] {
            for view in 0..128 {
                let [a, b] = [ground, view_colour(view)].map(|c| luminance(c) + 0.05);
                assert!(a.max(b) / a.min(b) >= 2.2, "view {view} on {ground:?}: {:.2}", a.max(b) / a.min(b));
            }
        }
    }
}
