//! A file's bytes as text or as the cells of a spreadsheet.
//!
//! In: a path, for spreadsheets with `#SHEET` behind it. Out: text decoded from UTF-8, UTF-16 or Latin-1 (as Windows
//! has it, code page 1252), or cells, those of JSON's records included. What goes wrong: files of MATLAB, NumPy and the
//! like are no text; the message says how to export them. A formula whose value the spreadsheet does not hold is
//! refused with its cell.

use std::io::{Cursor, Read};

use calamine::{Data, Reader, Sheets, open_workbook_auto_from_rs};
use camino::{Utf8Path, Utf8PathBuf};
use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

use super::fields::Fields;
use super::foreign;
use super::lines::records;
use super::numbers::Style;
use crate::files::{Error, Result, unreadable};

/// The longest table that is read, bytes.
const MOST_BYTES: u64 = 2 << 30;

/// The largest spreadsheet that is read, bytes: it is compressed, and read as a whole.
const MOST_SHEET_BYTES: usize = 64 << 20;

/// Bytes of a file that tell an encoding without a mark.
const SEEN: usize = 4096;

pub(super) enum Source {
    /// Text, and its encoding where that is not UTF-8.
    Text(String, Option<&'static str>),
    /// Records of JSON.
    Records(Vec<(u64, Fields)>),
    /// Rows of cells with their line, the sheet's name, and whether there are other sheets.
    Sheet { rows: Vec<(u64, Vec<String>)>, name: String, others: usize },
}

/// The file of a path that may name a sheet, and the sheet.
pub(super) fn split(path: &Utf8Path) -> (Utf8PathBuf, Option<String>) {
    match path.as_str().rsplit_once('#') {
        Some((file, sheet)) if !path.exists() && !file.is_empty() && !sheet.is_empty() => {
            (file.into(), Some(sheet.to_owned()))
        }
        _ => (path.to_owned(), None),
    }
}

/// What to do where a path is a list of files that are there.
fn of_several(path: &Utf8Path) -> Option<String> {
    let parts: Vec<&str> = path.as_str().split(',').map(str::trim).collect();
    let are_there = parts.len() > 1 && parts.iter().all(|part| split((*part).into()).0.is_file());
    are_there.then(|| format!("the flag takes one file, and is repeated: once for each of {}", parts.join(" and ")))
}

/// Reads a file; `what` names it in the message when it is not there, `hint` says what makes it.
pub(super) fn read(path: &Utf8Path, what: &'static str, hint: &str) -> Result<Source> {
    let (file, sheet) = split(path);
    let mut bytes = Vec::new();
    let read = std::fs::File::open(&file).and_then(|f| f.take(MOST_BYTES + 1).read_to_end(&mut bytes));
    match read {
        Ok(_) if bytes.len() as u64 > MOST_BYTES => {
            let message = format!("{what}: more than {} MB; no such file is that long", MOST_BYTES >> 20);
            return Err(refuse(&file, message, None));
        }
        Ok(_) => {}
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            return Err(Error::Missing {
                what,
                hint: Some(of_several(path).unwrap_or_else(|| hint.to_owned())),
                path: file,
            });
        }
        Err(source) => return Err(unreadable(&file, what, source)),
    }
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]) {
        return cells(bytes, &file, sheet.as_deref());
    }
    if sheet.is_some() {
        return Err(refuse(&file, "a sheet is named behind `#`, but the file is no spreadsheet".to_owned(), None));
    }
    if let Some(rows) = std::str::from_utf8(&bytes).ok().and_then(records::read) {
        return Ok(Source::Records(rows));
    }
    if let Some((kind, hint)) = foreign::of_bytes(&bytes, &file) {
        return Err(refuse(&file, format!("{what}: {kind}, which is not read"), Some(&hint)));
    }
    let (mut text, encoding) = decoded(&bytes);
    if text.contains('\0') {
        // Some loggers end their lines with one.
        text = text.lines().map(|line| line.trim_end_matches('\0')).collect::<Vec<_>>().join("\n");
    }
    if text.contains('\0') {
        let hint = "save it as CSV (comma, semicolon, tab or blanks) or as a spreadsheet (xlsx, xls, ods)";
        return Err(refuse(&file, format!("{what}: not a text, and no spreadsheet"), Some(hint)));
    }
    if let Some(hint) = foreign::of_yaml(&text, &file) {
        return Err(refuse(&file, format!("{what}: a YAML file, which is not read"), Some(&hint)));
    }
    Ok(Source::Text(without_numpy(text), encoding))
}

/// A text with the numbers that numpy 2 writes as `np.float64(1.5)` where it writes lists.
fn without_numpy(text: String) -> String {
    let mut parts = text.split("np.float");
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let number =
            part.strip_prefix("64(").or_else(|| part.strip_prefix("32(")).and_then(|rest| rest.split_once(')'));
        match number {
            Some((number, rest)) => plain.extend([number, rest]),
            None => plain.extend(["np.float", part]),
        }
    }
    plain
}

fn refuse(path: &Utf8Path, message: String, hint: Option<&str>) -> Error {
    Error::format(path, None, message, hint)
}

/// Text from bytes, and the encoding's name where it is not UTF-8.
fn decoded(bytes: &[u8]) -> (String, Option<&'static str>) {
    let encoding = Encoding::for_bom(bytes).map(|(encoding, _)| encoding).or_else(|| utf_16_without_mark(bytes));
    if let Some(encoding) = encoding {
        let (text, _, _) = encoding.decode(bytes);
        return (text.into_owned(), (encoding != UTF_8).then(|| encoding.name()));
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => (text.to_owned(), None),
        Err(_) => (WINDOWS_1252.decode(bytes).0.into_owned(), Some("Latin-1")),
    }
}

/// Numbers and names in UTF-16 have a zero in every other byte.
fn utf_16_without_mark(bytes: &[u8]) -> Option<&'static Encoding> {
    let seen = &bytes[..bytes.len().min(SEEN)];
    let zeros = |from: usize| seen.iter().skip(from).step_by(2).filter(|b| **b == 0).count();
    let (even, odd, half) = (zeros(0), zeros(1), seen.len() / 2);
    match (even, odd) {
        (0, odd) if odd > half * 3 / 4 && odd > 0 => Some(UTF_16LE),
        (even, 0) if even > half * 3 / 4 && even > 0 => Some(UTF_16BE),
        _ => None,
    }
}

fn cells(bytes: Vec<u8>, path: &Utf8Path, sheet: Option<&str>) -> Result<Source> {
    if bytes.len() > MOST_SHEET_BYTES {
        let message = format!("a spreadsheet of more than {} MB", MOST_SHEET_BYTES >> 20);
        return Err(refuse(path, message, Some("save the sheet as CSV")));
    }
    let unreadable =
        |e: calamine::Error| refuse(path, format!("not readable as a spreadsheet: {e}"), Some("save the sheet as CSV"));
    let mut book: Sheets<_> = open_workbook_auto_from_rs(Cursor::new(bytes)).map_err(unreadable)?;
    let names = book.sheet_names();
    let name = match sheet {
        // A cover page is no table: the first sheet that is one.
        None => {
            let mut tables = names.iter().filter(|name| book.worksheet_range(name).is_ok_and(|range| is_table(&range)));
            tables.next().or(names.first()).cloned()
        }
        Some(sheet) => names.iter().find(|name| name.eq_ignore_ascii_case(sheet)).cloned(),
    };
    let Some(name) = name else {
        let message = format!("no sheet `{}`; the file has: {}", sheet.unwrap_or("1"), names.join(", "));
        return Err(refuse(path, message, Some(&format!("`{path}#SHEET` names a sheet"))));
    };
    let range = book.worksheet_range(&name).map_err(unreadable)?;
    // A program that writes a sheet without computing it leaves formulas without values.
    let formulas = book.worksheet_formula(&name).map_err(unreadable)?;
    let corner = formulas.start().unwrap_or_default();
    let at = |(row, column, _): (usize, usize, &String)| (corner.0 + row as u32, corner.1 + column as u32);
    let is_empty = |at: &(u32, u32)| range.get_value(*at).is_none_or(|value| *value == Data::Empty);
    let open: Vec<(u32, u32)> = formulas.used_cells().map(at).filter(is_empty).collect();
    if let Some((row, column)) = open.first() {
        let message = format!(
            "sheet {name}: {} cells hold a formula without its value, the first is in column {} of this row",
            open.len(),
            column + 1
        );
        let hint = "open the file in a spreadsheet program and save it: that stores the values; a row of sums or means is no row of the table, remove it";
        return Err(Error::format(path, Some(u64::from(*row) + 1), message, Some(hint)));
    }
    let first = range.start().map_or(0, |(row, _)| u64::from(row)) + 1;
    let texts =
        range.used_cells().filter_map(|(_, _, data)| if let Data::String(v) = data { Some(v.trim()) } else { None });
    let style = Style::of(texts, false);
    let text = |data: &Data| match data {
        Data::String(v) => style.number(v.trim()).unwrap_or_else(|| cell(data)),
        _ => cell(data),
    };
    let rows = range.rows().zip(first..).map(|(row, line)| (line, row.iter().map(text).collect())).collect();
    Ok(Source::Sheet { rows, name, others: names.len() - 1 })
}

/// Whether some rows of a sheet hold the numbers of a point at the least.
fn is_table(range: &calamine::Range<Data>) -> bool {
    const ROWS: usize = 2;
    const NUMBERS: usize = 3;
    let number = |data: &&Data| cell(data).parse::<f64>().is_ok();
    range.rows().filter(|row| row.iter().filter(number).count() >= NUMBERS).take(ROWS).count() == ROWS
}

fn cell(data: &Data) -> String {
    match data {
        Data::Int(v) => v.to_string(),
        Data::Float(v) => v.to_string(),
        Data::String(v) => v.trim().to_owned(),
        Data::Bool(v) => v.to_string(),
        Data::DateTimeIso(v) | Data::DurationIso(v) => v.clone(),
        // A date is no number of a table of poses, and must not be taken for one.
        Data::DateTime(v) => format!("date {v}"),
        Data::Error(e) => e.to_string(),
        Data::Empty => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings_read_alike() {
        let text = "X [mm];U [µm]\n1,5;2\n";
        let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        let marked = [vec![0xff, 0xfe], utf16.clone()].concat();
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        for bytes in [text.as_bytes().to_vec(), utf16, big, marked, latin] {
            assert_eq!(decoded(&bytes).0, text);
        }
        assert_eq!(decoded(&[b"\xef\xbb\xbf", text.as_bytes()].concat()).0, text);
    }

    #[test]
    fn files_of_other_programs_are_refused_with_how_to_export_them() {
        let refused = |name: &str, bytes: &[u8]| {
            let (_folder, path) = crate::files::temporary(name, bytes);
            read(&path, "the table", "").err().map(|e| crate::diagnostic::report(&e)).unwrap()
        };
        assert!(refused("a.mat", b"MATLAB 5.0 MAT-file").contains("writematrix"));
        assert!(refused("b.dat", b"MATLAB 5.0 MAT-file").contains("MATLAB file"));
        assert!(refused("a.npy", b"\x93NUMPY\x01").contains("numpy.savetxt"));
        let (_folder, lines) = crate::files::temporary("lines.csv", b"j1,x\0\r\n1,2\0\r\n");
        let Ok(Source::Text(text, None)) = read(&lines, "the table", "") else { panic!("not read") };
        assert_eq!(text.lines().collect::<Vec<_>>(), ["j1,x", "1,2"]);
        let numpy = "1,np.float64(2.5),[np.float32(3), np.float64(-4e-3)]\nnp.float64(5,np.floats\n".to_owned();
        assert_eq!(without_numpy(numpy), "1,2.5,[3, -4e-3]\nnp.float64(5,np.floats\n");
        assert!(refused("a.csv", b"\x00\x01\x02\xffabc").contains("no spreadsheet"));
        assert!(refused("a.xlsx", b"PK\x03\x04 nothing").contains("not readable as a spreadsheet"));
    }
}
