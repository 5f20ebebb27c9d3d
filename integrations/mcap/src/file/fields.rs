//! The fields of MCAP's records, read from bytes that may be damaged.

use std::collections::BTreeMap;

/// The remaining bytes of a record.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn number<const SIZE: usize>(&mut self) -> Option<[u8; SIZE]> {
        let (number, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*number)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.number().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.number().map(u64::from_le_bytes)
    }

    pub(super) fn take(&mut self, length: u64) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(usize::try_from(length).ok()?)?;
        self.0 = rest;
        Some(taken)
    }

    pub(super) fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(length.into())
    }

    pub(super) fn text(&mut self) -> Option<&'a str> {
        self.bytes().and_then(|bytes| std::str::from_utf8(bytes).ok())
    }

    pub(super) fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let mut fields = Fields(self.bytes()?);
        let mut map = BTreeMap::new();
        while !fields.0.is_empty() {
            map.insert(fields.text()?.to_owned(), fields.text()?.to_owned());
        }
        Some(map)
    }

    pub(super) fn counts(&mut self) -> Option<BTreeMap<u16, u64>> {
        let mut fields = Fields(self.bytes()?);
        let mut counts = BTreeMap::new();
        while !fields.0.is_empty() {
            counts.insert(fields.u16()?, fields.u64()?);
        }
        Some(counts)
    }
}
