//! What a file is by its first bytes, so that an error can say it where another kind is wanted.

/// First bytes of kinds of files that end up in each other's place, with what people call them.
const KINDS: &[(&[u8], &str)] = &[
    (b"glTF", "a glTF scene"),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"\x76\x2f\x31\x01", "an OpenEXR picture"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"{", "JSON text"),
];

/// What the file that begins with these bytes is, to follow "it is"; `None` where they are of no kind that is known here.
pub fn kind_of(bytes: &[u8]) -> Option<&'static str> {
    if bytes.is_empty() {
        return Some("an empty file");
    }
    let mut kinds = KINDS.iter();
    let kind = kinds.find(|(first, _)| bytes.starts_with(first));
    kind.map(|(_, name)| *name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_known_by_its_first_bytes_and_not_by_those_within() {
        assert_eq!(kind_of(b"glTF\x02\0\0\0"), Some("a glTF scene"));
        assert_eq!(kind_of(b""), Some("an empty file"));
        assert_eq!(kind_of(b"see PK\x03\x04"), None);
    }
}
