//! Plotly.js, out of the crate that carries it.

/// The tag that opens and closes each script of the crate.
const OPEN: &str = "<script type=\"text/javascript\">";
const CLOSE: &str = "</script>";

/// The script of Plotly.js, without its tags. The crate gives a second script, for formulas, which is left behind.
pub(super) fn plotly() -> String {
    let all = plotly::Plot::offline_js_sources();
    let script = all.split(CLOSE).next().unwrap_or_default();
    script.trim_start().strip_prefix(OPEN).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crate_gives_two_scripts_and_the_first_is_plotly() {
        let all = plotly::Plot::offline_js_sources();
        assert_eq!((all.matches(OPEN).count(), all.matches(CLOSE).count()), (2, 2));
        let script = plotly();
        assert!(script.len() > 4_000_000 && script.len() < 5_500_000, "{}", script.len());
        assert!(script.trim_start().starts_with("/**\n* plotly.js v3."), "its own first line");
        assert!(script.contains("parcoords"));
        assert!(!script.contains("<script") && !script.contains("<!--"), "it can stand in a page");
    }
}
