//! Separated values read line by line in bounded memory; every error names file, line and column.
//!
//! A line is one record: a quoted cell can hold the separator, not a line break. A last line without its line break was cut
//! off by a crash: it is dropped, and [`Table::was_cut`] says so.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{BufRead, Read};
use std::ops::Range;
use std::str::FromStr;

use glam::{Quat, Vec3};

use super::TraceError;
use crate::gaze::sample::{unit, unit_rotation};

/// Longest line that is read. A row of `gaze.csv` has about 300 bytes.
const MAX_LINE_BYTES: u64 = 64 * 1024;

/// How far a stored direction or quaternion may be from length 1 before it is taken for something else than a rounded one.
const NEAR_UNIT: f32 = 0.01;

/// A table with a header row.
pub(crate) struct Table<R> {
    file: String,
    delimiter: u8,
    reader: R,
    header: Vec<String>,
    line: Vec<u8>,
    text: String,
    line_number: u64,
    cells: Vec<Cell>,
    cut: bool,
}

/// Where a column is. A column that the file lacks reads as empty cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column(Option<usize>);

struct Cell {
    bytes: Range<usize>,
    quoted: bool,
}

enum Line {
    Whole,
    Cut,
    End,
}

impl<R: BufRead> Table<R> {
    /// Reads the header. `None`: the file ends before its header is complete.
    pub fn open(
        file: impl Into<String>,
        delimiter: u8,
        reader: R,
    ) -> Result<Option<Self>, TraceError> {
        let mut table = Self {
            file: file.into(),
            delimiter,
            reader,
            header: Vec::new(),
            line: Vec::new(),
            text: String::new(),
            line_number: 0,
            cells: Vec::new(),
            cut: false,
        };
        if !table.next_line()? {
            return Ok(None);
        }
        let names = table
            .cells
            .iter()
            .map(|cell| &table.text[cell.bytes.clone()]);
        table.header = names
            .map(|name| name.trim_start_matches('\u{feff}').trim().to_owned())
            .collect();
        Ok(Some(table))
    }

    /// A column that must be there.
    pub fn column(&self, name: &str) -> Result<Column, TraceError> {
        match self.optional(name) {
            Column(None) => Err(TraceError::MissingColumn {
                file: self.file.clone(),
                column: name.to_owned(),
            }),
            found => Ok(found),
        }
    }

    /// A column that may be missing.
    pub fn optional(&self, name: &str) -> Column {
        Column(self.header.iter().position(|column| column == name))
    }

    /// The next row; blank lines are passed over.
    pub fn next_row(&mut self) -> Result<Option<Row<'_>>, TraceError> {
        if !self.next_line()? {
            return Ok(None);
        }
        if self.cells.len() != self.header.len() {
            return Err(TraceError::CellCount {
                file: self.file.clone(),
                line: self.line_number,
                expected: self.header.len(),
                found: self.cells.len(),
            });
        }
        Ok(Some(Row {
            file: &self.file,
            line: self.line_number,
            header: &self.header,
            text: &self.text,
            cells: &self.cells,
        }))
    }

    /// Whether the file ended in the middle of a line.
    pub fn was_cut(&self) -> bool {
        self.cut
    }

    /// The last line that was read, counted from 1.
    pub fn line_number(&self) -> u64 {
        self.line_number
    }

    /// Reads the next line that is not blank and finds its cells; `false` at the end.
    fn next_line(&mut self) -> Result<bool, TraceError> {
        loop {
            match self.read_line()? {
                Line::End => return Ok(false),
                Line::Cut => {
                    self.cut = true;
                    return Ok(false);
                }
                Line::Whole if self.line.is_empty() => {}
                Line::Whole => break,
            }
        }
        let text = str::from_utf8(&self.line).map_err(|_| TraceError::NotText {
            file: self.file.clone(),
            line: self.line_number,
        })?;
        self.text.clear();
        self.text.push_str(text);
        split(&self.text, self.delimiter, &mut self.cells);
        Ok(true)
    }

    fn read_line(&mut self) -> Result<Line, TraceError> {
        self.line.clear();
        let mut limited = (&mut self.reader).take(MAX_LINE_BYTES);
        limited
            .read_until(b'\n', &mut self.line)
            .map_err(|source| TraceError::Read {
                file: self.file.clone(),
                source,
            })?;
        if self.line.is_empty() {
            return Ok(Line::End);
        }
        self.line_number += 1;
        if self.line.pop_if(|last| *last == b'\n').is_none() {
            if self.line.len() as u64 == MAX_LINE_BYTES {
                return Err(TraceError::LineTooLong {
                    file: self.file.clone(),
                    line: self.line_number,
                    limit_bytes: MAX_LINE_BYTES,
                });
            }
            return Ok(Line::Cut);
        }
        self.line.pop_if(|last| *last == b'\r');
        Ok(Line::Whole)
    }
}

fn split(text: &str, delimiter: u8, cells: &mut Vec<Cell>) {
    cells.clear();
    let bytes = text.as_bytes();
    let mut start = 0;
    loop {
        let quoted = bytes.get(start) == Some(&b'"');
        let mut inside = quoted;
        let mut end = start + usize::from(quoted);
        while end < bytes.len() && (inside || bytes[end] != delimiter) {
            inside ^= quoted && bytes[end] == b'"';
            end += 1;
        }
        // A cell whose closing quote is missing keeps all that is left of the line.
        let closed = quoted && end > start + 1 && bytes[end - 1] == b'"';
        cells.push(Cell {
            bytes: start + usize::from(quoted)..end - usize::from(closed),
            quoted,
        });
        if end >= bytes.len() {
            return;
        }
        start = end + 1;
    }
}

/// One row of a [`Table`].
pub(crate) struct Row<'a> {
    file: &'a str,
    line: u64,
    header: &'a [String],
    text: &'a str,
    cells: &'a [Cell],
}

impl Row<'_> {
    /// A cell's text, without quotes.
    pub fn text(&self, Column(column): Column) -> Cow<'_, str> {
        let Some(cell) = column.and_then(|index| self.cells.get(index)) else {
            return Cow::Borrowed("");
        };
        let text = &self.text[cell.bytes.clone()];
        match cell.quoted {
            true => Cow::Owned(text.replace("\"\"", "\"")),
            false => Cow::Borrowed(text.trim()),
        }
    }

    /// What is wrong with a cell, and how to mend it.
    pub fn problem(&self, Column(column): Column, problem: impl Into<String>) -> TraceError {
        TraceError::Cell {
            file: self.file.to_owned(),
            line: self.line,
            column: column
                .and_then(|index| self.header.get(index))
                .cloned()
                .unwrap_or_default(),
            text: self.text(Column(column)).chars().take(40).collect(),
            problem: problem.into(),
        }
    }

    /// The value of a cell that must not be empty.
    pub fn required<T>(&self, column: Column, value: Option<T>) -> Result<T, TraceError> {
        value.ok_or_else(|| self.problem(column, "is empty; this row needs a value here"))
    }

    /// A whole number.
    pub fn integer<T: FromStr>(&self, column: Column) -> Result<Option<T>, TraceError> {
        let text = self.text(column);
        if text.is_empty() {
            return Ok(None);
        }
        let value = text.parse().map_err(|_| {
            self.problem(
                column,
                "is not a whole number in range; write digits, or leave the cell empty",
            )
        })?;
        Ok(Some(value))
    }

    /// A finite number.
    pub fn number(&self, column: Column) -> Result<Option<f32>, TraceError> {
        let text = self.text(column);
        if text.is_empty() {
            return Ok(None);
        }
        match text.parse::<f32>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            Ok(_) => Err(self.problem(
                column,
                "is not finite; leave the cell empty where there is no value",
            )),
            Err(_) => Err(self.problem(
                column,
                "is not a number; write a decimal number, or leave the cell empty",
            )),
        }
    }

    /// A finite number between two bounds.
    pub fn number_within(
        &self,
        column: Column,
        range: std::ops::RangeInclusive<f32>,
    ) -> Result<Option<f32>, TraceError> {
        match self.number(column)? {
            Some(value) if !range.contains(&value) => Err(self.problem(
                column,
                format!("lies outside {} to {}", range.start(), range.end()),
            )),
            value => Ok(value),
        }
    }

    /// 0 or 1; an empty cell is 0.
    pub fn flag(&self, column: Column) -> Result<bool, TraceError> {
        match &*self.text(column) {
            "" | "0" => Ok(false),
            "1" => Ok(true),
            _ => Err(self.problem(column, "is neither 0 nor 1")),
        }
    }

    /// A time in nanoseconds of `XrTime`, which is positive.
    pub fn time_ns(&self, column: Column) -> Result<Option<i64>, TraceError> {
        match self.integer::<i64>(column)? {
            Some(time_ns) if time_ns <= 0 => Err(self.problem(
                column,
                "is not a time; XrTime is a positive number of nanoseconds",
            )),
            time_ns => Ok(time_ns),
        }
    }

    /// Three numbers, or three empty cells.
    pub fn vector(&self, columns: [Column; 3]) -> Result<Option<Vec3>, TraceError> {
        Ok(self.numbers(columns)?.map(Vec3::from_array))
    }

    /// A unit vector, or three empty cells. Normalised if it is nearly one.
    pub fn direction(&self, columns: [Column; 3]) -> Result<Option<Vec3>, TraceError> {
        let Some(vector) = self.vector(columns)? else {
            return Ok(None);
        };
        self.near_unit(columns[0], vector.length(), "a direction")?;
        Ok(unit(vector))
    }

    /// A unit quaternion, or four empty cells. Normalised if it is nearly one.
    pub fn rotation(&self, columns: [Column; 4]) -> Result<Option<Quat>, TraceError> {
        let Some(values) = self.numbers(columns)? else {
            return Ok(None);
        };
        let rotation = Quat::from_array(values);
        self.near_unit(columns[0], rotation.length(), "a quaternion")?;
        Ok(unit_rotation(rotation))
    }

    fn numbers<const N: usize>(
        &self,
        columns: [Column; N],
    ) -> Result<Option<[f32; N]>, TraceError> {
        let mut values = [0.0; N];
        if columns.iter().all(|&column| self.text(column).is_empty()) {
            return Ok(None);
        }
        for (value, column) in values.iter_mut().zip(columns) {
            *value = self.required(column, self.number(column)?)?;
        }
        Ok(Some(values))
    }

    fn near_unit(&self, first: Column, length: f32, what: impl Display) -> Result<(), TraceError> {
        if (length - 1.0).abs() <= NEAR_UNIT {
            return Ok(());
        }
        Err(self.problem(first, format!("begins {what} of length {length}, which must be 1; divide it by its length, or mark it invalid")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cells(line: &str) -> Vec<String> {
        let text = format!("a,b,c\n{line}\n");
        let mut table = Table::open("t.csv", b',', text.as_bytes())
            .unwrap()
            .unwrap();
        let columns: Vec<_> = ["a", "b", "c"].map(|name| table.optional(name)).into();
        let row = table.next_row().unwrap().unwrap();
        columns
            .into_iter()
            .map(|column| row.text(column).into_owned())
            .collect()
    }

    #[test]
    fn quoted_cells_hold_separators_and_quotes() {
        assert_eq!(cells("1,\"x, y\",3"), ["1", "x, y", "3"]);
        assert_eq!(cells("\"say \"\"no\"\"\",2,"), ["say \"no\"", "2", ""]);
        assert_eq!(cells("\"\",2,\"\""), ["", "2", ""]);
    }

    #[test]
    fn a_line_beyond_the_limit_is_refused_without_reading_on() {
        let endless = std::io::repeat(b'x');
        let result = Table::open("t.csv", b',', std::io::BufReader::new(endless));
        assert!(matches!(
            result,
            Err(TraceError::LineTooLong { line: 1, .. })
        ));
    }

    #[test]
    fn an_error_names_file_line_and_column() {
        let mut table = Table::open("t.csv", b',', "a,b\n1,2\n\n3,x\n".as_bytes())
            .unwrap()
            .unwrap();
        let b = table.column("b").unwrap();
        assert_eq!(
            table.next_row().unwrap().unwrap().number(b).unwrap(),
            Some(2.0)
        );
        let message = table
            .next_row()
            .unwrap()
            .unwrap()
            .number(b)
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("t.csv, line 4, column b: `x`"),
            "{message}"
        );
        assert!(
            table
                .column("c")
                .unwrap_err()
                .to_string()
                .contains("no column `c`")
        );
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "[a-z0-9,\"\\n\\r. -]{0,200}") {
            if let Ok(Some(mut table)) = Table::open("t.csv", b',', text.as_bytes()) {
                let columns: Vec<_> = (0..5).map(|index| Column(Some(index))).collect();
                while let Ok(Some(row)) = table.next_row() {
                    for &column in &columns {
                        let _ = (row.text(column), row.number(column), row.integer::<i64>(column));
                    }
                }
            }
        }
    }
}
