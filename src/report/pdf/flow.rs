//! Pages after the first: a running head, and a place that moves down until the page is full.

use super::first::{part_sign, part_word};
use super::page::{Font, Fonts, Page, set};
use super::signs::sign;
use super::theme::{BOTTOM, LEFT, QUIET, RIGHT, Sign, TEXT};
use crate::inspect::InspectionResult;

/// Where the first line below the running head may stand, mm.
const TOP: f64 = 22.5;

/// Pages being filled from top to bottom.
pub struct Flow<'a> {
    fonts: &'a Fonts,
    head: Head,
    pages: Vec<Page<'a>>,
    /// How far the page in work is filled, mm from its top.
    pub y: f64,
}

struct Head {
    sign: Sign,
    word: &'static str,
    part: [String; 3],
    scan: String,
}

impl<'a> Flow<'a> {
    /// Begins with an empty page.
    pub fn new(fonts: &'a Fonts, result: &InspectionResult) -> Flow<'a> {
        let id = &result.identity;
        let head = Head {
            sign: part_sign(result),
            word: part_word(result),
            part: [id.part_name.clone(), id.part_number.clone(), id.part_revision.clone()],
            scan: format!("Scan {}", id.scan_file),
        };
        let mut flow = Flow { fonts, head, pages: Vec::new(), y: 0.0 };
        flow.turn();
        flow
    }

    /// Begins the next page.
    pub fn turn(&mut self) {
        let mut page = Page::new(self.fonts);
        let (word, part, scan) = (set(Font::Bold, 12.2), set(Font::SemiBold, 9.6), set(Font::Regular, 8.6));
        sign(&mut page, self.head.sign, LEFT + 2.9, 14.5, 2.8);
        page.text(LEFT + 8.4, 15.9, word, TEXT, self.head.word);
        let x = LEFT + 8.4 + self.fonts.width_mm(word, self.head.word) + 3.0;
        let scan_text = self.fonts.fitted(scan, &self.fonts.printable(scan.font, &self.head.scan), 55.0);
        page.text_right(RIGHT, 15.6, scan, QUIET, &scan_text);
        let room = RIGHT - x - self.fonts.width_mm(scan, &scan_text) - 6.0;
        let [name, number, revision] = &self.head.part;
        let part_text = self.fonts.shared(part, &[("", name), (", ", number), (", revision ", revision)], room);
        page.text(x, 15.7, part, TEXT, &part_text);
        page.rule(LEFT, RIGHT, 19.8, TEXT, 0.4);
        self.pages.push(page);
        self.y = TOP;
    }

    /// Turns the page unless so much is left of it, mm.
    pub fn need(&mut self, height: f64) {
        if self.y + height > BOTTOM && self.y > TOP {
            self.turn();
        }
    }

    /// Whether so much is left of the page, mm.
    pub fn has(&self, height: f64) -> bool {
        self.y + height <= BOTTOM
    }

    /// The page in work.
    pub fn page(&mut self) -> &mut Page<'a> {
        self.pages.last_mut().expect("a flow begins with a page")
    }

    /// The filled pages.
    pub fn into_pages(self) -> Vec<Page<'a>> {
        self.pages
    }
}
