//! What is tried, what came out, and how that is judged.

use std::fmt;
use std::time::Duration;

use crate::Error;
use glam::Vec3;

use crate::stability::lab::Lab;

/// The methods, in the order of the table's columns.
pub const METHODS: [&str; 9] = [
    "none",
    "screen_exact",
    "screen_planned",
    "texture_separable",
    "jimenez_2009",
    "jimenez_separable",
    "fitted_separable",
    "burley_disk",
    "texture_cascade",
];

/// Whose figure it is where a file is read, before any method runs.
pub const INPUT: &str = "input";

/// Those of this crate.
pub const OURS: [&str; 3] = ["screen_exact", "screen_planned", "texture_separable"];

/// What a case is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    Screen,
    Texture,
    Time,
    Numbers,
    Hosts,
    Files,
}

impl Group {
    pub const ALL: [Self; 6] = [
        Self::Screen,
        Self::Texture,
        Self::Time,
        Self::Numbers,
        Self::Hosts,
        Self::Files,
    ];

    pub fn title(self) -> &'static str {
        match self {
            Self::Screen => "screen space",
            Self::Texture => "texture space",
            Self::Time => "time",
            Self::Numbers => "numbers",
            Self::Hosts => "hosts",
            Self::Files => "files",
        }
    }
}

/// One thing that may go wrong.
pub struct Case {
    pub group: Group,
    /// Few words: a row of the table.
    pub name: String,
    /// The scene, and what the figure is of it.
    pub what: String,
    /// At this figure or less a method passes ...
    pub passes: f64,
    /// ... at this or less it is degraded, and beyond it fails.
    pub degrades: f64,
    /// Why there.
    pub why: String,
    /// Where ours does not pass.
    pub known: Vec<Known>,
    pub run: Run,
}

pub type Run = Box<dyn Fn(&Lab) -> Result<Outcome, Error>>;

/// A mode of ours that does not pass.
pub struct Known {
    pub method: &'static str,
    /// The figure must not become worse than this; infinite where it may even be no number.
    pub at_most: f64,
    /// Whether no method could that knows no more than it does.
    pub by_nature: bool,
    /// Why, and what to use instead.
    pub why: String,
}

/// What came out of a case.
#[derive(Default)]
pub struct Outcome {
    /// A method and its figure; methods that it does not apply to are left out.
    pub figures: Vec<(&'static str, f64)>,
    /// What the picture shows.
    pub shown: Option<Shown>,
}

/// A part of a frame, by every method.
pub struct Shown {
    pub size: [u32; 2],
    /// Linear irradiance, as all of these.
    pub truth: Vec<Vec3>,
    /// A method and its result.
    pub results: Vec<(&'static str, Vec<Vec3>)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Passes,
    Degraded,
    Fails,
}

/// A case that was tried.
pub struct Judged {
    pub case: Case,
    pub outcome: Outcome,
    pub took: Duration,
}

impl Case {
    pub fn title(&self) -> String {
        format!("{}: {}", self.group.title(), self.name)
    }

    pub fn verdict(&self, figure: f64) -> Verdict {
        // What is no number is not at most anything.
        if figure <= self.passes {
            Verdict::Passes
        } else if figure <= self.degrades {
            Verdict::Degraded
        } else {
            Verdict::Fails
        }
    }
}

impl Judged {
    pub fn new(case: Case, outcome: Outcome, took: Duration) -> Self {
        Self {
            case,
            outcome,
            took,
        }
    }

    /// A method's figure.
    pub fn figure(&self, method: &str) -> Option<f64> {
        let figures = &self.outcome.figures;
        figures.iter().find(|(m, _)| *m == method).map(|(_, f)| *f)
    }

    /// What is known of those of ours that do not pass here: a few pass in the quick form alone.
    pub fn shortcomings(&self) -> impl Iterator<Item = &Known> {
        self.case.known.iter().filter(|known| {
            let figure = self.figure(known.method);
            figure.is_none_or(|f| self.case.verdict(f) != Verdict::Passes)
        })
    }

    /// Modes of ours that are worse than they are known to be, or that are known and have no figure.
    pub fn worse(&self) -> Vec<String> {
        let ours = OURS
            .iter()
            .chain(&[INPUT])
            .filter_map(|m| self.figure(m).map(|figure| (m, figure)));
        let missing = self.case.known.iter().map(|known| known.method);
        let missing = missing.filter(|method| self.figure(method).is_none());
        let missing = missing.map(|m| format!("{}: {m} has no figure", self.case.title()));
        ours.filter_map(|(method, figure)| {
            let known = self.case.known.iter().find(|k| k.method == *method);
            let at_most = known.map_or(self.case.passes, |k| k.at_most);
            let holds = figure <= at_most || at_most == f64::INFINITY;
            (!holds).then(|| {
                let title = self.case.title();
                format!(
                    "{title}: {method} is at {}, not at most {at_most}",
                    short(figure)
                )
            })
        })
        .chain(missing)
        .collect()
    }

    /// Whether a rival fails where all of ours pass.
    pub fn rivals_fail_alone(&self) -> bool {
        let verdicts = |ours: bool| {
            let figures = self.outcome.figures.iter();
            figures
                .filter(move |(m, _)| OURS.contains(m) == ours && !["none", INPUT].contains(m))
                .map(|(_, f)| self.case.verdict(*f))
        };
        verdicts(true).all(|v| v == Verdict::Passes) && verdicts(false).any(|v| v == Verdict::Fails)
    }
}

/// A figure to two places that count.
pub fn short(figure: f64) -> String {
    match figure.abs() {
        _ if !figure.is_finite() => format!("{figure}"),
        0.0 => "0".into(),
        f if !(1e-4..1e4).contains(&f) => format!("{figure:.0e}"),
        f if f >= 10.0 => format!("{figure:.0}"),
        f => {
            let places = (1 - f.log10().floor() as i32).max(0) as usize;
            let text = format!("{figure:.places$}");
            text.strip_prefix('0').map(String::from).unwrap_or(text)
        }
    }
}

impl fmt::Display for Judged {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}", self.case.title())?;
        for (method, figure) in &self.outcome.figures {
            let mark = match self.case.verdict(*figure) {
                Verdict::Passes => '+',
                Verdict::Degraded => '~',
                Verdict::Fails => '-',
            };
            write!(f, "  {method} {}{mark}", short(*figure))?;
        }
        write!(f, "  ({:.1} s)", self.took.as_secs_f64())
    }
}
