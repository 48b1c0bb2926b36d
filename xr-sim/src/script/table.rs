//! Reading a CSV file by the names of its columns, telling file, line and column of what is wrong.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The largest file that is read: some days of gaze at 200 Hz.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// Why a session folder can't be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ScriptError {
    /// A file can't be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file is beyond any recording.
    #[error("{} has {bytes} bytes; at most {MAX_FILE_BYTES} are read: split the recording", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
    },
    /// A line isn't CSV of the header's width.
    #[error("{}, line {line}: {reason}; remove or mend the line", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Counted from 1, the header's.
        line: u64,
        /// What is wrong.
        reason: String,
    },
    /// A column that must be there isn't.
    #[error("{} has no column {column}; is it a session folder's?", path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column's name.
        column: String,
    },
    /// A value is no number, or not one that can be.
    #[error("{}, line {line}, column {column}: {value:?} {reason}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Counted from 1, the header's.
        line: u64,
        /// The column's name.
        column: String,
        /// What stands there.
        value: String,
        /// Why it can't be.
        reason: &'static str,
    },
    /// There is nothing to replay.
    #[error("{} has no rows; there is nothing to replay", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
}

/// A CSV file with a header. A last line that doesn't end is left out: its writer was interrupted.
pub(super) struct Table {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// A column by its name; absent where the file hasn't got it.
#[derive(Debug, Clone)]
pub(super) struct Column {
    name: String,
    index: Option<usize>,
}

/// The names of a file's columns.
pub(super) struct Header<'a> {
    path: &'a Path,
    names: csv::StringRecord,
}

/// One line of the file.
pub(super) struct Row<'a> {
    path: &'a Path,
    line: u64,
    fields: csv::StringRecord,
}

impl Table {
    /// Reads the file, or gives none where there is no such file.
    pub fn read_if_any(path: &Path) -> Result<Option<Self>, ScriptError> {
        match Self::read(path) {
            Err(ScriptError::Read { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
                Ok(None)
            }
            table => table.map(Some),
        }
    }

    pub fn read(path: &Path) -> Result<Self, ScriptError> {
        let failed = |source| ScriptError::Read {
            path: path.into(),
            source,
        };
        let file = File::open(path).map_err(failed)?;
        let mut bytes = Vec::new();
        file.take(MAX_FILE_BYTES + 1)
            .read_to_end(&mut bytes)
            .map_err(failed)?;
        if bytes.len() as u64 > MAX_FILE_BYTES {
            return Err(ScriptError::TooLarge {
                path: path.into(),
                bytes: bytes.len() as u64,
            });
        }
        let whole = bytes
            .iter()
            .rposition(|&byte| byte == b'\n')
            .map_or(0, |end| end + 1);
        if whole < bytes.len() {
            tracing::warn!("{}: the last line is cut and left out", path.display());
            bytes.truncate(whole);
        }
        Ok(Self {
            path: path.into(),
            bytes,
        })
    }

    /// Makes a `T` of every row; `columns` looks up, once, what `row` then asks for.
    pub fn rows<C, T>(
        &self,
        columns: impl FnOnce(&Header) -> Result<C, ScriptError>,
        mut row: impl FnMut(&C, &Row) -> Result<T, ScriptError>,
    ) -> Result<Vec<T>, ScriptError> {
        let path = self.path.as_path();
        let damaged = |error: csv::Error| ScriptError::Line {
            path: path.into(),
            line: error.position().map_or(1, csv::Position::line),
            reason: match error.kind() {
                csv::ErrorKind::UnequalLengths {
                    expected_len, len, ..
                } => {
                    format!("{len} fields where the header has {expected_len}")
                }
                csv::ErrorKind::Utf8 { .. } => "not text in UTF-8".into(),
                _ => error.to_string(),
            },
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(&self.bytes[..]);
        let names = reader.headers().map_err(damaged)?.clone();
        let columns = columns(&Header { path, names })?;
        let mut rows = Vec::new();
        for fields in reader.records() {
            let fields = fields.map_err(damaged)?;
            let line = fields.position().map_or(0, csv::Position::line);
            rows.push(row(&columns, &Row { path, line, fields })?);
        }
        Ok(rows)
    }
}

impl Header<'_> {
    /// A column that may be missing.
    pub fn column(&self, name: impl Into<String>) -> Column {
        let name = name.into();
        let index = self.names.iter().position(|found| found == name);
        Column { name, index }
    }

    /// A column that must be there.
    pub fn needed(&self, name: &str) -> Result<Column, ScriptError> {
        let column = self.column(name);
        match column.index {
            Some(_) => Ok(column),
            None => Err(ScriptError::MissingColumn {
                path: self.path.into(),
                column: name.into(),
            }),
        }
    }
}

impl Row<'_> {
    /// What stands in the column; none where it is missing or empty.
    pub fn text(&self, column: &Column) -> Option<&str> {
        self.fields
            .get(column.index?)
            .filter(|text| !text.is_empty())
    }

    /// A whole number, such as a time.
    pub fn integer(&self, column: &Column) -> Result<Option<i64>, ScriptError> {
        let Some(text) = self.text(column) else {
            return Ok(None);
        };
        text.parse()
            .map(Some)
            .map_err(|_| self.refuse(column, "is no whole number of 64 bits"))
    }

    /// A whole number that can't be left out.
    pub fn needed_integer(&self, column: &Column) -> Result<i64, ScriptError> {
        self.integer(column)?
            .ok_or_else(|| self.refuse(column, "must be given"))
    }

    /// A finite number.
    pub fn number(&self, column: &Column) -> Result<Option<f32>, ScriptError> {
        let Some(text) = self.text(column) else {
            return Ok(None);
        };
        match text.parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(self.refuse(column, "is no finite number")),
        }
    }

    /// Numbers that belong together: all of them, or none where one is missing.
    pub fn numbers<const N: usize>(
        &self,
        columns: &[Column; N],
    ) -> Result<Option<[f32; N]>, ScriptError> {
        let mut numbers = [0.0; N];
        for (number, column) in numbers.iter_mut().zip(columns) {
            match self.number(column)? {
                Some(value) => *number = value,
                None => return Ok(None),
            }
        }
        Ok(Some(numbers))
    }

    /// The error that names this value.
    pub fn refuse(&self, column: &Column, reason: &'static str) -> ScriptError {
        ScriptError::Value {
            path: self.path.into(),
            line: self.line,
            column: column.name.clone(),
            value: self.text(column).unwrap_or_default().into(),
            reason,
        }
    }
}
