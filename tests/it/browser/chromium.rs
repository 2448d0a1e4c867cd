//! Opens a page in headless Chromium, with no network, and reads what a probe found there.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use serde_json::Value;

const WATCH: &str = include_str!("watch.js");
const READ: &str = include_str!("read.js");
/// Nothing may come from elsewhere: whatever is asked for is refused and noted.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; \
                      img-src data: blob:; frame-src 'self'; worker-src blob:";
/// A page that is not done by then never will be.
const PATIENCE: Duration = Duration::from_secs(150);
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// A window is at least this wide.
const WINDOW_MIN: u32 = 500;

/// One browser at a time: they are heavy, and times are measured.
static ALONE: Mutex<()> = Mutex::new(());

/// With the processor as a graphics card, which the page may take for one or not, or with no WebGL at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Graphics {
    Played,
    Software,
    None,
}

/// The browser's name, if there is one.
fn browser() -> Option<&'static str> {
    let there = |name: &&str| {
        let asked = Command::new(name).arg("--version").stdin(Stdio::null()).output();
        asked.is_ok_and(|answer| answer.status.success())
    };
    NAMES.into_iter().find(there)
}

/// Opens `page` and runs `steps`, the body of an asynchronous function that gives an object. `None`, loudly, without a
/// browser. The answer also holds `errors` and `requests`.
pub(crate) fn open(page: &str, steps: &str, graphics: Graphics) -> Option<Value> {
    open_at(page, steps, graphics, 1300)
}

/// The same in a frame of that width: windows have a least width of their own.
pub(crate) fn open_at(page: &str, steps: &str, graphics: Graphics, width: u32) -> Option<Value> {
    let Some(browser) = browser() else {
        eprintln!("SKIPPED: no Chromium; the pages have not been opened");
        return None;
    };
    let _alone = ALONE.lock().unwrap_or_else(|broken| broken.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("page.html");
    let played = if graphics == Graphics::Played { "anyGl();" } else { "" };
    let head = format!(
        "<head><meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\"><script>{WATCH}{READ}{played}</script>"
    );
    let tail = format!(
        "<script>(async () => {{ try {{ finish(await (async () => {{ {steps} }})()); }} catch (error) {{ \
         finish({{ failed: String(error.stack) }}); }} }})();</script></body>"
    );
    assert_eq!((page.matches("<head>").count(), page.matches("\n</body>").count()), (1, 1));
    fs::write(&path, page.replace("<head>", &head).replace("\n</body>", &tail)).unwrap();

    let around = folder.path().join("around.html");
    let frame = format!(
        "<!DOCTYPE html><html><head><script>{WATCH}addEventListener('message', ({{ data }}) => data.all && answer(data.all));\
         </script></head><body style=\"margin:0\"><iframe src=\"page.html\" scrolling=\"no\" style=\"border:0;width:{width}px;height:1000px\">\
         </iframe></body></html>"
    );
    fs::write(&around, frame).unwrap();
    let path = if width < WINDOW_MIN { around } else { path };
    let answer = folder.path().join("dom.html");
    let mut command = Command::new(browser);
    command
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--no-first-run",
            "--mute-audio",
        ])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--host-resolver-rules=MAP * ~NOTFOUND", "--dump-dom"])
        .arg(format!("--window-size={},1000", width.max(WINDOW_MIN)))
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()));
    match graphics {
        Graphics::Played | Graphics::Software => {
            command.args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        }
        Graphics::None => command.args(["--disable-gpu", "--disable-3d-apis"]),
    };
    let address = format!("file://{}", path.display());
    command.arg(address).stdin(Stdio::null()).stdout(fs::File::create(&answer).unwrap());
    wait(command.stderr(Stdio::null()));
    Some(read(&answer))
}

fn wait(command: &mut Command) {
    let mut child = command.spawn().unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("the browser took longer than {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(25));
    }
}

fn read(answer: &Path) -> Value {
    let text = fs::read_to_string(answer).unwrap();
    let start = text.find("<pre id=\"probe\">").unwrap_or_else(|| {
        panic!("the probe has not answered: {}", text.chars().take(400).collect::<String>())
    });
    let inside = &text[start + "<pre id=\"probe\">".len()..];
    let found: Value = serde_json::from_str(&inside[..inside.find("</pre>").unwrap()]).unwrap();
    assert!(found["failed"].is_null(), "{}", found["failed"]);
    found
}
