//! Text of scene files in whichever encoding they are: told by a byte order mark, by the zero bytes that UTF-16 has
//! around the first `<`, or by the XML declaration; UTF-8 otherwise.

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE};

/// A decoded file.
#[derive(Debug)]
pub(super) struct Decoded {
    pub text: String,
    /// Name of the encoding.
    pub encoding: &'static str,
    /// Some bytes mean nothing in the encoding; replacement characters stand for them.
    pub is_damaged: bool,
}

/// Decodes a file.
///
/// # Errors
/// The declared encoding, if nothing is known about it.
pub(super) fn decode(bytes: Vec<u8>) -> Result<Decoded, String> {
    let (encoding, mark) = match Encoding::for_bom(&bytes) {
        Some(found) => found,
        None => (without_mark(&bytes)?, 0),
    };
    if encoding == UTF_8 && mark == 0 {
        // The usual case needs no copy.
        return Ok(match String::from_utf8(bytes) {
            Ok(text) => Decoded { text, encoding: "UTF-8", is_damaged: false },
            Err(e) => {
                let text = String::from_utf8_lossy(e.as_bytes()).into_owned();
                Decoded { text, encoding: "UTF-8", is_damaged: true }
            }
        });
    }
    let (text, is_damaged) = encoding.decode_without_bom_handling(&bytes[mark..]);
    Ok(Decoded { text: text.into_owned(), encoding: encoding.name(), is_damaged })
}

/// The encoding of a file without a byte order mark.
fn without_mark(bytes: &[u8]) -> Result<&'static Encoding, String> {
    if let [a, b, ..] = bytes {
        match (a, b) {
            (b'<', 0) => return Ok(UTF_16LE),
            (0, b'<') => return Ok(UTF_16BE),
            _ => {}
        }
    }
    let Some(label) = declared(bytes) else { return Ok(UTF_8) };
    match Encoding::for_label(label) {
        // The declaration itself was read byte by byte.
        Some(encoding) if encoding == UTF_16LE || encoding == UTF_16BE => Ok(UTF_8),
        Some(encoding) => Ok(encoding),
        None => Err(String::from_utf8_lossy(label).into_owned()),
    }
}

/// The value of `encoding` in the declaration `<?xml … ?>`.
fn declared(bytes: &[u8]) -> Option<&[u8]> {
    let inside = bytes.strip_prefix(b"<?xml")?;
    let inside = &inside[..inside.windows(2).take(1000).position(|w| w == b"?>")?];
    let name = b"encoding";
    let at = inside.windows(name.len()).position(|w| w == name)?;
    let value = inside[at + name.len()..].trim_ascii_start().strip_prefix(b"=")?.trim_ascii_start();
    let (quote, value) = value.split_first().filter(|(quote, _)| matches!(quote, b'"' | b'\''))?;
    Some(&value[..value.iter().position(|b| b == quote)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "<?xml version=\"1.0\"?>\n<scene version=\"3.0.0\"><!-- façade “Ö” € --></scene>";

    fn utf_16(text: &str, mark: bool, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
        let mark = if mark { &[0xfeff][..] } else { &[] };
        mark.iter().copied().chain(text.encode_utf16()).flat_map(bytes).collect()
    }

    #[test]
    fn unicode_is_told_by_its_marks() {
        let decoded = |bytes: Vec<u8>| {
            let found = decode(bytes).unwrap();
            assert!(!found.is_damaged);
            found.text
        };
        assert_eq!(decoded(TEXT.into()), TEXT);
        assert_eq!(decoded(format!("\u{feff}{TEXT}").into()), TEXT);
        for mark in [true, false] {
            assert_eq!(decoded(utf_16(TEXT, mark, u16::to_le_bytes)), TEXT);
            assert_eq!(decoded(utf_16(TEXT, mark, u16::to_be_bytes)), TEXT);
        }
        assert_eq!(decoded(vec![]), "");
    }

    #[test]
    fn declarations_are_obeyed() {
        let with = |label: &str, bytes: &[u8]| {
            let declaration = format!("<?xml version='1.0' encoding = {label} ?><a b='");
            let found = decode([declaration.as_bytes(), bytes, b"'/>"].concat());
            found.map(|found| found.text[declaration.len()..].trim_end_matches("'/>").to_owned())
        };
        for label in ["\"ISO-8859-1\"", "'latin1'", "\"windows-1252\""] {
            assert_eq!(with(label, b"fa\xe7ade \x80").unwrap(), "façade €");
        }
        assert_eq!(with("\"ISO-8859-2\"", b"\xb1").unwrap(), "ą");
        assert_eq!(with("\"Shift_JIS\"", b"\x83\x81").unwrap(), "メ");
        assert_eq!(with("\"utf-8\"", "façade".as_bytes()).unwrap(), "façade");
        // Said by a file that is not: an editor converted it.
        assert_eq!(with("\"utf-16\"", "façade".as_bytes()).unwrap(), "façade");
        assert_eq!(with("\"klingon\"", b"").unwrap_err(), "klingon");
    }

    #[test]
    fn damage_is_told() {
        let found = decode(b"<a b='\xe7'/>".to_vec()).unwrap();
        assert!(found.is_damaged && found.text == "<a b='\u{fffd}'/>" && found.encoding == "UTF-8");
        let odd = decode(b"\xff\xfe<\0a\0/\0>\0x".to_vec()).unwrap();
        assert!(odd.is_damaged && odd.text.starts_with("<a/>") && odd.encoding == "UTF-16LE");
    }
}
