//! An input that is read on a thread of its own, so that what becomes of it can be told.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use crate::Error;

/// An input of less than a megabyte is read in a tenth of a second, on a busy machine in some.
const PATIENCE: Duration = Duration::from_secs(20);
/// More than the built-in head and the largest picture that is decoded take together.
const MAX_BYTES: u64 = 2 << 30;

/// What has to become of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    Refused,
    Taken,
    /// As long as what is taken is as its documentation says.
    Either,
}

/// What a reader makes of an input: what is wrong of that which it took, or why it did not.
pub type Reading = Result<Option<String>, Error>;

pub struct Attempt {
    pub name: String,
    pub wanted: Wanted,
    pub read: Box<dyn FnOnce() -> Reading + Send>,
}

impl Attempt {
    pub fn new(
        name: impl Into<String>,
        wanted: Wanted,
        read: impl FnOnce() -> Reading + Send + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            wanted,
            read: Box::new(read),
        }
    }

    /// What went wrong.
    pub fn fault(self) -> Option<String> {
        let before = memory();
        let (done, came) = channel();
        let read = self.read;
        // A thread that hangs is left behind. One that overflows its stack ends the program.
        thread::spawn(move || done.send(read()));
        let fault = match came.recv_timeout(PATIENCE) {
            Err(RecvTimeoutError::Disconnected) => Some("panicked".into()),
            Err(RecvTimeoutError::Timeout) => Some(format!("took more than {PATIENCE:?}")),
            Ok(Ok(Some(flaw))) => Some(format!("was taken, with {flaw}")),
            Ok(Ok(None)) => (self.wanted == Wanted::Refused).then(|| "was taken".into()),
            Ok(Err(e)) if self.wanted == Wanted::Taken => Some(format!("was refused: {e}")),
            Ok(Err(e)) => {
                let said = e.to_string();
                let has_reason = said.contains(": got ") && said.contains(", needs ");
                (!has_reason).then(|| format!("was refused without a reason: {said}"))
            }
        };
        let taken = before.zip(memory()).and_then(|(before, after)| {
            let grew = after.peak > before.peak;
            grew.then(|| after.peak - before.now)
        });
        let greedy = taken.filter(|bytes| *bytes > MAX_BYTES);
        let fault = fault.or(greedy.map(|bytes| format!("took {} MiB", bytes >> 20)));
        fault.map(|fault| format!("{} {fault}", self.name))
    }
}

/// Of this program, in bytes; also what is asked for and never touched.
struct Memory {
    now: u64,
    peak: u64,
}

/// Where the system tells.
fn memory() -> Option<Memory> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let field = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        Some(kib << 10)
    };
    Some(Memory {
        now: field("VmSize:")?,
        peak: field("VmPeak:")?,
    })
}
