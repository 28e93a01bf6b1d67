//! Numbers as formulas have them: `pi/2`, `-np.pi / 2`, `deg2rad(90)`, `135*mm`, `q2 - 90°`.
//!
//! In: text, and what its names stand for. Out: the number, whether it was written with pi, and whether a joint's
//! variable is part of it, which counts as zero. What goes wrong: a name that stands for nothing, a multiple of a
//! joint's variable or several of them, or anything that is no sum of products; there is no number then. Nor is there
//! one where the joint counts the other way, unless that is asked for.

use std::f64::consts::PI;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    pub number: f64,
    /// Whether it is radians by its words.
    pub radians: bool,
    /// Whether a joint's variable was added.
    pub variable: bool,
}

/// Functions that turn degrees into radians.
const TO_RADIANS: [&str; 4] = ["radians", "rad", "toradians", "to_radians"];

/// Functions that do, and numbers to multiply with.
const PER_DEGREE: [&str; 6] = ["deg2rad", "d2r", "degtorad", "deg_to_rad", "dtor", "to_rad"];

/// Functions that turn radians into degrees.
const TO_DEGREES: [&str; 4] = ["rad2deg", "degrees", "radtodeg", "todegrees"];

/// Functions of numbers, whose arguments may be angles and whose values are none.
type Function = fn(f64) -> f64;
const FUNCTIONS: [(&str, Function); 4] = [("sin", f64::sin), ("cos", f64::cos), ("tan", f64::tan), ("sqrt", f64::sqrt)];

/// Names of parts of a half turn, with what they are of it.
const OF_PI: [(&str, f64); 7] =
    [("pi", 1.0), ("m_pi", 1.0), ("π", 1.0), ("m_pi_2", 0.5), ("half_pi", 0.5), ("m_pi_4", 0.25), ("two_pi", 2.0)];

/// Letters that joints' variables have.
const VARIABLES: [&str; 5] = ["theta", "θ", "q", "th", "t"];

/// The deepest brackets that are followed.
const DEEPEST: usize = 20;

/// What a joint's variable may be multiplied with: it stands there itself, or as degrees in radians or mm in m, or the
/// other way.
const OF_ONE: [f64; 5] = [1.0, PI / 180.0, 180.0 / PI, 1e-3, 1e3];

/// Rounding of such a factor, in parts of it.
const ROUNDED: f64 = 1e-9;

/// Evaluates a formula; `known` says what a name stands for.
pub fn evaluate(text: &str, known: &dyn Fn(&str) -> Option<Value>) -> Option<Value> {
    let (value, slope) = with_slope(text, known)?;
    // A joint that counts the other way, `-q2`, is another one.
    (!value.variable || slope > 0.0).then_some(value)
}

/// The same of a formula in which a joint's variable counts the other way, `90 - q2`; none of others.
pub fn counted_back(text: &str, known: &dyn Fn(&str) -> Option<Value>) -> Option<Value> {
    with_slope(text, known).filter(|(value, slope)| value.variable && *slope < 0.0).map(|(value, _)| value)
}

/// The number of the joint's variable that a formula holds, `q3`, `theta_3`.
pub fn number_of_variable(text: &str) -> Option<usize> {
    let text = plain(text);
    let none = |_: &str| None;
    let mut parser =
        Parser { rest: text.trim(), known: &none, reading: 0.0, radians: false, variable: false, number: None };
    parser.sum(0)?;
    parser.number
}

/// A formula's value, and what a joint's variable in it is multiplied with.
fn with_slope(text: &str, known: &dyn Fn(&str) -> Option<Value>) -> Option<(Value, f64)> {
    let plain = plain(text);
    let at = |reading: f64| {
        let mut parser = Parser { rest: plain.trim(), known, reading, radians: false, variable: false, number: None };
        let number = parser.sum(0)?;
        let whole = parser.rest.trim_start().is_empty() && number.is_finite();
        whole.then_some(Value { number, radians: parser.radians, variable: parser.variable })
    };
    let value = at(0.0)?;
    let slope = at(1.0)?.number - value.number;
    let is_one = OF_ONE.iter().any(|one| (slope.abs() - one).abs() < ROUNDED * one);
    (!value.variable || is_one).then_some((value, slope))
}

/// Without the marks of HTML and LaTeX: `θ<sub>2</sub>`, `\\theta_2`.
fn plain(text: &str) -> std::borrow::Cow<'_, str> {
    if !text.contains(['<', '\\', '$']) {
        return text.into();
    }
    ["<sub>", "</sub>", "\\", "$"].iter().fold(text.to_owned(), |text, mark| text.replace(mark, "")).into()
}

/// The formula with `q3` for a letter with a number, `d3` or `A3`, which is a joint's variable in its place.
pub fn of_reading(text: &str, letter: char) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut before = ' ';
    for (at, c) in text.char_indices() {
        let behind = text[at + c.len_utf8()..].trim_start_matches(['_', '{']);
        let is_it = c == letter && !(before.is_alphanumeric() || matches!(before, '_' | '.'));
        plain.push(if is_it && behind.starts_with(|c: char| c.is_ascii_digit()) { 'q' } else { c });
        before = c;
    }
    plain
}

struct Parser<'a> {
    rest: &'a str,
    known: &'a dyn Fn(&str) -> Option<Value>,
    /// What a joint's variable stands at.
    reading: f64,
    radians: bool,
    variable: bool,
    /// The number of the joint's variable.
    number: Option<usize>,
}

impl Parser<'_> {
    fn takes(&mut self, sign: char) -> bool {
        let rest = self.rest.trim_start();
        match rest.strip_prefix(sign) {
            // `**` is a power, which no table needs.
            Some(behind) if sign != '*' || !behind.starts_with('*') => {
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
        // `0.5f`, as C has it.
        if let Some(rest) = self.rest.strip_prefix(['f', 'F'])
            && !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_')
        {
            self.rest = rest;
        }
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

    /// A function of what stands in its brackets, the first of which was read; none of a joint's variable, for which no
    /// number stands.
    fn called(&mut self, name: &str, depth: usize) -> Option<f64> {
        let (radians, variable) = (self.radians, std::mem::take(&mut self.variable));
        let inside = self.sum(depth + 1)?;
        let of_two = name == "atan2";
        let second = if of_two && self.takes(',') { self.sum(depth + 1) } else { None };
        let is_number = self.takes(')') && !self.variable;
        (self.radians, self.variable) = (radians || of_two, variable);
        let function = FUNCTIONS.iter().find(|(known, _)| *known == name).map(|(_, function)| function);
        match function.filter(|_| is_number) {
            Some(function) => Some(function(inside)),
            None if of_two => second.filter(|_| is_number).map(|x| inside.atan2(x)),
            None => is_number.then(|| inside.to_degrees()),
        }
    }

    fn name(&mut self, depth: usize) -> Option<f64> {
        let is_part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '{' | '}');
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        let plain = name.rsplit('.').next().unwrap_or(name);
        self.rest = rest;
        let lower = plain.to_lowercase();
        let per_degree = PER_DEGREE.contains(&lower.as_str());
        if (per_degree || TO_RADIANS.contains(&lower.as_str())) && rest.trim_start().starts_with('(') {
            self.takes('(');
            let degrees = self.sum(depth + 1)?;
            self.radians = true;
            return self.takes(')').then(|| degrees.to_radians());
        }
        if rest.trim_start().starts_with('(')
            && (TO_DEGREES.contains(&lower.as_str()) || lower == "atan2" || FUNCTIONS.iter().any(|(n, _)| *n == lower))
        {
            self.takes('(');
            return self.called(&lower, depth);
        }
        if let Some((_, part)) = OF_PI.iter().find(|(name, _)| *name == lower) {
            self.radians = true;
            return Some(part * PI);
        }
        if let Some(value) = (self.known)(name) {
            self.radians |= value.radians;
            self.variable |= value.variable;
            return Some(value.number);
        }
        if per_degree {
            self.radians = true;
            return Some(1f64.to_radians());
        }
        let letters = plain.trim_end_matches(|c: char| c.is_numeric() || matches!(c, '_' | '{' | '}' | 'i' | '*'));
        let is_variable = VARIABLES.contains(&letters.to_lowercase().as_str());
        is_variable.then(|| {
            self.variable = true;
            self.number = plain[letters.len()..].trim_matches(['_', '{', '}', '*']).parse().ok();
            // `th5* + 90`: a star marks it.
            let behind = self.rest.trim_start().strip_prefix('*').map(str::trim_start);
            if let Some(behind) = behind.filter(|b| b.is_empty() || b.starts_with(['+', '-', '\u{2212}'])) {
                self.rest = behind;
            }
            self.reading
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_of_tables() {
        let plain = |number| Value { number, radians: false, variable: false };
        let known = |name: &str| match name {
            "mm" => Some(plain(1e-3)),
            "quarter" => Some(Value { radians: true, ..plain(PI / 2.0) }),
            _ => None,
        };
        let of = |text: &str| evaluate(text, &known).map(|v| (v.number, v.radians, v.variable));
        for text in [
            "pi/2",
            "np.pi / 2",
            "math.pi*0.5",
            "M_PI/2",
            "π/2",
            "deg2rad(90)",
            "np.radians(90.0)",
            "Math.toRadians(90)",
            "90 * DEG2RAD",
            "d2r(90)",
            "M_PI_2",
            "2*M_PI_4",
            "HALF_PI",
            "TWO_PI/4",
            "quarter",
            "-(-pi)/2",
            "0.5pi",
            "(90/180)*pi",
        ] {
            let (number, radians, variable) = of(text).unwrap();
            assert!((number - PI / 2.0).abs() < 1e-12 && radians && !variable, "{text}");
        }
        assert_eq!(of("-90°"), Some((-90.0, false, false)));
        assert_eq!((of("0.5f"), of("0.5foot")), (Some((0.5, false, false)), None));
        assert_eq!(of("135*mm"), Some((0.135, false, false)));
        assert_eq!(of("-1.5e-3 + 2"), Some((1.9985, false, false)));
        assert_eq!(of("\u{2212}90"), Some((-90.0, false, false)));
        for (text, number) in [
            ("q1", 0.0),
            ("θ2-90", -90.0),
            ("theta_3 + 90", 90.0),
            ("q_{4}", 0.0),
            ("th5*", 0.0),
            ("th5* + 90", 90.0),
            ("90 + \\theta_2", 90.0),
            ("θ<sub>3</sub>", 0.0),
        ] {
            assert_eq!(of(text), Some((number, false, true)), "{text}");
        }
        let (sine, radians, _) = of("0.2 + sin(pi/6)/np.sqrt(4) * 2").unwrap();
        assert!((sine - 0.7).abs() < 1e-12 && !radians);
    }

    #[test]
    fn functions_of_angles_and_letters_of_variables() {
        let of = |text: &str| evaluate(text, &|_| None).map(|v| (v.number, v.radians, v.variable));
        for (text, number, radians) in [
            ("rad2deg(-pi/2)", -90.0, false),
            ("np.degrees(math.pi)", 180.0, false),
            ("math.atan2(-1, 1)", -PI / 4.0, true),
            ("2*atan2(0.3, 0.3) - pi", -PI / 2.0, true),
        ] {
            let found = of(text).unwrap();
            assert!((found.0 - number).abs() < 1e-12 && found.1 == radians && !found.2, "{text} {found:?}");
        }
        assert_eq!([of("atan2(1)"), of("atan2(q1, 1)")], [None, None]);
        for (text, number) in
            [("q3 - 90", Some(3)), ("-theta_{2}", Some(2)), ("q_0", Some(0)), ("q", None), ("3", None)]
        {
            assert_eq!(number_of_variable(text), number, "{text}");
        }
        let of_reading =
            |text: &str, letter| of(&of_reading(text, letter)).map(|(number, _, variable)| (number, variable));
        assert_eq!(of_reading("d3 + 0.2", 'd'), Some((0.2, true)));
        assert_eq!(of_reading("A3 - 90", 'A'), Some((-90.0, true)));
        assert_eq!([of_reading("add3", 'd'), of_reading("A", 'A'), of_reading("d", 'd')], [None; 3]);
    }

    #[test]
    fn what_is_no_formula_has_no_value() {
        let of = |text: &str| evaluate(text, &|_| None).map(|v| v.number);
        for text in [
            "",
            "a1",
            "-q2",
            "90 - theta_3",
            "q2 + q3",
            "2*q2",
            "cos(q1)",
            "sin",
            "sin(",
            "sin(1",
            "sqrt(-1)",
            "asin(1)",
            "pi2",
            "pi/",
            "2 3",
            "x+1",
            "2**3",
            "(1",
            "1/0",
            "nan",
            "1e999",
        ] {
            assert_eq!(of(text), None, "{text}");
        }
        let back = |text: &str| counted_back(text, &|_| None).map(|v| (v.number, v.radians));
        assert_eq!([back("-q2"), back("90 - theta_3")], [Some((0.0, false)), Some((90.0, false))]);
        assert!(
            back("pi/2 - deg2rad(q4)").is_some_and(|(number, radians)| (number - PI / 2.0).abs() < 1e-12 && radians)
        );
        for text in ["q2", "90", "-90", "-q2 - q3", "-2*q2", "q2 - q2", "a - q2"] {
            assert_eq!(back(text), None, "{text}");
        }
        assert_eq!(of(&"(".repeat(10_000)), None);
        assert_eq!(of(&format!("{}1", "-".repeat(10_000))), None);
    }
}
