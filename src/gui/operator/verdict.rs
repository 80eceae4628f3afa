//! The verdict of the last part, to be read from three metres. A running part never changes it; only a finished one does.

use super::layout::{Form, Places};
use super::now::is_quiet;
use crate::gui::facts::{Facts, FinishedPart, Job};
use crate::gui::fonts;
use crate::gui::perform::may_run;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::sign::Sign;
use crate::gui::widgets::words;
use crate::inspect::{Inspection, Outcome, Verdict};
use crate::report::words::{Counts, capital, clean};
use egui::{Align2, CornerRadius, Rect, Sense, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};
use std::path::Path;

/// What the card says.
struct Said {
    sign: Sign,
    /// Which part, or that there is none.
    header: String,
    /// The scan's name in it.
    scan: String,
    word: String,
    sentence: String,
    note: String,
    /// What screen readers hear of it as a whole.
    name: String,
}

/// Draws the card. Returns what it says where that did not stand whole in it: the operator reads it elsewhere.
pub(super) fn verdict_ui(ui: &mut Ui, place: Rect, places: &Places, scope: &Scope) -> Option<String> {
    let (theme, form) = (scope.theme, places.form);
    // The newest part of the run, whatever is looked at on other screens; nothing that an earlier run or another plan said.
    let facts = scope.facts;
    let said = match facts.judged() {
        Some(part) => of_part(part, places.worst.is_some(), scope.words),
        None => trouble(scope).unwrap_or_else(|| before_the_first(scope)),
    };
    let frame = Stroke::new(4.0, said.sign.colour(theme));
    ui.painter().rect(place, CornerRadius::same(6), said.sign.fill(theme), frame, StrokeKind::Inside);
    if said.name != said.word {
        words::named(ui, place, &said.name);
    }
    let inner = place.shrink2(vec2(if form == Form::Bare { 16.0 } else { 24.0 }, 14.0));
    let (sign, text) = split(ui, inner, form, &said);
    said.sign.paint(ui.painter(), sign, theme);
    let cut = texts(ui, text, form, &said, scope);
    // Under what goes on it stands as soon as nothing does; a pop-up would only hide the button.
    if let Some(whole) = cut.as_ref().filter(|_| !is_quiet(facts)) {
        ui.interact(place, ui.scope_id().with("the whole verdict"), Sense::hover()).on_hover_text(whole);
    }
    cut
}

/// The largest size of the word.
fn largest_word(form: Form) -> f32 {
    match form {
        Form::Full => 208.0,
        Form::Compact => 150.0,
        Form::Column => 150.0,
        Form::Bare => 96.0,
    }
}

/// The size that the word keeps before lines below it are cut short or leave: it is read from three metres, they are not.
fn least_word(form: Form) -> f32 {
    match form {
        Form::Full => 150.0,
        Form::Compact => 110.0,
        Form::Column => 64.0,
        Form::Bare => 40.0,
    }
}

/// How many lines of sentence and note stand below the word in the height that it leaves. A long reason takes a second line of each where there
/// is room; the sentence never leaves.
fn lines_below(room: f32, [sentence, note]: [f32; 2], long: bool) -> [usize; 2] {
    let choices: &[[usize; 2]] = if long { &[[2, 2], [2, 1], [1, 1], [1, 0]] } else { &[[1, 1], [1, 0]] };
    let fits = |[s, n]: &&[usize; 2]| *s as f32 * sentence + *n as f32 * note <= room;
    choices.iter().find(fits).copied().unwrap_or([1, 0])
}

/// The sign gives way to the word first, down to a share of its height.
fn split(ui: &Ui, inner: Rect, form: Form, said: &Said) -> (Rect, Rect) {
    let (largest, least) = match form {
        Form::Full => (270.0, 150.0),
        Form::Compact => (204.0, 120.0),
        Form::Column => (204.0, 96.0),
        Form::Bare => (120.0, 64.0),
    };
    let gap = if form == Form::Full { 56.0 } else { 32.0 };
    let wide = words::width(ui, &said.word, fonts::bold(largest_word(form)));
    let side = (inner.width() - wide - gap).clamp(least, largest).min(inner.height());
    let column = Rect::from_min_size(inner.min, vec2(side, inner.height()));
    let indent = if form == Form::Full { 32.0_f32.min(inner.width() - side - gap - wide).max(0.0) } else { 0.0 };
    let sign = Rect::from_center_size(column.center(), Vec2::splat(side)).translate(vec2(indent, 0.0));
    (sign, inner.with_min_x(sign.right() + gap))
}

/// Sizes of header, sentence and note.
fn sizes(form: Form) -> (f32, f32, f32) {
    match form {
        Form::Full => (28.0, size::NOW, size::HEADER),
        Form::Compact => (size::HEADER - 2.0, size::HEADER, size::CARD),
        Form::Column => (size::CARD, size::CARD, size::BODY),
        Form::Bare => (size::BODY, size::BODY, size::NOTE),
    }
}

/// Writes the texts; returns sentence and note where one of them was cut, the one to act on first.
fn texts(ui: &mut Ui, place: Rect, form: Form, said: &Said, scope: &Scope) -> Option<String> {
    let theme = scope.theme;
    let (head, sentence, note) = sizes(form);
    let line = |points: f32| 1.4 * points;
    let top = Rect::from_min_size(place.min, vec2(place.width(), line(head)));
    let header = words::with_name_in(ui, &said.header, &said.scan, &fonts::semibold(head), top.width());
    words::line(ui, top, Align2::LEFT_CENTER, &header, fonts::semibold(head), theme.text);
    let refused = said.sign == Sign::Refused;
    let sentence_size = if refused { (0.75 * sentence).max(size::NOTE) } else { sentence };
    let widest = words::fitting_size(ui, &said.word, fonts::bold, place.width(), largest_word(form), 40.0);
    let below = place.height() - line(head) - least_word(form).min(widest);
    let [lines, note_lines] = lines_below(below, [line(sentence_size), line(note)], refused && form != Form::Bare);
    // What needs one line leaves the other to the word.
    let needed = |text: &str, font| if words::width(ui, text, font) < place.width() - 1.0 { 1 } else { 2 };
    let lines = lines.min(needed(&said.sentence, fonts::semibold(sentence_size)));
    let note_lines = note_lines.min(needed(&said.note, fonts::regular(note.max(1.0))));
    let bottom = place.bottom() - line(note) * note_lines as f32;
    let note_place = Rect::from_min_max(pos2(place.left(), bottom), place.max);
    let sentence_height = line(sentence_size) * lines as f32;
    let at = Rect::from_min_max(pos2(place.left(), bottom - sentence_height), pos2(place.right(), bottom));
    let font = fonts::semibold(sentence_size);
    let sentence = words::whole_clauses(ui, &said.sentence, &font, place.width(), lines);
    let mut cut = sentence != said.sentence || !words::fits(ui, &sentence, font.clone(), place.width(), lines);
    words::block(ui, at, Align2::LEFT_CENTER, &sentence, font, theme.text, lines);
    if note_lines > 0 {
        let font = fonts::regular(note);
        let note = words::whole_clauses(ui, &said.note, &font, place.width(), note_lines);
        cut |= note != said.note || !words::fits(ui, &note, font.clone(), place.width(), note_lines);
        words::block(ui, note_place, Align2::LEFT_CENTER, &note, font, theme.text, note_lines);
    } else {
        cut |= !said.note.is_empty();
    }
    let room = Rect::from_min_max(top.left_bottom(), at.right_top());
    // A letter that hangs below the line must not touch the sentence.
    let hangs = said.word.contains(['g', 'j', 'p', 'q', 'y']);
    let largest = largest_word(form).min(if hangs { room.height() / 1.15 } else { room.height() });
    let fit = words::fitting_size(ui, &said.word, fonts::bold, room.width(), largest, 40.0);
    words::line(ui, room, Align2::LEFT_CENTER, &said.word, fonts::bold(fit), said.sign.text_colour(theme));
    let all = [&said.note, &said.sentence].into_iter().filter(|text| !text.is_empty());
    cut.then(|| all.map(|text| text.trim_end_matches('.')).collect::<Vec<_>>().join(". "))
}

/// With a card of its own for what to do about a refused scan, this one leaves that out.
fn of_part(part: &FinishedPart, has_help: bool, words: &Words) -> Said {
    let sign = Sign::of(&part.result);
    let word = sign.word(words).to_owned();
    let index = words.thousands(part.index);
    let scan = clean(&scan_words(part));
    let values = [("n", index.as_str()), ("scan", scan.as_str())];
    let of = part.of.map(|of| words.thousands(of));
    let (header, name) = match &of {
        Some(of) => {
            let values = [values[0], values[1], ("of", of.as_str()), ("verdict", word.as_str())];
            (words.fill("operator.last_part_of", &values), words.fill("operator.verdict_name_of", &values))
        }
        None => {
            let values = [values[0], values[1], ("verdict", word.as_str())];
            (words.fill("operator.last_part", &values), words.fill("operator.verdict_name", &values))
        }
    };
    let (sentence, note) = match &part.result.outcome {
        Outcome::Measured(inspection) => measured(inspection, words),
        Outcome::Refused(refusal) if has_help => (words.told(part.reason(refusal)), String::new()),
        Outcome::Refused(refusal) => (words.told(part.reason(refusal)), words.told(&refusal.help)),
    };
    Said { sign, header, scan, word, sentence, note, name }
}

/// The scan's name, with its folder where that is not the plan's.
fn scan_words(part: &FinishedPart) -> String {
    let folder =
        part.scan_path.parent().filter(|folder| *folder != part.plan.scans.path && part.scan_path.is_absolute());
    match folder.and_then(Path::file_name) {
        Some(folder) => Path::new(folder).join(part.scan_name()).display().to_string(),
        None => part.scan_name().to_owned(),
    }
}

/// What decided the verdict, and what else there was; what to do comes first where something is to be done.
fn measured(inspection: &Inspection, words: &Words) -> (String, String) {
    let counts = Counts::of(&inspection.points);
    let of = words.thousands(counts.total());
    let sentence = |key: &str, only: &str, n: usize| match counts.total() {
        1 => words.text(only).to_owned(),
        _ => words.fill(key, &[("n", &words.thousands(n)), ("of", &of)]),
    };
    let (sentence, to_do) = match inspection.verdict {
        Verdict::Fail => (sentence("operator.out", "operator.only_out", counts.fail), "operator.do_fail"),
        Verdict::NotMeasured => {
            (sentence("operator.unmeasured", "operator.only_unmeasured", counts.not_measured), "operator.do_incomplete")
        }
        Verdict::Undecided => {
            (sentence("operator.undecided", "operator.only_undecided", counts.undecided), "operator.do_undecided")
        }
        Verdict::Pass => (sentence("operator.all_in", "operator.only_in", counts.pass), ""),
    };
    let others = [
        (counts.not_measured, Verdict::NotMeasured, "operator.n_unmeasured"),
        (counts.undecided, Verdict::Undecided, "operator.n_undecided"),
        (counts.pass, Verdict::Pass, "operator.n_in"),
    ];
    let others = others.iter().filter(|(n, verdict, _)| *n > 0 && *verdict != inspection.verdict);
    let others: Vec<String> = others.map(|(n, _, key)| words.count(key, *n)).collect();
    let others = others.join(", ");
    let note = match (to_do, others.is_empty()) {
        ("", _) => others,
        (key, true) => words.text(key).to_owned(),
        (key, false) => format!("{}. {}", words.text(key), capital(&others)),
    };
    (sentence, note)
}

/// Whether the card says why there is no verdict in the words of the message at hand.
pub(super) fn tells_the_message(scope: &Scope) -> bool {
    let facts = scope.facts;
    let troubles = &facts.troubles;
    let lost = troubles.results.as_ref().map(|(_, why)| why);
    let why = lost.or(troubles.plan.as_ref()).or_else(|| facts.failure()).filter(|_| facts.judged().is_none());
    why.zip(facts.message.as_ref()).is_some_and(|(why, message)| why.message == message.message)
}

/// Why there is no verdict though there should be one.
fn trouble(scope: &Scope) -> Option<Said> {
    let (facts, words) = (scope.facts, scope.words);
    if let Some((scan, why)) = &facts.troubles.results {
        return Some(without_verdict(Some(scan), &words.told(&why.message), why.help.as_deref(), words));
    }
    if let Some(why) = &facts.troubles.plan {
        let plan = facts.plan_path.as_deref();
        return Some(without_verdict(plan, &words.told(&why.message), why.help.as_deref(), words));
    }
    if let Some(unfinished) = facts.troubles.no_verdict_for() {
        let scan = unfinished.scan.file_name().map(|name| clean(&name.to_string_lossy())).unwrap_or_default();
        let sentence = words.fill("operator.scan_not_whole", &[("scan", &scan)]);
        return Some(without_verdict(Some(&unfinished.scan), &sentence, unfinished.why.help.as_deref(), words));
    }
    if let (Job::Idle, Some(_), Some(last)) = (&facts.job, &facts.last_end, facts.arrived.last()) {
        let sentence = words.count("operator.came_since", facts.arrived.len());
        return Some(without_verdict(Some(last), &sentence, Some(words.text("operator.inspect_them")), words));
    }
    facts.failure().map(|why| without_verdict(None, &words.told(&why.message), why.help.as_deref(), words))
}

/// There should be a verdict, and there is none: of which scan, or that the run could not begin, why, and what to do.
fn without_verdict(scan: Option<&Path>, sentence: &str, help: Option<&str>, words: &Words) -> Said {
    let header = match scan.and_then(Path::file_name) {
        Some(name) => clean(&name.to_string_lossy()),
        None => words.text("operator.ended_early").to_owned(),
    };
    let word = words.text("verdict.no_verdict").to_owned();
    let note = help.map(|help| words.told(help)).unwrap_or_default();
    let scan = header.clone();
    Said { sign: Sign::Refused, header, scan, name: word.clone(), word, sentence: sentence.to_owned(), note }
}

/// That there is no part yet, as a key among the texts: lamps beside it may tell of others.
fn none_yet(facts: &Facts) -> &'static str {
    match (facts.parts.is_empty(), facts.earlier_results().is_empty()) {
        (false, _) => "operator.none_in_run",
        (true, false) => "operator.none_since",
        (true, true) => "operator.none_yet",
    }
}

/// Nothing was inspected since the plan was opened.
fn before_the_first(scope: &Scope) -> Said {
    let (facts, words) = (scope.facts, scope.words);
    let text = |key: &str| words.text(key).to_owned();
    let press = if scope.settings.watch { "operator.press_watch_folder" } else { "operator.press_run" };
    let of_run = facts.parts.get(facts.run_from..).unwrap_or_default();
    let header = match of_run.iter().filter(|part| part.again).count() {
        0 => text(none_yet(facts)),
        again => words.count("operator.again_by_this_plan", again),
    };
    let say = |sign: Sign, word: &str, sentence: String, note: String| Said {
        sign,
        header: header.clone(),
        scan: String::new(),
        word: text(word),
        name: text(word),
        sentence,
        note,
    };
    match &facts.job {
        Job::Opening { .. } => return say(Sign::None, "verdict.opening", String::new(), String::new()),
        Job::Running(running) if running.watch && running.scan.is_none() && running.stage.is_none() => {
            return say(
                Sign::None,
                "verdict.waiting",
                text("operator.waiting_for_scans"),
                text("operator.appears_here"),
            );
        }
        Job::Running(_) => return say(Sign::None, "verdict.running", text("operator.appears_here"), String::new()),
        Job::Merging(_) if facts.plan.is_some() => {
            return say(Sign::None, "verdict.waiting", text("operator.not_while_merging"), String::new());
        }
        Job::Idle | Job::Fetching { .. } | Job::Trying { .. } | Job::Merging(_) => {}
    }
    if let Err(why) = may_run(facts) {
        return say(Sign::None, "verdict.not_ready", text(why), text("operator.open_another"));
    }
    match &facts.scans {
        Some(Ok(scans)) if !scans.is_empty() => {
            say(Sign::Ready, "verdict.ready", words.count("operator.scans_waiting", scans.len()), text(press))
        }
        Some(Ok(_)) => {
            let folder = facts.plan.as_ref().map(|p| p.scans.path.display().to_string()).unwrap_or_default();
            say(Sign::Ready, "verdict.ready", text("operator.no_scans"), folder)
        }
        Some(Err(fault)) => say(
            Sign::None,
            "verdict.not_ready",
            words.told(&fault.message),
            fault.help.as_deref().map(|help| words.told(help)).unwrap_or_default(),
        ),
        None => say(Sign::Ready, "verdict.ready", String::new(), text(press)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::operator::layout::places;

    /// Every window from 853 x 533 (1280 x 800 at 150 %) up: the word is larger than anything else on the card, also beside a long reason.
    #[test]
    fn the_word_of_a_refused_part_stays_large() {
        for (width, height, least) in [(853, 441, 64.0), (800, 508, 64.0), (1280, 708, 110.0), (1920, 980, 150.0)] {
            let inside = Rect::from_min_size(pos2(0.0, 0.0), vec2(width as f32, height as f32));
            let places = places(inside);
            let (head, sentence, note) = sizes(places.form);
            let height = places.verdict.height() - 28.0 - 1.4 * head;
            let lines = [1.4 * 0.75 * sentence, 1.4 * note];
            let [s, n] = lines_below(height - least_word(places.form), lines, true);
            assert!(s >= 1 && n >= 1, "{width}: {s} and {n} lines");
            let word = height - s as f32 * lines[0] - n as f32 * lines[1];
            assert!(word >= least && word > 2.0 * head, "{width}: {word}");
        }
    }

    #[test]
    fn lines_give_way_one_after_the_other() {
        let of = |room: f32| lines_below(room, [20.0, 10.0], true);
        assert_eq!([of(60.0), of(50.0), of(49.0), of(29.0), of(0.0)], [[2, 2], [2, 1], [1, 1], [1, 0], [1, 0]]);
        assert_eq!([lines_below(30.0, [20.0, 10.0], false), lines_below(29.0, [20.0, 10.0], false)], [[1, 1], [1, 0]]);
    }
}
