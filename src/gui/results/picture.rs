//! The picture of a view with everything that is drawn over it: to the clipboard, or into a PNG file.

use crate::gui::scope::Scope;
use crate::gui::theme::size;
use egui::{ColorImage, Modal, Rect, RichText, TextEdit, Ui};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// Nobody shuts a dialog that fast: it did not open.
const NOT_SHOWN: Duration = Duration::from_millis(300);

/// What comes back from the window's surface and from the file dialog.
enum News {
    /// The picture to be saved.
    Taken(ColorImage),
    /// Where to, or that nobody was asked.
    Path(Option<PathBuf>, Duration),
}

/// Pictures on their way.
#[derive(Default)]
pub struct Pictures {
    news: Option<(Sender<News>, Receiver<News>)>,
    taken: Option<ColorImage>,
    /// The path being typed, where the system has no dialog.
    typed: Option<String>,
    said: Option<Result<PathBuf, String>>,
}

impl std::fmt::Debug for Pictures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Pictures, {}", if self.taken.is_some() { "one taken" } else { "none taken" })
    }
}

impl Pictures {
    /// Copies what stands at a place of the window.
    pub fn copy(&mut self, ctx: &egui::Context, at: Rect) {
        let copier = ctx.clone();
        ctx.request_screenshot(move |all| {
            if let Some(part) = cut(&all, at, copier.pixels_per_point()) {
                copier.copy_image(part);
                copier.request_repaint();
            }
        });
    }

    /// Saves what stands at a place of the window; asks where.
    pub fn save(&mut self, ctx: &egui::Context, at: Rect) {
        let (sender, _) = self.news.get_or_insert_with(channel);
        let (sender, waker) = (sender.clone(), ctx.clone());
        self.said = None;
        ctx.request_screenshot(move |all| {
            if let Some(part) = cut(&all, at, waker.pixels_per_point())
                && sender.send(News::Taken(part)).is_ok()
            {
                waker.request_repaint();
            }
        });
    }

    /// Hears what came back, asks for a path where the system does not, says what came of it.
    pub fn ui(&mut self, ui: &mut Ui, scope: &mut Scope) {
        let news: Vec<News> = self.news.iter().flat_map(|(_, receiver)| receiver.try_iter()).collect();
        for news in news {
            match news {
                News::Taken(picture) => {
                    self.taken = Some(picture);
                    self.ask(ui.ctx());
                }
                News::Path(Some(path), _) => self.write(&path),
                News::Path(None, after) if after > NOT_SHOWN => self.taken = None,
                News::Path(None, _) => self.typed = Some(String::new()),
            }
        }
        self.typed_ui(ui, scope);
        self.said_ui(ui, scope);
    }

    fn ask(&mut self, ctx: &egui::Context) {
        let Some((sender, _)) = &self.news else { return };
        let (sender, waker) = (sender.clone(), ctx.clone());
        let asked = std::thread::Builder::new().name("file dialog".into()).spawn(move || {
            let begin = Instant::now();
            let path = rfd::FileDialog::new().add_filter("PNG", &["png"]).set_file_name("picture.png").save_file();
            if sender.send(News::Path(path, begin.elapsed())).is_ok() {
                waker.request_repaint();
            }
        });
        if asked.is_err() {
            self.typed = Some(String::new());
        }
    }

    fn write(&mut self, path: &Path) {
        let Some(picture) = self.taken.take() else { return };
        let path = if path.extension().is_some() { path.to_path_buf() } else { path.with_extension("png") };
        let written = png_of(&picture).and_then(|bytes| std::fs::write(&path, bytes).map_err(|e| e.to_string()));
        self.said = Some(written.map(|()| path.clone()).map_err(|e| format!("{}: {e}", path.display())));
    }

    fn typed_ui(&mut self, ui: &Ui, scope: &Scope) {
        let Some(mut text) = self.typed.take() else { return };
        let words = scope.words;
        let mut save = false;
        let shown = Modal::new(egui::Id::unique("picture path")).show(ui.ctx(), |ui| {
            ui.set_width(520.0_f32.min(ui.ctx().content_rect().width() - 64.0));
            ui.heading(words.text("results.save_picture"));
            let label = ui.label(words.text("results.picture_path"));
            let field = ui.add(TextEdit::singleline(&mut text).desired_width(f32::INFINITY)).labelled_by(label.id);
            if text.is_empty() && !field.has_focus() {
                field.request_focus();
            }
            save = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
            ui.horizontal(|ui| {
                save |= ui.button(words.text("results.save")).clicked();
                ui.button(words.text("results.cancel")).clicked()
            })
            .inner
        });
        if save && !text.trim().is_empty() {
            self.write(Path::new(text.trim().trim_matches('"')));
        } else if shown.inner || shown.should_close() {
            self.taken = None;
        } else {
            self.typed = Some(text);
        }
    }

    fn said_ui(&mut self, ui: &Ui, scope: &Scope) {
        let Some(said) = &self.said else { return };
        let text = match said {
            Ok(path) => scope.words.fill("results.picture_saved", &[("path", &path.display().to_string())]),
            Err(fault) => scope.words.fill("results.picture_not_saved", &[("fault", fault)]),
        };
        let shown = Modal::new(egui::Id::unique("picture said")).show(ui.ctx(), |ui| {
            ui.set_max_width(520.0);
            ui.label(RichText::new(text).size(size::BODY));
            ui.button(scope.words.text("help.close")).clicked()
        });
        if shown.inner || shown.should_close() {
            self.said = None;
        }
    }
}

/// The part of a picture of the window that stands at a place, in points; `None` when nothing of it does.
fn cut(all: &ColorImage, at: Rect, px_per_point: f32) -> Option<ColorImage> {
    let px = |v: f32, most: usize| ((v * px_per_point).round().max(0.0) as usize).min(most);
    let [left, right] = [at.left(), at.right()].map(|v| px(v, all.width()));
    let [top, bottom] = [at.top(), at.bottom()].map(|v| px(v, all.height()));
    (left < right && top < bottom).then(|| all.region_by_pixels([left, top], [right - left, bottom - top]))
}

/// A picture as the bytes of a PNG file.
fn png_of(picture: &ColorImage) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let [width, height] = [picture.width() as u32, picture.height() as u32];
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let pixels: Vec<u8> = picture.pixels.iter().flat_map(|p| [p.r(), p.g(), p.b()]).collect();
    let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
    writer.write_image_data(&pixels).map_err(|e| e.to_string())?;
    writer.finish().map_err(|e| e.to_string())?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Color32, pos2, vec2};

    #[test]
    fn a_picture_is_cut_out_and_read_back_as_it_was() {
        let pixel = |k: usize| Color32::from_rgb(k as u8, (k / 2) as u8, 7);
        let all = ColorImage::new([20, 10], (0..200).map(pixel).collect());
        // Two pixels a point: from (4, 2), 8 by 6 pixels.
        let part = cut(&all, Rect::from_min_size(pos2(2.0, 1.0), vec2(4.0, 3.0)), 2.0).unwrap();
        assert_eq!((part.width(), part.height(), part.pixels[0]), (8, 6, pixel(44)));
        let decoder = png::Decoder::new(std::io::Cursor::new(png_of(&part).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height), (8, 6));
        let expected: Vec<u8> = part.pixels.iter().flat_map(|p| [p.r(), p.g(), p.b()]).collect();
        assert_eq!(bytes, expected);
        assert!(cut(&all, Rect::from_min_size(pos2(50.0, 1.0), vec2(4.0, 3.0)), 2.0).is_none());
    }
}
