//! What is tried, what came out, and how that is judged.

use std::fmt;
use std::time::Duration;

use glam::Vec3;

use crate::Error;
use crate::stability::lab::Lab;

/// The methods, in the order of the table's columns.
pub const METHODS: [&str; 12] = [
    "none",
    EXACT,
    PLAN,
    ATLAS,
    "jimenez_2009",
    "jimenez_separable",
    "fitted_separable",
    "burley_disk",
    "texture_cascade",
    "jimenez_2010",
    "jimenez_2010_derived",
    "burley_2015",
];
/// Ours: the exact sum, a plan, and texture space.
pub const EXACT: &str = "screen_exact";
pub const PLAN: &str = "screen_planned";
pub const ATLAS: &str = "texture_separable";
pub const OURS: [&str; 3] = [EXACT, PLAN, ATLAS];
/// Whose figure it is where a file is read, before any method runs.
pub const INPUT: &str = "input";

/// What cases are about, in the order of the page.
pub const GROUPS: [&str; 9] = [
    "screen space",
    "light from behind",
    "ids and pixels",
    "texture space",
    "time",
    "numbers",
    "sizes",
    "hosts",
    "files",
];

/// A figure for each method; methods that a case does not apply to are left out.
pub type Figures = Vec<(&'static str, f64)>;
/// Linear light by each method, pixel by pixel.
pub type Results = Vec<(&'static str, Vec<Vec3>)>;

/// One thing that may go wrong.
pub struct Case {
    /// One of [`GROUPS`].
    pub group: &'static str,
    /// Few words: a row of the table.
    pub name: String,
    /// The scene, and what the figure is of it.
    pub what: String,
    pub bound: Bound,
    /// Where ours does not pass.
    pub known: Vec<Known>,
    /// Whether its picture shows what no other does.
    pub is_pictured: bool,
    pub run: Run,
}

type Run = Box<dyn Fn(&Lab) -> Result<Outcome, Error>>;

/// At `passes` or less a method passes, at `degrades` or less it is degraded, beyond it fails.
#[derive(Clone, Copy, PartialEq)]
pub struct Bound {
    pub passes: f64,
    pub degrades: f64,
    /// Why there.
    pub why: &'static str,
}

/// A method of ours that does not pass.
#[derive(Clone, Copy)]
pub struct Known {
    pub method: &'static str,
    /// The figure must not become worse than this; infinite where it may even be NaN.
    pub at_most: f64,
    /// Whether no method could pass that has the same inputs.
    pub by_nature: bool,
    /// Why, and what to use instead.
    pub why: &'static str,
}

/// What came out of a case.
#[derive(Default)]
pub struct Outcome {
    pub figures: Figures,
    /// What the picture shows.
    pub shown: Option<Shown>,
}

/// A part of a frame, by every method.
pub struct Shown {
    pub size: [u32; 2],
    pub truth: Vec<Vec3>,
    pub results: Results,
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
    /// With nothing known to fail; [`all`](super::cases::all) says of which group it is.
    pub fn new(
        name: impl Into<String>,
        what: impl Into<String>,
        bound: Bound,
        run: impl Fn(&Lab) -> Result<Outcome, Error> + 'static,
    ) -> Self {
        Self {
            group: "",
            name: name.into(),
            what: what.into(),
            bound,
            known: vec![],
            is_pictured: true,
            run: Box::new(run),
        }
    }

    pub fn known(mut self, known: impl IntoIterator<Item = Known>) -> Self {
        self.known.extend(known);
        self
    }

    /// Whether it has a picture; not where that would show the same as others do.
    pub fn pictured(self, is_pictured: bool) -> Self {
        Self { is_pictured, ..self }
    }

    pub fn title(&self) -> String {
        format!("{}: {}", self.group, self.name)
    }

    pub fn verdict(&self, figure: f64) -> Verdict {
        // NaN is not at most anything.
        if figure <= self.bound.passes {
            Verdict::Passes
        } else if figure <= self.bound.degrades {
            Verdict::Degraded
        } else {
            Verdict::Fails
        }
    }
}

/// A method of ours that does not pass, though another could.
pub fn known(method: &'static str, at_most: f64, why: &'static str) -> Known {
    Known { method, at_most, by_nature: false, why }
}

/// A method of ours that cannot pass with the inputs that it has.
pub fn by_nature(method: &'static str, at_most: f64, why: &'static str) -> Known {
    Known { by_nature: true, ..known(method, at_most, why) }
}

impl From<Figures> for Outcome {
    fn from(figures: Figures) -> Self {
        Self { figures, shown: None }
    }
}

impl Judged {
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

    /// Methods of ours that are worse than they are known to be, or that are known and have no figure.
    pub fn worse(&self) -> Vec<String> {
        let title = self.case.title();
        let missing = self.case.known.iter().filter(|k| self.figure(k.method).is_none());
        let missing = missing.map(|k| format!("{title}: {} has no figure", k.method));
        let ours = OURS.into_iter().chain([INPUT]);
        let worse = ours.filter_map(|method| {
            let figure = self.figure(method)?;
            let known = self.case.known.iter().find(|k| k.method == method);
            let at_most = known.map_or(self.case.bound.passes, |k| k.at_most);
            let holds = figure <= at_most || at_most == f64::INFINITY;
            (!holds).then(|| format!("{title}: {method} is at {figure:.5}, needs {at_most:.5} or less"))
        });
        worse.chain(missing).collect()
    }

    /// What a picture is worth: where verdicts differ, or ours do not pass.
    pub fn is_shown(&self) -> bool {
        let verdicts = |ours: bool| {
            let figures = self.outcome.figures.iter();
            figures
                .filter(move |(m, _)| OURS.contains(m) == ours && !["none", INPUT].contains(m))
                .map(|(_, f)| self.case.verdict(*f))
        };
        let rivals_fail_alone =
            verdicts(true).all(|v| v == Verdict::Passes) && verdicts(false).any(|v| v == Verdict::Fails);
        self.case.is_pictured
            && self.outcome.shown.is_some()
            && (rivals_fail_alone || self.shortcomings().next().is_some())
    }
}

/// A figure to two places that count.
pub fn short(figure: f64) -> String {
    match figure.abs() {
        _ if !figure.is_finite() => format!("{figure}"),
        0.0 => "0".into(),
        f if !(1e-4..1e4).contains(&f) => format!("{figure:.0e}"),
        f => {
            let places = (1 - f.log10().floor() as i32).max(0) as usize;
            format!("{figure:.places$}")
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
