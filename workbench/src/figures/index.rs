//! The page that lists all figures of a folder.

use monitor::report::html::{document, escape, figure, section};

use super::{Figures, Name};

/// The page: a section for each kind of figure, its pictures and numbers by the names of their files.
pub fn page(figures: &Figures) -> String {
    let mut body = "<h1>Figures</h1>\n".to_owned();
    for name in Name::ALL {
        let mut content = String::new();
        for one in figures.figures.iter().filter(|one| one.name == name) {
            let source = match one.source.as_str() {
                "" => String::new(),
                number => format!("Source 003, figure {number}. "),
            };
            let stem = escape(&one.table.stem);
            let title = escape(&one.title);
            let picture = format!(
                "<p id=\"{stem}\"><b>{title}</b></p>\n<a href=\"{stem}.svg\"><img src=\"{stem}.svg\" \
                 alt=\"{title}\" loading=\"lazy\" style=\"width:100%\"></a>\n"
            );
            content += &figure(picture, &format!("{source}{}", one.caption));
            let tables = [&one.table].into_iter().chain(&one.more);
            let links = tables.map(|table| {
                let file = format!("{}.csv", escape(&table.stem));
                format!("<a href=\"{file}\">{file}</a> ({} rows)", table.rows.len())
            });
            content += &format!("<p>{}</p>\n", links.collect::<Vec<_>>().join(", "));
        }
        if !content.is_empty() {
            body += &section(name.word(), &content);
        }
    }
    if !figures.skipped.is_empty() {
        let rows = figures.skipped.iter().map(|skipped| {
            format!(
                "<tr><th>{}</th><td>{}</td><td>{}</td></tr>\n",
                skipped.name.word(),
                escape(&skipped.of),
                escape(&skipped.why)
            )
        });
        body += &section("not drawn", &format!("<table>\n{}</table>\n", rows.collect::<String>()));
    }
    document("Graver figures", &body)
}
