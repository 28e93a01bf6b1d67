//! The cells of a row, and how they were told apart.

/// The fields of a row, in one piece.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fields {
    text: Box<str>,
    ends: Box<[u32]>,
}

impl Fields {
    /// From cells in their order.
    pub fn new(cells: impl IntoIterator<Item = impl AsRef<str>>) -> Fields {
        let (mut text, mut ends) = (String::new(), Vec::new());
        for cell in cells {
            text.push_str(cell.as_ref());
            // A row has less than 2^32 bytes.
            ends.push(text.len() as u32);
        }
        Fields { text: text.into(), ends: ends.into() }
    }

    pub fn len(&self) -> usize {
        self.ends.len()
    }

    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// One after the other.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        (0..self.len()).map(|column| &self[column])
    }
}

impl std::ops::Index<usize> for Fields {
    type Output = str;

    fn index(&self, column: usize) -> &str {
        let start = if column == 0 { 0 } else { self.ends[column - 1] };
        &self.text[start as usize..self.ends[column] as usize]
    }
}

/// How the cells of a file were told apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Form {
    /// Text with this between the cells; a blank stands for any number of them.
    Delimited(char),
    /// A sheet of a spreadsheet, and how many others there are.
    Sheet(String, usize),
    /// Values that have their names beside them: what holds them, and how many lines hold none.
    Named(&'static str, usize),
    /// Lines of a program, each with one joint target.
    Program {
        /// Lines without a target.
        others: usize,
        /// Whether the language says that the numbers are degrees.
        degrees: bool,
        /// The calls with the targets in them, where the language is none that is known; each once.
        calls: Vec<String>,
    },
}
