//! The window. Above the worker beside the command line: it shows what the worker tells and computes no result.
//!
//! ```text
//! worker --bridge--> events --hear--> Facts --views--> Actions --perform--> Facts, ViewState, jobs for the worker
//! ```
//!
//! `Facts` are what is so (plan, part, results, what runs); `ViewState` is what is looked at. Views read both through a
//! `Scope` and push `Action`s; nothing acts in the middle of drawing.

mod action;
mod app;
mod bar;
mod bar_places;
mod breadth;
mod bridge;
mod clock;
mod dialog;
mod earlier;
pub mod engineer;
mod facts;
mod fonts;
mod frame_times;
mod hear;
mod help;
mod icon;
mod keys;
mod later;
mod lookout;
mod menus;
pub mod merge;
mod messages;
mod new_plan;
mod open;
mod operator;
mod perform;
mod picture;
mod results;
pub mod scene;
mod scope;
mod settings;
mod shift;
mod text;
mod theme;
mod widgets;

pub use action::{Action, Screen};
pub use app::{App, Setup, install};
pub use clock::Clock;
pub use earlier::Looked;
pub use facts::{Facts, FinishedPart, Job, Running, RunningScan, Troubles, Wanted};
pub use frame_times::frame_times;
pub use icon::{mark_png, mark_svg};
pub use new_plan::Command as NewPlanCommand;
pub use open::open;
pub use scope::{Scope, ViewState};
pub use settings::{Settings, ThemeChoice};
pub use text::{Language, Words};
pub use theme::Theme;
