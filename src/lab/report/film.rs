//! An episode as an animated picture: one self-contained SVG, whose lines of text are shown and hidden in turn.
//!
//! Pictures are characters in a grid, as environments draw them. Frames that would not be told apart in time are left out:
//! an episode of many steps is shown at every second, third, ... of them.

use std::fmt::Write as _;

use super::number::{escape, place, significant, size};
use crate::task::policy::WatchedStep;

/// Frames of a film at most.
const FRAMES_MAX: usize = 160;
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

    /// The animated picture; what shows no motion shows the last frame. A line that stays is drawn once.
    #[must_use]
    pub fn svg(&self) -> String {
        let texts: Vec<Vec<String>> = self.frames.iter().map(Frame::lines).collect();
        let high = texts.iter().map(Vec::len).max().unwrap_or(0);
        let columns = texts.iter().flatten().map(|line| line.chars().count());
        let wide = columns.max().unwrap_or(0).max(30);
        let [of_character, of_line] = CHARACTER;
        let (width, height) =
            (2.0 * MARGIN + of_character * size(wide), 2.0 * MARGIN + of_line * size(high));
        let seconds = FRAME_SECONDS * size(self.frames.len()) + LAST_SECONDS;
        let mut body = String::new();
        for line in 0..high {
            let y = place(MARGIN + of_line * (size(line) + 0.8));
            let of_frame = |at: usize| texts[at].get(line).map_or("", String::as_str);
            let mut from = 0;
            while from < texts.len() {
                let text = of_frame(from);
                let same = (from..texts.len()).take_while(|&at| of_frame(at) == text).count();
                let to = from + same;
                if !text.trim().is_empty() {
                    let (hidden, animated) = self.shown(from, to, seconds);
                    let _ = write!(
                        body,
                        "<text xml:space=\"preserve\" x=\"{}\" y=\"{y}\"{hidden}>{}{animated}</text>",
                        place(MARGIN),
                        escape(text.trim_end())
                    );
                }
                from = to;
            }
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

    /// What shows something in the frames from one to before another, of all that make so many seconds, and hides it else.
    fn shown(&self, from: usize, to: usize, seconds: f64) -> (&'static str, String) {
        let time = |at: usize| FRAME_SECONDS * size(at) / seconds;
        let last = to == self.frames.len();
        let (values, times) = match (from, last) {
            (0, true) => return ("", String::new()),
            (0, false) => ("visible;hidden", format!("0;{:.5}", time(to))),
            (_, true) => ("hidden;visible", format!("0;{:.5}", time(from))),
            (_, false) => ("hidden;visible;hidden", format!("0;{:.5};{:.5}", time(from), time(to))),
        };
        let animated = format!(
            "<animate attributeName=\"visibility\" calcMode=\"discrete\" dur=\"{seconds:.2}s\" repeatCount=\"indefinite\" \
             values=\"{values}\" keyTimes=\"{times}\"/>"
        );
        (if last { "" } else { " visibility=\"hidden\"" }, animated)
    }
}

impl Frame {
    /// Numbers, then the picture.
    fn lines(&self) -> Vec<String> {
        let head = format!("step {}  return {}", self.step, significant(self.total));
        std::iter::once(head).chain(self.picture.lines().map(str::to_owned)).collect()
    }
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
        for (count, frames) in [(0, 0), (1, 1), (160, 160), (161, 81), (1000, 144)] {
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
        // two lines that change, thrice each, and one that stays
        assert_eq!((svg.matches("<text").count(), svg.matches("<animate").count()), (7, 6));
        assert_eq!(svg.matches(" visibility=\"hidden\"").count(), 4);
        assert!(!Film::new(0, &steps(1)).svg().contains("<animate"));
    }
}
