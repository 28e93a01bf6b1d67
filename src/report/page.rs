//! The frame of every HTML report: one file, no scripts, no network, readable on paper.

use crate::files::provenance::{Digested, Provenance};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// How the verdict at the top of a page is coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Green.
    Good,
    /// Amber.
    Doubtful,
    /// Red.
    Bad,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Tone::Good => "good",
            Tone::Doubtful => "doubtful",
            Tone::Bad => "bad",
        }
    }
}

const STYLE: &str = "
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, 'DejaVu Sans', sans-serif; color: #1c2430; background: #f4f5f7; margin: 0; }
main { max-width: 1040px; margin: 0 auto; padding: 28px 32px 64px; background: #fff; }
h1 { font-size: 24px; margin: 0 0 4px; } h2 { font-size: 18px; margin: 36px 0 8px; border-bottom: 1px solid #d9dde3; padding-bottom: 4px; }
p.lead { color: #5a6472; margin: 0 0 16px; }
.verdict { border-left: 8px solid; padding: 12px 16px; margin: 16px 0; border-radius: 4px; }
.verdict strong { display: block; font-size: 20px; }
.good { border-color: #2e8b57; background: #eaf6ef; } .doubtful { border-color: #d39b00; background: #fdf6e3; } .bad { border-color: #c0392b; background: #fbebe9; }
table { border-collapse: collapse; margin: 8px 0 16px; font-variant-numeric: tabular-nums; font-size: 14px; }
th { text-align: right; color: #5a6472; font-weight: 600; border-bottom: 1px solid #b8bfc9; padding: 3px 12px; }
td { text-align: right; padding: 2px 12px; border-bottom: 1px solid #eceef1; } th:first-child, td:first-child { text-align: left; }
.wide { overflow-x: auto; } table.ledger td { vertical-align: top; } table.ledger td.detail { text-align: left; font-size: 13px; color: #404a57; min-width: 320px; }
table.ledger td:first-child { min-width: 120px; } .allows { border-left-style: solid; border-left-width: 4px; padding: 0 6px; border-radius: 3px; }
table.ledger th:last-child { text-align: left; }
.scroll { max-height: 420px; overflow: auto; border: 1px solid #eceef1; }
figure { margin: 12px 0 20px; } figure svg { max-width: 100%; height: auto; } figcaption { color: #404a57; font-size: 14px; max-width: 860px; }
.side { display: flex; flex-wrap: wrap; gap: 16px; } .side > * { flex: 1 1 460px; min-width: 0; }
ul.warnings li { margin: 4px 0; }
footer { color: #5a6472; font-size: 13px; overflow-wrap: anywhere; }
@media print { body { background: #fff; } main { padding: 0; } .scroll { max-height: none; } }
";

/// A whole page. `lead` is a line under the title that says from what it was made.
pub fn page(title: &str, lead: &str, content: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main {
                h1 { (title) }
                p.lead { (lead) }
                (content)
            } }
        }
    }
    .into_string()
}

/// The page with where it came from at its end.
pub fn signed(page: String, provenance: Option<&Provenance>) -> String {
    let Some(p) = provenance else { return page };
    let files = |files: &[Digested]| {
        html! { @for file in files { li { (file.file) @if let Some(n) = file.pictures { " (" (n) " pictures)" } br; code { (file.sha256) } } } }
    };
    let footer = html! {
        footer {
            h2 { "Where this came from" }
            p { (p.program) ", " (p.date) br; code { (p.command) } }
            @if !p.inputs.is_empty() { p { "Made of, with SHA-256:" } ul { (files(&p.inputs)) } }
            @if !p.outputs.is_empty() { p { "Written by the same run:" } ul { (files(&p.outputs)) } }
            @if let Some(m) = &p.measured_by {
                p { "Measured by " (m.program) ", " (m.date) br; code { (m.command) } }
                ul { (files(&m.inputs)) }
            }
        }
    };
    match page.rfind("</main>") {
        Some(end) => format!("{}{}{}", &page[..end], footer.into_string(), &page[end..]),
        None => page,
    }
}

/// The box that says first what the reader came for.
pub fn verdict(tone: Tone, headline: &str, explanation: &str) -> Markup {
    html! { div class={ "verdict " (tone.class()) } { strong { (headline) } span { (explanation) } } }
}

/// A figure with what to conclude from it beneath.
pub fn figure(svg: &str, caption: &str) -> Markup {
    html! { figure { (PreEscaped(svg)) figcaption { (caption) } } }
}

/// A table; the first column is text, the others numbers.
pub fn table(header: &[&str], rows: &[Vec<String>]) -> Markup {
    html! {
        table {
            thead { tr { @for cell in header { th { (cell) } } } }
            tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
        }
    }
}

/// Warnings, where there are any.
pub fn warnings(list: &[String]) -> Markup {
    html! { @if !list.is_empty() { ul.warnings { @for warning in list { li { (warning) } } } } }
}
