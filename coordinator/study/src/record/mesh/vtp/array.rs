//! One array of numbers of a VTP file: as text, in base64, or appended, with or without blocks of zlib.
//!
//! Next file to read: [`super`].

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use roxmltree::Node;

use super::fault;
use crate::record::mesh::Fault;

/// How the file writes its numbers.
pub(super) struct Encoding<'a> {
    big_endian: bool,
    /// Bytes of a number in a header.
    header: usize,
    compressed: bool,
    /// Appended data behind their mark, and whether they are in base64.
    appended: (&'a [u8], bool),
}

impl<'a> Encoding<'a> {
    /// What the root and the appended data's node say.
    ///
    /// # Errors
    /// For a compressor that is not zlib.
    pub(super) fn of(
        root: Node<'_, '_>,
        node: Option<Node<'_, '_>>,
        appended: &'a [u8],
    ) -> Result<Self, Fault> {
        match root.attribute("compressor") {
            None | Some("" | "vtkZLibDataCompressor") => {}
            Some(other) => {
                return Err(fault(
                    root,
                    &format!("is compressed by {other}: write it by zlib, or uncompressed"),
                ));
            }
        }
        Ok(Self {
            big_endian: root.attribute("byte_order") == Some("BigEndian"),
            header: if root.attribute("header_type") == Some("UInt64") { 8 } else { 4 },
            compressed: root.attribute("compressor").is_some_and(|c| !c.is_empty()),
            appended: (appended, node.and_then(|n| n.attribute("encoding")) != Some("raw")),
        })
    }

    /// The bytes of an array from text or appended data, the header taken off; nothing where they end too early.
    fn bytes(&self, data: &[u8], base64: bool) -> Option<Vec<u8>> {
        let mut stream = Stream { data, base64 };
        let words = |bytes: Vec<u8>| -> Vec<usize> {
            bytes.chunks_exact(self.header).map(|w| self.word(w)).collect()
        };
        let first = words(stream.peek(self.header)?)[0];
        if !self.compressed {
            let all = stream.take(self.header.checked_add(first)?)?;
            return Some(all[self.header..].to_vec());
        }
        let header = words(stream.take(self.header.checked_mul(first.checked_add(3)?)?)?);
        let sizes = header.get(3..)?;
        let total = sizes.iter().try_fold(0_usize, |sum, size| sum.checked_add(*size))?;
        let packed = stream.take(total)?;
        let (mut rest, mut plain) = (packed.as_slice(), Vec::new());
        for size in sizes {
            let (block, behind) = rest.split_at_checked(*size)?;
            plain.extend(decompress_to_vec_zlib_with_limit(block, header[1].max(header[2])).ok()?);
            rest = behind;
        }
        Some(plain)
    }

    /// An unsigned number of up to eight bytes.
    fn word(&self, bytes: &[u8]) -> usize {
        let more = |sum: usize, b: &u8| sum.wrapping_shl(8) | usize::from(*b);
        if self.big_endian { bytes.iter().fold(0, more) } else { bytes.iter().rev().fold(0, more) }
    }

    /// Numbers of this type; nothing for a type that is none of VTK's.
    fn numbers(&self, kind: &str, bytes: &[u8]) -> Option<Vec<f64>> {
        macro_rules! all {
            ($of:ty) => {
                bytes
                    .chunks_exact(size_of::<$of>())
                    .map(|b| {
                        let mut word = [0; size_of::<$of>()];
                        word.copy_from_slice(b);
                        let value = if self.big_endian {
                            <$of>::from_be_bytes(word)
                        } else {
                            <$of>::from_le_bytes(word)
                        };
                        value as f64
                    })
                    .collect()
            };
        }
        Some(match kind {
            "Float32" => all!(f32),
            "Float64" => all!(f64),
            "Int8" => all!(i8),
            "UInt8" => all!(u8),
            "Int16" => all!(i16),
            "UInt16" => all!(u16),
            "Int32" => all!(i32),
            "UInt32" => all!(u32),
            "Int64" => all!(i64),
            "UInt64" => all!(u64),
            _ => return None,
        })
    }
}

/// Data that are taken from their beginning. In base64 every part that is taken was encoded by itself.
struct Stream<'a> {
    data: &'a [u8],
    base64: bool,
}

impl Stream<'_> {
    /// The first `n` bytes, which stay.
    fn peek(&self, n: usize) -> Option<Vec<u8>> {
        if !self.base64 {
            return self.data.get(..n).map(<[u8]>::to_vec);
        }
        let mut bytes = STANDARD.decode(self.data.get(..characters(n)?)?).ok()?;
        bytes.truncate(n);
        (bytes.len() == n).then_some(bytes)
    }

    /// The first `n` bytes, which go.
    fn take(&mut self, n: usize) -> Option<Vec<u8>> {
        let bytes = self.peek(n)?;
        self.data = &self.data[if self.base64 { characters(n)? } else { n }..];
        Some(bytes)
    }
}

/// Characters of `n` bytes in base64.
fn characters(n: usize) -> Option<usize> {
    n.div_ceil(3).checked_mul(4)
}

/// The numbers of a `DataArray`.
///
/// # Errors
/// When they end too early, are no numbers, or of a type or format that is not VTK's.
pub(super) fn array(node: Node<'_, '_>, encoding: &Encoding<'_>) -> Result<Vec<f64>, Fault> {
    let name = node.attribute("Name").unwrap_or("Points");
    let text: String = node.text().unwrap_or_default().to_owned();
    let (data, base64) = match node.attribute("format") {
        Some("ascii") => return as_text(node, name, &text),
        Some("binary") => (text.bytes().filter(|b| !b.is_ascii_whitespace()).collect::<Vec<u8>>(), true),
        Some("appended") => {
            let offset = number(node, "offset")?.unwrap_or(0);
            (encoding.appended.0.get(offset..).unwrap_or_default().to_vec(), encoding.appended.1)
        }
        other => {
            let message = format!(
                "the format of `{name}` is {}, expected ascii, binary or appended",
                other.unwrap_or("none")
            );
            return Err(fault(node, &message));
        }
    };
    let bytes = encoding.bytes(&data, base64).ok_or_else(|| {
        fault(node, &format!("the data of `{name}` end too early or are damaged: write the file again"))
    })?;
    let kind = node.attribute("type").unwrap_or_default();
    encoding
        .numbers(kind, &bytes)
        .ok_or_else(|| fault(node, &format!("`{name}` has the unknown type `{kind}`")))
}

fn as_text(node: Node<'_, '_>, name: &str, text: &str) -> Result<Vec<f64>, Fault> {
    let value =
        |word: &str| word.parse().map_err(|_| fault(node, &format!("`{word}` in `{name}` is not a number")));
    text.split_ascii_whitespace().map(value).collect()
}

/// A whole number that an attribute holds.
///
/// # Errors
/// When it holds something else.
pub(super) fn number(node: Node<'_, '_>, attribute: &str) -> Result<Option<usize>, Fault> {
    let read = |text: &str| {
        text.trim()
            .parse()
            .map_err(|_| fault(node, &format!("`{attribute}` is `{text}`, expected a whole number")))
    };
    node.attribute(attribute).map(read).transpose()
}
