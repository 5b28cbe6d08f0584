//! A table of the run as text, for export and display.
//!
//! Next file to read: [`crate::store`].

use rusqlite::types::ValueRef;

use super::{Store, StoreError};

/// The named columns of a table as text, in the order of writing; numbers keep every digit, NULL is empty.
///
/// # Errors
/// When the database refuses.
pub fn table(store: &Store, name: &str, columns: &str) -> Result<Vec<Vec<String>>, StoreError> {
    let n = columns.split(", ").count();
    store.rows(&format!("SELECT {columns} FROM {name} ORDER BY rowid"), |row| {
        (0..n)
            .map(|i| {
                Ok(match row.get_ref(i)? {
                    ValueRef::Null => String::new(),
                    ValueRef::Integer(v) => v.to_string(),
                    ValueRef::Real(v) => format!("{v:?}"),
                    ValueRef::Text(v) => String::from_utf8_lossy(v).into_owned(),
                    ValueRef::Blob(v) => format!("{} bytes", v.len()),
                })
            })
            .collect()
    })
}
