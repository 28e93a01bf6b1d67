//! The frame of every HTML report: one file, no network, readable on paper, on a phone and in the dark; a script only
//! to turn a view in space.

use super::drawing::script::SCRIPT;
use crate::diagnostic::capital;
use crate::files::provenance::{Digested, Provenance};
use crate::files::{self, OutDir};
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

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

/// A browser that obeys it lets no request leave the page, whatever stands in it.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

const STYLE: &str = "
:root { color-scheme: light; --ink: #1c2430; --soft: #5a6472; --ground: #fff; --around: #f4f5f7; --rule: #d9dde3; --hair: #eceef1;
  --good: #2e8b57; --good-bg: #eaf6ef; --doubt: #d39b00; --doubt-bg: #fdf6e3; --bad: #c0392b; --bad-bg: #fbebe9; --plain: #0072b2; --shade: rgba(0, 0, 0, 0.28); }
@media screen and (prefers-color-scheme: dark) {
  :root { color-scheme: dark; --ink: #e3e6ea; --soft: #a3acb8; --ground: #1a1a1a; --around: #101010; --rule: #3c424b; --hair: #2a2e34;
    --good: #4cbf82; --good-bg: #16281f; --doubt: #e0b030; --doubt-bg: #2b2515; --bad: #ee6a5c; --bad-bg: #301b19; --plain: #56b4e9; --shade: rgba(255, 255, 255, 0.3); }
  svg.plot { filter: invert(0.9) hue-rotate(180deg); }
}
body { font: 15px/1.5 system-ui, 'DejaVu Sans', sans-serif; color: var(--ink); background: var(--around); margin: 0; }
main { max-width: 1040px; margin: 0 auto; padding: 28px 32px 64px; background: var(--ground); }
h1 { font-size: 24px; margin: 0 0 4px; } h2 { font-size: 18px; margin: 36px 0 8px; border-bottom: 1px solid var(--rule); padding-bottom: 4px; }
a { color: var(--plain); }
p, li, figcaption { max-width: 80ch; overflow-wrap: anywhere; } p.lead { color: var(--soft); margin: 0 0 16px; }
.verdict { border-left: 8px solid; padding: 12px 16px; margin: 16px 0; border-radius: 4px; }
.verdict strong { display: block; font-size: 44px; line-height: 1.1; } .verdict p { margin: 8px 0 0; }
.numbers { display: flex; flex-wrap: wrap; gap: 8px 36px; margin: 10px 0 4px; } .numbers b { display: block; font-size: 38px; line-height: 1.15; white-space: nowrap; font-variant-numeric: tabular-nums; }
.numbers span { color: var(--soft); } .numbers > div { max-width: 300px; }
details { margin: 12px 0; } summary { cursor: pointer; font-weight: 600; color: var(--soft); }
.good { border-color: var(--good); background: var(--good-bg); } .doubtful { border-color: var(--doubt); background: var(--doubt-bg); }
.bad { border-color: var(--bad); background: var(--bad-bg); }
table { border-collapse: collapse; margin: 8px 0 16px; font-variant-numeric: tabular-nums; font-size: 14px; }
th { text-align: right; color: var(--soft); font-weight: 600; border-bottom: 1px solid var(--rule); padding: 3px 12px; }
td { text-align: right; padding: 2px 12px; border-bottom: 1px solid var(--hair); } th:first-child, td:first-child { text-align: left; padding-left: 4px; }
th.text, td.text { text-align: left; }
.wide { overflow-x: auto; background: linear-gradient(to right, var(--ground) 40%, transparent) left / 36px 100% no-repeat local,
  linear-gradient(to left, var(--ground) 40%, transparent) right / 36px 100% no-repeat local,
  linear-gradient(to right, var(--shade), transparent) left / 14px 100% no-repeat scroll,
  linear-gradient(to left, var(--shade), transparent) right / 14px 100% no-repeat scroll; }
table.ledger td { vertical-align: top; } table.ledger td.detail { text-align: left; font-size: 13px; min-width: 320px; }
table.ledger td:first-child { min-width: 120px; } .allows { border-left-style: solid; border-left-width: 4px; padding: 0 6px; border-radius: 3px; }
table.ledger th:last-child { text-align: left; }
.scroll { max-height: 420px; overflow: auto; border: 1px solid var(--hair); box-shadow: inset 0 -12px 10px -10px rgba(0,0,0,.2); }
figure { margin: 12px 0 20px; break-inside: avoid; } figure svg, figure img { max-width: 100%; height: auto; }
figcaption { color: var(--soft); font-size: 14px; }
.side { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(440px, 100%), 1fr)); gap: 16px; } .side > * { min-width: 0; }
svg.scene { cursor: grab; touch-action: none; user-select: none; border: 1px solid var(--hair); } svg.scene path { fill: none; stroke-width: 1.3; stroke-linejoin: round; stroke-linecap: round; }
svg.scene text { font: 14px sans-serif; fill: var(--ink); } .i-frame { stroke: var(--ink); } .i-plain { stroke: var(--plain); }
.i-good { stroke: var(--good); } .i-bad { stroke: var(--bad); } svg.scene .i-good, svg.scene .i-bad { stroke-width: 2.6; }
svg.scene .dots { stroke-width: 5; }
ul.warnings li { margin: 4px 0; }
footer { color: var(--soft); font-size: 13px; overflow-wrap: anywhere; }
@media (max-width: 600px) { main { padding: 16px 12px 40px; } td, th { padding-left: 6px; padding-right: 6px; }
  table.ledger, table.ledger tbody { display: block; } table.ledger thead { display: none; } table.ledger td { border: 0; }
  table.ledger tr { display: grid; grid-template-columns: 1fr repeat(4, auto); padding: 4px 0; border-bottom: 1px solid var(--hair); }
  table.ledger td.detail { grid-column: 1 / -1; min-width: 0; padding-left: 4px; } h1 { font-size: 21px; }
  .verdict strong { font-size: 30px; } .numbers b { font-size: 28px; } .numbers { gap: 6px 22px; } }
@page { margin: 14mm; }
@media print { details::details-content { content-visibility: visible; height: auto; } body { background: #fff; font-size: 12px; } main { padding: 0; max-width: none; } .scroll { max-height: none; overflow: visible; border: 0; }
  .wide { overflow: visible; background: none; } table { font-size: 11px; } td, th { padding-left: 5px; padding-right: 5px; } tr { break-inside: avoid; } h2 { break-after: avoid; } }
";

/// A whole page. `lead` is a line under the title that says from what it was made.
pub fn page(title: &str, lead: &str, content: &Markup) -> String {
    let content = content.clone().into_string();
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main {
                h1 { (title) }
                p.lead { (lead) }
                (PreEscaped(content.as_str()))
            }
            @if content.contains("<svg class=\"scene\"") { script { (PreEscaped(SCRIPT)) } } }
        }
    }
    .into_string()
}

/// Writes a page with where it came from at its end.
pub fn write(out: &OutDir, name: &str, page: String) -> files::Result<()> {
    out.write(name, signed(page, out.provenance().as_ref()).as_bytes())
}

fn signed(page: String, provenance: Option<&Provenance>) -> String {
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
    before_the_end(page, &footer)
}

/// The page with links to the pictures that `--draw` wrote beside it, one a pair.
pub fn with_overlays<'a>(page: String, pairs: impl Iterator<Item = &'a str>) -> String {
    let links = html! {
        h2 { "Every pair with its corners" }
        p { @for pair in pairs { a href={ "overlays/" (in_a_link(pair)) ".png" } { (pair) } " " } }
    };
    before_the_end(page, &links)
}

/// A file's name as a part of an address.
fn in_a_link(name: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-_.~".contains(&b);
    name.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

fn before_the_end(page: String, more: &Markup) -> String {
    match page.rfind("</main>") {
        Some(end) => format!("{}{}{}", &page[..end], more.0, &page[end..]),
        None => page,
    }
}

/// The box that says first what the reader came for: a word or two, the numbers that matter most with what they are,
/// and a sentence.
pub fn verdict(tone: Tone, headline: &str, numbers: &[(String, impl Render)], explanation: &str) -> Markup {
    html! {
        div class={ "verdict " (tone.class()) } {
            strong { (headline) }
            @if !numbers.is_empty() { div.numbers { @for (value, what) in numbers { div { b { (value) } span { (what) } } } } }
            p { (text(&capital(explanation))) }
        }
    }
}

/// What only some readers want, folded behind one line.
pub fn details(summary: &str, content: &Markup) -> Markup {
    html! { details { summary { (summary) } (content) } }
}

/// A figure with what to conclude from it beneath.
pub fn figure(svg: &str, caption: &str) -> Markup {
    html! { figure { (PreEscaped(svg)) figcaption { (caption) } } }
}

/// A table; numbers are aligned right, text left.
pub fn table<R: IntoIterator<Item = String>>(header: &[&str], rows: impl IntoIterator<Item = R>) -> Markup {
    let rows: Vec<Vec<String>> = rows.into_iter().map(|row| row.into_iter().collect()).collect();
    let columns = header.len().max(rows.iter().map(Vec::len).max().unwrap_or(0));
    let class: Vec<Option<&str>> = (0..columns).map(|k| (k > 0 && holds_text(&rows, k)).then_some("text")).collect();
    html! {
        div.wide { table {
            thead { tr { @for (cell, class) in header.iter().zip(&class) { th class=[class] { (cell) } } } }
            tbody { @for row in &rows { tr { @for (cell, class) in row.iter().zip(&class) { td class=[class] { (text(cell)) } } } } }
        } }
    }
}

/// Whether a column holds words more often than numbers, or nothing at all.
fn holds_text(rows: &[Vec<String>], column: usize) -> bool {
    /// Words of a number with its unit, of "3 of 12" and of three coordinates.
    const OF_NUMBER: usize = 3;
    let is_number = |cell: &str| {
        let digits = cell.trim_start_matches(['+', '-', '.']);
        digits.starts_with(|c: char| c.is_ascii_digit()) && cell.split_whitespace().count() <= OF_NUMBER
    };
    let cells = rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.trim());
    let blank = cells.clone().all(str::is_empty);
    let said = || cells.clone().filter(|cell| !matches!(*cell, "" | "n/a" | "-"));
    blank || 2 * said().filter(|cell| is_number(cell)).count() < said().count()
}

/// Warnings, where there are any.
pub fn warnings(list: &[impl AsRef<str>]) -> Markup {
    html! { @if !list.is_empty() { ul.warnings { @for warning in list { li { (text(warning.as_ref())) } } } } }
}

/// A sentence of the terminal: what stands there between backticks is code here.
pub fn text(sentence: &str) -> Markup {
    let parts: Vec<&str> = sentence.split('`').collect();
    // An odd backtick is one that somebody wrote, in a name of a file.
    if parts.len().is_multiple_of(2) {
        return html! { (sentence) };
    }
    html! { @for (i, part) in parts.iter().enumerate() { @if i % 2 == 1 { code { (part) } } @else { (part) } } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlays_are_linked_by_names_that_a_browser_finds() {
        let page = with_overlays("<main></main>".to_owned(), ["01", "a b#ü"].into_iter());
        assert!(page.contains("<a href=\"overlays/01.png\">01</a>"), "{page}");
        assert!(page.contains("href=\"overlays/a%20b%23%C3%BC.png\"") && page.ends_with("</main>"), "{page}");
    }

    #[test]
    fn numbers_stand_right_and_words_left() {
        let rows = [
            ["01", "0.012", "not-found", "12 corners of 54 were found, all of them at the left border", "", "n/a"],
            ["02", "n/a", "blurred", "the board was moved", "", "-1.2 mm"],
            ["03", "not seen", "", "moved", "", "3 of 12"],
            ["04", "+1.2, -3, 4", "ok", "moved", "", "-"],
        ];
        let page = table(&["", "a", "b", "c", "d", "e"], rows.map(|row| row.map(str::to_owned))).into_string();
        for text in ["b", "c", "d"] {
            assert!(page.contains(&format!("<th class=\"text\">{text}</th>")), "{page}");
        }
        for number in ["a", "e"] {
            assert!(page.contains(&format!("<th>{number}</th>")), "{page}");
        }
        assert!(page.contains("<td class=\"text\">blurred</td>") && page.contains("<td>0.012</td>"), "{page}");
    }

    #[test]
    fn backticks_become_code_where_they_come_in_pairs() {
        assert_eq!(
            text("give `--first <N>` or `-v`").into_string(),
            "give <code>--first &lt;N&gt;</code> or <code>-v</code>"
        );
        assert_eq!(text("a`b").into_string(), "a`b");
    }
    use crate::report::drawing::scene::{Ink, Scene};
    use nalgebra::Point3;

    #[test]
    fn a_page_asks_nobody_for_anything_and_has_a_script_only_where_something_turns() {
        let plain = page("a <b>", "lead", &html! { p { "text" } });
        assert!(plain.contains("a &lt;b&gt;") && plain.contains("default-src 'none'") && !plain.contains("<script"));
        let mut scene = Scene::default();
        scene.line(Ink::Plain, vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0)]);
        let turning = page("t", "lead", &scene.figure("a line", "A line."));
        assert_eq!(turning.matches("<script").count(), 1);
        for text in [plain, turning] {
            assert!(!text.contains("http://") && !text.contains("https://") && !text.contains("src=\"/"), "{text}");
        }
    }
}
