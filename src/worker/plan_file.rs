//! Plans on the disk while they are edited: opened, saved whole or not at all, and kept from getting lost by a crash.
//!
//! Beside `bracket.toml` lies `bracket.toml.autosave` as long as there is something unsaved: a line that names the file it was made
//! from by its hash, then the text.

use crate::diagnostic::Diagnostic;
use crate::io;
use crate::plan::document::{Change, Document, Step, Verb};
use crate::report::atomic;
use std::fs;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Largest plan, and autosaved plan, that is read: the reader's own limit, and a line.
const LARGEST: u64 = (1 << 20) + 200;
const MARK: &str = "# shapeline autosave of ";

/// A plan that was opened.
#[derive(Debug, Clone)]
pub struct Opened {
    /// It, as it lies on the disk; empty and unsaved where only an autosaved text is there.
    pub document: Document,
    /// What was not saved when the program last ended, to be offered.
    pub recovery: Option<Recovery>,
}

/// Text that was never saved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recovery {
    /// The text.
    pub text: String,
    /// Whether it was made from the file that lies there now; else somebody saved another one since.
    pub of_this_file: bool,
}

/// Why a plan was not saved.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SaveError {
    /// Another file lies there than the one that was read: the choice is a person's.
    #[error("{0}")]
    ChangedByOthers(Box<Diagnostic>, Vec<Change>),
    /// It could not be written.
    #[error("{0}")]
    Failed(Box<Diagnostic>),
}

/// Whether a file that somebody else changed may be overwritten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overwrite {
    /// Only the file that was read.
    Own,
    /// Whatever lies there, after a person said so.
    Anything,
}

/// Where unsaved text of a plan is kept.
pub fn autosave_path(plan: &Path) -> PathBuf {
    let mut name = plan.as_os_str().to_owned();
    name.push(".autosave");
    name.into()
}

/// Opens a plan for editing, sound or not.
///
/// # Errors
/// A file that cannot be read, or is no text. Where there is none, but an autosaved text, there is no error.
pub fn open_plan(path: &Path) -> Result<Opened, Box<Diagnostic>> {
    let kept = read_autosave(path);
    let document = match read_capped(path) {
        Ok(bytes) => Document::from_bytes(&bytes, path)?,
        Err(fault) if fault.kind() == ErrorKind::NotFound && kept.is_some() => Document::unsaved("", path),
        Err(fault) => return Err(Box::new(unreadable(path, &fault))),
    };
    let recovery = kept.filter(|(_, text)| text != document.text()).map(|(sha256, text)| {
        let of_this_file = sha256.as_deref() == document.saved_sha256();
        Recovery { text, of_this_file }
    });
    Ok(Opened { document, recovery })
}

/// Takes the text that was never saved, as a step that can be taken back.
pub fn recover(document: &mut Document, recovery: &Recovery) {
    document.set_text(&recovery.text, Step::new(Verb::Recover, "what was not saved"));
}

/// Keeps the unsaved text beside the plan; of a plan without unsaved text what was kept is removed.
///
/// # Errors
/// It could not be written.
pub fn autosave(document: &Document) -> Result<(), Box<Diagnostic>> {
    if !document.is_modified() {
        discard_autosave(document.path());
        return Ok(());
    }
    let of = document.saved_sha256().unwrap_or("nothing");
    let text = format!("{MARK}{of}\n{}", document.text());
    atomic::write(&autosave_path(document.path()), text.as_bytes()).map_err(|fault| {
        let help = "save the plan, or make room: until then a crash would lose what was edited";
        Box::new(Diagnostic { help: Some(help.to_owned()), ..fault })
    })
}

/// Forgets the unsaved text of a plan.
pub fn discard_autosave(plan: &Path) {
    // One that cannot be removed is offered again at the next start, and refused again.
    let _ = fs::remove_file(autosave_path(plan));
}

/// Saves the plan whole or not at all, and removes what was kept beside it. Nothing but the file that was read is overwritten, unless a
/// person chose so; between this look and the writing lies a moment.
///
/// # Errors
/// Another file lies there; it could not be written. The document stays unsaved.
pub fn save_plan(document: &mut Document, overwrite: Overwrite) -> Result<(), SaveError> {
    // A link to a plan stays a link.
    let target = fs::canonicalize(document.path()).unwrap_or_else(|_| document.path().to_path_buf());
    if overwrite == Overwrite::Own {
        refuse_others(document, &target)?;
    }
    let about = fs::metadata(&target).ok();
    if about.as_ref().is_some_and(|about| about.permissions().readonly()) {
        let told = Diagnostic::error("cannot save, the plan is read-only").in_file(document.path());
        return Err(failed(told.with_help("allow writing it, or save it under another name")));
    }
    let bytes = document.bytes();
    atomic::write(&target, &bytes).map_err(|fault| {
        let help = "save it under another name or in another folder; nothing of the file there was changed";
        failed(Diagnostic { help: Some(help.to_owned()), ..fault })
    })?;
    if let Some(about) = about {
        // Who may read and write the file is as before, where the system lets us.
        let _ = fs::set_permissions(&target, about.permissions());
    }
    document.mark_saved(&bytes);
    discard_autosave(document.path());
    Ok(())
}

fn failed(told: Diagnostic) -> SaveError {
    SaveError::Failed(Box::new(told))
}

fn refuse_others(document: &Document, target: &Path) -> Result<(), SaveError> {
    let told = |message: &str, help: &str, theirs: Vec<Change>| {
        let told = Diagnostic::error(message).in_file(document.path()).with_help(help);
        Err(SaveError::ChangedByOthers(Box::new(told), theirs))
    };
    match (read_capped(target), document.saved_sha256()) {
        (Ok(bytes), Some(sha256)) if io::sha256_hex(&bytes) == sha256 => Ok(()),
        (Ok(bytes), Some(_)) => told(
            "not saved: somebody else changed this plan since it was opened",
            "look at the other version first: save yours under another name and compare, or overwrite theirs",
            document.changes_by_others(&String::from_utf8_lossy(&bytes)),
        ),
        (Ok(_), None) => {
            told("not saved: a file of this name is there already", "choose another name, or overwrite it", Vec::new())
        }
        (Err(fault), None) if fault.kind() == ErrorKind::NotFound => Ok(()),
        (Err(fault), Some(_)) if fault.kind() == ErrorKind::NotFound => told(
            "not saved: somebody removed or renamed this plan since it was opened",
            "save it under another name, or write it again under this one",
            Vec::new(),
        ),
        (Err(fault), _) => Err(failed(unreadable(document.path(), &fault))),
    }
}

/// The hash of the file from which it was made, where there was one, and the text.
fn read_autosave(plan: &Path) -> Option<(Option<String>, String)> {
    let text = String::from_utf8(read_capped(&autosave_path(plan)).ok()?).ok()?;
    let (head, text) = text.strip_prefix(MARK)?.split_once('\n')?;
    Some(((head != "nothing").then(|| head.to_owned()), text.to_owned()))
}

fn read_capped(path: &Path) -> std::io::Result<Vec<u8>> {
    // A pipe or device could wait for ever; only plain files are opened.
    if !fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("it is no plain file"));
    }
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(LARGEST).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn unreadable(path: &Path, fault: &std::io::Error) -> Diagnostic {
    let fault = match fault.kind() {
        ErrorKind::NotFound => "there is no such file".to_owned(),
        ErrorKind::PermissionDenied => "it may not be read".to_owned(),
        _ => fault.to_string(),
    };
    let message = format!("could not read a plan: {fault}");
    Diagnostic::error(message).in_file(path).with_help("check name and folder, and that you may read it")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::document::FieldValue;

    const TEXT: &str = "# mine\r\nschema = 1\r\n[part]\r\nname = \"a\" # it\r\nthickness_mm = 1.0\r\n";

    fn plan() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.toml");
        fs::write(&path, TEXT).unwrap();
        (folder, path)
    }

    fn edited(path: &Path) -> Document {
        let mut document = open_plan(path).unwrap().document;
        document.set_setting("part", "thickness_mm", &FieldValue::Number(1.5)).unwrap();
        document
    }

    fn files(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn saving_writes_the_whole_text_as_the_file_has_it() {
        let (folder, path) = plan();
        let mut document = edited(&path);
        autosave(&document).unwrap();
        assert_eq!(files(folder.path()), ["p.toml", "p.toml.autosave"]);
        save_plan(&mut document, Overwrite::Own).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), TEXT.replace("1.0", "1.5"));
        assert!(!document.is_modified() && files(folder.path()) == ["p.toml"]);
        // Once more: the file on the disk is now the one that was saved.
        document.undo().unwrap();
        save_plan(&mut document, Overwrite::Own).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), TEXT);
    }

    #[test]
    fn what_somebody_else_changed_is_not_overwritten_without_a_word() {
        let (folder, path) = plan();
        let mut document = edited(&path);
        fs::write(&path, "# theirs\n").unwrap();
        let Err(SaveError::ChangedByOthers(told, _)) = save_plan(&mut document, Overwrite::Own) else { panic!() };
        assert!(told.message.contains("somebody else changed") && told.help.is_some(), "{told}");
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), document.is_modified()), ("# theirs\n", true));
        fs::remove_file(&path).unwrap();
        let Err(SaveError::ChangedByOthers(told, _)) = save_plan(&mut document, Overwrite::Own) else { panic!() };
        assert!(told.message.contains("removed or renamed"), "{told}");
        save_plan(&mut document, Overwrite::Anything).unwrap();
        assert_eq!(files(folder.path()), ["p.toml"]);
        let mut copy = document.copy_to(&path).unwrap();
        let Err(SaveError::ChangedByOthers(told, _)) = save_plan(&mut copy, Overwrite::Own) else { panic!() };
        assert!(told.message.contains("is there already"), "{told}");
        let mut gone = document.copy_to(&folder.path().join("no/p.toml")).unwrap();
        let Err(SaveError::Failed(told)) = save_plan(&mut gone, Overwrite::Own) else { panic!() };
        assert!(told.message.contains("folder does not exist") && gone.is_modified(), "{told}");
    }

    #[cfg(unix)]
    #[test]
    fn a_plan_that_is_read_only_stays_as_it_is_and_a_link_stays_a_link() {
        use std::os::unix::fs::PermissionsExt;
        let (folder, path) = plan();
        let link = folder.path().join("link.toml");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        save_plan(&mut edited(&link), Overwrite::Own).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&path).unwrap(), TEXT.replace("1.0", "1.5"));
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o440)).unwrap();
        let mut document = open_plan(&path).unwrap().document;
        document.set_setting("part", "thickness_mm", &FieldValue::Number(9.0)).unwrap();
        let Err(SaveError::Failed(told)) = save_plan(&mut document, Overwrite::Own) else { panic!() };
        assert!(told.message.contains("read-only"), "{told}");
    }

    #[test]
    fn unsaved_work_is_offered_after_a_crash() {
        let (folder, path) = plan();
        autosave(&edited(&path)).unwrap();
        let Opened { mut document, recovery } = open_plan(&path).unwrap();
        let recovery = recovery.unwrap();
        assert!(recovery.of_this_file && !document.is_modified());
        recover(&mut document, &recovery);
        assert_eq!(document.bytes(), TEXT.replace("1.0", "1.5").as_bytes());
        assert_eq!(document.undo().unwrap().to_string(), "Recover what was not saved");
        // Taken back and kept: nothing is unsaved any more.
        autosave(&document).unwrap();
        assert_eq!(files(folder.path()), ["p.toml"]);
        autosave(&edited(&path)).unwrap();
        fs::write(&path, "# theirs\n").unwrap();
        assert!(!open_plan(&path).unwrap().recovery.unwrap().of_this_file);
        // A new plan that was never saved.
        fs::remove_file(&path).unwrap();
        let opened = open_plan(&path).unwrap();
        assert!(opened.recovery.is_some() && opened.document.saved_sha256().is_none());
        discard_autosave(&path);
        let told = open_plan(&path).unwrap_err();
        assert!(told.message.contains("there is no such file"), "{told}");
        fs::write(autosave_path(&path), "torn").unwrap();
        assert!(open_plan(&path).is_err());
    }
}
