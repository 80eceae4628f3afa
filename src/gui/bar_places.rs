//! Where everything stands in the bar above the screens, by its width and the widths of its words: name, tabs, buttons.
//! What has no room gives way in that order: the name, the room around the tabs, the buttons into one menu, the size of the tabs' words.

use super::theme::size;
use egui::{Rect, pos2};

/// Free room at both ends.
const EDGE: f32 = 16.0;
/// Between two buttons: they are rare ones.
const GAP: f32 = 12.0;
/// Between the last tab and the first button at least.
const BETWEEN: f32 = 16.0;
/// What the program's mark and name take.
const NAME: f32 = 130.0;
/// Room around the words of a button.
const PAD: f32 = 32.0;
/// The least width of a button.
const BUTTON: f32 = 72.0;
/// Room for a tab's lock.
pub(super) const LOCK: f32 = 22.0;

/// How wide the words are.
#[derive(Debug, Clone)]
pub(super) struct Wishes {
    /// Of the tabs at `size::CARD`, the last one with its lock.
    pub tabs: Vec<f32>,
    /// Of the buttons from the right.
    pub buttons: Vec<f32>,
    /// Of the button that all others fold into.
    pub menu: f32,
}

/// Where it all stands.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BarPlaces {
    /// Mark and name.
    pub name: Option<Rect>,
    /// The tabs.
    pub tabs: Vec<Rect>,
    /// Size of their words; they shrink further where a tab is narrower than they are.
    pub font: f32,
    /// The buttons from the right; none when they are folded.
    pub buttons: Vec<Rect>,
    /// The button that they fold into.
    pub menu: Option<Rect>,
}

/// How high the bar is in a window.
pub(super) fn height(window: egui::Vec2) -> f32 {
    match () {
        () if window.y < 480.0 => 56.0,
        () if window.x < 1600.0 => 64.0,
        () => 72.0,
    }
}

/// Divides the bar.
pub(super) fn places(bar: Rect, wishes: &Wishes) -> BarPlaces {
    let width = |words: &f32| (words + PAD).max(BUTTON);
    let room = bar.width() - 2.0 * EDGE - BETWEEN;
    let buttons = wishes.buttons.iter().map(width).sum::<f32>() + GAP * (wishes.buttons.len() as f32 - 1.0);
    let menu = width(&wishes.menu);
    let tabs = |pad: f32, font: f32| wishes.tabs.iter().map(|w| w * font / size::CARD + pad).sum::<f32>();
    // In bars that are folded, too, there is a size below which words are hard to read.
    let choices = [
        (NAME, 48.0, size::CARD, false),
        (0.0, 48.0, size::CARD, false),
        (0.0, 32.0, size::CARD, false),
        (0.0, 48.0, size::CARD, true),
        (0.0, 32.0, size::CARD, true),
        (0.0, 20.0, size::BAR, true),
        (0.0, 14.0, size::BODY, true),
        (0.0, 12.0, size::NOTE, true),
    ];
    let fits = |&(name, pad, font, folded): &(f32, f32, f32, bool)| {
        name + tabs(pad, font) + if folded { menu } else { buttons } <= room
    };
    let last = choices[choices.len() - 1];
    let (name, pad, font, folded) = choices.into_iter().find(fits).unwrap_or(last);
    let mut right = bar.right() - EDGE;
    let mut next = |wide: f32| {
        let button = Rect::from_min_max(pos2(right - wide, bar.top() + 4.0), pos2(right, bar.bottom() - 4.0));
        right = button.left() - GAP;
        button.shrink2(egui::vec2(0.0, if bar.height() < 60.0 { 0.0 } else { 4.0 }))
    };
    let buttons = if folded { Vec::new() } else { wishes.buttons.iter().map(|w| next(width(w))).collect() };
    let menu = folded.then(|| next(menu));
    // Where even that is too little, the tabs share what is left.
    let left = bar.left() + EDGE + name;
    let most = right + GAP - BETWEEN - left;
    let squeeze = (most / tabs(pad, font)).min(1.0);
    let mut x = left;
    let tab = |words: &f32| {
        let from = x;
        x += squeeze * (words * font / size::CARD + pad);
        Rect::from_min_max(pos2(from, bar.top()), pos2(x, bar.bottom()))
    };
    let tabs = wishes.tabs.iter().map(tab).collect();
    let name = (name > 0.0).then(|| Rect::from_min_max(pos2(bar.left() + EDGE, bar.top()), pos2(left, bar.bottom())));
    BarPlaces { name, tabs, font, buttons, menu }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::action::Screen;
    use crate::gui::fonts;
    use crate::gui::text::{Language, Words};
    use egui::vec2;

    /// The words of a language, measured.
    fn wishes(ui: &egui::Ui, language: Language) -> Wishes {
        super::super::bar::wishes(ui, Words::of(language))
    }

    #[test]
    fn nothing_in_the_bar_overlaps_and_the_words_of_tabs_are_whole_in_every_language_and_width() {
        let ctx = egui::Context::default();
        fonts::install(&ctx);
        let _ = ctx.run_ui(egui::RawInput::default(), |ui| {
            for language in Language::ALL {
                let wishes = wishes(ui, language);
                assert_eq!((wishes.tabs.len(), wishes.buttons.len()), (Screen::ALL.len(), 4));
                for width in 480..=3840 {
                    let window = vec2(width as f32, if width % 2 == 0 { 360.0 } else { 1080.0 });
                    let bar = Rect::from_min_size(pos2(0.0, 0.0), vec2(window.x, height(window)));
                    let p = places(bar, &wishes);
                    let all: Vec<Rect> =
                        p.name.iter().chain(&p.tabs).chain(&p.buttons).chain(&p.menu).copied().collect();
                    for (k, a) in all.iter().enumerate() {
                        assert!(bar.contains_rect(*a) && a.is_positive(), "{language:?} {width}: {a:?}");
                        let others = all[k + 1..].iter();
                        others
                            .for_each(|b| assert!(!a.shrink(0.01).intersects(b.shrink(0.01)), "{width}: {a:?} {b:?}"));
                    }
                    for (tab, words) in p.tabs.iter().zip(&wishes.tabs) {
                        let least = words * p.font / size::CARD + 8.0;
                        assert!(tab.width() >= least, "{language:?} {width}: {tab:?}, {least}");
                    }
                    for button in p.buttons.iter().chain(&p.menu) {
                        assert!(button.height() >= 48.0 && button.width() >= BUTTON, "{button:?}");
                    }
                    assert_eq!(p.buttons.is_empty(), p.menu.is_some(), "{language:?} {width}");
                }
            }
        });
    }
}
