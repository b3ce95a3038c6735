//! A page that needs no other file, neither beside it nor from the network: what the reports of the
//! examples have in common.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use image::{ImageResult, RgbImage};

use crate::output::png;

/// The page up to its heading, in the common style and one of its own.
pub fn head(title: &str, style: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=en>\n<meta charset=utf-8>\n\
         <meta name=viewport content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>{STYLE}{style}</style>\n<main>\n",
        escape(title)
    )
}

/// Adds a line without trailing blanks.
pub fn line(text: &mut String, line: &str) {
    text.push_str(line.trim_end());
    text.push('\n');
}

/// Text as HTML and SVG show it, between tags or in a quoted attribute.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// A picture as the address that an `img` takes it from.
///
/// # Errors
/// A picture without pixels.
pub fn address(picture: &RgbImage) -> ImageResult<String> {
    let data = BASE64.encode(png(picture)?);
    Ok(format!("data:image/png;base64,{data}"))
}

// Pictures lie on 18 % grey (sRGB 118), so that neither their colours nor their brightness are
// judged against the page.
const STYLE: &str = "
:root { color-scheme: dark; --page: #262626; --text: #e4e4e4; --dim: #a8a8a8; --rule: #444; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--text); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 68rem; margin: auto; padding: clamp(1rem, 4vw, 2.5rem); }
h1 { margin: 0 0 .5rem; font-size: clamp(1.5rem, 4vw, 2.2rem); font-weight: 600; line-height: 1.2; }
h2 { margin: 3rem 0 .75rem; font-size: 1.3rem; font-weight: 600; }
h3 { margin: 1.5rem 0 0; font-size: 1rem; font-weight: 600; }
h3 + p { margin: 0 0 .5rem; color: var(--dim); font-size: .9rem; }
.lead { margin: 0 0 1.5rem; max-width: 46rem; }
.note { margin: 0 0 1.5rem; padding-left: .75rem; border-left: 3px solid #c9a24a; color: var(--dim); }
.mat { background: #767676; padding: clamp(.5rem, 2.5vw, 1.75rem); border-radius: 4px; }
img { display: block; width: 100%; image-rendering: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { padding: .45rem 0 .45rem clamp(.5rem, 3vw, 2rem); border-bottom: 1px solid var(--rule); vertical-align: top; text-align: right; font-weight: 400; }
thead th { vertical-align: bottom; font-weight: 600; font-size: .9rem; line-height: 1.25; }
th[scope=row] { padding-left: 0; text-align: left; }
th span { color: var(--dim); font-size: .85rem; }
th small { display: block; max-width: 34rem; color: var(--dim); font-size: .8rem; line-height: 1.35; }
.strip { display: flex; gap: clamp(.4rem, 1.5vw, 1rem); padding-bottom: .6rem; }
figure { flex: 1 1 0; min-width: 0; margin: 0; }
figcaption { margin-top: .3rem; color: #fff; font-size: .85rem; line-height: 1.25; text-align: center; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1.25rem; margin: 0; font-size: .9rem; }
dt { color: var(--dim); }
dd { margin: 0; overflow-wrap: anywhere; }
@media (max-width: 34rem) { body { font-size: 15px; } td, thead th { font-size: .8rem; } }
";
