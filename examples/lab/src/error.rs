//! The error of the lab's programs: one line that names the input, what it got and what it needs.

use std::fmt;

/// An input that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error(String);

impl Error {
    /// An error from its three parts; `input` begins with the name of an option, a field or a file.
    pub fn new(input: impl fmt::Display, got: impl fmt::Display, needs: impl fmt::Display) -> Self {
        Self::one_line(format!("{input}: got {got}, needs {needs}"))
    }

    /// The same, of an input that is part of `whole`, such as a file.
    pub fn within(self, whole: impl fmt::Display) -> Self {
        Self::one_line(format!("{whole}: {}", self.0))
    }

    /// Names of files and keys may hold line breaks.
    fn one_line(text: String) -> Self {
        Self(text.replace(['\n', '\r'], " "))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Error {}

impl From<subsurface::Error> for Error {
    fn from(error: subsurface::Error) -> Self {
        Self::one_line(error.to_string())
    }
}
