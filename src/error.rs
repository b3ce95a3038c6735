//! The one error of the crate: which input, what it was, what is needed.

use std::fmt;

/// An input that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The input: it begins with the name of its field or its file.
    pub input: String,
    /// What was handed in.
    pub got: String,
    /// What would have been accepted.
    pub needs: String,
}

impl Error {
    /// An error from its three parts.
    pub fn new(input: impl Into<String>, got: impl Into<String>, needs: impl Into<String>) -> Self {
        Self {
            input: input.into(),
            got: got.into(),
            needs: needs.into(),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: got {}, needs {}", self.input, self.got, self.needs)
    }
}

impl std::error::Error for Error {}
