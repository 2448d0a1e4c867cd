//! A set over HTTP: from the first mirror that has it right, resumed where it broke off.
//!
//! A download grows in `NAME.part` beside the set. When a connection breaks, or the program is ended, the
//! next request asks for the bytes that are missing. The content decides in the end: a whole file of the
//! wrong hash is thrown away, once more tried from its first byte if it was resumed, then left to the next
//! mirror.
#![expect(clippy::disallowed_methods, reason = "data sets live in files")]

use std::{
    fs::{self, File, OpenOptions},
    io::{self, BufReader, Read, Write},
    path::Path,
    thread,
    time::Duration,
};

use flate2::read::MultiGzDecoder;
use ureq::http::{Response, header::CONTENT_RANGE};

use super::{FetchError, FetchEvent, archive, stage::Stage};
use crate::lab::data::{
    catalog::{CatalogFile, MirrorForm},
    error::DataError,
};

/// How the network is used.
pub(super) struct Network {
    agent: ureq::Agent,
    /// Connections in a row that bring nothing before a mirror is given up.
    idle_tries: u32,
    /// Wait after a connection that brought something; it doubles with each that did not.
    pause: Duration,
}

impl Network {
    /// Patient, and through the proxy that the environment names.
    pub(super) fn new() -> Self {
        let proxy = ureq::Proxy::try_from_env();
        Self::with(proxy, 3, Duration::from_secs(1))
    }

    /// The same for somebody who has other places to turn to.
    pub(super) fn hasty() -> Self {
        Self { idle_tries: 1, ..Self::new() }
    }

    pub(super) fn with(proxy: Option<ureq::Proxy>, idle_tries: u32, pause: Duration) -> Self {
        let agent = ureq::Agent::config_builder()
            .proxy(proxy)
            .accept_encoding("identity")
            .timeout_connect(Some(Duration::from_secs(20)))
            .timeout_recv_response(Some(Duration::from_secs(60)))
            .timeout_per_read(Some(Duration::from_secs(60)))
            .build()
            .new_agent();
        Self { agent, idle_tries, pause }
    }
}

/// Why a download ended early.
enum Trouble {
    /// The mirror's fault, in words.
    Network(String),
    /// Ours: no other mirror will help.
    Local(DataError),
}

/// Gets every wanted file from the first of `mirrors` that has it right.
pub(super) fn get(
    stage: &mut Stage<'_>,
    mirrors: &[&str],
    network: &Network,
) -> Result<(), DataError> {
    match stage.entry.mirror_form {
        MirrorForm::TarGz(name) => one(stage, mirrors, network, name, None),
        MirrorForm::GzipEach => stage.wanted().into_iter().try_for_each(|file| {
            one(stage, mirrors, network, &format!("{}.gz", file.name), Some(file))
        }),
    }
}

/// Gets an archive by its whole address, and puts its wanted files in place.
pub(super) fn archive_at(
    stage: &mut Stage<'_>,
    network: &Network,
    base: &str,
    name: &str,
) -> Result<(), DataError> {
    one(stage, &[base], network, name, None)
}

/// Gets one remote file: the gzip of `file`, or an archive of all.
fn one(
    stage: &mut Stage<'_>,
    mirrors: &[&str],
    network: &Network,
    name: &str,
    file: Option<&'static CatalogFile>,
) -> Result<(), DataError> {
    let part = stage.beside(&format!("{name}.part"));
    let mut tries = Vec::new();
    for mirror in mirrors {
        let url = format!("{mirror}{name}");
        stage.tell(FetchEvent::Trying { place: url.clone() });
        loop {
            let resumed = size(&part) > 0;
            let why = match download(stage, network, &url, name, &part) {
                Ok(()) => match unpack(stage, &part, file) {
                    Ok(()) => return remove(&part),
                    Err(DataError::Fetch(wrong)) => {
                        remove(&part)?;
                        if resumed {
                            continue;
                        }
                        wrong.to_string()
                    }
                    Err(other) => return Err(other),
                },
                Err(Trouble::Network(why)) => why,
                Err(Trouble::Local(error)) => return Err(error),
            };
            tries.push(format!("{url}: {why}"));
            stage.tell(FetchEvent::Failed { place: url, why });
            break;
        }
    }
    let (set, how) = (stage.entry.set, stage.entry.how_to_get());
    Err(FetchError::Mirrors { set, file: name.to_owned(), tries, how }.into())
}

fn unpack(
    stage: &mut Stage<'_>,
    part: &Path,
    file: Option<&'static CatalogFile>,
) -> Result<(), DataError> {
    let source = BufReader::new(File::open(part).map_err(DataError::io("open", part))?);
    match file {
        Some(file) => stage.install(file, &mut MultiGzDecoder::new(source)),
        None => archive::install(stage, &part.display().to_string(), source),
    }
}

/// Brings `part` to its end, over as many connections as it takes.
fn download(
    stage: &mut Stage<'_>,
    network: &Network,
    url: &str,
    name: &str,
    part: &Path,
) -> Result<(), Trouble> {
    let mut idle = 0;
    loop {
        let have = size(part);
        let mut request = network.agent.get(url);
        if have > 0 {
            request = request.header("Range", format!("bytes={have}-"));
        }
        let why = match request.call() {
            Ok(response) => match receive(stage, response, have, name, part) {
                Err(Trouble::Network(why)) => why,
                end => return end,
            },
            // Nothing lies beyond what we have: the hash will tell whether it is all.
            Err(ureq::Error::StatusCode(416)) if have > 0 => return Ok(()),
            Err(ureq::Error::StatusCode(status)) if status < 500 => {
                return Err(Trouble::Network(format!("the server answers {status}")));
            }
            Err(other) => other.to_string(),
        };
        idle = if size(part) > have { 0 } else { idle + 1 };
        if idle == network.idle_tries {
            return Err(Trouble::Network(why));
        }
        thread::sleep(network.pause * 2u32.saturating_pow(idle));
    }
}

/// Takes in one response; an error of the network leaves what has arrived.
fn receive(
    stage: &mut Stage<'_>,
    mut response: Response<ureq::Body>,
    have: u64,
    name: &str,
    part: &Path,
) -> Result<(), Trouble> {
    let resumed = have > 0 && response.status() == 206;
    if resumed && !starts_at(&response, have) {
        remove(part).map_err(Trouble::Local)?;
        return Err(Trouble::Network("the server resumes at the wrong byte".to_owned()));
    }
    let local = || |e| Trouble::Local(DataError::io("write", part)(e));
    let mut options = OpenOptions::new();
    options.create(true).write(true).append(resumed).truncate(!resumed);
    let mut to = options.open(part).map_err(local())?;
    let mut bytes = if resumed { have } else { 0 };
    let file = || name.to_owned();
    if resumed {
        stage.tell(FetchEvent::Resumed { file: file(), bytes });
    }
    let total = response.body().content_length().and_then(|rest| bytes.checked_add(rest));
    // Compression may lengthen a file a little, never by this much.
    let limit = stage.entry.bytes() + (1 << 20);
    let mut body = response.body_mut().as_reader();
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = match body.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => count,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
            Err(e) => return Err(Trouble::Network(format!("broke off after {bytes} bytes: {e}"))),
        };
        bytes += u64::try_from(count).expect("a buffer is small");
        if bytes > limit {
            drop(to);
            remove(part).map_err(Trouble::Local)?;
            return Err(Trouble::Network(format!(
                "sends more than the {limit} bytes there can be"
            )));
        }
        to.write_all(&buffer[..count]).map_err(local())?;
        stage.tell(FetchEvent::Received { file: file(), bytes, total });
    }
    if total.is_some_and(|total| bytes < total) {
        return Err(Trouble::Network(format!("broke off after {bytes} bytes")));
    }
    to.sync_all().map_err(local())
}

/// Whether a partial response begins at byte `at`.
fn starts_at(response: &Response<ureq::Body>, at: u64) -> bool {
    let range = response.headers().get(CONTENT_RANGE).and_then(|value| value.to_str().ok());
    let start = range.and_then(|range| range.strip_prefix("bytes ")?.split('-').next());
    start.is_some_and(|start| start.trim() == at.to_string())
}

fn size(path: &Path) -> u64 {
    fs::metadata(path).map_or(0, |data| data.len())
}

fn remove(path: &Path) -> Result<(), DataError> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(DataError::io("remove", path)(e)),
        _ => Ok(()),
    }
}
