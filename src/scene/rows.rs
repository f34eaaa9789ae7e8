//! CSV files that scenes name: finite numbers and ids below a header, each refused by its line.

use csv::{Error, Position, Reader, ReaderBuilder, StringRecord, Trim};

/// A file whose rows are read one after the other.
pub struct Rows<'t> {
    pub header: Vec<String>,
    text: &'t str,
    reader: Reader<&'t [u8]>,
}

/// One row, as long as the header.
pub struct Row<'r> {
    /// Its line in the file, from 1.
    pub line: u64,
    header: &'r [String],
    values: &'r StringRecord,
}

impl<'t> Rows<'t> {
    /// Of the text of a file; blanks around values do not count, nor do empty lines.
    ///
    /// # Errors
    /// A sentence that names what is wrong with the header.
    pub fn of(text: &'t str) -> Result<Self, String> {
        let mut reader = ReaderBuilder::new().trim(Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| in_words(&error, text))?;
        let header = header.iter().map(str::to_owned).collect();
        Ok(Self { header, text, reader })
    }

    /// The header as the file has it.
    pub fn header_line(&self) -> String {
        self.header.join(",")
    }

    /// The column of this name, if there is one.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|known| known == name)
    }

    /// Hands out the rows in order.
    ///
    /// # Errors
    /// The first sentence that `row` gives, or one of a row that is longer or shorter than the header.
    pub fn each(mut self, mut row: impl FnMut(&Row<'_>) -> Result<(), String>) -> Result<(), String> {
        let mut values = StringRecord::new();
        while self.reader.read_record(&mut values).map_err(|error| in_words(&error, self.text))? {
            let line = line_of(values.position(), self.text);
            row(&Row { line, header: &self.header, values: &values })?;
        }
        Ok(())
    }
}

impl<'r> Row<'r> {
    pub fn text(&self, column: usize) -> &'r str {
        &self.values[column]
    }

    /// A value times `scale`.
    ///
    /// # Errors
    /// A sentence that names the line, where it is no finite number.
    pub fn number(&self, column: usize, scale: f64) -> Result<f64, String> {
        // The sum makes 0.0 of -0.0, which is the same place.
        let value = self.text(column).parse::<f64>().ok().map(|value| scale * value + 0.0);
        let what =
            if scale == 1.0 { "a finite number" } else { "a number that is finite also times the scale" };
        value.filter(|value| value.is_finite()).ok_or_else(|| self.refuse(column, what))
    }

    /// A whole number that is not negative.
    ///
    /// # Errors
    /// A sentence that names the line, where it is none.
    pub fn whole(&self, column: usize) -> Result<u32, String> {
        let value = self.text(column).parse().ok();
        value.ok_or_else(|| self.refuse(column, &format!("a whole number from 0 to {}", u32::MAX)))
    }

    /// The id of a particle.
    ///
    /// # Errors
    /// A sentence that names the line, where it is none.
    pub fn id(&self, column: usize) -> Result<u32, String> {
        let value = self.text(column).parse().ok().filter(|&id| id > 0);
        value.ok_or_else(|| self.refuse(column, &format!("a whole number from 1 to {}", u32::MAX)))
    }

    fn refuse(&self, column: usize, what: &str) -> String {
        format!("line {}: `{}` = `{}` is not {what}", self.line, self.header[column], self.text(column))
    }
}

/// The line of a row, which is said to begin where the one before it ends: at empty lines, if there are any.
fn line_of(position: Option<&Position>, text: &str) -> u64 {
    let Some(position) = position else { return 0 };
    let left = text.as_bytes().get(position.byte() as usize..).unwrap_or_default();
    let empty = left.iter().take_while(|byte| matches!(byte, b'\n' | b'\r')).filter(|byte| **byte == b'\n');
    position.line() + empty.count() as u64
}

fn in_words(error: &Error, text: &str) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = line_of(pos.as_ref(), text);
            format!("line {line}: {len} values below a header of {expected_len}")
        }
        _ => error.to_string(),
    }
}
