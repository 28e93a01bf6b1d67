//! The guide as one HTML page: the pages' Markdown in the frame of the reports, with a table of contents. Pictures are
//! in the file.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use maud::{Markup, PreEscaped, html};
use pulldown_cmark::{CowStr, Event, HeadingLevel, Options, Parser, Tag, TagEnd};

use super::page;
use crate::guide::{self, Page, Picture};

/// What a book has beyond a report. Narrow screens show a row of a table as a list of its cells, each with its column's
/// name.
const STYLE: &str = "
nav ol { columns: 2 300px; padding-left: 24px; } nav li { break-inside: avoid; } nav code { color: var(--soft); }
section { margin-top: 48px; } section > h2 { font-size: 21px; } h3 { font-size: 16px; margin: 24px 0 6px; }
a { color: var(--plain); } code, pre { font-size: 13px; } pre { overflow-x: auto; background: var(--around); padding: 10px 12px; border-radius: 4px; max-width: 100%; }
section th, section td { text-align: left; vertical-align: top; padding: 4px 12px 4px 4px; } section img { max-width: 100%; height: auto; }
section td img { min-width: 200px; width: 320px; } p.top { font-size: 13px; }
@media (max-width: 600px) { section thead { display: none; } section table, section tbody, section tr, section td { display: block; }
  section tr { border-bottom: 1px solid var(--rule); padding: 8px 0; } section td, section td:first-child { border: 0; padding: 2px 0; }
  section td:first-child { font-weight: 600; }
  section td[data-label]:not(:first-child)::before { content: attr(data-label) ': '; color: var(--soft); } }
";

pub fn book(pages: &[Page], pictures: &[Picture]) -> String {
    let content = html! {
        style { (PreEscaped(STYLE)) }
        nav id="contents" { ol { @for page in pages { li { a href={ "#" (page.topic) } { (page.title()) } " " code { (page.topic) } } } } }
        @for page in pages {
            section id=(page.topic) {
                (markdown(page.text, pictures))
                p.top { a href="#contents" { "contents" } }
            }
        }
    };
    let lead = format!("stereocal {}; each page is also printed by `stereocal guide TOPIC`", env!("CARGO_PKG_VERSION"));
    page::page("stereocal: the guide", &lead.replace('`', ""), &content)
}

/// A page's Markdown as HTML, its headings one level deeper.
fn markdown(text: &str, pictures: &[Picture]) -> Markup {
    let mut columns = Columns::default();
    let events = Parser::new_ext(text, Options::ENABLE_TABLES).map(|event| columns.labelled(changed(event, pictures)));
    let mut out = String::new();
    pulldown_cmark::html::push_html(&mut out, events);
    PreEscaped(out)
}

/// An event as the book wants it: headings deeper, pictures in the file, commands that print a page as links to it.
fn changed<'a>(event: Event<'a>, pictures: &[Picture]) -> Event<'a> {
    match event {
        Event::Start(Tag::Heading { level, id, classes, attrs }) => {
            Event::Start(Tag::Heading { level: deeper(level), id, classes, attrs })
        }
        Event::End(TagEnd::Heading(level)) => Event::End(TagEnd::Heading(deeper(level))),
        Event::Start(Tag::Image { link_type, dest_url, title, id }) => {
            let dest_url = in_the_file(&dest_url, pictures).map_or(dest_url, CowStr::from);
            Event::Start(Tag::Image { link_type, dest_url, title, id })
        }
        Event::Code(code) => match code.strip_prefix("stereocal guide ").and_then(guide::page) {
            Some(page) => {
                let link = html! { a href={ "#" (page.topic) } { code { (&*code) } } };
                Event::InlineHtml(link.into_string().into())
            }
            None => Event::Code(code),
        },
        other => other,
    }
}

fn deeper(level: HeadingLevel) -> HeadingLevel {
    match level {
        HeadingLevel::H1 => HeadingLevel::H2,
        HeadingLevel::H2 => HeadingLevel::H3,
        _ => HeadingLevel::H4,
    }
}

/// A picture as an address that needs no other file.
fn in_the_file(path: &str, pictures: &[Picture]) -> Option<String> {
    let picture = pictures.iter().find(|picture| picture.path == path)?;
    let kind = if path.ends_with(".svg") { "svg+xml" } else { "png" };
    Some(format!("data:image/{kind};base64,{}", BASE64_STANDARD.encode(picture.bytes)))
}

/// The names of a table's columns, given to each of its cells.
#[derive(Debug, Default)]
struct Columns {
    names: Vec<String>,
    in_head: bool,
    cell: usize,
}

impl Columns {
    fn labelled<'a>(&mut self, event: Event<'a>) -> Event<'a> {
        match &event {
            Event::Start(Tag::TableHead) => (self.in_head, self.names) = (true, Vec::new()),
            Event::End(TagEnd::TableHead) => self.in_head = false,
            Event::Start(Tag::TableRow) => self.cell = 0,
            Event::Start(Tag::TableCell) if self.in_head => self.names.push(String::new()),
            Event::Start(Tag::TableCell) => {
                let name = self.names.get(self.cell).map(String::as_str).unwrap_or_default();
                self.cell += 1;
                let label = (!name.is_empty()).then_some(name);
                let cell = html! { td data-label=[label] {} }.into_string();
                return Event::Html(cell.trim_end_matches("</td>").to_owned().into());
            }
            Event::End(TagEnd::TableCell) if !self.in_head => return Event::Html("</td>".into()),
            Event::Text(text) | Event::Code(text) if self.in_head => {
                if let Some(name) = self.names.last_mut() {
                    name.push_str(text);
                }
            }
            _ => {}
        }
        event
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn html_of(text: &str) -> String {
        markdown(text, &[Picture { path: "pictures/a.svg", bytes: b"<svg/>" }]).into_string()
    }

    #[test]
    fn cells_carry_the_names_of_their_columns() {
        let html = html_of("| it says | `do` |\n|---|---|\n| a *b* | c |\n");
        assert!(html.contains("<th>it says</th>"), "{html}");
        assert!(html.contains("<td data-label=\"it says\">a <em>b</em></td>"), "{html}");
        assert!(html.contains("<td data-label=\"do\">c</td>"), "{html}");
    }

    #[test]
    fn pictures_are_in_the_file_and_pages_are_linked() {
        let html = html_of("# Title\n![a way](pictures/a.svg) `stereocal guide boards` `stereocal guide nothing`");
        assert!(html.contains("<h2>Title</h2>"), "{html}");
        assert!(html.contains("src=\"data:image/svg+xml;base64,PHN2Zy8+\" alt=\"a way\""), "{html}");
        assert!(html.contains("<a href=\"#boards\"><code>stereocal guide boards</code></a>"), "{html}");
        assert!(html.contains("<code>stereocal guide nothing</code>") && !html.contains("#nothing"), "{html}");
    }

    #[test]
    fn the_book_holds_every_page_and_asks_nobody_for_anything() {
        let html = book(&guide::PAGES, &guide::PICTURES);
        for page in guide::PAGES {
            assert!(html.contains(&format!("href=\"#{}\"", page.topic)), "{}", page.topic);
            assert!(html.contains(&format!("<section id=\"{}\"", page.topic)), "{}", page.topic);
        }
        assert!(!html.contains("src=\"pictures/") && !html.contains("<script"));
        assert_eq!(html.matches("src=\"data:image/").count(), guide::PICTURES.len());
    }
}
