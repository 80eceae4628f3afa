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
    sign: Option<Sign>,
    word: &'static str,
    /// Literal texts and values in turn.
    about: Vec<(&'static str, String)>,
    right: String,
}

impl<'a> Flow<'a> {
    /// Begins with an empty page.
    pub fn new(fonts: &'a Fonts, result: &InspectionResult) -> Flow<'a> {
        let id = &result.identity;
        let about =
            vec![("", id.part_name.clone()), (", ", id.part_number.clone()), (", revision ", id.part_revision.clone())];
        let right = format!("Scan {}", id.scan_file);
        Self::begin(fonts, Head { sign: Some(part_sign(result)), word: part_word(result), about, right })
    }

    /// Begins with an empty page of a document that is not about one part.
    pub fn titled(fonts: &'a Fonts, word: &'static str, about: &str, right: &str) -> Flow<'a> {
        Self::begin(fonts, Head { sign: None, word, about: vec![("", about.to_owned())], right: right.to_owned() })
    }

    fn begin(fonts: &'a Fonts, head: Head) -> Flow<'a> {
        let mut flow = Flow { fonts, head, pages: Vec::new(), y: 0.0 };
        flow.turn();
        flow
    }

    /// Begins the next page.
    pub fn turn(&mut self) {
        let mut page = Page::new(self.fonts);
        let (word, part, scan) = (set(Font::Bold, 12.2), set(Font::SemiBold, 9.6), set(Font::Regular, 8.6));
        let mut x = LEFT;
        if let Some(of) = self.head.sign {
            sign(&mut page, of, LEFT + 2.9, 14.5, 2.8);
            x += 8.4;
        }
        page.text(x, 15.9, word, TEXT, self.head.word);
        x += self.fonts.width_mm(word, self.head.word) + 3.0;
        let scan_text = self.fonts.fitted(scan, &self.fonts.printable(scan.font, &self.head.right), 55.0);
        page.text_right(RIGHT, 15.6, scan, QUIET, &scan_text);
        let room = RIGHT - x - self.fonts.width_mm(scan, &scan_text) - 6.0;
        let pieces: Vec<(&str, &str)> =
            self.head.about.iter().map(|(literal, value)| (*literal, value.as_str())).collect();
        let part_text = self.fonts.shared(part, &pieces, room);
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
