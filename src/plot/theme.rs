//! How pictures look: colours by style sheet alone, told apart by the colour-blind and none of them red; for a light screen, a dark
//! one, and paper.

/// What a picture is looked at on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub(crate) enum Theme {
    /// As the reader's screen is set, and for paper when printed.
    #[default]
    Auto,
    /// A light screen.
    Light,
    /// A dark screen.
    Dark,
    /// Paper, where colours may be missing: each line has dashes of its own.
    Print,
}

/// Okabe and Ito's hues, dark enough for a white ground.
const LIGHT: &str = "--ground:#fff;--text:#15191e;--quiet:#55606b;--edge:#c4ccd4;--over:#b35900;\
--s0:#0072b2;--s1:#7d6500;--s2:#a3407a;--s3:#00735a;--s4:#ad5200;--s5:#4d4d4d;";
/// The console's colours.
const DARK: &str = "--ground:#0a0d11;--text:#eef2f6;--quiet:#a3afbc;--edge:#3a4552;--over:#ff8a3c;\
--s0:#56b4e9;--s1:#eedd88;--s2:#d58ab5;--s3:#2fbf91;--s4:#e69f00;--s5:#d9dfe6;";
/// Dashes of lines on paper, and a piece of each beside its name.
const DASHES: &str = ".plot .key{display:inline-block}.plot .box{margin-right:62px}\
.dashed.s0{stroke-dasharray:16 3 3 3}.dashed.s1{stroke-dasharray:1 4}.dashed.s2{stroke-dasharray:9 3 2 3 2 3}\
.dashed.s3{stroke-dasharray:20 6}.dashed.s4{stroke-dasharray:4 2 1 2}.dashed.s5{stroke-dasharray:12 3 4 3}.s1{stroke-dasharray:9 3}.s2{stroke-dasharray:2 3}.s3{stroke-dasharray:9 3 2 3}\
.s4{stroke-dasharray:5 4}.s5{stroke-dasharray:14 4}";
/// What is drawn alike everywhere.
const SHAPES: &str = ".key{display:none}.curve{fill:none;stroke-width:1.4;stroke-linejoin:round;vector-effect:non-scaling-stroke}\
.range{fill-opacity:.22}.dashed{stroke-dasharray:6 4}\
.s0{--line:var(--s0)}.s1{--line:var(--s1)}.s2{--line:var(--s2)}.s3{--line:var(--s3)}.s4{--line:var(--s4)}.s5{--line:var(--s5)}\
.curve{stroke:var(--line)}.range{fill:var(--line)}.name{fill:var(--line);color:var(--line);font-weight:600}\
.lane{fill:var(--s0)}.t0{fill-opacity:.35}.t1{fill-opacity:.55}.t2{fill-opacity:.78}\
path.t3{stroke:var(--s0);stroke-width:1px;vector-effect:non-scaling-stroke}";

impl Theme {
    /// The style sheet, for whatever has the class `plot` and is in it.
    #[must_use]
    pub(super) fn css(self) -> String {
        let colours = match self {
            Self::Light => format!(".plot{{{LIGHT}color-scheme:light}}"),
            Self::Dark => format!(".plot{{{DARK}color-scheme:dark}}"),
            Self::Print => format!(".plot{{{LIGHT}color-scheme:light}}{DASHES}"),
            Self::Auto => format!(
                ".plot{{{LIGHT}color-scheme:light dark}}\
                 @media screen and (prefers-color-scheme:dark){{.plot{{{DARK}}}}}@media print{{{DASHES}}}"
            ),
        };
        format!("{colours}{SHAPES}")
    }
}

/// The classes of a line of that style: six colours, then the same again in dashes.
#[must_use]
pub(super) fn classes(style: usize) -> String {
    format!("s{}{}", style % 6, if style < 6 { "" } else { " dashed" })
}
