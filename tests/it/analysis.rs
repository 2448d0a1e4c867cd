//! What updates have to do with the gradient: said of a real run, at states that are kept and at states that are learnt again.

use serde_json::Value;

use crate::program::{dalean, run, trained};

fn layers(stdout: &str) -> Vec<Value> {
    let lines = stdout.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    lines.filter(|line| line["event"] == "layer").collect()
}

#[test]
fn a_run_says_what_its_updates_have_to_do_with_the_gradient() {
    let dir = tempfile::tempdir().unwrap();
    let (folder, done) = trained(dir.path(), &[]);
    let analyse = |more: &[&str]| {
        let mut command = dalean();
        command.arg("analyse").arg(&folder).args(more);
        run(&mut command)
    };
    let ran = analyse(&["--json"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let found = layers(&ran.stdout);
    let states: Vec<_> =
        found.iter().map(|one| (one["epoch"].as_u64(), one["layer"].as_u64())).collect();
    let last = done["epochs"].as_u64();
    assert_eq!(states, [(Some(0), Some(0)), (Some(0), Some(1)), (last, Some(0)), (last, Some(1))]);
    for one in &found {
        let cos = one["agreement"].as_f64().unwrap();
        assert!((-1.0..=1.0 + 1e-12).contains(&cos), "{one}");
        if one["layer"] == 1 {
            assert!((cos - 1.0).abs() < 1e-9, "outputs hear their own errors: {one}");
        }
    }
    // by nothing else, hidden updates go uphill after an epoch or two
    assert!(found[2]["agreement"].as_f64().unwrap() > 0.1, "{}", found[2]);

    // the same figures wherever states come from, and with any number of threads
    let again = analyse(&["--json", "--at", "2,0,1", "--threads", "2"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    let more = layers(&again.stdout);
    assert_eq!(more.len(), 6);
    assert_eq!((&more[0..2], &more[4..6]), (&found[0..2], &found[2..4]));
    assert_ne!(more[2]["agreement"], more[4]["agreement"]);

    let page = dir.path().join("page.html");
    let shown = analyse(&["--page", page.to_str().unwrap()]);
    assert_eq!(shown.code, Some(0), "{shown:?}");
    assert!(
        shown.stdout.contains("after 2 epochs") && shown.stdout.contains("random_dense"),
        "{shown:?}"
    );
    #[expect(clippy::disallowed_methods, reason = "the page")]
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains("Agreement with the gradient") && html.contains("How large updates are"));

    let beyond = analyse(&["--at", "3"]);
    assert_eq!(beyond.code, Some(1), "{beyond:?}");
    assert!(beyond.stderr.contains("has no epoch 3"), "{beyond:?}");
}
