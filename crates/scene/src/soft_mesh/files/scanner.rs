//! Words and numbers from bytes that are text, or numbers in binary.

use super::cells::MAX_ITEMS;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// What a number in binary is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    /// Bytes of a number.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number in `bytes`, of which there are [`Kind::size`]. Whole numbers beyond 2^53 lose their last digits, and are no
    /// number of any node.
    pub(super) fn decode(self, bytes: &[u8], encoding: Encoding) -> f64 {
        let mut low_first = [0; 8];
        let size = self.size();
        low_first[..size].copy_from_slice(&bytes[..size]);
        if encoding == Encoding::BigEndian {
            low_first[..size].reverse();
        }
        let bits = u64::from_le_bytes(low_first);
        match self {
            Self::I8 => f64::from(bits as i8),
            Self::I16 => f64::from(bits as i16),
            Self::I32 => f64::from(bits as i32),
            Self::I64 => bits as i64 as f64,
            Self::U8 | Self::U16 | Self::U32 | Self::U64 => bits as f64,
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
        }
    }
}

/// A whole number of at least 0 that a decimal stands for.
pub(super) fn whole(number: f64) -> Option<u64> {
    (number.fract() == 0.0 && (0.0..=9e15).contains(&number)).then_some(number as u64)
}

/// A place in a file. What goes wrong is told in words, with the place.
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    pub(super) encoding: Encoding,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, encoding: Encoding::Text }
    }

    /// A problem at this place.
    pub(super) fn problem(&self, text: impl std::fmt::Display) -> String {
        let read = &self.bytes[..self.at.min(self.bytes.len())];
        if self.encoding == Encoding::Text {
            format!("line {}: {text}", 1 + read.iter().filter(|&&byte| byte == b'\n').count())
        } else {
            format!("byte {}: {text}", self.at)
        }
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// What is left of this line, without blanks at its ends; nothing at the end of the file.
    pub(super) fn line(&mut self) -> Option<&'a str> {
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        let length = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        Some(std::str::from_utf8(&rest[..length]).unwrap_or("").trim())
    }

    /// The next word, or nothing at the end of the file.
    pub(super) fn next_word(&mut self) -> Option<&'a str> {
        let rest = self.rest();
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        Some(std::str::from_utf8(&rest[start..start + length]).unwrap_or("\u{fffd}"))
    }

    pub(super) fn word(&mut self) -> Result<&'a str, String> {
        self.next_word().ok_or_else(|| self.problem("the file ends too early"))
    }

    /// Goes on after the next `end`.
    pub(super) fn skip_to(&mut self, end: &str) -> Result<(), String> {
        let found = self.rest().windows(end.len()).position(|window| window == end.as_bytes());
        self.at += found.ok_or_else(|| self.problem(format_args!("{end} is missing")))? + end.len();
        Ok(())
    }

    /// A count in text, of things that take at least a byte each.
    pub(super) fn count_in_words(&mut self) -> Result<u64, String> {
        let word = self.word()?;
        word.parse().map_err(|_| self.problem(format_args!("{word:?} is not a count")))
    }

    /// The next number: a word, or in binary of this kind.
    pub(super) fn number(&mut self, kind: Kind) -> Result<f64, String> {
        if self.encoding == Encoding::Text {
            let word = self.word()?;
            return word.parse().map_err(|_| self.problem(format_args!("{word:?} is not a number")));
        }
        let bytes = self.rest().get(..kind.size()).ok_or_else(|| self.problem("the file ends too early"))?;
        self.at += kind.size();
        Ok(kind.decode(bytes, self.encoding))
    }

    pub(super) fn whole(&mut self, kind: Kind) -> Result<u64, String> {
        let number = self.number(kind)?;
        whole(number).ok_or_else(|| self.problem(format_args!("{number} is not a whole number from 0")))
    }

    /// A count of things that take at least a byte each.
    pub(super) fn count(&mut self, kind: Kind) -> Result<u64, String> {
        let count = self.whole(kind)?;
        self.check_count(count)
    }

    pub(super) fn check_count(&self, count: u64) -> Result<u64, String> {
        if count > MAX_ITEMS {
            return Err(self.problem(format_args!("{count} are more than {}", MAX_ITEMS)));
        }
        let left = self.rest().len() as u64;
        if count > left {
            Err(self.problem(format_args!("{count} cannot be in {left} bytes")))
        } else {
            Ok(count)
        }
    }
}
