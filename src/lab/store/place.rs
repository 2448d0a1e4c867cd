//! Places that files are written to and read from: whole or not at all, and never outside the folder they are in.
//!
//! ```text
//! own folder      a part beside the place, flushed, moved into it; a link that lies there is replaced, never followed
//! file of a user  the same; into a device, a pipe or what a link leads to it is written, and nothing is moved over it
//! part            .dalean-part-XXXXXX, locked while it is written: one without a lock was left by a kill, and is removed
//! ```
#![expect(clippy::disallowed_methods, reason = "this is where files are opened")]

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// How names of parts begin.
const PART: &str = ".dalean-part-";
/// How they began once, in run folders.
const PART_OLD: &str = ".part-";

/// Opens a file that lies in a folder which may come from anywhere: a link there is not followed and a pipe not waited
/// at. `options` say for what.
///
/// # Errors
/// When the system refuses, or the place is no plain file.
pub(super) fn open(place: &Path, options: &mut OpenOptions, links: bool) -> io::Result<File> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;

        use rustix::fs::OFlags;

        let links = if links { OFlags::empty() } else { OFlags::NOFOLLOW };
        options.custom_flags((links | OFlags::NONBLOCK).bits().cast_signed());
    }
    if !links && fs::symlink_metadata(place).is_ok_and(|found| found.is_symlink()) {
        return Err(no_file("is a link, and what lies elsewhere is no part of this folder"));
    }
    let file = options.open(place)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(no_file("is no plain file")) }
}

fn no_file(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what)
}

/// Whether a plain file lies there: no link, no pipe, no folder.
#[must_use]
pub fn is_plain(place: &Path) -> bool {
    fs::symlink_metadata(place).is_ok_and(|found| found.is_file())
}

/// Makes a folder and those it lies in; one that is a link is refused, as it would lead elsewhere.
///
/// # Errors
/// When it cannot be made or is a link.
pub fn make_folder(place: &Path) -> io::Result<()> {
    match fs::symlink_metadata(place) {
        Ok(found) if found.is_symlink() => {
            let what = "it is a link: what is written there would lie elsewhere; put a folder in its place";
            Err(no_file(what))
        }
        _ => fs::create_dir_all(place),
    }
}

/// A part that nobody clears while it is written.
fn new_part(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PART);
    #[cfg(unix)]
    let builder = {
        // readable by whom the user's mask allows, as any other file
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666))
    };
    loop {
        let part = builder.tempfile_in(folder)?;
        // not every file system has locks; without them nobody can tell that a part was left, and nobody removes it
        if part.as_file().lock().is_err() || part.path().exists() {
            return Ok(part);
        }
        // someone took it for a part that was left, before it was locked
    }
}

/// Writes a file of a folder of ours whole: beside its place, flushed, then moved into it.
///
/// # Errors
/// When the system or `write` refuses; the old file is then still there.
pub fn write_whole(
    place: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    let folder = folder_of(place);
    let mut part = new_part(folder)?;
    write(part.as_file_mut())?;
    part.as_file().sync_all()?;
    part.persist(place).map_err(|error| error.error)?;
    // the move itself has to reach the disk; not every file system lets a folder be flushed
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

fn folder_of(place: &Path) -> &Path {
    let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or_else(|| Path::new("."))
}

/// Writes a file that a user named, once all of it is known: a new one whole, as [`write_whole`]; into a device, a pipe
/// or what a link leads to.
///
/// # Errors
/// When the system refuses; an old file is then still there.
pub fn write_out(place: &Path, bytes: &[u8]) -> io::Result<()> {
    match fs::symlink_metadata(place) {
        Ok(found) if !found.is_file() && !found.is_dir() => {
            let plain =
                found.is_symlink() && fs::metadata(place).is_ok_and(|found| found.is_file());
            let missing = found.is_symlink() && fs::metadata(place).is_err();
            let mut file =
                OpenOptions::new().write(true).create(missing).truncate(plain).open(place)?;
            file.write_all(bytes)?;
            if plain || missing { file.sync_all() } else { file.flush() }
        }
        _ => {
            clear_parts(folder_of(place));
            write_whole(place, |file| file.write_all(bytes))
        }
    }
}

/// Removes parts that a kill has left in a folder; those that someone is writing stay.
pub fn clear_parts(folder: &Path) {
    each_part(
        folder,
        |name| name.strip_prefix(PART).is_some_and(is_random),
        |path| {
            let file = open(path, OpenOptions::new().read(true).write(true), false);
            if file.is_ok_and(|file| file.try_lock().is_ok()) {
                let _ = fs::remove_file(path);
            }
        },
    );
}

/// Removes all parts of a folder that the caller holds.
pub(super) fn clear_held(folder: &Path) {
    let ours = |name: &str| name.starts_with(PART) || name.starts_with(PART_OLD);
    each_part(folder, ours, |path| drop(fs::remove_file(path)));
}

/// What the library puts behind the prefix.
fn is_random(rest: &str) -> bool {
    rest.len() == 6 && rest.bytes().all(|b| b.is_ascii_alphanumeric())
}

fn each_part(folder: &Path, is_part: impl Fn(&str) -> bool, mut act: impl FnMut(&Path)) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if entry.file_name().to_str().is_some_and(&is_part) && is_plain(&entry.path()) {
            act(&entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_part_left_by_a_kill_is_cleared_and_one_at_work_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let at_work = new_part(folder.path()).unwrap();
        fs::write(folder.path().join(".dalean-part-abcDEF"), "half").unwrap();
        fs::write(folder.path().join(".dalean-part-of-mine"), "not ours").unwrap();
        write_out(&folder.path().join("table"), b"whole").unwrap();
        let kept = at_work.path().file_name().unwrap().to_str().unwrap().to_owned();
        let mut wanted = vec![".dalean-part-of-mine".to_owned(), kept, "table".to_owned()];
        wanted.sort();
        assert_eq!(names(folder.path()), wanted);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_written_into_by_a_user_and_replaced_by_us() {
        use std::os::unix::fs::symlink;

        let folder = tempfile::tempdir().unwrap();
        let [far, link] = ["far", "link"].map(|name| folder.path().join(name));
        fs::write(&far, "what was there before").unwrap();
        symlink(&far, &link).unwrap();
        write_out(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&far).unwrap(), b"new");
        // a file of ours takes the place of the link
        write_whole(&link, |file| file.write_all(b"ours")).unwrap();
        assert!(is_plain(&link) && fs::read(&far).unwrap() == b"new");
        // and what is opened in our folders is never elsewhere
        fs::remove_file(&link).unwrap();
        symlink(&far, &link).unwrap();
        let opened = open(&link, OpenOptions::new().write(true).create(true), false);
        assert!(opened.unwrap_err().to_string().contains("is a link"));
        assert!(make_folder(&link).is_err());
        assert_eq!(fs::read(&far).unwrap(), b"new");
    }
}
