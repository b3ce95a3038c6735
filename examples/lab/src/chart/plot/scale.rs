//! Axes: from a value to a place on the drawing.

/// An axis.
#[derive(Clone, Copy)]
pub struct Scale {
    /// The least and the greatest value, or their decimal logarithms.
    low: f64,
    high: f64,
    is_linear: bool,
    /// Whether 0 is among the values: it has the lower end of the axis to itself.
    has_zero: bool,
    /// Where the ends lie on the drawing.
    start: f64,
    end: f64,
}

/// Left free at each end, as a part of what is between.
const ROOM: f64 = 0.08;

/// A line of the grid.
#[derive(Debug, PartialEq)]
pub struct Tick {
    /// The value that it marks.
    pub value: f64,
    /// What is written beside it; a minor tick has none.
    pub label: Option<String>,
}

impl Scale {
    /// A linear axis between two values, where [`over`](Self::over) makes a logarithmic one.
    pub fn linear(low: f64, high: f64) -> Self {
        Self { low, high, is_linear: true, has_zero: false, start: 0.0, end: 1.0 }
    }

    /// A logarithmic axis that has room for all `values` that have a logarithm, and a little more. Spans at least a decade,
    /// so that a difference that is nothing does not look like one.
    pub fn over(values: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut has_zero = false;
        for value in values.filter(|value| value.is_finite()) {
            if value > 0.0 {
                low = low.min(value.log10());
                high = high.max(value.log10());
            } else {
                has_zero = true;
            }
        }
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let room = (ROOM * (high - low)).max((1.0 - (high - low)) / 2.0);
        Self { low: low - room, high: high + room, is_linear: false, has_zero, start: 0.0, end: 1.0 }
    }

    /// The same axis between two places on the drawing.
    pub fn between(self, start: f64, end: f64) -> Self {
        Self { start, end, ..self }
    }

    /// Where a value lies. What is beyond an end of the axis, as 0 is, lies on that end.
    pub fn place(&self, value: f64) -> f64 {
        let at = if self.is_linear { value } else { value.max(f64::MIN_POSITIVE).log10() };
        let part = ((at - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        self.start + part * (self.end - self.start)
    }

    /// The grid: every power of ten, between them the multiples, and 0 where it is among the values.
    pub fn ticks(&self) -> Vec<Tick> {
        let span = self.high - self.low;
        if self.is_linear {
            // Steps of 1, 2 or 5 times a power of ten, four to ten of them.
            let power = 10f64.powf((span / 4.0).log10().floor());
            let step = [5.0, 2.0, 1.0].map(|s| s * power).into_iter().find(|step| span / step >= 4.0);
            let step = step.unwrap_or(power);
            // Rounding takes no tick off an end.
            let steps = (self.low / step - 1e-9).ceil() as i64..=(self.high / step + 1e-9).floor() as i64;
            let decimals = (-step.log10().floor()).max(0.0) as usize;
            let text = |value: f64| format!("{value:.decimals$}").replace('-', "−");
            let values = steps.map(|i| i as f64 * step);
            return values.map(|value| Tick { value, label: Some(text(value)) }).collect();
        }
        // Labels a decade apart where there are few, further apart where there are many.
        let step = (span / 7.0).ceil() as i32;
        let mut ticks = Vec::new();
        let mut least = self.low;
        if self.has_zero {
            // Next to it there is no room for another label.
            least += ROOM * span;
            ticks.push(Tick { value: 0.0, label: Some("0".into()) });
        }
        for power in self.low.floor() as i32..=self.high.floor() as i32 {
            for digit in 1..=9 {
                let log = f64::from(power) + f64::from(digit).log10();
                let is_labelled = match digit {
                    1 => power.rem_euclid(step) == 0,
                    2 | 5 => span < 2.6,
                    _ => false,
                };
                let is_shown = digit == 1 || span < 7.0;
                if is_shown && (least..=self.high).contains(&log) {
                    let value = f64::from(digit) * 10f64.powi(power);
                    ticks.push(Tick { value, label: is_labelled.then(|| power_text(digit, power)) });
                }
            }
        }
        ticks
    }
}

/// `digit`·10^`power`, written out where that is short.
fn power_text(digit: i32, power: i32) -> String {
    match power {
        0..4 => format!("{digit}{}", "0".repeat(power as usize)),
        -4..0 => format!("0.{}{digit}", "0".repeat(-power as usize - 1)),
        _ => format!("{digit}e{}", power.to_string().replace('-', "−")),
    }
}

/// A number with three significant digits; a dash for what is none.
pub fn rounded(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        "–".into()
    } else if size == 0.0 {
        "0".into()
    } else if !(1e-4..1e7).contains(&size) {
        format!("{value:.2e}")
    } else {
        let decimals = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.decimals$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_where_their_logarithms_do() {
        let scale = Scale::over([0.1, 1000.0].into_iter()).between(100.0, 0.0);
        assert!((scale.place(10.0) - 50.0).abs() < 1e-9);
        assert!(scale.place(0.1) < 100.0 && scale.place(1000.0) > 0.0);
        assert_eq!(scale.place(0.0), 100.0);
        assert_eq!(scale.place(f64::INFINITY), 0.0);
    }

    #[test]
    fn a_linear_axis_has_its_values_at_equal_steps() {
        let scale = Scale::linear(-0.15, 0.15).between(0.0, 300.0);
        assert!((scale.place(0.05) - 200.0).abs() < 1e-9);
        let ticks = scale.ticks();
        let labels: Vec<_> = ticks.iter().filter_map(|tick| tick.label.as_deref()).collect();
        assert_eq!(labels, ["−0.15", "−0.10", "−0.05", "0.00", "0.05", "0.10", "0.15"]);
        for (low, high) in [(0.0, 1.0), (0.5, 1.0), (-3e4, 1e4)] {
            assert!((4..=11).contains(&Scale::linear(low, high).ticks().len()), "{low} to {high}");
        }
    }

    #[test]
    fn labels_say_the_value() {
        for values in [vec![1e-6, 1e6], vec![0.02, 40.0], vec![3.0, 4.0]] {
            let ticks = Scale::over(values.iter().copied()).ticks();
            let labelled: Vec<_> = ticks.iter().filter(|tick| tick.label.is_some()).collect();
            assert!((2..10).contains(&labelled.len()), "{values:?} {ticks:?}");
            for tick in labelled {
                let text = tick.label.as_ref().unwrap().replace('−', "-");
                let said: f64 = text.parse().unwrap();
                assert!((said / tick.value - 1.0).abs() < 1e-12, "{tick:?}");
            }
        }
    }

    #[test]
    fn an_axis_of_nothing_is_still_an_axis() {
        for values in [vec![], vec![0.0, f64::NAN, f64::INFINITY], vec![2.0]] {
            let scale = Scale::over(values.into_iter());
            assert!(!scale.ticks().is_empty());
            assert!((0.0..=1.0).contains(&scale.place(2.0)));
        }
    }

    #[test]
    fn zero_has_a_place_of_its_own() {
        let ticks = Scale::over([0.0, 0.01, 10.0].into_iter()).ticks();
        assert_eq!(ticks[0].label.as_deref(), Some("0"));
        assert!(ticks[1..].iter().all(|tick| tick.value > 0.0));
    }

    #[test]
    fn numbers_have_three_digits() {
        let texts = [0.0, 0.012345, 9.876, 1234.5, 1e-7, -0.5].map(rounded);
        assert_eq!(texts, ["0", "0.0123", "9.88", "1234", "1.00e-7", "-0.500"]);
    }
}
