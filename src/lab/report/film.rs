//! An episode as an animated picture: one self-contained SVG, a group a frame, shown one after the other.
//!
//! Pictures are characters in a grid, as environments draw them. Frames that would not be told apart in time are left out:
//! an episode of many steps is shown at every second, third, ... of them.

use std::fmt::Write as _;

use super::number::{escape, place, significant, size};
use crate::task::policy::WatchedStep;

/// Frames of a film at most.
const FRAMES_MAX: usize = 240;
/// Seconds of a frame.
const FRAME_SECONDS: f64 = 0.08;
/// Seconds of the last frame.
const LAST_SECONDS: f64 = 1.2;
/// Width and height of a character.
const CHARACTER: [f64; 2] = [8.4, 17.0];
/// Room around the picture.
const MARGIN: f64 = 12.0;

/// A frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Step, from 0.
    pub step: u32,
    /// Picture in characters.
    pub picture: String,
    /// Return so far, this step's reward included.
    pub total: f64,
}

/// An episode in pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Which episode of the evaluation.
    pub episode: u32,
    /// Steps of it.
    pub steps: u32,
    /// Pictures, thinned, the last one among them.
    pub frames: Vec<Frame>,
}

impl Film {
    /// A film of the steps that were watched.
    #[must_use]
    pub fn new(episode: u32, steps: &[WatchedStep]) -> Self {
        let mut total = 0i64;
        let frames = steps.iter().map(|one| {
            total = total.saturating_add(one.reward);
            Frame { step: one.step, picture: one.picture.clone(), total: total as f64 / 65_536.0 }
        });
        let frames: Vec<Frame> = frames.collect();
        let stride = frames.len().div_ceil(FRAMES_MAX).max(1);
        let last = frames.len().saturating_sub(1);
        let kept = frames.into_iter().enumerate();
        let kept = kept.filter(|(at, _)| at % stride == 0 || *at == last).map(|(_, frame)| frame);
        let steps = u32::try_from(steps.len()).unwrap_or(u32::MAX);
        Self { episode, steps, frames: kept.collect() }
    }

    /// The animated picture. Who asks for less motion is shown the last frame alone.
    #[must_use]
    pub fn svg(&self) -> String {
        let lines = |frame: &Frame| frame.picture.lines().count();
        let columns = |frame: &Frame| frame.picture.lines().map(|l| l.chars().count()).max();
        let high = self.frames.iter().map(lines).max().unwrap_or(0);
        let wide = self.frames.iter().filter_map(columns).max().unwrap_or(0).max(30);
        let [of_character, of_line] = CHARACTER;
        let (width, height) =
            (2.0 * MARGIN + of_character * size(wide), 2.0 * MARGIN + of_line * size(high + 1));
        let frames = size(self.frames.len());
        let seconds = FRAME_SECONDS * frames + LAST_SECONDS;
        let last = self.frames.len().saturating_sub(1);
        let mut body = String::new();
        for (at, frame) in self.frames.iter().enumerate() {
            let from = FRAME_SECONDS * size(at) / seconds;
            let to = if at == last { 1.0 } else { FRAME_SECONDS * size(at + 1) / seconds };
            let hidden = if at == last { "" } else { " visibility=\"hidden\"" };
            let animated = match (at, self.frames.len()) {
                (_, 1) => String::new(),
                (0, _) => animate(&["visible", "hidden"], &[0.0, to], seconds),
                (_, _) if at == last => animate(&["hidden", "visible"], &[0.0, from], seconds),
                _ => animate(&["hidden", "visible", "hidden"], &[0.0, from, to], seconds),
            };
            let _ = write!(body, "<g{hidden}>{animated}");
            let head = format!("step {}  return {}", frame.step, significant(frame.total));
            let texts = std::iter::once(&*head).chain(frame.picture.lines());
            for (line, text) in texts.enumerate().filter(|(_, text)| !text.trim().is_empty()) {
                let _ = write!(
                    body,
                    "<text xml:space=\"preserve\" x=\"{}\" y=\"{}\">{}</text>",
                    place(MARGIN),
                    place(MARGIN + of_line * (size(line) + 0.8)),
                    escape(text)
                );
            }
            body += "</g>";
        }
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"film\" viewBox=\"0 0 {} {}\" style=\"max-width:{}px\" \
             role=\"img\" aria-label=\"Episode {}, step by step\"><g font-family=\"ui-monospace, Menlo, Consolas, monospace\" \
             font-size=\"14\" fill=\"currentColor\">{body}</g></svg>",
            place(width),
            place(height),
            place(1.2 * width),
            self.episode
        )
    }
}

/// Visibility over a time that starts again at its end.
fn animate(values: &[&str], times: &[f64], seconds: f64) -> String {
    let times: Vec<String> = times.iter().map(|time| format!("{time:.5}")).collect();
    format!(
        "<animate attributeName=\"visibility\" calcMode=\"discrete\" dur=\"{seconds:.2}s\" repeatCount=\"indefinite\" \
         values=\"{}\" keyTimes=\"{}\"/>",
        values.join(";"),
        times.join(";")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(count: u32) -> Vec<WatchedStep> {
        let one = |step| WatchedStep {
            step,
            picture: format!("<{step}>\n  |"),
            reward: 1 << 15,
            ..WatchedStep::default()
        };
        (0..count).map(one).collect()
    }

    #[test]
    fn a_film_has_few_frames_and_the_last_one() {
        for (count, frames) in [(0, 0), (1, 1), (240, 240), (241, 121), (1000, 201)] {
            let film = Film::new(3, &steps(count));
            assert_eq!((film.frames.len(), film.steps), (frames, count));
            if let Some(last) = film.frames.last() {
                assert_eq!((last.step, last.total), (count - 1, f64::from(count) / 2.0));
            }
        }
    }

    #[test]
    fn a_picture_says_what_an_environment_drew_and_shows_one_frame_at_a_time() {
        let svg = Film::new(0, &steps(3)).svg();
        let tree = resvg::usvg::Tree::from_str(&svg, &resvg::usvg::Options::default());
        assert!(tree.is_ok(), "{svg}");
        assert!(svg.contains("&lt;1&gt;") && svg.contains("step 2  return 1.5"), "{svg}");
        assert_eq!(
            (svg.matches("<animate").count(), svg.matches("visibility=\"hidden\"").count()),
            (3, 2)
        );
        assert!(!Film::new(0, &steps(1)).svg().contains("<animate"));
    }
}
