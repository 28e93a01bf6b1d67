//! Numbers behind a key in a YAML or Python-like text: enough for calibration files, which are keys and lists of numbers.

/// The text behind a key at the start of a line (blanks and quotes aside), up to the end of the file.
pub fn behind<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let bare = line.trim_start().trim_start_matches('\'');
        if let Some(rest) = bare.strip_prefix(key)
            && let Some(rest) = rest.trim_start_matches('\'').trim_start().strip_prefix(':')
        {
            return Some(&text[at + line.len() - rest.len()..]);
        }
        at += line.len();
    }
    None
}

/// A single number behind a key.
pub fn number(text: &str, key: &str) -> Result<f64, String> {
    let rest = behind(text, key).ok_or_else(|| format!("no `{key}`"))?;
    let word = rest.lines().next().unwrap_or_default().trim().trim_end_matches(',');
    word.parse().map_err(|_| format!("`{key}` is not a number: `{word}`"))
}

/// The first `count` numbers in brackets behind a key, or all of the first brackets where `count` is `None`.
pub fn list(text: &str, key: &str, count: Option<usize>) -> Result<Vec<f64>, String> {
    let mut rest = behind(text, key).ok_or_else(|| format!("no `{key}`"))?;
    let mut all = Vec::new();
    loop {
        let open = rest.find('[').ok_or_else(|| format!("`{key}` has no list of numbers"))?;
        let inner = rest[open + 1..].trim_start();
        if let Some(nested) = inner.strip_prefix('[') {
            rest = &rest[rest.len() - nested.len() - 1..];
            continue;
        }
        let close = inner.find(']').ok_or_else(|| format!("the list of `{key}` has no end"))?;
        for word in inner[..close].split(',').map(str::trim).filter(|w| !w.is_empty()) {
            all.push(word.parse().map_err(|_| format!("`{key}` holds `{word}`, which is not a number"))?);
        }
        match count {
            Some(count) if all.len() < count => rest = &inner[close..],
            Some(count) if all.len() > count => return Err(format!("`{key}` has {} numbers, not {count}", all.len())),
            _ => return Ok(all),
        }
    }
}
