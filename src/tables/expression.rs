//! Numbers as formulas have them: `pi/2`, `-np.pi / 2`, `deg2rad(90)`, `135*mm`, `q2 - 90°`.
//!
//! In: text, and what its names stand for. Out: the number, whether it was written with pi, and whether a joint's variable is part of it, which
//! counts as zero. What goes wrong: a name that stands for nothing, or anything that is no sum of products; there is no number then.

use std::f64::consts::PI;

/// What a formula says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    pub number: f64,
    /// Whether it is radians by its words.
    pub radians: bool,
    /// Whether a joint's variable was added.
    pub variable: bool,
}

/// Functions that turn degrees into radians.
const TO_RADIANS: [&str; 4] = ["deg2rad", "radians", "rad", "to_radians"];

/// Letters that joints' variables have.
const VARIABLES: [&str; 5] = ["theta", "θ", "q", "th", "t"];

/// The deepest brackets that are followed.
const DEEPEST: usize = 20;

/// Evaluates a formula; `known` says what a name stands for.
pub fn evaluate(text: &str, known: &dyn Fn(&str) -> Option<f64>) -> Option<Value> {
    let plain = plain(text);
    let mut parser = Parser { rest: plain.trim(), known, radians: false, variable: false };
    let number = parser.sum(0)?;
    let whole = parser.rest.trim_start().is_empty() && number.is_finite();
    whole.then_some(Value { number, radians: parser.radians, variable: parser.variable })
}

/// Without the marks of HTML and LaTeX: `θ<sub>2</sub>`, `\\theta_2`.
fn plain(text: &str) -> std::borrow::Cow<'_, str> {
    if !text.contains(['<', '\\', '$']) {
        return text.into();
    }
    ["<sub>", "</sub>", "\\", "$"].iter().fold(text.to_owned(), |text, mark| text.replace(mark, "")).into()
}

struct Parser<'a> {
    rest: &'a str,
    known: &'a dyn Fn(&str) -> Option<f64>,
    radians: bool,
    variable: bool,
}

impl Parser<'_> {
    fn takes(&mut self, sign: char) -> bool {
        let rest = self.rest.trim_start();
        match rest.strip_prefix(sign) {
            // `**` is a power, which no table needs.
            Some(behind) if !behind.starts_with('*') => {
                self.rest = behind;
                true
            }
            _ => false,
        }
    }

    fn sum(&mut self, depth: usize) -> Option<f64> {
        let mut total = self.product(depth)?;
        loop {
            if self.takes('+') {
                total += self.product(depth)?;
            } else if self.takes('-') || self.takes('\u{2212}') {
                total -= self.product(depth)?;
            } else {
                return Some(total);
            }
        }
    }

    fn product(&mut self, depth: usize) -> Option<f64> {
        let mut total = self.factor(depth)?;
        loop {
            if self.takes('*') {
                total *= self.factor(depth)?;
            } else if self.takes('/') {
                total /= self.factor(depth)?;
            } else {
                return Some(total);
            }
        }
    }

    fn factor(&mut self, depth: usize) -> Option<f64> {
        if depth > DEEPEST {
            return None;
        }
        if self.takes('-') || self.takes('\u{2212}') {
            return self.factor(depth + 1).map(|v| -v);
        }
        if self.takes('+') {
            return self.factor(depth + 1);
        }
        if self.takes('(') {
            let inside = self.sum(depth + 1)?;
            return self.takes(')').then_some(inside);
        }
        self.rest = self.rest.trim_start();
        match self.rest.chars().next()? {
            c if c.is_ascii_digit() || c == '.' => self.number(),
            _ => self.name(depth),
        }
    }

    fn number(&mut self) -> Option<f64> {
        let mut end = 0;
        let bytes = self.rest.as_bytes();
        while end < bytes.len() {
            let exponent = end > 0 && matches!(bytes[end - 1], b'e' | b'E');
            let is_part = bytes[end].is_ascii_digit()
                || bytes[end] == b'.'
                || matches!(bytes[end], b'e' | b'E')
                    && bytes.get(end + 1).is_some_and(|b| b.is_ascii_digit() || matches!(b, b'-' | b'+'))
                || matches!(bytes[end], b'-' | b'+') && exponent;
            if !is_part {
                break;
            }
            end += 1;
        }
        let value = self.rest[..end].parse().ok()?;
        self.rest = self.rest[end..].trim_start_matches(['°', 'º']);
        // `2pi` is a product without its sign.
        let times = ["pi", "π"].iter().find_map(|pi| self.rest.strip_prefix(pi));
        Some(match times {
            Some(rest) => {
                (self.rest, self.radians) = (rest, true);
                value * PI
            }
            None => value,
        })
    }

    fn name(&mut self, depth: usize) -> Option<f64> {
        let is_part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '{' | '}');
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        let plain = name.rsplit('.').next().unwrap_or(name);
        self.rest = rest;
        if TO_RADIANS.contains(&plain) && rest.trim_start().starts_with('(') {
            self.takes('(');
            let degrees = self.sum(depth + 1)?;
            self.radians = true;
            return self.takes(')').then(|| degrees.to_radians());
        }
        if matches!(plain.to_lowercase().as_str(), "pi" | "m_pi" | "π") {
            self.radians = true;
            return Some(PI);
        }
        if let Some(value) = (self.known)(name) {
            return Some(value);
        }
        let letters = plain.trim_end_matches(|c: char| c.is_numeric() || matches!(c, '_' | '{' | '}' | 'i' | '*'));
        let is_variable = VARIABLES.contains(&letters.to_lowercase().as_str());
        is_variable.then(|| {
            self.variable = true;
            self.takes('*');
            0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_of_tables() {
        let known = |name: &str| (name == "mm").then_some(1e-3);
        let of = |text: &str| evaluate(text, &known).map(|v| (v.number, v.radians, v.variable));
        for text in [
            "pi/2",
            "np.pi / 2",
            "math.pi*0.5",
            "M_PI/2",
            "π/2",
            "deg2rad(90)",
            "np.radians(90.0)",
            "-(-pi)/2",
            "0.5pi",
        ] {
            let (number, radians, variable) = of(text).unwrap();
            assert!((number - PI / 2.0).abs() < 1e-12 && radians && !variable, "{text}");
        }
        assert_eq!(of("-90°"), Some((-90.0, false, false)));
        assert_eq!(of("135*mm"), Some((0.135, false, false)));
        assert_eq!(of("-1.5e-3 + 2"), Some((1.9985, false, false)));
        assert_eq!(of("\u{2212}90"), Some((-90.0, false, false)));
        for (text, number) in [
            ("q1", 0.0),
            ("θ2-90", -90.0),
            ("theta_3 + 90", 90.0),
            ("q_{4}", 0.0),
            ("th5*", 0.0),
            ("90 + \\theta_2", 90.0),
            ("θ<sub>3</sub>", 0.0),
        ] {
            assert_eq!(of(text), Some((number, false, true)), "{text}");
        }
        for text in ["", "a1", "pi/", "2 3", "x+1", "2**3", "(1", "1/0", "nan", "1e999"] {
            assert_eq!(of(text), None, "{text}");
        }
        assert_eq!(of(&"(".repeat(10_000)), None);
        assert_eq!(of(&format!("{}1", "-".repeat(10_000))), None);
    }
}
