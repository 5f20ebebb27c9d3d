//! Texts that fit a `STATUSTEXT` of MAVLink.

use core::fmt;

/// Text of at most 50 bytes of ASCII.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct StatusText {
    bytes: [u8; Self::CAPACITY],
    length: u8,
}

impl StatusText {
    /// Maximum number of characters.
    pub const CAPACITY: usize = 50;

    /// Formats a text. It is truncated at the capacity, and characters outside ASCII become question marks.
    pub fn new(arguments: fmt::Arguments<'_>) -> Self {
        let mut text = Self { bytes: [0; Self::CAPACITY], length: 0 };
        // Writing to a `StatusText` never fails.
        let _ = fmt::write(&mut text, arguments);
        text
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        let bytes = self.bytes.get(..usize::from(self.length)).unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }
}

impl fmt::Write for StatusText {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for c in text.chars() {
            let Some(slot) = self.bytes.get_mut(usize::from(self.length)) else { break };
            *slot = if c.is_ascii() { c as u8 } else { b'?' };
            self.length += 1;
        }
        Ok(())
    }
}

impl fmt::Display for StatusText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Debug for StatusText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_cut_at_fifty_characters() {
        let text = StatusText::new(format_args!("{}", "0123456789".repeat(6)));
        assert_eq!(text.as_str(), "0123456789".repeat(5));
        assert_eq!(StatusText::new(format_args!("5 µs")).as_str(), "5 ?s");
    }
}
