//! The window's frame: where it stands, what it is drawn with, what is said when it cannot be.

use super::app::{self, App, Setup};
use super::icon::icon;
use super::settings::{LEAST_WINDOW, Settings, config_folder, data_folder};
use crate::diagnostic::Diagnostic;
use crate::report::words::capital;
use std::io::IsTerminal;
use std::path::PathBuf;

/// The window of the first start.
const FIRST: [f32; 2] = [1280.0, 800.0];

/// Opens the window, with a plan if one is given, else the last one, else the demo. Returns when it is closed.
///
/// The error: there is no display, no OpenGL, or the worker cannot be started.
pub fn open(plan: Option<PathBuf>) -> Result<(), Diagnostic> {
    let shown = plan.as_ref().map_or_else(|| "PLAN.toml".into(), |p| p.display().to_string());
    let settings_file = config_folder().map(|folder| folder.join("window.toml"));
    let settings = settings_file.as_deref().map_or_else(Settings::default, Settings::read);
    let setup = Setup { plan, settings_file, data_folder: data_folder(), ..Setup::default() };
    let options = eframe::NativeOptions {
        viewport: viewport(&settings),
        renderer: eframe::Renderer::Glow,
        depth_buffer: 24,
        ..eframe::NativeOptions::default()
    };
    let create: eframe::AppCreator = Box::new(|context| {
        app::install(&context.egui_ctx);
        come_into_view(context);
        Ok(Box::new(App::new(&context.egui_ctx, setup)?))
    });
    eframe::run_native("shapeline", options, create).map_err(|fault| {
        let told = no_window(&fault, &shown);
        tell_without_terminal(&told);
        told
    })
}

/// Who started the program from a menu sees no terminal: the system's own message says the same. Without a display there is nobody to see it,
/// and it fails at once.
fn tell_without_terminal(told: &Diagnostic) {
    if std::io::stderr().is_terminal() {
        return;
    }
    let help = told.help.as_deref().map(capital).unwrap_or_default();
    let text = format!("{}\n\n{help}", capital(&told.message));
    rfd::MessageDialog::new().set_level(rfd::MessageLevel::Error).set_title("Shapeline").set_description(text).show();
}

fn viewport(settings: &Settings) -> egui::ViewportBuilder {
    let builder = egui::ViewportBuilder::default()
        .with_title("Shapeline")
        .with_app_id("shapeline")
        .with_icon(icon())
        .with_min_inner_size(LEAST_WINDOW);
    let scale = settings.magnification();
    let Some(place) = settings.place else { return builder.with_inner_size(FIRST) };
    // Kept in points at that scale; the frame is made before egui knows the scale.
    let builder = builder.with_inner_size(place.size.map(|s| s * scale)).with_maximized(place.maximized);
    match place.position {
        Some(position) => builder.with_position(position.map(|p| p * scale)),
        None => builder,
    }
}

/// A window whose screen is gone comes to the main one.
fn come_into_view(context: &eframe::CreationContext) {
    let Some(window) = context.winit_window() else { return };
    let Ok(corner) = window.outer_position() else { return };
    let inside = |at: i32, from: i32, length: u32| (from..from.saturating_add_unsigned(length)).contains(&at);
    // The bar with which it can be moved must be seen, if only a little of it.
    let seen = window.available_monitors().any(|monitor| {
        let (from, size) = (monitor.position(), monitor.size());
        let width = window.outer_size().width.cast_signed();
        let left_or_right = inside(corner.x, from.x, size.width) || inside(corner.x + width, from.x, size.width);
        left_or_right && inside(corner.y + 8, from.y, size.height)
    });
    if !seen {
        context.egui_ctx.send_viewport_cmd(egui::ViewportCommand::OuterPosition(egui::pos2(0.0, 0.0)));
    }
}

fn no_window(fault: &eframe::Error, plan: &str) -> Diagnostic {
    let help = format!(
        "`shapeline run {plan}` does the same inspection on the command line, `shapeline --help` lists the rest"
    );
    // The end of their chain says why; before it stand places in sources.
    let words = fault.to_string().replace('\n', " ");
    let why = words.rsplit(": ").next().unwrap_or_default().trim_end_matches('.');
    let what = match fault {
        eframe::Error::AppCreation(inner) => match inner.downcast_ref::<Diagnostic>() {
            Some(diagnostic) => return diagnostic.clone(),
            None => format!("the window cannot be opened: {why}"),
        },
        eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => {
            format!("the window cannot be opened, there is no display: {why}")
        }
        eframe::Error::Glutin(_) | eframe::Error::NoGlutinConfigs(..) | eframe::Error::OpenGL(_) => {
            format!("the window cannot be opened, OpenGL is missing: {why}")
        }
    };
    Diagnostic::error(what).with_help(help)
}
