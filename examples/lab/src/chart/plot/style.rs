//! How a method looks in every picture: its name for people, its colour and its shape.

use crate::svg::Marker;

/// Does nothing: the light as it fell.
pub const NONE: &str = "none";
/// Copies the frame: what any method costs at least.
pub const COPY: &str = "copy";

/// A method in a picture.
#[derive(Clone, Copy)]
pub struct Style<'a> {
    /// As in `chart.csv`.
    pub method: &'a str,
    /// For people.
    pub title: &'a str,
    pub color: &'static str,
    pub marker: Marker,
}

// Colours after Okabe & Ito and Tol, which the colour-blind can tell apart; shapes for print.
const METHODS: [Style; 14] = [
    style(NONE, "no scattering", "#777777", Marker::Plus),
    style(COPY, "copy", "#777777", Marker::Cross),
    style("screen_exact", "screen space, exact sum", "#222222", Marker::Diamond),
    style("screen_planned", "screen space, a plan", "#0072b2", Marker::Circle),
    style("texture_separable", "texture space, separable", "#009e73", Marker::Square),
    style("texture_cascade", "texture space, cascade", "#44aa99", Marker::Star),
    style("texture_2d", "texture space, 2-D", "#117733", Marker::Plus),
    style("jimenez_2009", "Jimenez 2009", "#e69f00", Marker::Pentagon),
    style("jimenez_separable", "Jimenez separable", "#d55e00", Marker::Up),
    style("fitted_separable", "fitted separable", "#cc5fa0", Marker::Down),
    style("burley_disk", "Burley disk", "#6a3d9a", Marker::Cross),
    style("jimenez_2010", "Jimenez 2010, transmission", "#d55e00", Marker::Star),
    style("jimenez_2010_derived", "Jimenez 2010, derived", "#d55e00", Marker::Square),
    style("burley_2015", "Burley 2015, transmission", "#6a3d9a", Marker::Star),
];

// For methods that are not among those.
const OTHERS: [(&str, Marker); 5] = [
    ("#56b4e9", Marker::Square),
    ("#999933", Marker::Diamond),
    ("#882255", Marker::Circle),
    ("#332288", Marker::Up),
    ("#a0522d", Marker::Down),
];

const fn style(
    method: &'static str,
    title: &'static str,
    color: &'static str,
    marker: Marker,
) -> Style<'static> {
    Style { method, title, color, marker }
}

/// Each name once, in the order that they come in.
pub fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut once = Vec::new();
    for name in names {
        if !once.contains(&name) {
            once.push(name);
        }
    }
    once
}

/// The styles of some methods, each once: the known ones first, then others as they come.
pub fn styles<'a>(methods: impl Iterator<Item = &'a str>) -> Vec<Style<'a>> {
    let (known, others): (Vec<_>, Vec<_>) =
        distinct(methods).into_iter().partition(|name| METHODS.iter().any(|style| style.method == *name));
    let known = METHODS.into_iter().filter(|style| known.contains(&style.method));
    let others = others
        .into_iter()
        .zip(OTHERS.into_iter().cycle())
        .map(|(method, (color, marker))| Style { method, title: method, color, marker });
    known.chain(others).collect()
}

impl Style<'_> {
    /// The method at a setting, for people.
    pub fn name(&self, setting: &str) -> String {
        format!("{} {setting}", self.title).trim_end().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_a_look_of_its_own() {
        let looks: Vec<_> = METHODS.iter().map(|style| (style.color, style.marker)).chain(OTHERS).collect();
        for (i, look) in looks.iter().enumerate() {
            assert!(!looks[..i].contains(look), "{look:?}");
        }
    }

    #[test]
    fn unknown_methods_come_last_and_are_not_left_off() {
        let names = ["mine", "burley_disk", "yours", "mine", "copy"];
        let styles = styles(names.into_iter());
        let methods: Vec<_> = styles.iter().map(|style| style.method).collect();
        assert_eq!(methods, ["copy", "burley_disk", "mine", "yours"]);
        assert_eq!(styles[2].name("4"), "mine 4");
        assert_eq!(styles[1].name(""), "Burley disk");
    }
}
