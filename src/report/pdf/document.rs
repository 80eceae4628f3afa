//! From pages to the bytes of a PDF that are the same for the same result.
//!
//! The library gives random ids to documents and dates to their information; both are replaced: the id is derived from
//! the result's own bytes, and there is no date, because a report has no clock.

use super::page::{Fonts, Page};
use super::theme::PAGE;
use crate::report::raster::MapPicture;
use crate::report::words::PROGRAM;
use printpdf::{
    Mm, PdfDocument, PdfFont, PdfPage, PdfSaveOptions, RawImage, RawImageData, RawImageFormat, XObject, XObjectId,
};
use sha2::{Digest, Sha256};

/// A picture that pages draw under a name.
pub struct Picture {
    /// The name.
    pub id: XObjectId,
    /// Pixels a row, and rows.
    pub size_px: [usize; 2],
    /// RGB, row by row from the top.
    pub pixels: Vec<u8>,
}

impl From<MapPicture> for Picture {
    fn from(map: MapPicture) -> Self {
        Self { id: map_id(), size_px: [map.width_px, map.height_px], pixels: map.pixels }
    }
}

/// The name under which pages draw the map.
pub fn map_id() -> XObjectId {
    XObjectId("Map".to_owned())
}

/// Puts the pages together. `seed` is the text from which the document's id is made.
pub fn bytes(pages: Vec<Page<'_>>, fonts: &Fonts, pictures: Vec<Picture>, title: &str, seed: &[u8]) -> Vec<u8> {
    let mut document = PdfDocument::new(title);
    document.metadata.info.creator = PROGRAM.to_owned();
    document.metadata.info.producer = PROGRAM.to_owned();
    for (id, font) in fonts.parsed() {
        document.resources.fonts.map.insert(id.clone(), PdfFont::new(font.clone()));
    }
    for picture in pictures {
        let image = RawImage {
            width: picture.size_px[0],
            height: picture.size_px[1],
            pixels: RawImageData::U8(picture.pixels),
            data_format: RawImageFormat::RGB8,
            tag: Vec::new(),
        };
        document.resources.xobjects.map.insert(picture.id, XObject::Image(image));
    }
    document.pages =
        pages.into_iter().map(|page| PdfPage::new(Mm(PAGE[0] as f32), Mm(PAGE[1] as f32), page.into_ops())).collect();
    // Images stay as they are: the library would shrink them by default.
    let options = PdfSaveOptions { image_optimization: None, subset_fonts: false, ..PdfSaveOptions::default() };
    let mut file = document.to_lopdf_document(&options, &mut Vec::new());

    let digest = Sha256::digest(seed);
    if let Ok(ids) = file.trailer.get_mut(b"ID").and_then(|id| id.as_array_mut()) {
        for id in ids {
            if let Ok(id) = id.as_str_mut() {
                *id = digest[..16].iter().flat_map(|b| format!("{b:02x}").into_bytes()).collect();
            }
        }
    }
    let info = file.trailer.get(b"Info").and_then(|info| info.as_reference());
    if let Ok(info) = info.and_then(|id| file.get_object_mut(id)).and_then(|info| info.as_dict_mut()) {
        // The last one would claim a printing standard that this file does not follow.
        for key in ["CreationDate", "ModDate", "GTS_PDFXVersion", "Identifier"] {
            info.remove(key.as_bytes());
        }
    }
    file.compress();
    let mut bytes = Vec::new();
    file.save_to(&mut bytes).expect("a Vec takes every write");
    bytes
}
