//! Files as text.

use crate::ReadError;

/// The text of a file in UTF-8, or in UTF-16 with a byte order mark.
///
/// # Errors
///
/// Where it is not text, with its place.
pub(crate) fn text(bytes: &[u8]) -> Result<String, ReadError> {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| from([pair[0], pair[1]]));
        char::decode_utf16(units).map(|unit| unit.unwrap_or('\u{fffd}')).collect()
    };
    match bytes {
        [0xff, 0xfe, ..] => return Ok(wide(u16::from_le_bytes)),
        [0xfe, 0xff, ..] => return Ok(wide(u16::from_be_bytes)),
        _ => {}
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match core::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(_) if is_latin(bytes) => Ok(bytes.iter().map(|&byte| char::from(byte)).collect()),
        Err(error) => {
            let line = bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
            Err(ReadError::new("the file is not text in UTF-8", "save it as UTF-8")
                .at_line(line as u64 + 1))
        }
    }
}

/// Whether the declaration of a document says ISO 8859-1, whose bytes are characters.
fn is_latin(bytes: &[u8]) -> bool {
    let head = bytes[..bytes.len().min(200)].to_ascii_lowercase();
    let head = String::from_utf8_lossy(&head).into_owned();
    let declaration = head.split("?>").next().unwrap_or("");
    declaration.contains("iso-8859-1") || declaration.contains("windows-1252")
}

#[cfg(test)]
mod tests {
    use super::text;

    #[test]
    fn encodings_with_a_mark_are_read() {
        assert_eq!(text(b"\xef\xbb\xbf<a/>").expect("UTF-8"), "<a/>");
        assert_eq!(text(b"\xff\xfe<\0a\0").expect("UTF-16"), "<a");
        assert_eq!(text(b"\xfe\xff\0<\0a").expect("UTF-16"), "<a");
        let latin = b"<?xml version='1.0' encoding='ISO-8859-1'?><a>\xe4</a>";
        assert!(text(latin).expect("declared").ends_with("<a>\u{e4}</a>"));
        assert_eq!(text(b"a\n\xff").expect_err("not text").line, Some(2));
    }
}
