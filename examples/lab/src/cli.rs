//! The command lines of the programs.

use std::ffi::OsString;
use std::process::ExitCode;
use std::str::FromStr;

use lexopt::{Arg, ValueExt};

use crate::Error;

/// Runs a program: what `parse` makes of the command line goes to `run`. Whoever asks for help gets it instead.
pub fn main<T>(
    help: &str,
    parse: impl FnOnce(&mut Arguments) -> Result<T, Error>,
    run: impl FnOnce(T) -> Result<(), Error>,
) -> ExitCode {
    let words: Vec<OsString> = std::env::args_os().skip(1).collect();
    if words.iter().any(|word| word == "-h" || word == "--help") {
        print!("{help}");
        return ExitCode::SUCCESS;
    }
    match parse(&mut Arguments::new(words)).and_then(run) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The words of a command line, in turn.
pub struct Arguments {
    parser: lexopt::Parser,
    /// The one that was met last.
    last: String,
}

impl Arguments {
    /// Of what stands after the program's name.
    pub fn new(words: impl IntoIterator<Item = impl Into<OsString>>) -> Self {
        Self { parser: lexopt::Parser::from_args(words), last: String::new() }
    }

    /// The next option, such as `--out`, or value that is none's.
    ///
    /// # Errors
    /// A flag that was given a value; what is not UTF-8.
    pub fn next_word(&mut self) -> Result<Option<String>, Error> {
        let Some(word) = self.parser.next().map_err(refused)? else {
            return Ok(None);
        };
        self.last = match word {
            Arg::Long(name) => format!("--{name}"),
            Arg::Short(letter) => format!("-{letter}"),
            Arg::Value(value) => value.string().map_err(refused)?,
        };
        Ok(Some(self.last.clone()))
    }

    /// For what was met last and is not known.
    pub fn unknown(&self) -> Error {
        Error::new("command line", format!("\"{}\"", self.last), "options as --help lists them")
    }

    /// The value of the option that was met last.
    ///
    /// # Errors
    /// None, or the next option in its place.
    pub fn value(&mut self) -> Result<String, Error> {
        let text = self.parser.value().and_then(|value| value.string()).map_err(refused)?;
        match text.is_empty() || text.starts_with("--") {
            true => Err(Error::new(&self.last, format!("\"{text}\""), "a value of its own")),
            false => Ok(text),
        }
    }

    /// The value as `read` understands it.
    ///
    /// # Errors
    /// One that it does not; `needs` says what it does.
    pub fn value_by<T>(&mut self, needs: &str, read: impl FnOnce(&str) -> Option<T>) -> Result<T, Error> {
        let text = self.value()?;
        read(&text).ok_or_else(|| Error::new(&self.last, text, needs))
    }

    /// The value as a number that fits.
    ///
    /// # Errors
    /// One that does not; `needs` says which do.
    pub fn number<T: FromStr>(&mut self, needs: &str, fits: impl FnOnce(&T) -> bool) -> Result<T, Error> {
        self.value_by(needs, |text| text.parse().ok().filter(fits))
    }

    /// # Errors
    /// A value that is no number above 0.
    pub fn positive(&mut self) -> Result<f32, Error> {
        self.number("a number above 0 and below 3.4e38", |x: &f32| x.is_finite() && *x > 0.0)
    }

    /// An error of a plan: a number, or a fraction such as 1/255.
    ///
    /// # Errors
    /// A value that is neither, or not above 0.
    pub fn max_error(&mut self) -> Result<f32, Error> {
        self.value_by("a number above 0, such as 1/255", |text| {
            let number = |text: &str| text.trim().parse::<f32>().ok();
            let error = match text.split_once('/') {
                Some((parts, whole)) => number(parts)? / number(whole)?,
                None => number(text)?,
            };
            Some(error).filter(|x| x.is_finite() && *x > 0.0)
        })
    }

    /// Width and height in pixels.
    ///
    /// # Errors
    /// A value that is not of the form, or a side that does not fit; `needs` says which do.
    pub fn size(&mut self, needs: &str, fits: impl Fn(u32) -> bool) -> Result<[u32; 2], Error> {
        self.value_by(&format!("WIDTHxHEIGHT in pixels, such as 512x512{needs}"), |text| {
            let (width, height) = text.split_once('x')?;
            let size = [width.parse().ok()?, height.parse().ok()?];
            size.into_iter().all(fits).then_some(size)
        })
    }

    /// Names, with commas between them.
    ///
    /// # Errors
    /// As [`value`](Self::value).
    pub fn names(&mut self) -> Result<Vec<String>, Error> {
        Ok(self.value()?.split(',').map(str::to_owned).collect())
    }
}

fn refused(error: lexopt::Error) -> Error {
    Error::new("command line", format!("\"{error}\""), "options as --help lists them")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What `read` makes of an option's value.
    fn of<T>(value: &str, read: impl FnOnce(&mut Arguments) -> Result<T, Error>) -> Result<T, String> {
        let mut arguments = Arguments::new(["--option", value]);
        assert_eq!(arguments.next_word(), Ok(Some("--option".into())));
        read(&mut arguments).map_err(|e| e.to_string())
    }

    #[test]
    fn values_are_checked() {
        let size = |text| of(text, |a| a.size("", |side| side >= 64));
        assert_eq!(size("640x480"), Ok([640, 480]));
        for bad in ["640", "0x480", "640x-1", "axb", "", "--quick"] {
            assert!(size(bad).is_err_and(|e| e.starts_with("--option: ")), "{bad}");
        }
        assert_eq!(of("10", Arguments::positive), Ok(10.0));
        for bad in ["0", "-1", "NaN", "inf", "1e39"] {
            assert!(of(bad, Arguments::positive).is_err(), "{bad}");
        }
        assert_eq!(of("1/255", Arguments::max_error), Ok(1.0 / 255.0));
        for bad in ["0", "1/0", "1/", "-1/255", "x"] {
            assert!(of(bad, Arguments::max_error).is_err(), "{bad}");
        }
        assert_eq!(of("a,b", Arguments::names), Ok(vec!["a".into(), "b".into()]));
    }
}
