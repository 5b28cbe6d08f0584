//! The encodings of VTP files, and what is refused.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use miniz_oxide::deflate::compress_to_vec_zlib;

use super::read;

const POINTS: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
const CORNERS: [i64; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
const OFFSETS: [i64; 4] = [3, 6, 9, 12];

/// A tetrahedron whose arrays have these attributes and texts, and what stands behind its polygons.
fn file(root: &str, arrays: [(String, String); 3], behind: &[u8]) -> Vec<u8> {
    let [points, corners, offsets] =
        arrays.map(|(attributes, text)| format!("{attributes}>{text}</DataArray>"));
    let head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" {root}>\n<PolyData>\n<Piece NumberOfPoints=\"4\" NumberOfPolys=\"4\">\n\
         <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" {points}</Points>\n\
         <Polys><DataArray type=\"Int64\" Name=\"connectivity\" {corners}<DataArray type=\"Int64\" Name=\"offsets\" \
         {offsets}</Polys>\n</Piece>\n</PolyData>\n"
    );
    [head.as_bytes(), behind, b"</VTKFile>\n"].concat()
}

fn ascii() -> Vec<u8> {
    let text = |values: &[String]| ("format=\"ascii\"".to_owned(), values.join(" "));
    let whole = |values: &[i64]| text(&values.iter().map(ToString::to_string).collect::<Vec<_>>());
    file("", [text(&POINTS.map(|x| x.to_string())), whole(&CORNERS), whole(&OFFSETS)], b"")
}

/// The bytes of the three arrays.
fn plain(big_endian: bool) -> [Vec<u8>; 3] {
    let whole = |v: &i64| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
    let real = |v: &f32| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
    [
        POINTS.iter().flat_map(real).collect(),
        CORNERS.iter().flat_map(whole).collect(),
        OFFSETS.iter().flat_map(whole).collect(),
    ]
}

/// An array with its header of 32-bit numbers, in base64.
fn encoded(bytes: &[u8]) -> String {
    let length = u32::try_from(bytes.len()).unwrap();
    STANDARD.encode([length.to_le_bytes().as_slice(), bytes].concat())
}

/// An array in two blocks of zlib, its header of 64-bit numbers encoded by itself.
fn packed(bytes: &[u8]) -> String {
    let block = bytes.len() / 2 + 1;
    let blocks: Vec<Vec<u8>> = bytes.chunks(block).map(|part| compress_to_vec_zlib(part, 6)).collect();
    let sizes = blocks.iter().map(Vec::len);
    let header: Vec<u8> = [2, block, bytes.len() - block]
        .into_iter()
        .chain(sizes)
        .flat_map(|n| (n as u64).to_le_bytes())
        .collect();
    STANDARD.encode(header) + &STANDARD.encode(blocks.concat())
}

#[test]
fn every_encoding_gives_the_same_tetrahedron() {
    let expected = read(&ascii()).unwrap();
    assert_eq!((expected.vertices.len(), expected.triangles.len()), (4, 4));
    let inline = plain(false).map(|bytes| ("format=\"binary\"".to_owned(), encoded(&bytes)));
    assert_eq!(read(&file("header_type=\"UInt32\"", inline, b"")).unwrap(), expected);
    let zlib = "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"";
    let inline =
        plain(false).map(|bytes| ("format=\"binary\"".to_owned(), format!("\n  {}\n", packed(&bytes))));
    assert_eq!(read(&file(zlib, inline, b"")).unwrap(), expected);
    let mut behind = b"<AppendedData encoding=\"base64\">\n  _".to_vec();
    let appended = plain(false).map(|bytes| {
        let offset = behind.len() - b"<AppendedData encoding=\"base64\">\n  _".len();
        behind.extend(packed(&bytes).bytes());
        (format!("format=\"appended\" offset=\"{offset}\""), String::new())
    });
    behind.extend(b"\n</AppendedData>\n");
    assert_eq!(read(&file(zlib, appended, &behind)).unwrap(), expected);
}

/// Written by vtkXMLPolyDataWriter of VTK 9.7.2: as it is set, with its appended data raw, and inline without a compressor.
const BY_VTK: [&[u8]; 3] =
    [include_bytes!("by-vtk.vtp"), include_bytes!("by-vtk-raw.vtp"), include_bytes!("by-vtk-inline.vtp")];

#[test]
fn files_that_vtk_writes_are_the_same_tetrahedron() {
    for file in BY_VTK {
        assert_eq!(read(file).unwrap(), read(&ascii()).unwrap());
    }
}

#[test]
fn raw_data_of_either_byte_order_are_read_though_they_are_no_text() {
    for big_endian in [false, true] {
        let mut behind = b"<AppendedData encoding=\"raw\">\n_".to_vec();
        let start = behind.len();
        let appended = plain(big_endian).map(|bytes| {
            let offset = behind.len() - start;
            let length = u32::try_from(bytes.len()).unwrap();
            behind.extend(if big_endian { length.to_be_bytes() } else { length.to_le_bytes() });
            behind.extend(bytes);
            (format!("format=\"appended\" offset=\"{offset}\""), String::new())
        });
        behind.extend(b"\n</AppendedData>\n");
        assert!(std::str::from_utf8(&behind).is_err(), "0x80 in 1.0 is no text");
        let order = if big_endian { "byte_order=\"BigEndian\"" } else { "byte_order=\"LittleEndian\"" };
        assert_eq!(read(&file(order, appended, &behind)).unwrap(), read(&ascii()).unwrap());
    }
}

#[test]
fn what_is_not_read_is_refused_with_its_place() {
    let text = String::from_utf8(ascii()).unwrap();
    let said = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        read(text.replacen(from, to, 1).as_bytes()).unwrap_err().message
    };
    assert_eq!(
        said("\"PolyData\"", "\"UnstructuredGrid\""),
        "expected a VTKFile of type PolyData, found `UnstructuredGrid`: extract its surface"
    );
    assert_eq!(said("3 6 9 12", "3 7 9 12"), "polygon 1 has 4 corners: cut it into triangles");
    assert_eq!(said("3 6 9 12", "3 6 9"), "12 corners for 3 triangles");
    assert_eq!(
        said("0 2 1 0 1 3", "0 2 1 0 1 9"),
        "triangle 1 names the point 9 and there are 4, counted from 0"
    );
    assert_eq!(said("0 2 1 0 1 3", "0 2 1 0 x 3"), "`x` in `connectivity` is not a number");
    assert_eq!(
        said("NumberOfPolys=\"4\"", "NumberOfPolys=\"4\" NumberOfStrips=\"1\""),
        "has strips of triangles: cut them into triangles (vtkTriangleFilter)"
    );
    assert!(said("</Points>", "").starts_with("is no XML: "));
    let inline = plain(false).map(|bytes| ("format=\"binary\"".to_owned(), encoded(&bytes)[..20].to_owned()));
    let cut = read(&file("", inline, b"")).unwrap_err();
    assert_eq!(cut.message, "the data of `Points` end too early or are damaged: write the file again");
    assert!(cut.span.is_some());
    let lz4 = read(&file("compressor=\"vtkLZ4DataCompressor\"", Default::default(), b"")).unwrap_err();
    assert_eq!(lz4.message, "is compressed by vtkLZ4DataCompressor: write it by zlib, or uncompressed");
}
