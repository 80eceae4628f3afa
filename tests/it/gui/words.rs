//! In another language the window says nothing in the library's English.

use super::*;
use egui_kittest::kittest::NodeT;
use shapeline::gui::Words;
use shapeline::inspect::{InspectionResult, PointResult};
use std::collections::BTreeSet;

/// The German or Swedish window over a measured part with a point that was not, and a scan that was refused.
fn window_in(language: Language, size: [f32; 2]) -> Window {
    let project = Project::new();
    project.write("scans/1.ply", &demo_file("scans/03_out_of_tolerance.ply"));
    project.write("scans/2.ply", &demo_file("scans/05_cut_off.ply"));
    project.change_plan(&[("[-0.043121145, 0.025872687, 0.998734785]", "[0.9, 0.1, 0.42]")]);
    let mut window = Window::open(setup(&project), size);
    window.ask(Action::Language(language));
    window.ask(Action::Run);
    window.wait("the end of the sequence", |app| app.facts().last_end.is_some());
    window.harness.run_steps(3);
    window
}

/// All that is said.
fn said(window: &Window) -> BTreeSet<String> {
    let all = window.harness.query_all_by(|_| true);
    all.flat_map(|node| [node.accesskit_node().label(), node.accesskit_node().value()]).flatten().collect()
}

/// Long pieces of the library's templates; every sentence of it holds one, or is shorter.
pub fn english() -> Vec<String> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/text/library.de.toml");
    let catalogue: toml_edit::DocumentMut =
        std::fs::read_to_string(file).expect("the catalogue").parse().expect("TOML");
    let pieces = catalogue.iter().flat_map(|(template, _)| {
        let pieces: Vec<&str> =
            template.split('{').map(|piece| piece.split_once('}').map_or(piece, |(_, text)| text)).collect();
        pieces.into_iter().map(|piece| piece.trim_matches([' ', ',', ':']).to_lowercase()).collect::<Vec<_>>()
    });
    pieces.filter(|piece| piece.len() >= 14 && piece.contains(' ')).collect()
}

#[track_caller]
pub fn assert_no_english(window: &Window, english: &[String]) {
    let left: Vec<String> = said(window)
        .into_iter()
        .filter(|said| english.iter().any(|piece| said.to_lowercase().contains(piece)))
        .collect();
    assert!(left.is_empty(), "{left:#?}");
}

fn unmeasured(result: &InspectionResult) -> (usize, &PointResult) {
    let Outcome::Measured(inspection) = &result.outcome else { panic!("{result:?}") };
    inspection.points.iter().enumerate().find(|(_, p)| p.verdict == Verdict::NotMeasured).expect("it leans too far")
}

#[test]
fn refusals_reasons_gates_and_problems_are_told_in_the_windows_language() {
    let english = english();
    assert!(english.len() > 300, "{}", english.len());
    for language in [Language::German, Language::Swedish] {
        let words = Words::of(language);
        let mut window = window_in(language, [1920.0, 1080.0]);
        let parts = window.app().facts().parts.clone();
        let Outcome::Refused(refusal) = &parts[1].result.outcome else { panic!("it is cut off") };
        assert_ne!(words.told(&refusal.reason), refusal.reason);
        assert!(window.says(&words.told(parts[1].reason(refusal))) && window.says(&words.told(&refusal.help)));
        assert_no_english(&window, &english);
        window.ask(Action::Show(Screen::Results));
        window.harness.run_steps(3);
        assert!(window.says(&words.told(&refusal.reason)) && window.says(&words.told(&refusal.help)));
        assert_no_english(&window, &english);
        let (at, point) = unmeasured(&parts[0].result);
        window.ask(Action::ChoosePart(Some(0)));
        window.ask(Action::ChoosePoint(Some(at)));
        window.harness.run_steps(3);
        assert!(window.says(&words.told(point.reason.as_deref().expect("a reason"))));
        assert!(
            !point.card.gates.is_empty() && point.card.gates.iter().all(|gate| window.says(&words.told(gate.name)))
        );
        assert_no_english(&window, &english);
    }
}
