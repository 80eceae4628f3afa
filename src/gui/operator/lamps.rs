//! The last parts as a strip of lamps, each a button to its part; then the one at hand and those to come.

use super::layout::lamp_places;
use crate::gui::earlier::Looked;
use crate::gui::facts::Facts;
use crate::gui::fonts;
use crate::gui::messages::sentence;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::sign::{Sign, problem};
use crate::gui::widgets::{cards, words};
use crate::report::words::{capital, clean};
use crate::worker::earlier::Earlier;
use egui::{Align2, CornerRadius, Rect, Role, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, pos2, vec2};
use std::path::{Path, PathBuf};

/// One lamp.
#[derive(Debug, Clone, PartialEq)]
struct Lamp {
    sign: Sign,
    /// The scan's name without its ending.
    scan: String,
    /// What stands below the sign of it.
    label: String,
    /// It was held to another plan than the one before it.
    begins_plan: bool,
    /// Its part, when there is a result to look at: place in `Facts::parts`, index, how many there were.
    part: Option<(usize, usize, Option<usize>)>,
    /// Its place among results from before this start.
    earlier: Option<usize>,
    /// It was held to another plan than the one at hand.
    other_plan: bool,
}

impl Lamp {
    fn without_result(sign: Sign, scan: String) -> Self {
        Self { sign, scan, label: String::new(), begins_plan: false, part: None, earlier: None, other_plan: false }
    }

    /// What a press of it leads to.
    fn leads_to(&self) -> Option<Looked> {
        let earlier = self.earlier.map(Looked::Earlier);
        self.part.map(|(at, ..)| Looked::Part(at)).or(earlier)
    }
}

/// Draws the card.
pub(super) fn lamps_ui(ui: &mut Ui, place: Rect, count: usize, scope: &mut Scope) {
    let theme = scope.theme;
    cards::card(ui, place, theme);
    let head = Rect::from_min_max(place.min + vec2(16.0, 6.0), pos2(place.right() - 16.0, place.top() + 30.0));
    match &scope.facts.troubles.folder {
        Some(lost) => {
            let text =
                format!("{}. {}", capital(&sentence(lost, scope.words)), scope.words.text("operator.trying_again"));
            words::line(ui, head, Align2::LEFT_CENTER, &text, fonts::semibold(size::BAR), theme.undecided_text);
        }
        None => {
            let told = unreadable_ui(ui, head, scope);
            let earlier = !scope.facts.earlier_results().is_empty() && scope.facts.parts.len() < count;
            let key = if earlier { "operator.last_parts_earlier" } else { "operator.last_parts" };
            let text = scope.words.fill(key, &[("n", &count.to_string())]);
            let rest = head.with_max_x(told);
            words::line(ui, rest, Align2::LEFT_CENTER, &text, fonts::semibold(size::BODY), theme.text);
        }
    }
    let mut lamps = lamps(scope.facts, count);
    let room = lamp_places(place, count).next().map_or(0.0, |place| place.width() - 4.0);
    shorten_all(&mut lamps, (room / words::width(ui, "0", fonts::mono(15.0))) as usize);
    for (k, (lamp, place)) in lamps.iter().zip(lamp_places(place, count)).enumerate() {
        lamp_ui(ui, place, k, lamp, scope);
    }
}

/// Results of the folder that cannot be read have no lamp; at the right it is told that there are any. Returns how far the rest may go.
fn unreadable_ui(ui: &mut Ui, head: Rect, scope: &Scope) -> f32 {
    let unreadable = scope.facts.earlier.as_ref().map_or(0, |earlier| earlier.unreadable.len());
    if unreadable == 0 {
        return head.right();
    }
    let text = scope.words.count("operator.unreadable_results", unreadable);
    let font = fonts::semibold(size::BODY);
    let wide = (words::width(ui, &text, font.clone()) + 4.0).min(head.width() - 24.0);
    let line = head.with_min_x(head.right() - wide);
    words::line(ui, line, Align2::RIGHT_CENTER, &text, font, scope.theme.undecided_text);
    let mark = Rect::from_center_size(pos2(line.left() - 12.0, line.center().y), Vec2::splat(16.0));
    problem(ui.painter(), mark, false, scope.theme);
    mark.left() - 12.0
}

fn lamp_ui(ui: &mut Ui, place: Rect, k: usize, lamp: &Lamp, scope: &mut Scope) {
    let theme = scope.theme;
    let words = scope.words;
    let leads_to = lamp.leads_to();
    let sense = if leads_to.is_some() { Sense::click() } else { Sense::hover() };
    let response = ui.interact(place, ui.scope_id().with(("lamp", k)), sense);
    let word = lamp.sign.word(words);
    let name = match lamp.part {
        Some((_, index, Some(of))) => {
            let (n, of) = (words.thousands(index), words.thousands(of));
            words.fill("operator.lamp_of", &[("verdict", word), ("n", &n), ("of", &of)])
        }
        Some((_, index, None)) => words.fill("operator.lamp", &[("verdict", word), ("n", &words.thousands(index))]),
        None if lamp.earlier.is_some() => {
            let key = if lamp.other_plan { "results.earlier_lamp_other" } else { "results.earlier_lamp" };
            words.fill(key, &[("verdict", word), ("scan", &lamp.scan)])
        }
        None if lamp.scan.is_empty() => word.to_owned(),
        None => format!("{word}, {}", lamp.scan),
    };
    let role = if leads_to.is_some() { Role::Button } else { Role::Label };
    response.widget_info(|| WidgetInfo::labeled(role, leads_to.is_some(), &name));
    let newest = lamp.part.is_some_and(|(at, ..)| at + 1 == scope.facts.parts.len() && scope.facts.judged().is_some());
    if lamp.begins_plan && k > 0 {
        let stroke = Stroke::new(2.0, theme.strong_stroke);
        ui.painter().vline(place.left() - 2.0, place.top() + 4.0..=place.bottom() - 4.0, stroke);
    }
    if newest {
        let frame = Stroke::new(2.0, lamp.sign.colour(theme));
        ui.painter().rect(place, CornerRadius::same(4), lamp.sign.fill(theme), frame, StrokeKind::Inside);
    } else if leads_to.is_some() && (response.hovered() || response.has_focus()) {
        let frame = Stroke::new(2.0, theme.accent);
        ui.painter().rect(place, CornerRadius::same(4), theme.raised, frame, StrokeKind::Inside);
    }
    let side = (place.height() - 34.0).min(place.width() - 8.0).clamp(16.0, 48.0);
    let spare = place.height() - side - 22.0;
    let middle = pos2(place.center().x, place.top() + 0.5 * spare + 0.5 * side);
    // What is from before this start is small, so that nobody takes it for a part of now.
    let shown = if lamp.earlier.is_some() { 0.5 * side } else { side };
    let sign = Rect::from_center_size(middle, Vec2::splat(side));
    let shown = Rect::from_center_size(middle, Vec2::splat(shown));
    match lamp.other_plan {
        true => lamp.sign.paint_hollow(ui.painter(), shown, theme),
        false => lamp.sign.paint(ui.painter(), shown, theme),
    }
    let label = Rect::from_min_max(pos2(place.left() + 2.0, sign.bottom() + 3.0), place.max - vec2(2.0, 0.0));
    let label = label.with_max_y(label.top() + 20.0);
    let colour = if lamp.part.is_some() { theme.text } else { theme.quiet };
    ui.painter().text(label.center(), Align2::CENTER_CENTER, &lamp.label, fonts::mono(15.0), colour);
    if let (true, Some(looked)) = (response.clicked(), leads_to) {
        scope.ask(looked.action());
    }
}

/// Labels that fit: all names whole, or else all by their numbers.
fn shorten_all(lamps: &mut [Lamp], fits: usize) {
    let whole = lamps.iter().all(|lamp| lamp.scan.chars().count() <= fits);
    for lamp in lamps {
        lamp.label = if whole { lamp.scan.clone() } else { shortened(&lamp.scan, fits) };
    }
}

/// The number at a name's front or its end; without one, as much of the name's front and end as there is room for.
fn shortened(name: &str, fits: usize) -> String {
    let digit = |c: &char| c.is_ascii_digit();
    let front: String = name.chars().take_while(digit).collect();
    let end = name.len() - name.chars().rev().take_while(digit).count();
    let number = if front.is_empty() { &name[end..] } else { &front };
    if !number.is_empty() && number.len() <= fits {
        return number.to_owned();
    }
    if name.chars().count() <= fits {
        return name.to_owned();
    }
    words::cut_in_the_middle(name, fits)
}

/// The strip: finished parts from the left, the one at hand, those to come; when there are too many the oldest leave.
fn lamps(facts: &Facts, count: usize) -> Vec<Lamp> {
    let stem = |path: &Path| clean(&path.file_stem().map(|s| s.to_string_lossy()).unwrap_or_default());
    let mut lamps: Vec<Lamp> = facts
        .parts
        .iter()
        .enumerate()
        .map(|(at, part)| Lamp {
            sign: Sign::of(&part.result),
            scan: clean(&part.short_name()),
            label: String::new(),
            begins_plan: at > 0 && facts.parts[at - 1].plan.sha256 != part.plan.sha256,
            part: Some((at, part.index, part.of)),
            earlier: None,
            other_plan: false,
        })
        .collect();
    let running = facts.running();
    if let Some(scan) = running.and_then(|r| r.scan.as_ref()) {
        lamps.push(Lamp::without_result(Sign::Running, stem(&scan.path)));
    }
    if let Some((scan, _)) = &facts.troubles.results {
        lamps.push(Lamp::without_result(Sign::Refused, stem(scan)));
    }
    let at_hand = running.and_then(|r| r.scan.as_ref()).map(|scan| &scan.path);
    for unfinished in facts.troubles.unfinished.iter().filter(|unfinished| Some(&unfinished.scan) != at_hand) {
        lamps.push(Lamp::without_result(Sign::NotMeasured, stem(&unfinished.scan)));
    }
    let surplus = lamps.len().saturating_sub(count);
    lamps.drain(..surplus);
    let to_come = to_come(facts);
    let free = count - lamps.len();
    let earlier = earlier_lamps(facts, free.saturating_sub(to_come.len()).min(MOST_EARLIER));
    if let Some(first) = lamps.first_mut() {
        first.begins_plan |= !earlier.is_empty();
    }
    lamps.splice(0..0, earlier);
    let room = count - lamps.len();
    lamps.extend(to_come.into_iter().take(room).map(|scan| Lamp::without_result(Sign::None, stem(scan))));
    lamps.resize(count, Lamp::without_result(Sign::None, String::new()));
    lamps
}

/// How many lamps of results from before this start stand before those of now.
const MOST_EARLIER: usize = 5;

/// The newest of them.
fn earlier_lamps(facts: &Facts, count: usize) -> Vec<Lamp> {
    let all = facts.earlier_results();
    let newest = all.iter().enumerate().skip(all.len() - count.min(all.len()));
    let lamp = |(k, earlier): (usize, &Earlier)| Lamp {
        earlier: Some(k),
        other_plan: earlier.is_vouched_for() && facts.is_of_another_plan(earlier),
        ..Lamp::without_result(Sign::of_earlier(earlier), earlier.short_name())
    };
    newest.map(lamp).collect()
}

/// The scans that wait.
fn to_come(facts: &Facts) -> Vec<&PathBuf> {
    match (&facts.scans, facts.running()) {
        (Some(Ok(scans)), Some(running)) if !running.watch => {
            let at_hand = running.scan.as_ref().map_or(running.done, |s| s.index);
            let all = if running.named.is_empty() { scans } else { &running.named };
            all.iter().skip(at_hand).collect()
        }
        (Some(Ok(scans)), None) if facts.last_end.is_none() => scans.iter().collect(),
        (Some(Ok(scans)), None) => {
            let before: Vec<&PathBuf> = scans.iter().filter(|scan| !facts.arrived.contains(scan)).collect();
            let left = before.len().saturating_sub(facts.left_over);
            before.into_iter().skip(left).chain(&facts.arrived).collect()
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_become_their_numbers() {
        for (name, short) in [
            ("0017", "0017"),
            ("01_good_top", "01"),
            ("press2_20260314_153000", "153000"),
            ("20260314153000", "20…3000"),
            ("bracket", "bracket"),
            ("bracket_left", "br…left"),
            ("käårä_mäßig", "kä…äßig"),
        ] {
            assert_eq!(shortened(name, 7), short);
        }
    }
}
