//! The page: its frame, headings, text and tables. What is shown is escaped here and nowhere else.

use super::Table;
use std::fmt::Write;

/// Cells with more bytes than this are text, which is broken into lines.
const LONG: usize = 40;

/// A page that is being written.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    body: String,
}

/// Text that is safe between tags and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Page {
        Page { title: title.into(), body: String::new() }
    }

    /// A heading; level 2 begins a part, level 3 a part of it.
    pub fn heading(&mut self, level: u8, text: &str) {
        let _ = writeln!(self.body, "<h{level}>{}</h{level}>", escape(text));
    }

    /// A paragraph.
    pub fn text(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escape(text));
    }

    /// Adds the command line.
    pub fn command(&mut self, text: &str) {
        let _ = writeln!(self.body, "<pre>{}</pre>", escape(text));
    }

    /// A table; columns after the first hold numbers.
    pub fn table(&mut self, table: &Table) {
        let row = |out: &mut String, tag: &str, cells: &[String]| {
            out.push_str("<tr>");
            for cell in cells {
                let class = if cell.len() > LONG { " class=\"long\"" } else { "" };
                let _ = write!(out, "<{tag}{class}>{}</{tag}>", escape(cell));
            }
            out.push_str("</tr>\n");
        };
        self.body.push_str("<div class=\"scroll\"><table><thead>");
        row(&mut self.body, "th", &table.head);
        self.body.push_str("</thead><tbody>\n");
        for cells in &table.rows {
            row(&mut self.body, "td", cells);
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// Markup that was made by [`super::plot`] or [`super::pictures`].
    pub fn markup(&mut self, markup: &str) {
        self.body.push_str(markup);
        self.body.push('\n');
    }

    /// The whole file.
    pub fn finish(self) -> String {
        let title = escape(&self.title);
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n<link rel=\"icon\" href=\"data:,\">\n\
             <title>{title}</title>\n<style>\n{}</style>\n</head>\n<body>\n<h1>{title}</h1>\n\
             {}<script>\n{}</script>\n</body>\n</html>\n",
            include_str!("style.css"),
            self.body,
            include_str!("viewer.js"),
        )
    }
}
