//! The manifest as Parquet.

use crate::table::{Cell, Columns, ForEach, Kind};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};
use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

/// Rows that are written together.
const ROWS: usize = 10_000;

/// Bytes that wait to be written: the writer of the crate wants one that it may send to another thread, and keeps it.
#[derive(Clone, Default)]
struct Waiting(Arc<Mutex<Vec<u8>>>);

impl Write for Waiting {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Waiting {
    fn write_to(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut bytes = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        out.write_all(&std::mem::take(&mut *bytes))
    }
}

/// Writes all members; every column may be empty but for those that no member lacks.
pub(crate) fn write(
    out: &mut dyn Write,
    columns: &Columns,
    for_each: ForEach<'_>,
) -> io::Result<()> {
    let waiting = Waiting::default();
    let properties = Arc::new(
        WriterProperties::builder()
            .set_created_by("heart-phantom".into())
            .build(),
    );
    let schema = schema(columns)?;
    let mut writer = SerializedFileWriter::new(waiting.clone(), schema, properties)?;
    let mut rows = Vec::new();
    let mut flush = |rows: &mut Vec<Vec<Cell>>, writer: &mut SerializedFileWriter<Waiting>| {
        if !rows.is_empty() {
            write_group(writer, columns, rows)?;
            rows.clear();
        }
        waiting.write_to(out)
    };
    for_each(&mut |cells| {
        rows.push(cells);
        match rows.len() {
            ROWS => flush(&mut rows, &mut writer),
            _ => Ok(()),
        }
    })?;
    flush(&mut rows, &mut writer)?;
    writer.finish()?;
    flush(&mut rows, &mut writer)
}

fn schema(columns: &Columns) -> Result<TypePtr, ParquetError> {
    let fields = columns.all().map(|(name, kind)| {
        let (physical, logical) = match kind {
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            Kind::Whole => (Physical::INT64, None),
            Kind::Number => (Physical::DOUBLE, None),
        };
        let field = Type::primitive_type_builder(name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical);
        field.build().map(Arc::new)
    });
    let fields = fields.collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder("manifest")
        .with_fields(fields)
        .build()?;
    Ok(Arc::new(schema))
}

fn write_group(
    writer: &mut SerializedFileWriter<Waiting>,
    columns: &Columns,
    rows: &[Vec<Cell>],
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for (k, (_, kind)) in columns.all().enumerate() {
        let cells = || rows.iter().map(|row| &row[k]);
        // 1 where there is a value.
        let there: Vec<i16> = cells()
            .map(|cell| i16::from(*cell != Cell::Nothing))
            .collect();
        let Some(mut column) = group.next_column()? else {
            break;
        };
        match kind {
            Kind::Text => {
                write_values::<ByteArrayType>(&mut column, &there, cells(), |cell| match cell {
                    Cell::Text(text) => Some(text.as_str().into()),
                    _ => None,
                })
            }
            Kind::Whole => {
                write_values::<Int64Type>(&mut column, &there, cells(), |cell| match cell {
                    Cell::Whole(whole) => Some(*whole as i64),
                    _ => None,
                })
            }
            Kind::Number => {
                write_values::<DoubleType>(&mut column, &there, cells(), |cell| match cell {
                    Cell::Number(number) => Some(*number),
                    _ => None,
                })
            }
        }?;
        column.close()?;
    }
    group.close().map(drop)
}

fn write_values<'a, T: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    there: &[i16],
    cells: impl Iterator<Item = &'a Cell>,
    value: impl Fn(&'a Cell) -> Option<T::T>,
) -> Result<usize, ParquetError> {
    let values: Vec<T::T> = cells.filter_map(value).collect();
    column.typed::<T>().write_batch(&values, Some(there), None)
}
