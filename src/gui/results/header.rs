//! The line over the results: verdict, what was inspected, counts, and the parts of the sequence one click away.

use super::trend::tail;
use crate::gui::earlier::Looked;
use crate::gui::facts::FinishedPart;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::sign::Sign;
use crate::gui::widgets::words as write;
use crate::inspect::{Identity, Outcome, PointResult, Verdict};
use crate::report::stored::StoredOutcome;
use crate::report::words::{Counts, clean};
use crate::worker::earlier::Earlier;
use egui::{Align2, Button, CornerRadius, Rect, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};

/// Lamps of parts that are shown at most.
const LAMPS: usize = 20;
const LAMP: [f32; 2] = [25.0, 46.0];
/// The least width of a button with words, and that of one with an arrow.
const BUTTON: f32 = 96.0;
const ARROW: f32 = 38.0;

/// What the line says of the part looked at.
pub struct Head {
    looked: Looked,
    sign: Sign,
    /// The verdict was given by another plan than the one at hand.
    hollow: bool,
    /// Which part it is.
    which: String,
    /// The part's name; scan, side, margin and inliers.
    names: [String; 2],
    /// The scan's name in them.
    scan: String,
    counts: Vec<(Verdict, String)>,
}

impl Head {
    /// Of a part, by its place.
    pub fn of_part(part: &FinishedPart, place: usize, words: &Words) -> Self {
        let counts = match &part.result.outcome {
            Outcome::Measured(inspection) => counts_of(&inspection.points, words),
            Outcome::Refused(_) => Vec::new(),
        };
        let (looked, sign) = (Looked::Part(place), Sign::of(&part.result));
        Self {
            looked,
            sign,
            hollow: false,
            which: part_words(part, words),
            names: names(part, words),
            scan: part.scan_name().to_owned(),
            counts,
        }
    }

    /// Of a result from before this start, by its place, whose scan was inspected again: what that found, and that it is of now.
    pub fn of_again(part: &FinishedPart, place: usize, words: &Words) -> Self {
        let head = Self::of_part(part, place, words);
        Self { looked: Looked::Earlier(place), which: words.text("results.again").to_owned(), ..head }
    }

    /// Of a result from before this start, by its place. What nothing vouches for is not counted either.
    pub fn of_earlier(earlier: &Earlier, place: usize, other_plan: bool, words: &Words) -> Self {
        let stored = &earlier.stored;
        let counts = match &stored.outcome {
            StoredOutcome::Measured(inspection) if earlier.is_vouched_for() => counts_of(&inspection.points, words),
            _ => Vec::new(),
        };
        let scan = words.fill("results.scan", &[("scan", &clean(&stored.identity.scan_file))]);
        let names = [name_of(&stored.identity, words), format!("{scan}, {}", earlier.written)];
        let (looked, sign) = (Looked::Earlier(place), Sign::of_earlier(earlier));
        let hollow = other_plan && earlier.is_vouched_for();
        let which = words.text(if hollow { "results.earlier_other" } else { "results.earlier" }).to_owned();
        let scan = clean(&stored.identity.scan_file);
        Self { looked, sign, hollow, which, names, scan, counts }
    }
}

/// Draws the line for what is looked at.
pub fn header_ui(ui: &mut Ui, at: Rect, head: &Head, scope: &mut Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let sign = head.sign;
    let y = at.center().y;
    let sign_place = Rect::from_center_size(pos2(at.left() + 22.0, y), vec2(42.0, 42.0));
    if head.hollow {
        sign.paint_hollow(ui.painter(), sign_place, theme);
    } else {
        sign.paint(ui.painter(), sign_place, theme);
    }
    let colour = if head.hollow { theme.quiet } else { sign.text_colour(theme) };
    let word = sign.word(words);
    let of = &head.which;
    let wide =
        write::width(ui, word, fonts::semibold(size::HEADER)).max(write::width(ui, of, fonts::regular(size::TABLE)));
    let verdict = Rect::from_min_size(pos2(at.left() + 56.0, y - 26.0), vec2(wide + 4.0, 30.0));
    write::line(ui, verdict, Align2::LEFT_CENTER, word, fonts::semibold(size::HEADER), colour);
    let below = Rect::from_min_size(pos2(verdict.left(), y + 5.0), vec2(wide + 4.0, 18.0));
    write::line(ui, below, Align2::LEFT_CENTER, of, fonts::regular(size::TABLE), theme.quiet);
    let lamps_left = lamps_ui(ui, at.with_min_x(verdict.right() + 16.0), head.looked, scope);
    if lamps_left - verdict.right() < LEAST_NAMES + 56.0 {
        return;
    }
    let mut x = rule(ui, verdict.right() + 16.0, at, theme.stroke);
    let counts_width = counts_width(ui, &head.counts);
    let room = lamps_left - x - 24.0;
    let natural = names_width(ui, &head.names);
    let with_counts = room > counts_width + 220.0;
    let names_width = if with_counts { (room - counts_width - 40.0).min(natural) } else { room };
    names_ui(
        ui,
        Rect::from_min_size(pos2(x, at.top()), vec2(names_width, at.height())),
        &head.names,
        &head.scan,
        scope,
    );
    if with_counts {
        x = rule(ui, x + names_width + 12.0, at, theme.stroke);
        counts_ui(ui, pos2(x, at.center().y), &head.counts, scope);
    }
}

/// The least room for the part's name.
const LEAST_NAMES: f32 = 110.0;

/// A thin line down; returns where to go on.
fn rule(ui: &Ui, x: f32, at: Rect, colour: egui::Color32) -> f32 {
    ui.painter().vline(x, at.top() + 10.0..=at.bottom() - 10.0, Stroke::new(1.0, colour));
    x + 16.0
}

/// "Part 17 of 25".
fn part_words(part: &FinishedPart, words: &Words) -> String {
    let n = words.thousands(part.index);
    match part.of {
        Some(of) => words.fill("results.part_of", &[("n", &n), ("of", &words.thousands(of))]),
        None => words.fill("results.part", &[("n", &n)]),
    }
}

/// What both lines of names take when nothing cuts them.
fn names_width(ui: &Ui, [first, second]: &[String; 2]) -> f32 {
    let wide = write::width(ui, first, fonts::semibold(size::BAR));
    wide.max(write::width(ui, second, fonts::regular(size::TABLE))) + 4.0
}

/// Two lines: the part's name; scan, side, margin and inliers.
fn names_ui(ui: &mut Ui, at: Rect, [name, fit]: &[String; 2], scan: &str, scope: &Scope) {
    let theme = scope.theme;
    let first = Rect::from_min_size(pos2(at.left(), at.center().y - 22.0), vec2(at.width(), 22.0));
    write::line(ui, first, Align2::LEFT_CENTER, name, fonts::semibold(size::BAR), theme.text);
    let below = Rect::from_min_size(pos2(at.left(), at.center().y + 3.0), vec2(at.width(), 20.0));
    let fit = write::with_name_in(ui, fit, scan, &fonts::regular(size::TABLE), below.width());
    write::line(ui, below, Align2::LEFT_CENTER, &fit, fonts::regular(size::TABLE), theme.quiet);
}

fn names(part: &FinishedPart, words: &Words) -> [String; 2] {
    let id = &part.result.identity;
    let name = name_of(id, words);
    let scan = words.fill("results.scan", &[("scan", &id.scan_file)]);
    let Outcome::Measured(inspection) = &part.result.outcome else { return [name, scan] };
    let fit = &inspection.best_fit;
    let side = match fit.face {
        crate::plan::Side::Top => words.text("results.from_top"),
        crate::plan::Side::Bottom => words.text("results.from_bottom"),
    };
    let inliers = format!("{} %", words.number(100.0 * fit.inlier_ratio, 0));
    let rest = [("side", side), ("margin", &words.number(fit.margin, 1)), ("inliers", &inliers)];
    [name, format!("{scan}, {}", words.fill("results.fit", &rest))]
}

/// Name, number and revision of the part.
fn name_of(id: &Identity, words: &Words) -> String {
    let of_part = [("name", &*id.part_name), ("number", &*id.part_number), ("revision", &*id.part_revision)];
    words.fill("results.revision", &of_part)
}

fn counts_of(points: &[PointResult], words: &Words) -> Vec<(Verdict, String)> {
    let counts = Counts::of(points);
    [
        (Verdict::Fail, counts.fail, "results.n_out"),
        (Verdict::NotMeasured, counts.not_measured, "results.n_not_measured"),
        (Verdict::Undecided, counts.undecided, "results.n_undecided"),
        (Verdict::Pass, counts.pass, "results.n_in"),
    ]
    .into_iter()
    .filter(|(_, n, _)| *n > 0)
    .map(|(verdict, n, key)| (verdict, words.count(key, n)))
    .collect()
}

fn counts_width(ui: &Ui, counts: &[(Verdict, String)]) -> f32 {
    counts.iter().map(|(_, text)| 22.0 + write::width(ui, text, fonts::semibold(size::BODY)) + 18.0).sum()
}

fn counts_ui(ui: &mut Ui, from: egui::Pos2, counts: &[(Verdict, String)], scope: &Scope) {
    let mut x = from.x;
    for (verdict, text) in counts {
        let sign = Rect::from_center_size(pos2(x + 8.0, from.y), vec2(16.0, 16.0));
        Sign::from(*verdict).paint(ui.painter(), sign, scope.theme);
        let wide = write::width(ui, text, fonts::semibold(size::BODY)) + 2.0;
        let line = Rect::from_min_size(pos2(x + 22.0, from.y - 12.0), vec2(wide, 24.0));
        write::line(ui, line, Align2::LEFT_CENTER, text, fonts::semibold(size::BODY), scope.theme.text);
        x = line.right() + 18.0;
    }
}

/// Previous, lamps, next, from the right; returns where they begin. The words of the buttons give way to arrows where they would leave
/// no room for lamps.
fn lamps_ui(ui: &mut Ui, at: Rect, looked: Looked, scope: &mut Scope) -> f32 {
    let words = scope.words;
    let (place, all) = (looked.place(scope.facts), scope.facts.earlier_results().len() + scope.facts.parts.len());
    let of = |key: &str| write::width(ui, words.text(key), fonts::regular(size::BODY)) + 24.0;
    let with_words = of("results.previous").max(of("results.next")).max(BUTTON);
    let in_words = at.width() >= 2.0 * with_words + 16.0 + 5.0 * LAMP[0] + LEAST_NAMES;
    let button_width = if in_words { with_words } else { ARROW };
    let room = at.width() - 2.0 * button_width - 16.0;
    let most = if in_words { room - LEAST_NAMES } else { room };
    let many =
        ((most / LAMP[0]).max(1.0) as usize).min((at.width() * 0.35 / LAMP[0]) as usize).clamp(1, LAMPS).min(all);
    // What is looked at stays in sight; else the newest ones.
    let first = all.saturating_sub(many).min(place);
    let y = at.center().y;
    let button = |right: f32| Rect::from_min_max(pos2(right - button_width, y - 15.0), pos2(right, y + 15.0));
    let next = button(at.right());
    let mut step = |ui: &mut Ui, place_of: Rect, key: &str| {
        let forward = key == "results.next";
        let to = looked.step(scope.facts, forward);
        let text = words.text(key);
        let shown = if in_words { text } else { "" };
        let response = ui.add_enabled_ui(to.is_some(), |ui| ui.put(place_of, Button::new(shown))).inner;
        response.widget_info(|| WidgetInfo::labeled(Role::Button, to.is_some(), text));
        if !in_words {
            let towards = if forward { 1.0 } else { -1.0 };
            let line = [vec2(-3.5, -7.0), vec2(3.5, 0.0), vec2(-3.5, 7.0)];
            let line = line.map(|v| place_of.center() + vec2(towards * v.x, v.y)).to_vec();
            let colour = if to.is_some() { scope.theme.text } else { scope.theme.strong_stroke };
            ui.painter().line(line, Stroke::new(2.0, colour));
        }
        if let (true, Some(to)) = (response.clicked(), to) {
            scope.actions.push(to.action());
        }
    };
    step(ui, next, "results.next");
    let left = next.left() - 8.0 - many as f32 * LAMP[0];
    let previous = button(left - 8.0);
    step(ui, previous, "results.previous");
    for k in first..first + many {
        let at = pos2(left + (k - first) as f32 * LAMP[0], y - 0.5 * LAMP[1]);
        let Some(lamp) = Looked::at(scope.facts, k) else { continue };
        if lamp_ui(ui, Rect::from_min_size(at, vec2(LAMP[0], LAMP[1])), lamp, k == place, scope) {
            scope.actions.push(lamp.action());
        }
        let begins = k > first && lamp == Looked::Part(0);
        if begins {
            ui.painter().vline(
                at.x - 0.5,
                at.y + 4.0..=at.y + LAMP[1] - 4.0,
                Stroke::new(2.0, scope.theme.strong_stroke),
            );
        }
    }
    previous.left()
}

/// One lamp; those from before this start are smaller.
fn lamp_ui(ui: &mut Ui, at: Rect, lamp: Looked, looked_at: bool, scope: &Scope) -> bool {
    let (theme, words, facts) = (scope.theme, scope.words, scope.facts);
    let (sign, hollow, name, said) = match lamp {
        Looked::Part(k) => {
            let part = &facts.parts[k];
            let sign = Sign::of(&part.result);
            (sign, false, part.short_name(), format!("{}, {}", sign.word(words), part_words(part, words)))
        }
        Looked::Earlier(k) => {
            let earlier = &facts.earlier_results()[k];
            let hollow = earlier.is_vouched_for() && facts.is_of_another_plan(earlier);
            (Sign::of_earlier(earlier), hollow, earlier.short_name(), earlier_words(earlier, hollow, words))
        }
    };
    let response = ui.interact(at, ui.scope_id().with(("lamp", lamp, &name)), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, looked_at, &said));
    if looked_at || response.hovered() || response.has_focus() {
        let frame = Stroke::new(if looked_at { 2.0 } else { 1.0 }, theme.accent);
        let fill = if looked_at { theme.choice } else { theme.panel };
        ui.painter().rect(at, CornerRadius::same(4), fill, frame, StrokeKind::Inside);
    }
    let side = if matches!(lamp, Looked::Part(_)) { 15.0 } else { 10.0 };
    let place = Rect::from_center_size(pos2(at.center().x, at.top() + 15.0), vec2(side, side));
    match hollow {
        true => sign.paint_hollow(ui.painter(), place, theme),
        false => sign.paint(ui.painter(), place, theme),
    }
    let digits: String = name.chars().filter(char::is_ascii_digit).collect();
    let short = if digits.len() >= 2 { digits[digits.len() - 2..].to_owned() } else { tail(&name, 2) };
    let colour = if matches!(lamp, Looked::Part(_)) { theme.text } else { theme.quiet };
    let below = pos2(at.center().x, at.bottom() - 11.0);
    ui.painter().text(below, Align2::CENTER_CENTER, short, fonts::mono(11.0), colour);
    let response = response.on_hover_text(if matches!(lamp, Looked::Part(_)) { name } else { said });
    response.clicked()
}

/// A result from before this start in words.
fn earlier_words(earlier: &Earlier, other_plan: bool, words: &Words) -> String {
    let verdict = Sign::of_earlier(earlier).word(words);
    let key = if other_plan { "results.earlier_lamp_other" } else { "results.earlier_lamp" };
    words.fill(key, &[("verdict", verdict), ("scan", &earlier.short_name())])
}
