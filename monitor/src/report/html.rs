//! A page that opens offline: one HTML file with its pictures inside, no reference to a network.

use super::chart::{GRID, INK, PAPER};
use plotters::style::RGBColor;

/// A part of a page under a heading.
pub fn section(name: &str, content: &str) -> String {
    format!("<section>\n<h2>{name}</h2>\n{content}</section>\n")
}

/// A picture with what it shows.
pub fn figure(svg: String, caption: &str) -> String {
    format!("<figure>\n{svg}<figcaption>{}</figcaption>\n</figure>\n", escape(caption))
}

/// Plain text as HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The colour as plotters writes it into attributes.
fn hexadecimal(colour: RGBColor) -> String {
    format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2)
}

/// A whole page: `body` is HTML, `title` plain text.
pub fn document(title: &str, body: &str) -> String {
    document_with(title, "", body)
}

/// The same with more elements in its head.
pub fn document_with(title: &str, head: &str, body: &str) -> String {
    let (ink, grid, paper) = (hexadecimal(INK), hexadecimal(GRID), hexadecimal(PAPER));
    format!(
        r#"<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; --ink: {ink}; --grid: {grid}; --paper: {paper}; --back: #F3F4F6; }}
@media (prefers-color-scheme: dark) {{
  :root {{ --ink: #C9CFD8; --grid: #3A414C; --paper: #1E2228; --back: #15181C; }}
}}
body {{ margin: 0 auto; max-width: 62rem; padding: 1.5rem; background: var(--back); color: var(--ink);
  font: 15px/1.5 system-ui, sans-serif; }}
h1 {{ font-size: 1.5rem; margin: 0 0 .3rem; }}
h2 {{ font-size: 1.05rem; margin: 0 0 .6rem; }}
section {{ background: var(--paper); border: 1px solid var(--grid); border-radius: 8px;
  padding: 1rem 1.2rem; margin: 1rem 0; overflow-x: auto; }}
figure {{ margin: 0 0 1rem; }}
figcaption {{ font-size: .85rem; opacity: .8; }}
svg {{ display: block; width: 100%; height: auto; }}
svg [fill="{ink}"] {{ fill: var(--ink); }}
svg [stroke="{ink}"] {{ stroke: var(--ink); }}
svg [stroke="{grid}"] {{ stroke: var(--grid); }}
svg [fill="{paper}"] {{ fill: var(--paper); }}
table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; }}
th, td {{ padding: .15rem .9rem .15rem 0; vertical-align: top; text-align: left; }}
th {{ font-weight: 600; white-space: nowrap; }}
.figures td, .figures th {{ text-align: right; }}
.figures th:first-child {{ text-align: left; }}
.warning td {{ color: #C77700; }}
.outcome {{ display: inline-block; margin: 0; padding: .1rem .7rem; border-radius: 1rem; color: #FFF;
  background: #B3413C; }}
.completed {{ background: #1B7D52; }}
.stopped {{ background: #8A5F0A; }}
</style>
{head}</head>
<body>
{body}</body>
</html>
"#,
        title = escape(title),
    )
}
