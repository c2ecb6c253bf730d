//! The view: what is known, and how it is drawn in a terminal of any size.

use super::asking::News;
use super::keys;
use super::panel::{self, Tone};
use super::trail::Trail;
use monitor::latency::HopLatency;
use operator::{Queue, Status};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::canvas::{Canvas, Line as CanvasLine};
use ratatui::widgets::{Block, Clear, Paragraph};
use std::collections::BTreeMap;

/// Narrower than this there is no room for the path beside the words.
const WIDE: u16 = 60;

/// Lower than this there is none below the bar.
const HIGH: u16 = 9;

/// Columns of the words beside the path.
const WORDS: u16 = 40;

/// What is known of a pipeline.
#[derive(Debug)]
pub(super) struct View {
    instance: String,
    has_colour: bool,
    status: Option<Status>,
    /// The jobs, a second ago at most.
    jobs: Queue,
    /// Why there is no newer status.
    silence: Option<String>,
    /// What became of the last key.
    answer: String,
    trail: Trail,
    /// Of the hops, by name.
    latencies: BTreeMap<String, HopLatency>,
    has_help: bool,
}

impl View {
    /// A view of the pipeline of this instance, of which nothing is known yet.
    pub(super) fn new(instance: &str, has_colour: bool) -> Self {
        Self {
            instance: instance.to_owned(),
            has_colour,
            status: None,
            jobs: Queue::default(),
            silence: Some("asking".to_owned()),
            answer: String::new(),
            trail: Trail::default(),
            latencies: BTreeMap::new(),
            has_help: false,
        }
    }

    /// Takes what came.
    pub(super) fn take(&mut self, news: News) {
        match news {
            News::Status(status) => {
                self.trail.follow(&status);
                self.status = Some(*status);
                self.silence = None;
            }
            News::Jobs(jobs) => self.jobs = *jobs,
            News::Latencies(latencies) => self.latencies = latencies,
            News::Silence(why) => self.silence = Some(why),
            News::Answer(text) => self.answer = text,
        }
    }

    /// The overrides of rate and power, also while the job is held.
    pub(super) fn overrides(&self) -> [f64; 2] {
        let overrides = |status: &Status| [status.rate_override, status.power_override];
        self.status.as_ref().map_or([1.0; 2], overrides)
    }

    /// Shows the help, or hides it.
    pub(super) fn turn_help(&mut self) {
        self.has_help = !self.has_help;
    }

    /// Draws all of it.
    pub(super) fn draw(&self, frame: &mut Frame<'_>) {
        let area = frame.area();
        let [title, progress, middle, answer, bottom] = Layout::vertical([
            Constraint::Length(1),
            Constraint::Length(1),
            Constraint::Fill(1),
            Constraint::Length(u16::from(area.height >= HIGH)),
            Constraint::Length(u16::from(area.height >= HIGH)),
        ])
        .areas(area);
        self.draw_title(frame, title);
        if let Some(status) = &self.status {
            let bar = panel::progress(status, usize::from(progress.width)).unwrap_or_default();
            frame.render_widget(Paragraph::new(bar), progress);
            if area.width >= WIDE && area.height >= HIGH {
                let [path, words] =
                    Layout::horizontal([Constraint::Fill(1), Constraint::Length(WORDS)])
                        .areas(middle);
                self.draw_path(frame, path);
                self.draw_words(frame, words, status);
            } else {
                self.draw_words(frame, middle, status);
            }
        }
        frame.render_widget(Paragraph::new(self.answer.as_str()), answer);
        let dim = Style::new().add_modifier(Modifier::DIM);
        frame.render_widget(Paragraph::new(keys::LINE).style(dim), bottom);
        if self.has_help {
            self.draw_help(frame, area);
        }
    }

    fn draw_title(&self, frame: &mut Frame<'_>, area: Rect) {
        let mut spans = vec![Span::raw(format!("{}  ", self.instance))];
        match (&self.silence, &self.status) {
            (Some(why), _) => spans.push(Span::styled(why.clone(), self.style(Tone::Bad))),
            (None, Some(status)) => {
                let state = panel::state(status);
                spans.push(Span::styled(state.text, self.style(state.tone)));
            }
            (None, None) => {}
        }
        frame.render_widget(Paragraph::new(Line::from(spans)), area);
    }

    fn draw_words(&self, frame: &mut Frame<'_>, area: Rect, status: &Status) {
        let lines: Vec<_> = panel::lines(status, &self.jobs, &self.latencies)
            .into_iter()
            .map(|line| {
                let name = Span::styled(format!("{:10}", line.name), Modifier::DIM);
                Line::from(vec![name, Span::styled(line.text, self.style(line.tone))])
            })
            .collect();
        frame.render_widget(Paragraph::new(lines), area);
    }

    fn draw_path(&self, frame: &mut Frame<'_>, area: Rect) {
        let [[left, bottom], [right, top]] = self.trail.bounds();
        // The same scale both ways: a character has two dots across and four down.
        let (across, down) = (f64::from(area.width) * 2.0, f64::from(area.height) * 4.0);
        if across < 1.0 || down < 1.0 {
            return;
        }
        let scale = ((right - left) / across).max((top - bottom) / down).max(1e-9);
        let (half_x, half_y) = (scale * across / 2.0, scale * down / 2.0);
        let (x, y) = ((left + right) / 2.0, (bottom + top) / 2.0);
        let (dark, lit) = if self.has_colour {
            (Color::DarkGray, Color::Red)
        } else {
            (Color::Reset, Color::Reset)
        };
        let canvas = Canvas::default()
            .marker(Marker::Braille)
            .x_bounds([x - half_x, x + half_x])
            .y_bounds([y - half_y, y + half_y])
            .paint(|context| {
                for is_lit in [false, true] {
                    // Without colours the way in the dark would look as the marks do.
                    if !is_lit && !self.has_colour {
                        continue;
                    }
                    for (from, to) in self.trail.lines().filter(|(_, to)| to.is_lit == is_lit) {
                        let color = if is_lit { lit } else { dark };
                        let ([x1, y1], [x2, y2]) = (from.place, to.place);
                        context.draw(&CanvasLine { x1, y1, x2, y2, color });
                    }
                }
                if let Some(status) = &self.status {
                    context.print(status.tool[0], status.tool[1], "+");
                }
            });
        frame.render_widget(canvas, area);
    }

    fn draw_help(&self, frame: &mut Frame<'_>, area: Rect) {
        let lines: Vec<_> =
            keys::HELP.iter().map(|(key, what)| Line::raw(format!("{key:8} {what}"))).collect();
        let widest = lines.iter().map(Line::width).max().unwrap_or(0) as u16;
        let (width, height) =
            ((widest + 2).min(area.width), (lines.len() as u16 + 2).min(area.height));
        let place = Rect {
            x: area.x + (area.width - width) / 2,
            y: area.y + (area.height - height) / 2,
            width,
            height,
        };
        frame.render_widget(Clear, place);
        frame.render_widget(Paragraph::new(lines).block(Block::bordered().title("keys")), place);
    }

    fn style(&self, tone: Tone) -> Style {
        let (color, modifier) = match tone {
            Tone::Plain => return Style::new(),
            Tone::Good => (Color::Green, Modifier::empty()),
            Tone::Busy => (Color::Yellow, Modifier::BOLD),
            Tone::Bad => (Color::Red, Modifier::REVERSED),
        };
        let style = Style::new().add_modifier(modifier);
        if self.has_colour { style.fg(color) } else { style }
    }
}

#[cfg(test)]
mod tests;
